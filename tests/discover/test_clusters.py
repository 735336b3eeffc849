"""Intervals hold the truth although every condition has an error of form of its own."""

import numpy as np
import pytest

from mrfit.discover.evidence.clusters import clustered, score
from mrfit.discover.policy import STANDARD
from mrfit.fit.diagnostics.uncertainty import Uncertainty, analyse

CONDITIONS, SAMPLES, DRAWS = 9, 400, 1000


def slope_and_widths(rng: np.random.Generator, scatter: float) -> tuple[float, float, float]:
    """Fit y = 0.5*x over conditions whose own slopes scatter; return the slope and both half-widths."""
    x = [rng.standard_normal(SAMPLES) for _ in range(CONDITIONS)]
    y = [(0.5 + scatter * rng.standard_normal()) * c + 0.1 * rng.standard_normal(SAMPLES) for c in x]
    jacobians = [c[:, None] for c in x]
    slope = float(np.linalg.lstsq(np.vstack(jacobians), np.concatenate(y), rcond=None)[0][0])
    residuals = [slope * c - d for c, d in zip(x, y, strict=True)]
    within = analyse(jacobians, residuals)
    both = clustered(within, jacobians, residuals, [f"c{k}" for k in range(CONDITIONS)])
    one = np.ones(1)
    return slope, within.half_width(one), both.half_width(one)


def test_scatter_between_conditions_is_in_the_interval() -> None:
    rng = np.random.default_rng(3)
    held = np.array(
        [[abs(s - 0.5) < w for w in widths] for s, *widths in (slope_and_widths(rng, 0.2) for _ in range(200))]
    )
    assert held[:, 0].mean() < 0.6
    assert 0.91 < held[:, 1].mean() < 0.99


def test_intervals_are_not_narrower_than_the_noise_within_records_makes_them() -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        _, within, both = slope_and_widths(rng, 0.0)
        assert both >= within * (1 - 1e-9)


def test_two_conditions_tell_no_scatter() -> None:
    rng = np.random.default_rng(5)
    jacobians, residuals = [rng.standard_normal((50, 1)) for _ in range(2)], [rng.standard_normal(50) for _ in range(2)]
    within = analyse(jacobians, residuals)
    assert clustered(within, jacobians, residuals, ["a", "b"]) is within


def one_slope(rng: np.random.Generator, conditions: int, slope: float, scatter: float) -> tuple[float, Uncertainty]:
    """Return a slope that is the same in all conditions but for their scatter, and its uncertainty."""
    x = [rng.standard_normal(60) for _ in range(conditions)]
    y = [(slope + scatter * rng.standard_normal()) * c + 0.05 * rng.standard_normal(60) for c in x]
    jacobians = [c[:, None] for c in x]
    found = float(np.linalg.lstsq(np.vstack(jacobians), np.concatenate(y), rcond=None)[0][0])
    residuals = [found * c - d for c, d in zip(x, y, strict=True)]
    within = analyse(jacobians, residuals)
    return found, clustered(within, jacobians, residuals, [f"c{k}" for k in range(conditions)])


@pytest.mark.parametrize(("conditions", "numbers"), [(4, 1), (5, 1), (6, 2)])
def test_few_conditions_make_no_effect_clear_by_chance(conditions: int, numbers: int) -> None:
    rng = np.random.default_rng(6)
    nulls = [one_slope(rng, conditions, 0.0, 0.3) for _ in range(DRAWS)]
    by_interval = [STANDARD.half_width * abs(found) / own.half_width(np.ones(1)) for found, own in nulls]
    by_conditions = [score(own, 0, found, numbers) for found, own in nulls]
    clear = [sum(z > STANDARD.clear for z in found) for found in (by_interval, by_conditions)]
    assert clear[1] <= 0.004 * DRAWS and 2 * clear[1] <= clear[0]


def test_an_effect_that_six_conditions_agree_on_is_clear_and_the_more_numbers_they_tell_the_less() -> None:
    rng = np.random.default_rng(7)
    found, own = one_slope(rng, 6, 0.5, 0.01)
    scores = [score(own, 0, found, numbers) for numbers in (1, 2, 3)]
    assert scores[0] > STANDARD.clear and scores == sorted(scores, reverse=True)
