"""Corners: found in triangles, trapezoids and steps through noise, and in nothing that is smooth."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import maximum_filter1d
from scipy.signal import butter, lfilter, sosfilt

from mrfit.signal.corners import SIDE, find_corners, greatest_near
from mrfit.signal.polynomial_pieces import lowest_polynomials


@pytest.mark.parametrize("width", [1, 2, 5, 6, 11])
@pytest.mark.parametrize("length", [1, 4, 100])
def test_the_greatest_near_are_those_of_scipy(width: int, length: int) -> None:
    values = np.random.default_rng(length).normal(size=length)
    assert np.array_equal(greatest_near(values, width), maximum_filter1d(values, width))


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    lengths=st.lists(st.integers(3 * SIDE, 200), min_size=2, max_size=8),
    share=st.sampled_from([0.0, 1e-3, 3e-3]),
    steps=st.booleans(),
)
def test_corners_of_lines_are_found_where_they_are(seed: int, lengths: list[int], share: float, steps: bool) -> None:
    rng = np.random.default_rng(seed)
    signs = np.where(np.arange(len(lengths)) % 2, -1.0, 1.0)
    slopes = signs * rng.uniform(0.5, 2.0, len(lengths)) / 100
    values = np.cumsum(np.concatenate([np.full(n, s) for n, s in zip(lengths, slopes, strict=True)]))
    corners = np.cumsum(lengths)[:-1]
    if steps:
        values += np.repeat(signs, lengths) / 2
    noise = share * float(np.ptp(values)) if steps else share * 0.1
    found = find_corners(values + noise * rng.standard_normal(len(values)), noise)
    assert len(found) == len(corners)
    # the last sample of one line lies on the next one, too
    assert np.all(np.abs(found - corners) <= (0 if steps else 1 if share == 0.0 else 4))


@pytest.mark.parametrize("share", [0.0, 1e-3, 1e-2])
@pytest.mark.parametrize("rate", [300, 1500])
def test_what_is_smooth_has_no_corners(share: float, rate: int) -> None:
    t = np.arange(8 * rate) / rate
    rng = np.random.default_rng(rate)
    square = np.where((0.7 * t) % 1 < 0.5, 1.0, -1.0)
    lag = np.exp(-1 / (0.03 * rate))
    smooth = {
        "sine": np.sin(9 * t),
        "chirp": np.sin(2 * np.pi * (0.5 * t + 0.5 * t**2)),
        "rounded square": np.tanh(np.sin(5 * t) / 0.3),
        "road": sosfilt(butter(2, [1, 12], "band", fs=rate, output="sos"), rng.standard_normal(len(t))),
        "rounded steps": lfilter([1 - lag], [1, -lag], lfilter([1 - lag], [1, -lag], square)),
    }
    for name, values in smooth.items():
        noise = share * float(np.ptp(values)) / 2
        recorded = values + noise * rng.standard_normal(len(values))
        assert len(find_corners(recorded, noise)) == 0, name


def test_polynomials_meet_where_they_cross() -> None:
    rng = np.random.default_rng(3)
    at = np.arange(400.0)
    corner = 200.4
    values = 0.02 * np.where(at < corner, at, 2 * corner - at)
    misplaced = np.array([0, 202])
    found, stands = lowest_polynomials(
        values + 0.02 * rng.standard_normal(400), misplaced, np.array([202, 400]), 0.02, 1
    )
    assert stands.all()
    assert found[:201] == pytest.approx(np.full(201, 0.02), rel=0.02)
    assert found[201:] == pytest.approx(np.full(199, -0.02), rel=0.02)


def test_a_piece_that_no_polynomial_fits_is_told() -> None:
    values = np.concatenate([np.sin(np.arange(300) / 20), 3.0 + np.zeros(300)])
    noisy = values + 0.01 * np.random.default_rng(4).standard_normal(600)
    found, stands = lowest_polynomials(noisy, np.array([0, 300]), np.array([300, 600]), 0.01, 0)
    assert stands.tolist() == [False, True]
    assert np.ptp(found[300:]) == 0.0
