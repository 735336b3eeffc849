"""Values of a table, with their variances, units and covariates; units that are drawn from their population."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pandas import DataFrame

from mrfit.core.specs import Array
from mrfit.drift.analysis import Trend
from mrfit.drift.draws import drawn_units, sets_of_units
from mrfit.drift.population import Population, population
from mrfit.drift.source import (
    HALF_INTERVAL,
    FitValue,
    columns_of,
    completed,
    condition_of,
    motion_of,
    read_values,
    values_of_table,
)
from mrfit.errors import ConfigError, DataError
from mrfit.settings.drift import Settings


def row(log: str = "u1", value: float = 2.0, **given: Any) -> dict[str, Any]:
    return {"log": log, "parameter": "fy", "value": value, "low": 1.0, "high": 3.0, **given}


def of(*rows: dict[str, Any]) -> list[FitValue]:
    return values_of_table(DataFrame(list(rows)))


def test_an_interval_gives_the_variance_of_a_normal_value() -> None:
    (plain,) = of(row())
    assert plain.variance == pytest.approx((1.0 / HALF_INTERVAL) ** 2) and plain.value == 2.0 and not plain.log_scale
    (log,) = of(row(scale="log"))
    assert log.value == math.log(2.0) and log.variance == pytest.approx((math.log(3.0) / 2.0 / HALF_INTERVAL) ** 2)


def test_of_a_covariance_a_row_takes_its_own_place() -> None:
    matrix = [np.array([4.0, 1.0]), np.array([1.0, 9.0])]
    found = of(*(row(covariance=m, condition="c") for m in matrix), row("u2", covariance=np.array([16.0, 0.0])))
    assert [v.variance for v in found] == [4.0, 9.0, 16.0]


@pytest.mark.parametrize(
    "given",
    [{"low": math.nan}, {"high": math.inf}, {"covariance": None}, {"covariance": np.array([math.nan])}],
)
def test_a_value_that_the_data_leave_open_is_passed_over(given: dict[str, Any]) -> None:
    assert of(row(**given)) == []
    assert len(of(row(), row("u2"))) == 2


def test_a_value_that_has_no_logarithm_is_named() -> None:
    with pytest.raises(DataError, match="fy of u1 is -2.0, on a logarithmic scale"):
        of(row(value=-2.0, scale="log"))


@pytest.mark.parametrize(
    ("lacking", "said"),
    [("log", "no column log"), ("parameter", "no column parameter"), ("low", "no column covariance")],
)
def test_a_lacking_column_is_named(lacking: str, said: str) -> None:
    with pytest.raises(DataError, match=said):
        values_of_table(DataFrame([row()]).drop(columns=lacking))


def test_other_numbers_of_a_table_are_covariates_and_words_are_not() -> None:
    (found,) = of(row(hours=7, site="x", nrmse=0.1, cold=math.nan))
    assert found.covariates == {"hours": 7.0}


@pytest.mark.parametrize(
    ("name", "condition", "cycles"),
    [
        ("sine-1Hz", "sine-1Hz", {}),
        ("sine-1Hz-cycles1to10", "sine-1Hz", {"cycles": 5.0}),
        ("sine-cycles11to20", "sine", {"cycles": 15.0}),
        ("sine-cycles11to20-1A", "sine-cycles11to20-1A", {}),
    ],
)
def test_the_cycles_of_a_block_are_a_covariate(name: str, condition: str, cycles: dict[str, float]) -> None:
    assert condition_of(name) == (condition, cycles)


def value(log: str, **given: Any) -> FitValue:
    return replace(FitValue(log, "", "sine", "fy", "N", "yield", 1.0, 0.01, False), **given)


def test_units_are_those_of_the_pattern_else_the_logs() -> None:
    values = [value("u1_a"), value("u1_b")]
    assert [v.specimen for v in completed(values, Settings())] == ["u1_a", "u1_b"]
    assert [v.specimen for v in completed(values, Settings(unit="{unit}_*"))] == ["u1", "u1"]


def test_a_date_in_a_name_is_days_and_one_that_is_stated_comes_first() -> None:
    values = [value("u_2026-01-02"), value("u_2026-01-04"), value("x", covariates={"date": 3.0})]
    dates = [v.covariates["date"] for v in completed(values, Settings(over=("date",)))]
    assert dates[1] - dates[0] == 2.0 and dates[2] == 3.0


def test_over_the_current_conditions_are_compared_with_each_other(tmp_path: Path) -> None:
    values = [value("a", condition=c, covariates={"current": i}) for c, i in (("s-1A", 1.0), ("s-2A", 2.0))]
    assert {v.condition for v in completed(values, Settings(over=("current",)))} == {"all"}
    with pytest.raises(DataError, match="one fit of every condition"):
        completed(values, Settings())


def test_covariates_of_a_file_are_found_by_log_name_or_stem(tmp_path: Path) -> None:
    path = tmp_path / "life.csv"
    path.write_text("log,cycles\nlogs/a.csv,1\nb.csv,2\nc,3\n")
    values = [value("logs/a.csv"), value("logs/b.csv"), value("logs/c.csv")]
    found = completed(values, Settings(covariates=path, over=("cycles",)))
    assert [v.covariates["cycles"] for v in found] == [1.0, 2.0, 3.0]
    with pytest.raises(DataError, match="no row of log 'd.csv'"):
        completed([*values, value("d.csv")], Settings(covariates=path))
    path.write_text("name,cycles\na,1\n")
    with pytest.raises(DataError, match="no column 'log'"):
        completed(values, Settings(covariates=path))


@pytest.mark.parametrize(
    ("values", "given", "error", "said"),
    [
        ([], {}, DataError, "no fit here states a covariance"),
        ([value("a", model="tanh"), value("b", model="dahl")], {}, DataError, "fits of several models, dahl, tanh"),
        ([value("a"), value("b")], {"over": ("hours",)}, ConfigError, "--over hours: no fit states it; there are none"),
        ([value("a"), value("b")], {"over": ("date",)}, ConfigError, "no log has one in its name"),
    ],
)
def test_what_cannot_be_compared_is_said(values: Any, given: Any, error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        completed(values, Settings(**given))


def test_what_is_no_table_and_no_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("")
    with pytest.raises(DataError, match="no workspace, and no table"):
        read_values([tmp_path / "a.txt"], Settings())
    (tmp_path / "a.parquet").write_text("")
    with pytest.raises(DataError, match="cannot be read as a table"):
        read_values([tmp_path / "a.parquet"], Settings())


def test_covariates_that_are_not_known_are_nan() -> None:
    found = columns_of([value("a", covariates={"x": 1.0}), value("b")], ["x", "y"])
    assert found.shape == (2, 2) and found[0, 0] == 1.0 and np.isnan(found.ravel()[1:]).all()
    assert columns_of([], ["x"]).shape == (0, 1)


@pytest.mark.parametrize("text", ["", "1:0.01", "0:0.01:1", "1:0:1", "1:0.01:nan", "a:b:c", "1:2:3:4"])
def test_a_motion_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match="as 1:0.01:0.5"):
        motion_of(text)
    assert motion_of("1:0.01:-0.5") == (1.0, 0.01, -0.5)


SIGMA, CORRELATION = 0.2, 0.9


def trends(scores: Array, **given: Any) -> list[Trend]:
    """Return trends whose units have these values (K, U), known exactly."""
    made = []
    for k, values in enumerate(scores):
        rows = tuple(
            value(f"u{n}", parameter=f"p{k}", value=float(v), variance=1e-12, settable=True, **given)
            for n, v in enumerate(values)
        )
        names = tuple(r.log for r in rows)
        spread: Population = population(values, np.full(len(values), 1e-12))
        places = np.arange(len(rows))
        made.append(Trend(rows, (), np.empty((len(rows), 0)), places, names, population=spread))
    return made


def correlated(units: int) -> Array:
    rng = np.random.default_rng(3)
    root = np.linalg.cholesky([[1.0, CORRELATION], [CORRELATION, 1.0]])
    return 5.0 + SIGMA * (root @ rng.standard_normal((2, units)))


def test_drawn_units_have_mean_scatter_and_correlation_of_the_units() -> None:
    scores = correlated(60)
    found = drawn_units(trends(scores), 4000, seed=1)
    assert found.mean(axis=0) == pytest.approx(scores.mean(axis=1), abs=0.01)
    assert found.std(axis=0) == pytest.approx(scores.std(axis=1, ddof=1), rel=0.1)
    shrunk = 60.0 * np.corrcoef(scores)[0, 1] / 62.0
    assert np.corrcoef(found.T)[0, 1] == pytest.approx(shrunk, abs=0.03)
    assert np.array_equal(found, drawn_units(trends(scores), 4000, seed=1))


def test_of_two_units_no_correlation_is_taken_and_a_logarithm_is_drawn_as_one() -> None:
    found = drawn_units(trends(correlated(60)[:, :3], log_scale=True), 2000, seed=1)
    assert (found > 0.0).all()
    few = [replace(t, odd=[(2, 9.0, 1e-9)]) for t in trends(correlated(60)[:, :3])]
    assert abs(np.corrcoef(drawn_units(few, 4000, seed=1).T)[0, 1]) < 0.1


def test_a_drawn_unit_is_a_parameter_set_and_what_cannot_be_set_is_left_out() -> None:
    first, second = trends(correlated(10))
    derived = replace(second, rows=tuple(replace(r, settable=False) for r in second.rows))
    found = dict(sets_of_units([first, derived], 12, seed=0))
    assert sorted(found) == [f"sine_{k:03d}.ssv" for k in range(1, 13)]
    text = found["sine_001.ssv"].decode()
    assert 'name="p0"' in text and 'name="p1"' not in text and "population of 10 units" in text


def test_draws_without_a_population_are_refused_and_none_are_nothing() -> None:
    alone = [replace(t, population=None) for t in trends(correlated(3))]
    with pytest.raises(ConfigError, match="--draws: no parameter here has a population"):
        list(sets_of_units(alone, 3, seed=0))
    assert list(sets_of_units(alone, 0, seed=0)) == []
