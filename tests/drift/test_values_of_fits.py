"""Values of a fit with their variances, names and covariates, read off its document."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mrfit.batch.log import NO_SHEET, _tests
from mrfit.drift.source import FitValue, values_of_fit
from mrfit.io.schemas.band import Remainder
from mrfit.io.schemas.fit import Caution, Covariance, Fit, Level, MetricRow, Passivity, Quantity, Result, SegmentUse

KNOWN = Covariance(
    names=["c", "fy", "ratio"], roles=["viscous", "yield", ""], log=[True, False, False],
    rows=[[0.04, 0.01, 0.0], [0.01, 9.0, 0.0], [0.0, 0.0, 0.25]], degrees=20.0,
)  # fmt: skip


def result(
    condition: str = "sine", recordings: tuple[str, ...] = ("a",), work: float | None = None, **given: Any
) -> Result:
    parameters = [
        Quantity(name="fy", value=300.0, unit="N", low=290.0, high=310.0),
        Quantity(name="c", value=900.0, unit="N*s/m"),
        Quantity(name="f0", value=0.0, unit="N", fixed=True),
    ]
    passivity = [] if work is None else [Passivity(condition=condition, loop_area=work, passive=True)]
    about: dict[str, Any] = {
        "parameters": parameters,
        "derived": [Quantity(name="ratio", value=3.0)],
        "covariance": KNOWN,
    }
    about |= {"segments": [SegmentUse(id=f"{r}#1", condition=condition, role="train") for r in recordings]}
    return Result(**{**about, "condition": condition, "evaluations": 1, "passivity": passivity, **given})


def fit(*results: Result, **given: Any) -> Fit:
    return Fit(name="f", model="bingham", optimizer="lsq", output="force", results=[*results], metrics=[], **given)


def by_name(values: list[FitValue]) -> dict[str, FitValue]:
    return {v.parameter: v for v in values}


def test_values_are_on_the_scale_of_the_search_with_their_own_variance() -> None:
    found = by_name(values_of_fit(fit(result()), "a.csv"))
    # what is not in the covariance is not determined
    assert [*found] == ["c", "fy", "ratio"]
    c, fy = found["c"], found["fy"]
    assert (c.value, c.variance, c.log_scale, c.role, c.unit) == (math.log(900.0), 0.04, True, "viscous", "N*s/m")
    assert (fy.value, fy.variance, fy.log_scale, fy.role, fy.unit) == (300.0, 9.0, False, "yield", "N")
    assert [v.settable for v in found.values()] == [True, True, False] and {v.model for v in found.values()} == {
        "bingham"
    }
    assert values_of_fit(fit(result(covariance=None)), "a.csv") == []


@pytest.mark.parametrize(
    ("results", "label", "logs"),
    [
        # one set of parameters is of all there is
        ([("a",)], "w", ["w"]),
        ([("a", "b")], "w", ["w"]),
        # of several each is named after its recording
        ([("a",), ("b",)], "w", ["w/a", "w/b"]),
        ([("a", "b"), ("c",)], "w", ["w", "w/c"]),
        # but for the workspace of a log, which is named after it
        ([("a",), ("a",)], "logs/a.csv", ["logs/a.csv", "logs/a.csv"]),
        ([("a",), ("b",)], "logs/a.csv", ["logs/a.csv", "logs/a.csv/b"]),
    ],
)
def test_a_fit_of_several_conditions_names_each_after_its_recording(
    results: list[tuple[str, ...]], label: str, logs: list[str]
) -> None:
    made = [result(f"c{k}", recordings) for k, recordings in enumerate(results)]
    assert [v.log for v in values_of_fit(fit(*made), label) if v.parameter == "fy"] == logs


def test_conditions_of_a_test_are_covariates_where_they_are_known() -> None:
    found = values_of_fit(fit(result(at=Level(frequency=2.0, current=0.5))), "a")[0]
    assert found.covariates == {"frequency": 2.0, "current": 0.5} and found.condition == "sine"


def remainder(**extents: tuple[float, float]) -> Remainder:
    return Remainder(condition="sine", role="train", quantile=1.0, reach=1.0, independent=9.0, extents=extents)


def test_the_temperature_is_the_middle_of_what_the_data_range_over() -> None:
    warm = result(remainders=[remainder(temperature=(20.0, 30.0)), remainder(temperature=(40.0, 50.0))])
    assert values_of_fit(fit(warm), "a")[0].covariates == {"temperature": 35.0}
    assert values_of_fit(fit(result(remainders=[remainder(current=(0.0, 1.0))])), "a")[0].covariates == {}


def test_the_energy_of_blocks_of_cycles_adds_up_to_the_middle_of_each() -> None:
    blocks = [result("sine-cycles1to10", work=5.0), result("sine-cycles11to30", work=4.0), result("sine", work=7.0)]
    found = [v for v in values_of_fit(fit(*blocks), "a") if v.parameter == "fy"]
    # 10 cycles of 5 J, 20 of 4 J: half of the first, all of it and half of the second
    assert [v.covariates for v in found] == [
        {"cycles": 5.0, "energy": 25.0},
        {"cycles": 20.0, "energy": 50.0 + 40.0},
        {},
    ]
    assert {v.condition for v in found} == {"sine"}


def test_each_log_takes_its_own_energy_and_a_loop_that_is_not_known_none() -> None:
    blocks = [result("sine-cycles1to10", (r,), work=w) for r, w in (("a", 5.0), ("b", 3.0), ("c", None))]
    found = [v for v in values_of_fit(fit(*blocks), "w") if v.parameter == "fy"]
    assert [v.covariates.get("energy") for v in found] == [25.0, 15.0, None]


def test_what_is_out_of_date_about_a_fit_is_a_doubt_of_its_values() -> None:
    found = values_of_fit(fit(result(), outdated=["the code has changed"]), "a")
    assert {v.doubts for v in found} == {("warning outdated: f: the code has changed",)}


def test_a_batch_keeps_errors_by_role_free_parameters_and_each_kind_of_warning_once() -> None:
    cautions = [Caution(kind=k, text="") for k in ("drift", "bound", "drift")]
    rows = [
        MetricRow(condition=c, role=r, samples=9, nrmse=e)  # type: ignore[arg-type]
        for c, r, e in (("all", "train", 0.9), ("sine", "train", 0.1), ("sine", "holdout", 0.2), ("tri", "train", 0.3))
    ]
    made = fit(
        result(warnings=cautions[:1], at=Level(frequency=2.0, amplitude=0.01)), result("tri"), warnings=cautions[1:]
    )
    made = replace(made, metrics=rows)
    first, second = _tests(made, [NO_SHEET])
    assert (first.nrmse, first.nrmse_holdout, second.nrmse, second.nrmse_holdout) == (0.1, 0.2, 0.3, None)
    assert first.warnings == ["bound", "drift", NO_SHEET] and second.warnings == ["bound", "drift", NO_SHEET]
    assert [p.parameter for p in first.parameters] == ["fy", "c", "ratio"]
    assert (first.parameters[0].low, first.parameters[0].high, first.parameters[1].low) == (290.0, 310.0, None)
    assert (first.frequency, first.amplitude, first.current) == (2.0, 0.01, None)
    assert np.array_equal(first.covariance.rows if first.covariance else [], KNOWN.rows)
