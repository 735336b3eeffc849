"""Tables of the page of a batch, what its figures draw, and which results of a batch are there already."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrfit.batch.fleet import RESIDUAL, Fleet, Group
from mrfit.batch.log import NO_SHEET, Job, StageSettings, made_of
from mrfit.batch.page import PAGE_ROWS, _copies, _shown_groups, _spread, _values, _warnings, _with_interval
from mrfit.batch.stage import _fault, _is_done, _is_elsewhere
from mrfit.errors import DataError
from mrfit.fit.stage import Settings as FitSettings
from mrfit.flux.stage import Settings as FluxSettings
from mrfit.ingest.stage import Settings as IngestSettings
from mrfit.io.schemas.batch import LogRow, OfCondition


def group(*values: float, parameter: str = "fy", condition: str = "sine", half: float = 1.0, unit: str = "N") -> Group:
    logs = tuple(f"{k}.csv" for k in range(len(values)))
    return Group(parameter, condition, unit, logs, np.array(values), np.full(len(values), half))


def fleet(*groups: Group) -> Fleet:
    return Fleet(groups, (), (), False)


def warned(*kinds: list[str], log: str = "a") -> LogRow:
    return LogRow(log=log, tests=[OfCondition(condition=f"c{k}", warnings=own) for k, own in enumerate(kinds)])


def test_a_warning_counts_once_a_log_and_the_usual_ones_come_first() -> None:
    rows = [warned(["drift", "bound"], ["drift"]), warned(["drift"]), warned(["sign"]), warned([])]
    assert _warnings(rows) == [("drift", 2), ("bound", 1), ("sign", 1)]


def test_logs_of_one_content_are_those_that_were_fitted() -> None:
    rows = [
        LogRow(log=name, key=key, error=error)
        for name, key, error in (
            ("a", "x", ""),
            ("b", "x", ""),
            ("c", "y", ""),
            ("d", "", ""),
            ("e", "", ""),
            ("f", "x", "bad"),
        )
    ]
    assert _copies(rows) == [("a, b",)]


@pytest.mark.parametrize(
    ("half", "cells"), [(2.0, ("100.0", "98.0 to 102.0")), (0.0, ("100", "–")), (np.nan, ("100.0", "–"))]
)
def test_a_value_has_its_interval_where_that_is_known(half: float, cells: tuple[str, str]) -> None:
    shown, interval = _with_interval(group(100.0, half=half))
    assert interval == cells[1] and float(shown) == float(cells[0])


def test_a_distribution_is_told_by_its_ends_quantiles_and_robust_deviation() -> None:
    # least, 5 %, median, 95 %, most of 0 to 100, and 1.4826 times the median deviation of 25
    assert [float(str(c)) for c in _spread(group(*np.arange(101.0)))] == [101, 0, 5, 50, 95, 100, 37.06]
    assert _spread(group(7.0))[-1] == "–"


def test_groups_are_by_parameter_and_condition_as_people_sort_and_those_of_most_logs_where_there_are_too_many() -> None:
    groups = [group(1.0, parameter=p, condition=c) for p in ("fy", "c") for c in ("sine-10Hz", "sine-2Hz")]
    assert [(g.parameter, g.condition) for g in _shown_groups(fleet(*groups))] == [
        ("fy", "sine-2Hz"), ("fy", "sine-10Hz"), ("c", "sine-2Hz"), ("c", "sine-10Hz")
    ]  # fmt: skip
    many = [group(*np.ones(1 + k % 2), condition=f"c{k}") for k in range(2 * PAGE_ROWS)]
    shown = _shown_groups(fleet(*many))
    assert len(shown) == PAGE_ROWS and {len(g.values) for g in shown} == {2}


@pytest.mark.parametrize(
    ("groups", "values", "label"),
    [
        ([group(2.0, 4.0, 6.0)], [2.0, 4.0, 6.0], "fy (N)"),
        ([group(0.1, unit="", parameter=RESIDUAL)], [0.1], RESIDUAL),
        # of several conditions each over its own median, unless one of these is nought
        (
            [group(2.0, 4.0, 6.0), group(10.0, 30.0, 20.0)],
            [0.5, 0.5, 1.0, 1.5, 1.5, 1.0],
            "fy over the median of its condition",
        ),
        ([group(2.0), group(0.0)], [2.0, 0.0], "fy (N)"),
    ],
)
def test_values_of_several_conditions_are_drawn_over_their_medians(
    groups: list[Group], values: list[float], label: str
) -> None:
    order = {f"{k}.csv": k for k in range(3)}
    at, found, said = _values(groups, order)
    assert list(found) == pytest.approx(values) and said == label and list(at) == sorted(at)


ASKED = StageSettings(IngestSettings(), FluxSettings(), FitSettings("bingham"), report=False, sheet=False)


def job(workspace: Path | None = None, **asked: bool) -> Job:
    return Job("a.csv", "k", (), None, workspace, replace(ASKED, **asked))  # type: ignore[arg-type]


def row(key: str = "k", **given: object) -> LogRow:
    return LogRow(log="a.csv", key=key, **given)  # type: ignore[arg-type]


def test_a_result_is_there_where_its_key_is_and_what_was_kept_is_as_it_was(tmp_path: Path) -> None:
    assert not _is_done(job(), None) and not _is_done(job(), row("other")) and _is_done(job(), row())
    own = job(tmp_path)
    assert _is_done(own, row(made=made_of(own))) and not _is_done(own, row(made="other"))
    # a log that failed has nothing in its workspace
    assert _is_done(own, row(made="other", error="bad"))
    before = made_of(own)
    (tmp_path / "ingest.json").write_text("{}")
    assert made_of(own) != before and not _is_done(own, row(made=before))


def test_a_report_or_a_sheet_that_was_asked_for_has_to_be_there_unless_the_log_allows_none(tmp_path: Path) -> None:
    reported, measured = job(tmp_path, report=True), job(tmp_path, sheet=True)
    made = made_of(reported)
    assert not _is_done(reported, row(made=made)) and not _is_done(measured, row(made=made))
    for name in ("report/report.json", "sheet/sheet.json"):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_text("{}")
    assert _is_done(reported, row(made=made)) and _is_done(measured, row(made=made))
    (tmp_path / "sheet/sheet.json").unlink()
    none = [OfCondition(condition="sine", warnings=[NO_SHEET])]
    assert not _is_done(measured, row(made=made)) and _is_done(measured, row(made=made, tests=none))


@pytest.mark.parametrize(
    ("name", "elsewhere"), [("logs/a.csv", False), ("logs/in/a.csv", False), ("logs-2/a.csv", True), ("a.csv", True)]
)
def test_logs_beside_the_folder_are_of_another_batch(name: str, elsewhere: bool) -> None:
    assert _is_elsewhere(name, Path("logs")) is elsewhere


def test_a_fault_of_mrfit_is_raised_and_one_of_the_machine_told() -> None:
    with pytest.raises(ZeroDivisionError):
        _fault(ZeroDivisionError())
    # a worker that was killed has no error: it was memory, most of the time
    assert isinstance(_fault(None), MemoryError)
    for error in (DataError("bad"), MemoryError()):
        assert _fault(error) is error
