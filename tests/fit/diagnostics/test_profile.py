"""Profile-likelihood intervals agree with the t interval of linear models, and stay open where a bound comes first."""

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.fit.diagnostics.bootstrap import Interval
from mrfit.fit.diagnostics.profile import profile_intervals, variance_factors
from mrfit.fit.diagnostics.uncertainty import Linearised, analyse
from mrfit.search.problem import Posed
from tests.fit.toy import block, linear_model

SAMPLES = 2000
PHASE = np.linspace(0, 20 * np.pi, SAMPLES, endpoint=False)


def profiled(drive: Array, truth: Array, noise: float) -> tuple[dict[str, Interval], Array, Array]:
    """Return profile intervals, the estimate, and the standard errors for white noise."""
    rng = np.random.default_rng(1)
    assembly, cube = linear_model(*[""] * len(truth))
    measured = truth @ drive + noise * rng.standard_normal(SAMPLES)
    estimate = np.linalg.lstsq(drive.T, measured, rcond=None)[0]
    point = cube.to_points(estimate[None, :])[0]
    errors = measured - estimate @ drive
    linearised = Linearised([2 * drive.T], [-errors], [0.0])
    uncertainty = analyse(linearised.jacobians, linearised.residuals)
    assert np.allclose(variance_factors(uncertainty, linearised)[0], 1.0, atol=0.35)
    posed = Posed([block(drive, measured)], np.ones(1), assembly, cube)
    spread = noise * np.sqrt(np.diag(np.linalg.pinv(drive @ drive.T)))
    return profile_intervals(posed, point, uncertainty, linearised), estimate, spread


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
