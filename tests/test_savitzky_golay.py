"""Local polynomials: exact on cubics, as wide as the noise allows, narrow at edges."""

import numpy as np
import pytest
from scipy.signal import lfilter

from mrfit.savitzky_golay import savitzky_golay
from tests.test_drive import reversals


def test_local_polynomials_reproduce_cubics_up_to_the_ends() -> None:
    t = np.arange(400) / 100
    values = 1 + 2 * t - 3 * t**2 + 0.5 * t**3
    smoothed = savitzky_golay(values, 0.01, noise=0.01)
    assert smoothed.window > 50
    assert smoothed.values == pytest.approx(values, abs=1e-9)
    assert smoothed.first == pytest.approx(2 - 6 * t + 1.5 * t**2, abs=1e-8)
    assert smoothed.second == pytest.approx(-6 + 3 * t, abs=1e-6)


def test_a_noise_free_signal_is_left_as_recorded() -> None:
    values = np.abs(((np.arange(3000) / 700) % 1) - 0.5)
    assert savitzky_golay(values, 1.0).window == 1
    assert np.array_equal(savitzky_golay(values, 1.0).values, values)


def test_more_noise_asks_for_a_wider_window() -> None:
    rng = np.random.default_rng(5)
    clean, noise = np.sin(np.arange(20_000) / 300), rng.standard_normal(20_000)
    windows = [savitzky_golay(clean + s * noise, 1.0).window for s in (1e-3, 1e-2, 1e-1)]
    assert windows == sorted(windows) and windows[0] < windows[2]


@pytest.mark.parametrize("pole", [0.0, 0.95])
def test_the_plateaus_of_a_binary_sequence_are_smoothed_and_its_edges_kept(pole: float) -> None:
    rng = np.random.default_rng(6)
    bits = np.repeat(rng.integers(0, 2, 100) * 2.0 - 1.0, 200)
    clean = lfilter([1 - pole], [1, -pole], bits)
    noisy = clean + 0.01 * rng.standard_normal(len(clean))
    smoothed = savitzky_golay(noisy, 1e-3)
    assert smoothed.window < 30 < 100 < smoothed.widest
    assert reversals(smoothed.values) < reversals(noisy) / 5
    assert np.std(smoothed.values - clean) < 0.005
    assert np.max(np.abs(smoothed.values - clean)) < 0.08


def test_wiggles_of_noise_that_is_not_white_are_removed() -> None:
    rng = np.random.default_rng(7)
    clean = np.convolve(rng.standard_normal(20_400), np.hanning(401) / 12, mode="valid")
    coloured = np.convolve(rng.standard_normal(20_006), np.hanning(7), mode="same")[3:-3]
    smoothed = savitzky_golay(clean + 0.002 * coloured, 1e-3)
    assert reversals(smoothed.values) < 1.5 * reversals(clean) < reversals(clean + 0.002 * coloured) / 5
    assert np.std(smoothed.values - clean) < 0.003 * np.ptp(clean)
