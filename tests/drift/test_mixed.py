"""The mixed model gives what statsmodels' MixedLM gives where nothing is known of the variances."""

import numpy as np
import pytest
from scipy import stats

from mrfit.drift.mixed import fit_mixed


@pytest.mark.parametrize("tests", [(4,), (2, 3, 6)])
def test_it_equals_the_mixed_model_of_statsmodels(tests: tuple[int, ...]) -> None:
    lm = pytest.importorskip("statsmodels.regression.mixed_linear_model")
    rng = np.random.default_rng(3)
    units = np.repeat(np.arange(18), np.resize(tests, 18))
    time = rng.uniform(0.0, 1.0, len(units))
    x = np.column_stack([np.ones(len(units)), time])
    y = 3.0 + 0.5 * time + rng.standard_normal(18)[units] + 0.5 * rng.standard_normal(len(units))
    theirs = lm.MixedLM(y, x, groups=units).fit(reml=True, method="bfgs", gtol=1e-12)
    ours = fit_mixed(y, x, np.zeros(len(y)), units, np.ones((len(y), 1)))
    assert ours.beta == pytest.approx(theirs.fe_params, rel=1e-6)
    assert ours.components[0] == pytest.approx(theirs.scale, rel=1e-6)
    assert ours.components[1] == pytest.approx(float(theirs.cov_re[0, 0]), rel=1e-6)
    # their standard errors are of the observed information, with the variances; ours begin with (X'V⁻¹X)⁻¹
    v = ours.components[0] * np.eye(len(y)) + ours.components[1] * (units[:, None] == units)
    assert ours.covariance == pytest.approx(np.linalg.inv(x.T @ np.linalg.solve(v, x)), rel=1e-9)
    assert ours.errors == pytest.approx(theirs.bse_fe, rel=0.05)


def test_without_units_it_is_least_squares_with_its_t_intervals() -> None:
    rng = np.random.default_rng(1)
    x = np.column_stack([np.ones(9), np.arange(9.0)])
    y = x @ [1.0, 0.2] + rng.standard_normal(9)
    found = fit_mixed(y, x, np.zeros(9), np.arange(9), np.empty((9, 0)))
    line = stats.linregress(x[:, 1], y)
    assert found.beta[1] == pytest.approx(line.slope, rel=1e-8)
    assert found.errors[1] == pytest.approx(line.stderr, rel=1e-6) and found.degrees[1] == pytest.approx(7.0, rel=1e-6)
    assert found.probabilities[1] == pytest.approx(line.pvalue, rel=1e-5)


def test_known_variances_are_weights_where_nothing_else_differs() -> None:
    known = np.array([1.0, 4.0, 9.0, 1.0])
    y = np.array([1.0, 1.1, 0.9, 1.05])
    found = fit_mixed(y, np.ones((4, 1)), known, np.arange(4), np.empty((4, 0)))
    assert found.components[0] == 0.0
    assert found.beta[0] == pytest.approx(np.average(y, weights=1.0 / known))
    assert found.errors[0] == pytest.approx(np.sum(1.0 / known) ** -0.5)
