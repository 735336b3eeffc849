"""Free play: the damper stands still within the clearance, and goes with the rod beyond it."""

import numpy as np
import pytest

import mrfit
from mrfit.effects.free_play import transform
from mrfit.simulate.assembly import assemble

DT, AMPLITUDE, W = 1e-3, 0.01, 1e-3


def stroke(frequency: float = 1.0, amplitude: float = AMPLITUDE) -> dict[str, np.ndarray]:
    phase = 2 * np.pi * frequency * DT * np.arange(4000)
    return {
        "displacement": amplitude * np.sin(phase),
        "velocity": amplitude * 2 * np.pi * frequency * np.cos(phase),
    }


def damper(w: float, channels: dict[str, np.ndarray], g: float = 1.0) -> np.ndarray:
    return transform(channels, np.array([g, w]), DT)["velocity"]


def test_the_damper_rests_over_the_clearance_behind_every_turn() -> None:
    channels = stroke()
    moving = damper(W, channels) != 0.0
    x, v = channels["displacement"], channels["velocity"]
    whole = moving & np.roll(moving, 1)
    np.testing.assert_allclose(damper(W, channels)[whole], v[whole], rtol=1e-9)
    # a turn at +A: still down to A - 2w, and with the rod from there to the other turn
    falling = np.arange(1251, 1750)
    still = x[falling] > x[:1500].max() - 2 * W
    np.testing.assert_array_equal(moving[falling], ~still)


def test_a_stroke_within_the_clearance_moves_nothing_and_one_without_is_left_as_it_is() -> None:
    channels = stroke(amplitude=0.9 * W)
    assert not damper(W, channels).any()
    np.testing.assert_array_equal(damper(W, channels, 0.0), channels["velocity"])
    np.testing.assert_array_equal(damper(W, channels, 0.4), 0.6 * channels["velocity"])


@pytest.mark.parametrize("frequency", [0.5, 3.0])
def test_the_way_without_a_force_does_not_depend_on_the_rate(frequency: float) -> None:
    channels = stroke(frequency)
    still = damper(W, channels)[500:3500] == 0.0
    way = np.abs(np.diff(channels["displacement"][500:3501]))[still].sum()
    turns = np.count_nonzero(np.diff(np.sign(channels["velocity"][500:3501])))
    assert way / turns == pytest.approx(2 * W, rel=0.05)


def test_a_fit_finds_the_clearance_that_was_planted() -> None:
    rng, whole = np.random.default_rng(3), assemble("tanh+free-play")
    theta, logs = whole.spec.start[None].copy(), []
    theta[0, -2:] = 0.9, 1.3e-3
    for frequency in (0.5, 1.5):
        channels = stroke(frequency)
        drive = np.stack([channels[n] for n in whole.spec.inputs])
        force = whole.simulate(drive, theta, DT)[0] + rng.normal(0.0, 2.0, drive.shape[1])
        logs.append(mrfit.Recording.from_arrays(dt=DT, force=force, name=f"{frequency} Hz", **channels))
    found = mrfit.fit(logs, "tanh+free-play", per="all", holdout="none", progress=False)
    assert found.params.loc["free-play.w", "value"] == pytest.approx(1.3e-3, rel=0.02)
    assert found.params.loc["free-play.g", "value"] == pytest.approx(0.9, rel=0.02)
