"""The unit of a fit's output on its page, and words for every way in which its noise floor is found."""

from typing import get_args

import pytest

from mrfit.io.schemas.fit import Fit, MetricRow, Result
from mrfit.report.output_unit import OutputUnit, output_unit
from mrfit.report.verdict import METHODS
from mrfit.signal.noise_floor import Method


def fit_of(output: str, *metrics: MetricRow) -> Fit:
    result = Result(condition="all", evaluations=1, parameters=[])
    return Fit(name="a", model="tanh", optimizer="lsq", output=output, results=[result], metrics=list(metrics))


def row(role: str, rmse: float | None, nrmse: float | None) -> MetricRow:
    return MetricRow(condition="all", role=role, samples=9, rmse=rmse, nrmse=nrmse)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("output", "rmse", "nrmse", "unit"),
    [
        # a range of 10 kN and an error of 100 N: 1 kN lies between
        ("force", 100.0, 0.01, (1e-3, "kN")),
        ("force", 90.0, 0.01, (1.0, "N")),
        ("flux", 1e-5, 1e-4, (1e3, "mWb")),
        ("torque", 0.5, 0.25, (1.0, "N·m")),
    ],
)
def test_the_geometric_mean_of_range_and_error_decides(
    output: str, rmse: float, nrmse: float, unit: tuple[float, str]
) -> None:
    found = output_unit(fit_of(output, row("train", rmse, nrmse)))
    assert (pytest.approx(found.factor), found.unit) == unit


def test_an_error_that_cannot_be_told_decides_nothing() -> None:
    held = row("holdout", 100.0, 0.01)
    for rmse, nrmse in ((None, None), (0.0, 0.0), (float("inf"), float("inf"))):
        assert output_unit(fit_of("force", row("train", rmse, nrmse), held)).unit == "kN"
        assert output_unit(fit_of("force", row("train", rmse, nrmse))) == OutputUnit(1.0, "N")
    # training decides where both can
    assert output_unit(fit_of("force", row("train", 1.0, 0.01), held)).unit == "N"


def test_squares_and_values_have_the_unit() -> None:
    assert [OutputUnit(1.0, u).squared for u in ("kN", "N·m", "m/s²", "")] == ["kN²", "(N·m)²", "(m/s²)²", ""]
    assert OutputUnit(1e-3, "kN").words(-1234.5) == "−1.23 kN"
    assert OutputUnit(1.0, "").words(0.5) == "0.500" and OutputUnit(1.0, "N").words(None) == "– N"


def test_every_way_to_a_noise_floor_has_words() -> None:
    assert set(METHODS) == set(get_args(Method))
