"""The band of a trend's mean, and which panels come first."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import linregress
from scipy.stats import t as student

from mrfit.drift.analysis import Trend, _fitted, _trends
from mrfit.drift.page import BAND_POINTS, PANELS_DRAWN, _mean_of, figure
from mrfit.drift.population import population
from mrfit.io.schemas.drift import ChangePoint
from tests.drift.test_causes import trend, value


def line(units: int) -> Trend:
    rng = np.random.default_rng(4)
    rows = [value(f"u{k}", 5.0 + 0.3 * k + rng.standard_normal(), 0.0, x=float(k)) for k in range(units)]
    [found] = _trends(rows, ("x",))
    return _fitted(found)


def test_the_band_of_a_line_is_that_of_least_squares() -> None:
    own = line(9)
    x, y = own.values[:, 0], own.y
    across = np.linspace(0.0, 8.0, BAND_POINTS)
    fit = linregress(x, y)
    left = y - fit.intercept - fit.slope * x
    spread = np.sqrt(left @ left / 7.0 * (1.0 / 9.0 + (across - 4.0) ** 2 / np.sum((x - 4.0) ** 2)))
    found = _mean_of(own, across)
    assert found is not None
    assert found[0] == pytest.approx(fit.intercept + fit.slope * across)
    assert found[1] == pytest.approx(student.ppf(0.975, 7) * spread, rel=1e-4)


def test_without_a_covariate_the_mean_is_that_of_the_population_and_without_units_there_is_none() -> None:
    own = trend(*(value(f"u{k}", y) for k, y in enumerate((1.0, 2.0, 4.0))))
    assert _mean_of(own, np.zeros(BAND_POINTS)) is None
    whole = replace(own, population=population(own.y, own.known))
    found = _mean_of(whole, np.zeros(BAND_POINTS))
    assert found is not None and whole.population is not None
    low, high = whole.population.mean_interval
    assert found[0] == pytest.approx(np.full(BAND_POINTS, whole.population.mean))
    assert found[1] == pytest.approx(np.full(BAND_POINTS, (high - low) / 2.0))


def test_trends_with_a_step_or_an_odd_unit_are_drawn_before_the_others() -> None:
    plain = [
        replace(trend(*(replace(value(f"u{k}", float(k)), parameter=f"p{n}") for k in range(3)))) for n in range(3)
    ]
    stepped = replace(plain[1], change=ChangePoint(covariate="x", at=1.0, change=1.0, probability=0.001))
    odd = replace(plain[2], odd=[(0, 9.0, 1e-4)])
    drawn = figure([plain[0], stepped, odd])
    assert drawn.index("p1 (N)") < drawn.index("p2 (N)") < drawn.index("p0 (N)")
    assert PANELS_DRAWN >= 3
