"""Intervals over units are the exact ones of normal samples where all units are known alike."""

import math

import numpy as np
import pytest
from scipy import stats

from mrfit.drift.population import TAIL_DEGREES, likelihood_of_sums, odd_units, population


def test_it_gives_the_intervals_of_a_normal_sample() -> None:
    values = np.random.default_rng(2).standard_normal(12)
    found = population(values, np.zeros(12))
    mean, sigma = values.mean(), values.std(ddof=1)
    half = stats.t.ppf(0.975, 11) * sigma / np.sqrt(12)
    assert found.mean == pytest.approx(mean) and found.variance == pytest.approx(sigma**2, rel=1e-4)
    assert found.mean_interval == pytest.approx((mean - half, mean + half), abs=0.05 * sigma)
    low, high = np.sqrt(11 * sigma**2 / stats.chi2.ppf([0.975, 0.025], 11))
    assert found.sigma_interval == pytest.approx((low, high), rel=0.04)


def test_ranges_are_those_of_a_normal_sample_where_many_units_show_no_tails() -> None:
    values = stats.norm.ppf((np.arange(400) + 0.5) / 400)
    found = population(values, np.zeros(400))
    assert np.mean(found.tails[0] == TAIL_DEGREES[-1]) > 0.95
    # 95/95 factors of n = 400 by Howe's formula, and one-sided by the noncentral t
    factor = 1.96 * np.sqrt(399 * (1 + 1 / 400) / stats.chi2.ppf(0.05, 399))
    assert np.diff(found.tolerance)[0] / 2.0 / values.std(ddof=1) == pytest.approx(factor, rel=0.02)
    one_sided = stats.nct.ppf(0.95, 399, stats.norm.ppf(0.95) * 20.0) / 20.0
    assert found.limits()[1] / values.std(ddof=1) == pytest.approx(one_sided, rel=0.02)


def test_slopes_of_the_same_values_cost_degrees_of_freedom() -> None:
    rng = np.random.default_rng(3)
    beside = np.array([[0.0, 0.5], [0.0, 1.0], [0.0, 2.0], [1.0, 0.5], [1.0, 1.0], [1.0, 2.0]])
    beside, values = beside - beside.mean(axis=0), rng.standard_normal(6)
    found = population(values + beside @ [30.0, -5.0], np.zeros(6), beside=beside)
    design = np.column_stack([np.ones(6), beside])
    rest = values - design @ np.linalg.lstsq(design, values, rcond=None)[0]
    sigma = np.sqrt(rest @ rest / 3.0)
    half = stats.t.ppf(0.975, 3) * sigma / np.sqrt(6)
    assert found.mean == pytest.approx(values.mean()) and found.variance == pytest.approx(sigma**2, rel=1e-4)
    assert found.mean_interval == pytest.approx((values.mean() - half, values.mean() + half), abs=0.1 * sigma)
    # no less than the normal law's 95/95 factor of 3 degrees of freedom by Howe's formula, and less without slopes
    factor = 1.96 * np.sqrt(3 * (1 + 1 / 6) / stats.chi2.ppf(0.05, 3))
    assert factor < np.diff(found.tolerance)[0] / 2.0 / sigma < 2.0 * factor
    alone = population(values, np.zeros(6))
    assert np.diff(alone.tolerance)[0] / values.std(ddof=1) < np.diff(found.tolerance)[0] / sigma


def test_ranges_hold_the_interval_of_the_mean_and_units_as_often_as_is_said() -> None:
    rng, beside = np.random.default_rng(7), np.array([[0.0], [0.0], [0.0], [1.0], [1.0], [1.0]]) - 0.5
    known = np.array([0.01, 0.1, 1.0, 1.0, 4.0, 9.0])
    for omega, times in ((0.0, 20), (5.0, 60)):
        hits = 0
        for _ in range(times):
            found = population(rng.standard_normal(6) * np.sqrt(omega**2 + known), known, beside=beside)
            (low, high), mean = found.tolerance, found.mean_interval
            assert low <= mean[0] and mean[1] <= high
            held = stats.norm.cdf(high / omega) - stats.norm.cdf(low / omega) if omega else float(low <= 0.0 <= high)
            hits += held >= 0.95
        assert hits >= 0.9 * times


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


def test_a_unit_of_heavy_tails_and_a_normal_error_have_the_density_of_their_sum() -> None:
    places, error = np.linspace(-80.0, 80.0, 160001), 0.7
    for degrees in (3.0, 10.0):
        for off in (0.0, 2.0, 30.0):
            parts = stats.t.pdf(places, degrees, scale=1.5) * stats.norm.pdf(off - places, scale=error)
            density = math.sqrt(2.0 * math.pi) * float(np.sum(parts)) * (places[1] - places[0])
            found = likelihood_of_sums(degrees, np.array([[off]]), np.array([1.5**2]), np.array([error**2]))
            assert found[0] == pytest.approx(math.log(density), abs=1e-6)


def test_heavy_tails_are_seen_and_widen_ranges() -> None:
    values = stats.t.ppf((np.arange(200) + 0.5) / 200, 4)
    found = population(values, np.full(200, 1e-4))
    degrees, _, scales = found.tails
    assert np.mean(degrees <= 6.0) > 0.8 and np.median(scales) == pytest.approx(1.0, rel=0.15)
    low, high = found.tolerance
    assert 0.95 < stats.t.cdf(high, 4) - stats.t.cdf(low, 4) < 0.98
    # a unit far off moves them less than it moves the standard deviation
    far = population(np.append(values, 60.0), np.full(201, 1e-4))
    assert far.tolerance[1] < 1.2 * high and far.variance > 2.0 * found.variance
