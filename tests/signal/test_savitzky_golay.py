"""Local polynomials: exact on cubics, as wide as the noise allows, ending at corners."""

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfilt

from mrfit.signal.noise import noise_level, white_part
from mrfit.signal.savitzky_golay import Smoother
from tests.signal.test_smoothing import reversals


def test_local_polynomials_reproduce_cubics_up_to_the_ends() -> None:
    t = np.arange(400) / 100
    values = 1 + 2 * t - 3 * t**2 + 0.5 * t**3
    smoother = Smoother(values, noise=0.01)
    assert smoother.smoothed(0).window > 50
    assert smoother.smoothed(0).values == pytest.approx(values, abs=1e-9)
    assert smoother.smoothed(1).values / 0.01 == pytest.approx(2 - 6 * t + 1.5 * t**2, abs=1e-8)
    assert smoother.smoothed(2).values / 0.01**2 == pytest.approx(-6 + 3 * t, abs=1e-6)


def test_a_noise_free_signal_is_left_as_recorded() -> None:
    values = np.abs(((np.arange(3000) / 700) % 1) - 0.5)
    found = Smoother(values).smoothed(0)
    assert found.widest == 1
    assert np.array_equal(found.values, values)


def test_more_noise_asks_for_a_wider_window() -> None:
    rng = np.random.default_rng(5)
    clean, noise = np.sin(np.arange(20_000) / 300), rng.standard_normal(20_000)
    windows = [Smoother(clean + s * noise).smoothed(0).window for s in (1e-3, 1e-2, 1e-1)]
    assert windows == sorted(windows) and windows[0] < windows[2]


@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_the_error_is_near_that_of_the_best_fixed_window(derivative: int) -> None:
    """No fixed window, chosen with the truth in hand, does much better on a stationary signal."""
    from scipy.signal import savgol_filter

    for seed in range(3):
        rng = np.random.default_rng([11, seed])
        clean = np.convolve(rng.standard_normal(30_400), np.hanning(401) ** 2, mode="valid")
        truth = clean
        for _ in range(derivative):
            truth = np.gradient(truth)
        noisy = clean + 0.01 * np.std(clean) * rng.standard_normal(len(clean))
        inner = slice(500, -500)
        best = min(
            float(np.std((savgol_filter(noisy, w, 3, deriv=derivative) - truth)[inner])) for w in range(15, 401, 6)
        )
        found = Smoother(noisy).smoothed(derivative).values
        assert np.std((found - truth)[inner]) < 1.4 * best


@pytest.mark.parametrize("pole", [0.0, 0.95])
def test_the_plateaus_of_a_binary_sequence_are_smoothed_and_its_edges_kept(pole: float) -> None:
    rng = np.random.default_rng(6)
    bits = np.repeat(rng.integers(0, 2, 100) * 2.0 - 1.0, 200)
    clean = lfilter([1 - pole], [1, -pole], bits)
    noisy = clean + 0.01 * rng.standard_normal(len(clean))
    found = Smoother(noisy).smoothed(0)
    assert found.widest > 100
    assert found.window < 30 or pole == 0.0
    assert reversals(found.values) < reversals(noisy) / 5
    assert np.std(found.values - clean) < 0.005
    assert np.max(np.abs(found.values - clean)) < 0.08


def test_wiggles_of_noise_that_is_not_white_are_removed() -> None:
    rng = np.random.default_rng(7)
    clean = np.convolve(rng.standard_normal(20_400), np.hanning(401) / 12, mode="valid")
    coloured = np.convolve(rng.standard_normal(20_006), np.hanning(7), mode="same")[3:-3]
    found = Smoother(clean + 0.002 * coloured).smoothed(0)
    assert reversals(found.values) < 1.5 * reversals(clean) < reversals(clean + 0.002 * coloured) / 5
    assert np.std(found.values - clean) < 0.003 * np.ptp(clean)


def test_a_rough_signal_without_noise_is_no_noise() -> None:
    """After a filter of second order on each side, displacement falls by 12 dB per octave up to the Nyquist rate."""
    rng = np.random.default_rng(8)
    rough = sosfilt(butter(2, [1, 12], "band", fs=1000, output="sos"), rng.standard_normal(20_000))
    assert noise_level(rough) > 1e-4 * np.ptp(rough)
    assert np.array_equal(Smoother(rough).smoothed(0).values, rough)


@pytest.mark.parametrize("share", [1e-4, 1e-3, 1e-2])
def test_white_noise_stays_white_noise(share: float) -> None:
    rng = np.random.default_rng(9)
    clean = np.sin(np.arange(5000) / 40)
    assert white_part(clean + share * rng.standard_normal(5000)) == pytest.approx(share, rel=0.1)
