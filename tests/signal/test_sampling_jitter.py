"""Noise of samples whose instants scatter is found where it is, and is not taken for a fast signal."""

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.signal.sampling_jitter import noise_power
from mrfit.signal.savitzky_golay import Smoother

RATE, SAMPLES = 500.0, 4000
STEP = 1.0 / RATE


def drops(t: Array, width: float = 0.06) -> Array:
    """Return the stroke in m of a damper that is struck four times and returns slowly."""
    return sum(8e-3 * np.exp(-0.5 * ((t - at) / width) ** 2) for at in (1.0, 3.0, 5.0, 7.0))


def measured(jitter: float, noise: float, seed: int) -> tuple[Array, Array]:
    """Return a stroke with samples that are late by a share of a step, and the power of its noise, (N,) each."""
    rng = np.random.default_rng([81, seed])
    t = STEP * np.arange(SAMPLES)
    late = jitter * STEP * rng.standard_normal(SAMPLES)
    speed = (drops(t + 1e-6) - drops(t - 1e-6)) / 2e-6
    return drops(t + late) + noise * rng.standard_normal(SAMPLES), noise**2 + (jitter * STEP * speed) ** 2


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("jitter", "noise"), [(0.02, 5e-7), (0.05, 1e-6), (0.2, 3e-6)])
def test_the_noise_grows_with_the_speed_as_the_jitter_makes_it(jitter: float, noise: float, seed: int) -> None:
    values, power = measured(jitter, noise, seed)
    found = noise_power(values)
    assert found is not None
    fast = power > 4.0 * noise**2
    assert np.median(found[fast] / power[fast]) == pytest.approx(1.0, abs=0.35)
    assert np.median(found[~fast] / power[~fast]) == pytest.approx(1.0, abs=0.35)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("noise", [0.0, 1e-7, 1e-5])
def test_the_same_noise_everywhere_and_a_fast_signal_are_no_jitter(noise: float, seed: int) -> None:
    rng = np.random.default_rng([82, seed])
    t = STEP * np.arange(SAMPLES)
    white = noise * rng.standard_normal(SAMPLES)
    road = np.cumsum(np.convolve(rng.standard_normal(SAMPLES), np.hanning(25), mode="same"))
    for stroke in (
        drops(t, 0.004),
        5e-3 * np.sin(2 * np.pi * 40.0 * t) * np.exp(-((t - 4.0) ** 2)),
        5e-3 * np.sin(2 * np.pi * (0.5 + 4.0 * t) * t),
        5e-3 * np.abs((2.0 * t) % 2.0 - 1.0),
        5e-3 * road / np.ptp(road),
    ):
        assert noise_power(stroke + white) is None
    step = 1e-5
    assert noise_power(step * np.round((drops(t) + white) / step)) is None


def test_too_few_samples_tell_no_jitter() -> None:
    values, _ = measured(0.05, 1e-6, 0)
    assert noise_power(values[:900]) is None


@pytest.mark.parametrize("seed", range(3))
def test_an_acceleration_beside_jitter_has_windows_as_wide_as_its_noise_asks(seed: int) -> None:
    t = STEP * np.arange(SAMPLES)
    truth = np.gradient(np.gradient(drops(t)))
    values, _ = measured(0.02, 5e-7, seed)
    errors = [np.std(Smoother(values, moves=moves).smoothed(2).values - truth) for moves in (False, True)]
    assert errors[1] < 0.5 * errors[0] and errors[1] < 0.05 * np.std(truth)
    still, _ = measured(0.0, 5e-7, seed)
    plain, same = (Smoother(still, moves=moves).smoothed(2).values for moves in (False, True))
    assert np.array_equal(plain, same)


def test_a_stroke_that_rests_without_any_noise_is_smoothed_as_before() -> None:
    values, _ = measured(0.02, 0.0, 0)
    values[np.abs(values) < 1e-5] = 0.0
    found = Smoother(values, moves=True)
    assert np.all(np.isfinite(found.smoothed(2).values))
