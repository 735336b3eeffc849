"""Backlash: the force comes back over a travel behind every turn, by degrees and to the share that was lost."""

import numpy as np
import pytest

import mrfit
from mrfit.effects import free_play
from mrfit.effects.backlash import shape
from mrfit.simulate.assembly import assemble

DT, SPEED, W = 1e-3, 0.05, 1e-3


def triangle(amplitude: float = 0.01) -> dict[str, np.ndarray]:
    quarter = round(amplitude / SPEED / DT)
    side = np.where((np.arange(20 * quarter) + quarter) // (2 * quarter) % 2 == 0, 1.0, -1.0)
    return {"displacement": np.cumsum(side) * SPEED * DT, "velocity": side * SPEED}


def force(theta: list[float], channels: dict[str, np.ndarray], size: float = 100.0) -> np.ndarray:
    coulomb = size * np.sign(channels["velocity"])[None]
    return shape(coulomb, channels, np.array([theta]), DT)[0]


@pytest.mark.parametrize("p", [1.0, 3.0])
def test_friction_comes_back_as_a_power_of_the_travel_behind_a_turn(p: float) -> None:
    channels = triangle()
    turn = int(np.flatnonzero(np.diff(channels["velocity"]))[-2]) + 1
    share = np.minimum((np.arange(1, 200)) * SPEED * DT / (2 * W), 1.0)
    found = np.abs(force([0.9, W, p], channels))[turn : turn + 199]
    np.testing.assert_allclose(found, 100.0 * (1.0 - 0.9 * (1.0 - share**p)), rtol=1e-9)


def test_the_share_that_is_lost_does_not_depend_on_the_force_and_a_clearance_leaves_none() -> None:
    channels = triangle()
    soft, hard = (force([0.6, W, 2.0], channels, size) / size for size in (1.0, 1e4))
    np.testing.assert_allclose(soft, hard, rtol=1e-12)
    turn = int(np.flatnonzero(np.diff(channels["velocity"]))[-2]) + 1
    behind = slice(turn + 1, turn + round(2 * W / SPEED / DT) - 1)
    rested = free_play.transform(channels, np.array([1.0, W]), DT)["velocity"]
    assert np.abs(soft[behind]).min() >= 0.4
    assert np.ptp(np.abs(soft[behind])) > 0.5
    assert not rested[behind].any()


def test_a_force_that_passes_zero_while_the_joint_turns_has_no_step() -> None:
    channels = triangle()
    smooth = 100.0 * np.sin(2 * np.pi * np.arange(len(channels["velocity"])) / 97)
    found = shape(smooth[None], channels, np.array([[1.0, W, 2.0]]), DT)[0]
    assert np.abs(np.diff(found)).max() < 1.5 * np.abs(np.diff(smooth)).max() + 100.0 * 2 * SPEED * DT / W


def test_a_fit_finds_the_joint_that_was_planted() -> None:
    rng, whole = np.random.default_rng(5), assemble("dahl+backlash")
    theta, logs = whole.spec.start[None].copy(), []
    theta[0, -3:] = 0.8, 1.2e-3, 3.0
    for amplitude in (3e-3, 0.01):
        channels = triangle(amplitude)
        drive = np.stack([channels[n] for n in whole.spec.inputs])
        made = whole.simulate(drive, theta, DT)[0]
        made = made + rng.normal(0.0, 2e-3 * np.ptp(made), len(made))
        logs.append(mrfit.Recording.from_arrays(dt=DT, force=made, name=f"{amplitude:g} m", **channels))
    found = mrfit.fit(logs, "dahl+backlash", per="all", holdout="none", progress=False)
    assert found.params.loc["backlash.d", "value"] == pytest.approx(0.8, rel=0.05)
    assert found.params.loc["backlash.w", "value"] == pytest.approx(1.2e-3, rel=0.05)
