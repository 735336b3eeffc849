"""Degradation: the law of Baber and Wen for sliding friction in closed form, and what tells it from a drift."""

import numpy as np
import pytest

import mrfit
from benchmarks.stateful_effects import recordings
from mrfit.effects.degradation import shape
from mrfit.simulate.assembly import assemble

DT, SPEED, FORCE = 1e-3, 0.05, 200.0


def triangle(amplitude: float = 0.01, speed: float = SPEED) -> dict[str, np.ndarray]:
    quarter = round(amplitude / speed / DT)
    side = np.where((np.arange(8000) + quarter) // (2 * quarter) % 2 == 0, 1.0, -1.0)
    return {"displacement": np.cumsum(side) * speed * DT, "velocity": side * speed}


def degraded(delta: float, r: float, channels: dict[str, np.ndarray]) -> np.ndarray:
    coulomb = FORCE * np.sign(channels["velocity"])[None]
    return shape(coulomb, channels, np.array([[delta, r]]), DT)[0]


def test_sliding_friction_loses_strength_as_the_root_of_its_work() -> None:
    channels, delta = triangle(), 2e-3
    travel = np.arange(8000) * SPEED * DT
    found = np.abs(degraded(delta, 0.0, channels))
    # F (1 + delta E) = F0 and dE = F ds: (1 + delta E)^2 = 1 + 2 delta F0 s; a step across a turn does no work
    turns = np.cumsum(np.diff(channels["velocity"], prepend=SPEED) != 0.0)
    np.testing.assert_allclose(
        found, FORCE / np.sqrt(1.0 + 2.0 * delta * FORCE * (travel - turns * SPEED * DT)), rtol=1e-3
    )
    energy = np.sum(0.5 * (found[1:] + found[:-1]) * SPEED * DT)
    assert FORCE / found[-1] - 1.0 == pytest.approx(delta * energy, rel=0.01)


def test_the_compliance_behind_a_turn_grows_by_r_over_the_force_for_every_joule() -> None:
    channels, r = triangle(), 2e-6
    found = degraded(0.0, r, channels)
    turns = np.flatnonzero(np.diff(channels["velocity"]))[3:] + 1
    work = np.append(0.0, np.cumsum(0.5 * (found[1:] + found[:-1]) * np.diff(channels["displacement"])))
    # towards the force of the other direction as exp(-s/length): at first it changes by 2F over the length
    left = np.abs(found + FORCE * np.sign(found[turns - 1][:, None]))
    across = left[np.arange(len(turns)), turns + 4] / left[np.arange(len(turns)), turns]
    np.testing.assert_allclose(-4 * SPEED * DT / np.log(across), r * work[turns], rtol=0.05)


def test_equal_energy_and_not_equal_time_makes_an_equal_loss() -> None:
    slow, fast = (np.abs(degraded(2e-3, 0.0, triangle(speed=v))) for v in (0.02, 0.06))
    assert fast[-1] < 0.92 * slow[-1]
    assert fast[2000] == pytest.approx(slow[6000], rel=0.01)


def test_a_fit_finds_the_loss_that_was_planted() -> None:
    rng, whole = np.random.default_rng(5), assemble("dahl+degradation")
    theta, logs = whole.spec.start[None].copy(), []
    theta[0, -2:] = 1.5e-3, 1e-6
    for speed in (0.02, 0.06):
        channels = triangle(speed=speed)
        timed = {**channels, "time": DT * np.arange(len(channels["velocity"]))}
        drive = np.stack([timed[n] for n in whole.spec.inputs])
        made = whole.simulate(drive, theta, DT)[0]
        made = made + rng.normal(0.0, 2e-3 * np.ptp(made), len(made))
        logs.append(mrfit.Recording.from_arrays(dt=DT, force=made, name=f"{speed:g} mps", **channels))
    found = mrfit.fit(logs, "dahl+degradation", per="all", holdout="none", progress=False)
    assert found.params.loc["degradation.delta", "value"] == pytest.approx(1.5e-3, rel=0.05)


def test_of_sines_the_cycles_before_a_segment_have_taken_strength_too() -> None:
    rng, whole = np.random.default_rng(3), assemble("dahl+degradation")
    theta = whole.spec.start.copy()
    theta[-2:] = 1.5e-3, 2e-6
    found = mrfit.fit(recordings(whole, theta, rng), "dahl+degradation", per="all", holdout="none", progress=False)
    own = found.params.loc["degradation.delta"]
    assert own["value"] == pytest.approx(1.5e-3, rel=0.02) and own["low"] < 1.5e-3 < own["high"]
