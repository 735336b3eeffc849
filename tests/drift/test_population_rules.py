"""Probabilities, bounds and odd units of a population, against the laws of normal samples."""

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import minimize_scalar

from mrfit.core.specs import Array
from mrfit.drift.population import UNITS_NEEDED, odd_units, population

SAMPLE = np.random.default_rng(2).standard_normal(12)


@pytest.mark.parametrize("off", [1.0, 2.0, 4.0])
def test_another_unit_is_as_far_off_as_often_as_student_s_law_says(off: float) -> None:
    found = population(SAMPLE, np.zeros(12))
    spread = SAMPLE.std(ddof=1) * np.sqrt(1.0 + 1.0 / 12.0)
    for sign in (1.0, -1.0):
        told = found.probability(SAMPLE.mean() + sign * off * spread, 0.0)
        assert told == pytest.approx(2.0 * stats.t.sf(off, 11), rel=0.08)
    # a unit that is known badly may lie farther off
    assert found.probability(SAMPLE.mean() + off * spread, 100.0) > 0.6


def test_scores_are_distances_in_the_deviation_of_units_and_their_own_errors() -> None:
    known = np.linspace(0.1, 1.2, 12)
    found = population(SAMPLE, known)
    assert found.scores == pytest.approx((SAMPLE - found.mean) / np.sqrt(found.variance + known))
    # the mean of units with weights that fall with both
    assert found.mean == pytest.approx(np.average(SAMPLE, weights=1.0 / (found.variance + known)))


@pytest.mark.parametrize("slope", [False, True])
def test_the_variance_between_units_has_the_greatest_restricted_likelihood(slope: bool) -> None:
    rng = np.random.default_rng(5)
    known, beside = rng.uniform(0.05, 3.0, 15), np.linspace(-1.0, 1.0, 15)[:, None]
    values = 2.5 * rng.standard_normal(15) + np.sqrt(known) * rng.standard_normal(15) + 4.0 * slope * beside[:, 0]
    design = np.column_stack([np.ones(15), beside]) if slope else np.ones((15, 1))

    def likelihood(omega: float) -> float:
        weights = 1.0 / (omega + known)
        precision = design.T @ (weights[:, None] * design)
        rest = values - design @ np.linalg.solve(precision, design.T @ (weights * values))
        return float(np.sum(np.log(weights)) - np.linalg.slogdet(precision)[1] - np.sum(weights * rest**2)) / 2.0

    best = minimize_scalar(lambda omega: -likelihood(omega), bounds=(0.0, 50.0), method="bounded",
                           options={"xatol": 1e-9})  # fmt: skip
    found = population(values, known, beside=beside if slope else None)
    assert best.x > 1.0 and found.variance == pytest.approx(best.x, rel=1e-4)


def test_bounds_move_with_what_the_covariates_change_and_widen_with_how_units_differ_in_it() -> None:
    found = population(SAMPLE, np.zeros(12))
    low, high = found.limits()
    assert found.limits(-2.0, 3.0) == pytest.approx((low - 2.0, high + 3.0))
    wide = found.limits(more=2.0)
    assert wide[0] < low and wide[1] > high
    # where the change alone differs between units the bound is that of a normal law of its deviation
    far = found.limits(more=1e4)
    assert far[1] == pytest.approx(-far[0], rel=1e-2) and 1.6e4 < far[1] < 3e4


def test_the_same_seed_draws_the_same_and_another_one_nearly() -> None:
    one, same, other = (population(SAMPLE, np.full(12, 0.1), seed=s) for s in (0, 0, 1))
    assert np.array_equal(one.means, same.means) and not np.array_equal(one.means, other.means)
    assert one.mean_interval == pytest.approx(other.mean_interval, abs=0.1)


def test_a_population_whose_units_scatter_less_than_their_fits_say_is_not_told() -> None:
    assert population(0.001 * SAMPLE, np.ones(12)).untold and not population(SAMPLE, np.zeros(12)).untold


def test_odd_units_take_no_part_in_mean_and_deviation_and_keep_their_places() -> None:
    values = np.append(SAMPLE, 50.0)
    found, sound = population(values, np.zeros(13), odd=[12]), population(SAMPLE, np.zeros(12))
    assert (found.mean, found.variance) == pytest.approx((sound.mean, sound.variance))
    assert found.mean_interval == pytest.approx(sound.mean_interval)
    assert len(found.scores) == 13 and found.scores[12] == pytest.approx((50.0 - found.mean) / found.variance**0.5)


def spoilt(units: int, *places: int) -> Array:
    """Return units at even quantiles of the normal law, but for some that are far off."""
    values: Array = stats.norm.ppf((np.arange(units) + 0.5) / units)
    for k, place in enumerate(places):
        values[place] = (30.0 + 10.0 * k) * (-1.0) ** k
    return values


@pytest.mark.parametrize(
    ("units", "places", "found"),
    [
        (20, (3, 11, 17), [17, 11, 3]),
        # a quarter of the units at most
        (8, (1, 4, 6), []),
        (8, (1, 4), [4, 1]),
        (UNITS_NEEDED, (0,), []),
    ],
)
def test_odd_units_are_found_one_after_the_other_up_to_a_quarter_of_all(
    units: int, places: tuple[int, ...], found: list[int]
) -> None:
    told = odd_units(spoilt(units, *places), np.full(units, 1e-4), 1)
    assert [place for place, _, _ in told] == found


def test_the_more_is_judged_the_clearer_a_unit_has_to_stand_out() -> None:
    values = spoilt(12)
    values[5] = 6.0
    [(place, z, once)] = odd_units(values, np.zeros(12), 1)
    assert place == 5 and z > 3.0 and 0.0 < once < 0.01
    # against all others: their mean and deviation, with the error of that mean
    rest = np.delete(values, 5)
    assert z == pytest.approx((6.0 - rest.mean()) / (rest.std(ddof=1) * np.sqrt(1.0 + 1.0 / 11.0)), rel=0.02)
    [(_, _, five)] = odd_units(values, np.zeros(12), 5)
    assert five == pytest.approx(5.0 * once)
    assert odd_units(values, np.zeros(12), round(0.011 / once)) == []
