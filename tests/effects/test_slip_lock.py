"""Slip-lock: the pinching of Foliente, and what tells it from a clearance."""

import numpy as np
import pytest

import mrfit
from mrfit.effects import free_play
from mrfit.effects.slip_lock import transform
from mrfit.simulate.assembly import assemble

DT, SPEED, D = 1e-3, 0.05, 2e-3
THETA = np.array([0.8, D, 0.1, 0.3])


def triangle(amplitude: float = 0.01) -> dict[str, np.ndarray]:
    quarter = round(amplitude / SPEED / DT)
    side = np.where((np.arange(20 * quarter) + quarter) // (2 * quarter) % 2 == 0, 1.0, -1.0)
    return {"displacement": np.cumsum(side) * SPEED * DT, "velocity": side * SPEED}


def seen(theta: np.ndarray, channels: dict[str, np.ndarray]) -> np.ndarray:
    return transform(channels, theta, DT)["velocity"]


def test_the_share_that_is_lost_is_the_pinching_function_of_the_travel_behind_a_turn() -> None:
    channels = triangle()
    turn = int(np.flatnonzero(np.diff(channels["velocity"]))[-2]) + 1
    after = np.arange(1, 300)
    # z rises from -z_end to 1 as 1 - (1 + z_end) exp(-s/d); the turn's own step has no travel
    z = 1.0 - 2.0 * np.exp(-after * SPEED * DT / D)
    lost = 1.0 - np.abs(seen(THETA, channels)[turn + after]) / SPEED
    np.testing.assert_allclose(lost, 0.8 * np.exp(-(((z - 0.1) / 0.3) ** 2)), atol=2e-4)


def test_what_a_joint_loses_lies_behind_the_turn_and_not_at_it_as_with_a_clearance() -> None:
    channels = triangle()
    turn = int(np.flatnonzero(np.diff(channels["velocity"]))[-2]) + 1
    slipped = np.abs(seen(THETA, channels)) / SPEED
    rested = np.abs(free_play.transform(channels, np.array([1.0, D / 2]), DT)["velocity"]) / SPEED
    assert slipped[turn + 1] > 0.9
    assert rested[turn + 1] == 0.0
    middle = turn + round(D * np.log(2.0) / SPEED / DT)
    assert slipped[middle] < 0.35


def test_a_fit_finds_the_joint_that_was_planted_in_a_loop() -> None:
    rng, whole = np.random.default_rng(5), assemble("dahl+slip-lock")
    theta, logs = whole.spec.start[None].copy(), []
    theta[0, -4:] = 0.7, 1.5e-3, 0.1, 0.35
    for amplitude in (3e-3, 0.01):
        channels = triangle(amplitude)
        drive = np.stack([channels[n] for n in whole.spec.inputs])
        force = whole.simulate(drive, theta, DT)[0]
        force = force + rng.normal(0.0, 2e-3 * np.ptp(force), len(force))
        logs.append(mrfit.Recording.from_arrays(dt=DT, force=force, name=f"{amplitude:g} m", **channels))
    found = mrfit.fit(logs, "dahl+slip-lock", per="all", holdout="none", progress=False)
    assert found.params.loc["slip-lock.zeta", "value"] == pytest.approx(0.7, rel=0.05)
    assert found.params.loc["slip-lock.d", "value"] == pytest.approx(1.5e-3, rel=0.1)
