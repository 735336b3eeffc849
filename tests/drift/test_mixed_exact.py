"""The mixed model where its answer is known: balanced designs, and the maximum of the restricted likelihood."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import t as student

from mrfit.core.specs import Array
from mrfit.drift.mixed import fit_mixed

UNITS, TESTS = 7, 5


def balanced(seed: int, between: float = 2.0, slope: float = 0.0) -> tuple[Array, Array, Array]:
    """Return values of units that were tested at the same times, these times, and the units."""
    rng = np.random.default_rng(seed)
    units, time = np.repeat(np.arange(UNITS), TESTS), np.tile(np.arange(float(TESTS)), UNITS)
    level, own = between * rng.standard_normal(UNITS), slope * rng.standard_normal(UNITS)
    return 10.0 + level[units] + own[units] * time + rng.standard_normal(len(units)), time, units


@settings(deadline=None, max_examples=10)
@given(st.integers(0, 1000))
def test_the_mean_of_balanced_units_has_the_error_and_the_degrees_of_their_means(seed: int) -> None:
    y, _, units = balanced(seed)
    found = fit_mixed(y, np.ones((len(y), 1)), np.zeros(len(y)), units, np.ones((len(y), 1)))
    means = y.reshape(UNITS, TESTS).mean(axis=1)
    assert found.beta[0] == pytest.approx(means.mean())
    assert found.errors[0] == pytest.approx(means.std(ddof=1) / np.sqrt(UNITS), rel=1e-5)
    assert found.degrees[0] == pytest.approx(UNITS - 1.0, rel=1e-4)
    within = y.reshape(UNITS, TESTS).var(axis=1, ddof=1).mean()
    assert found.components[0] == pytest.approx(within, rel=1e-5)
    assert found.components[1] == pytest.approx(means.var(ddof=1) - within / TESTS, rel=1e-4)


def test_the_slope_within_balanced_units_is_that_of_least_squares_with_a_level_each() -> None:
    y, time, units = balanced(3)
    centred = time - time.mean()
    found = fit_mixed(y, np.column_stack([np.ones(len(y)), centred]), np.zeros(len(y)), units, np.ones((len(y), 1)))
    design = np.column_stack([units[:, None] == np.arange(UNITS), centred])
    beta, left, *_ = np.linalg.lstsq(design, y, rcond=None)
    free = len(y) - UNITS - 1
    error = np.sqrt(left[0] / free / (centred @ centred))
    assert found.beta[1] == pytest.approx(beta[-1]) and found.errors[1] == pytest.approx(error, rel=1e-5)
    assert found.degrees[1] == pytest.approx(free, rel=1e-3)
    assert found.probabilities[1] == pytest.approx(2.0 * student.sf(abs(beta[-1]) / error, free), rel=1e-3)


def restricted(gamma: Array, y: Array, x: Array, known: Array, units: Array, z: Array) -> float:
    """Return the restricted log-likelihood, by whole matrices."""
    alike = units[:, None] == units
    v = np.diag(known + gamma[0]) + sum(
        g * alike * np.outer(column, column) for g, column in zip(gamma[1:], z.T, strict=True)
    )
    inverse = np.linalg.inv(v)
    precision = x.T @ inverse @ x
    rest = y - x @ np.linalg.solve(precision, x.T @ inverse @ y)
    return float(-0.5 * (np.linalg.slogdet(v)[1] + np.linalg.slogdet(precision)[1] + rest @ inverse @ rest))


@pytest.mark.parametrize("seed", [1, 2])
def test_levels_and_slopes_that_differ_between_units_have_the_greatest_restricted_likelihood(seed: int) -> None:
    y, time, units = balanced(seed, slope=0.8)
    rng = np.random.default_rng(seed)
    kept = rng.permutation(len(y))[: len(y) - 6]
    y, time, units, known = y[kept], time[kept], units[kept], rng.uniform(0.1, 1.0, len(kept))
    x = np.column_stack([np.ones(len(y)), time])
    found = fit_mixed(y, x, known, units, x)
    data = (y, x, known, units, x)
    best = restricted(found.components, *data)
    # near it and far from it nothing is likelier
    others = [found.components * np.where(np.arange(3) == k, share, 1.0) for k in range(3) for share in (0.98, 1.02)]
    others += [*rng.lognormal(0.0, 2.0, (12, 3))]
    assert np.all(found.components > 0.0) and best > max(restricted(g, *data) for g in others)
    change = [restricted(found.components * (1.0 + 1e-4 * e), *data) - best for e in np.eye(3)]
    assert np.abs(change).max() < 1e-6


def test_values_of_another_size_have_the_same_fit() -> None:
    y, time, units = balanced(5, slope=0.5)
    x, known = np.column_stack([np.ones(len(y)), time]), np.full(len(y), 0.2)
    one, other = fit_mixed(y, x, known, units, x), fit_mixed(1e6 * y, x, 1e12 * known, units, x)
    assert other.beta == pytest.approx(1e6 * one.beta) and other.errors == pytest.approx(1e6 * one.errors)
    assert other.components == pytest.approx(1e12 * one.components)
    assert other.component_errors == pytest.approx(1e12 * one.component_errors)
    assert other.covariance == pytest.approx(1e12 * one.covariance) and other.degrees == pytest.approx(one.degrees)


def test_of_a_variance_that_is_none_nothing_is_estimated() -> None:
    y, _, units = balanced(6, between=0.0)
    found = fit_mixed(y, np.ones((len(y), 1)), np.full(len(y), 100.0), units, np.ones((len(y), 1)))
    assert found.components == pytest.approx([0.0, 0.0], abs=1e-12)
    assert np.all(found.component_errors == 0.0) and np.isinf(found.degrees[0])
    assert found.errors[0] == pytest.approx(np.sqrt(100.0 / len(y)))


def test_values_that_are_all_alike_have_no_variance() -> None:
    found = fit_mixed(np.full(6, 3.0), np.ones((6, 1)), np.zeros(6), np.repeat([0, 1, 2], 2), np.ones((6, 1)))
    assert found.beta[0] == pytest.approx(3.0) and np.all(found.components < 1e-9)


def test_the_order_of_rows_and_the_numbers_of_units_are_of_no_account() -> None:
    y, time, units = balanced(8)
    x, z = np.column_stack([np.ones(len(y)), time]), np.ones((len(y), 1))
    known = np.random.default_rng(0).uniform(0.1, 2.0, len(y))
    order = np.random.default_rng(1).permutation(len(y))
    one = fit_mixed(y, x, known, units, z)
    other = fit_mixed(y[order], x[order], known[order], (100 - 3 * units)[order], z)
    assert other.beta == pytest.approx(one.beta) and other.errors == pytest.approx(one.errors)
    assert other.components == pytest.approx(one.components)
