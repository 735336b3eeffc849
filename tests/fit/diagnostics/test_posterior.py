"""The posterior is the HAC interval where a model is linear, and stays within the bounds where that does not."""

import numpy as np
import pytest

from mrfit.fit.diagnostics import posterior
from mrfit.io.schemas.fit import FitDiagnostics
from tests.fit.diagnostics.test_diagnose import judged


@pytest.fixture(scope="module")
def both() -> tuple[FitDiagnostics, FitDiagnostics]:
    return judged(), judged("posterior")


def test_of_a_nearly_linear_model_it_is_the_interval_of_the_covariance(
    both: tuple[FitDiagnostics, FitDiagnostics],
) -> None:
    cheap, full = both
    assert full.intervals == "posterior"
    for one, other in zip(cheap.parameters, full.parameters, strict=True):
        assert one.low is not None and one.high is not None and other.low is not None and other.high is not None
        width = one.high - one.low
        assert other.high - other.low == pytest.approx(width, rel=0.15)
        assert (other.low + other.high) / 2.0 == pytest.approx((one.low + one.high) / 2.0, abs=0.1 * width)


def test_its_draws_are_kept_and_lie_within_the_bounds(both: tuple[FitDiagnostics, FitDiagnostics]) -> None:
    draws = both[1].draws
    assert draws is not None and both[0].draws is None
    rows = np.array(draws.rows)
    for column, name in zip(rows.T, draws.names, strict=True):
        row = next(p for p in both[1].parameters if p.name == name)
        assert row.bound_low is not None and row.bound_high is not None
        assert np.all((column >= row.bound_low) & (column <= row.bound_high))


def test_weighted_draws_and_walkers_give_the_same_intervals(
    both: tuple[FitDiagnostics, FitDiagnostics], monkeypatch
) -> None:  # type: ignore[no-untyped-def]
    pytest.importorskip("emcee")
    monkeypatch.setattr(posterior, "EFFECTIVE_DRAWS", np.inf)
    for one, walked in zip(both[1].parameters, judged("posterior").parameters, strict=True):
        assert walked.low == pytest.approx(one.low, abs=0.1 * (one.high - one.low))
        assert walked.high == pytest.approx(one.high, abs=0.1 * (one.high - one.low))
