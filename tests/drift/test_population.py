"""Intervals over units are the exact ones of normal samples where all units are known alike."""

import numpy as np
import pytest
from scipy import stats

from mrfit.drift.population import heavy_tailed, odd_units, population


def test_it_gives_the_intervals_of_a_normal_sample() -> None:
    values = np.random.default_rng(2).standard_normal(12)
    found = population(values, np.zeros(12))
    mean, sigma = values.mean(), values.std(ddof=1)
    half = stats.t.ppf(0.975, 11) * sigma / np.sqrt(12)
    assert found.mean == pytest.approx(mean) and found.variance == pytest.approx(sigma**2, rel=1e-4)
    assert found.mean_interval == pytest.approx((mean - half, mean + half), abs=0.05 * sigma)
    low, high = np.sqrt(11 * sigma**2 / stats.chi2.ppf([0.975, 0.025], 11))
    assert found.sigma_interval == pytest.approx((low, high), rel=0.04)
    # 95/95 factors of n = 12: two-sided 3.162 (ISO 16269-6), one-sided by the noncentral t
    assert np.diff(found.tolerance)[0] / 2.0 / sigma == pytest.approx(3.162, rel=0.03)
    one_sided = stats.nct.ppf(0.95, 11, stats.norm.ppf(0.95) * np.sqrt(12)) / np.sqrt(12)
    assert (found.limits[1] - mean) / sigma == pytest.approx(one_sided, rel=0.03)


def test_units_that_scatter_as_their_fits_do_differ_by_nothing() -> None:
    values = 0.5 * np.random.default_rng(4).standard_normal(20)
    found = population(values, np.ones(20))
    assert found.variance == 0.0 and found.sigma_interval[0] == 0.0


def test_units_that_are_known_better_count_for_more() -> None:
    values, variances = np.array([1.0, 1.1, 0.9, 5.0]), np.array([0.01, 0.01, 0.01, 100.0])
    assert population(values, variances).mean == pytest.approx(1.0, abs=0.02)


def test_a_faulty_unit_stands_out_and_sound_ones_do_not() -> None:
    values = np.random.default_rng(5).standard_normal(20)
    assert odd_units(values, np.full(20, 0.01), 20) == []
    values[7] += 9.0
    ((place, z, probability),) = odd_units(values, np.full(20, 0.01), 20)
    assert place == 7 and z > 5.0 and probability < 0.01
    # a value that its own fit explains is none
    assert odd_units(values, np.where(np.arange(20) == 7, 25.0, 0.01), 20) == []


def test_heavy_tails_widen_ranges_and_hardly_move_the_mean() -> None:
    values = np.random.default_rng(6).standard_t(4, 40)
    values[0] = 30.0
    normal, heavy = population(values, np.full(40, 0.01)), heavy_tailed(values, np.full(40, 0.01))
    location, scale = stats.t.fit(values, f0=4)[1:]
    assert heavy.mean == pytest.approx(location, abs=0.05)
    assert heavy.variance == pytest.approx(2.0 * scale**2, rel=0.1) and heavy.variance < normal.variance
    low, high = heavy.tolerance
    assert stats.t.cdf(high, 4, location, scale) - stats.t.cdf(low, 4, location, scale) > 0.95
    assert heavy.limits[1] < high and heavy.mean_interval[0] < location < heavy.mean_interval[1]
