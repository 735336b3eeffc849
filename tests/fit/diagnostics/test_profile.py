"""Profile-likelihood intervals agree with the t interval of linear models, and stay open where a bound comes first."""

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.fit.diagnostics.bootstrap import BootstrapInterval
from mrfit.fit.diagnostics.profile import ProfiledParameter, variance_factors
from mrfit.fit.diagnostics.profile import profiled as profiles_of
from mrfit.fit.diagnostics.uncertainty import Linearisation, analyse
from mrfit.search.problem import LeastSquaresProblem
from tests.fit.toy import block, linear_model

SAMPLES = 2000
PHASE = np.linspace(0, 20 * np.pi, SAMPLES, endpoint=False)


def likelihoods(drive: Array, truth: Array, noise: float) -> tuple[dict[str, ProfiledParameter], Array, Array]:
    """Return profiles by name, the estimate, and the standard errors for white noise."""
    rng = np.random.default_rng(1)
    assembly, cube = linear_model(*[""] * len(truth))
    measured = truth @ drive + noise * rng.standard_normal(SAMPLES)
    estimate = np.linalg.lstsq(drive.T, measured, rcond=None)[0]
    point = cube.to_points(estimate[None, :])[0]
    errors = measured - estimate @ drive
    linearised = Linearisation([2 * drive.T], [-errors], [0.0])
    uncertainty = analyse(linearised.jacobians, linearised.residuals)
    assert np.allclose(variance_factors(uncertainty, linearised)[0], 1.0, atol=0.35)
    posed = LeastSquaresProblem([block(drive, measured)], np.ones(1), assembly, cube)
    spread = noise * np.sqrt(np.diag(np.linalg.pinv(drive @ drive.T)))
    found = profiles_of(posed, point, uncertainty, linearised)
    return {one.profile.name: one for one in found}, estimate, spread


def profiled(drive: Array, truth: Array, noise: float) -> tuple[dict[str, BootstrapInterval], Array, Array]:
    found, estimate, spread = likelihoods(drive, truth, noise)
    return {name: one.interval for name, one in found.items()}, estimate, spread


def test_intervals_of_a_linear_model_are_t_intervals_though_its_columns_are_correlated() -> None:
    found, estimate, spread = profiled(
        np.vstack([np.sin(PHASE), 0.8 * np.sin(PHASE) + 0.5 * np.cos(PHASE)]), np.array([0.3, -0.2]), 0.1
    )
    for k, name in enumerate(("p0", "p1")):
        low, high = found[name]
        assert low is not None and high is not None
        assert (low + high) / 2 == pytest.approx(estimate[k], abs=0.1 * spread[k])
        assert (high - low) / 2 == pytest.approx(1.96 * spread[k], rel=0.25)


def test_an_interval_is_open_on_the_side_where_the_bound_comes_first() -> None:
    found, _, _ = profiled(np.vstack([np.sin(PHASE)]), np.array([0.95]), 2.0)
    low, high = found["p0"]
    assert low is not None and low < 0.95
    assert high is None


def test_a_redundant_pair_has_no_profile() -> None:
    found, _, _ = profiled(np.vstack([np.sin(PHASE), np.sin(PHASE), np.ones(SAMPLES)]), np.array([0.1, 0.1, 0.2]), 0.1)
    assert set(found) == {"p2"}


def test_the_profile_of_a_linear_model_is_a_parabola_in_standard_errors() -> None:
    drive = np.vstack([np.sin(PHASE), 0.8 * np.sin(PHASE) + 0.5 * np.cos(PHASE)])
    found, estimate, spread = likelihoods(drive, np.array([0.3, -0.2]), 0.1)
    for k, name in enumerate(("p0", "p1")):
        profile, interval = found[name].profile, found[name].interval
        values, rises = np.array(profile.values), np.array(profile.rises)
        assert np.all(np.diff(values) > 0.0) and len(values) >= 7
        assert rises[np.argmin(np.abs(values - estimate[k]))] == 0.0
        # white noise: the root of the rise is the distance in standard errors
        assert rises == pytest.approx(np.abs(values - estimate[k]) / spread[k], rel=0.3, abs=0.02)
        assert values[0] < interval.low and values[-1] > interval.high
        at_ends = np.interp([interval.low, interval.high], values, rises)
        assert at_ends == pytest.approx([profile.quantile] * 2, rel=0.02)
