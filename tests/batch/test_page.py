"""The page of many logs: what comes first stands open, the rest is there to unfold."""

from dataclasses import replace

import pytest

from mrfit.batch.fleet import findings, fleet_of
from mrfit.batch.page import FIRST, PAGE_ROWS, render
from mrfit.cli.batch import show
from mrfit.io.schemas.batch import BatchFile, Fitted, LogRow, OfCondition


def failed(count: int) -> str:
    rows = [LogRow(log=f"logs/{k:04d}.csv", error=f"logs/{k:04d}.csv: cut <b> in line {k}") for k in range(count)]
    return render(rows, fleet_of([]))


def test_the_first_rows_stand_open_and_the_others_unfold() -> None:
    page = failed(60)
    open_part, _, folded = page.partition("<details>")
    assert open_part.count("cut &lt;b&gt;") == FIRST and folded.count("cut &lt;b&gt;") == 60 - FIRST
    assert f"{60 - FIRST} more rows" in page and "60 failed; outliers and drifts not looked for" in page
    # the log's name stands in its row once
    assert page.count("logs/0007.csv") == 1


def test_few_rows_need_no_unfolding_and_too_many_stay_in_the_table_of_all() -> None:
    assert "<details>" not in failed(FIRST)
    assert f"Logs that failed ({PAGE_ROWS} of {PAGE_ROWS + 1})" in failed(PAGE_ROWS + 1)


def test_logs_of_the_same_bytes_are_named_and_one_value_has_no_spread() -> None:
    rows = [fitted(k, "a", None) for k in range(3)]
    named = [replace(row, key=key) for row, key in zip(rows, ("x", "y", "x"), strict=True)]
    assert "0.csv, 2.csv" in render(named, fleet_of(named))
    other = [replace(row, key=key) for row, key in zip(rows, "xyz", strict=True)]
    assert "same content" not in render(other, fleet_of(other))
    alone = [*other, fitted(4, "b", None)]
    assert ">–</td>" in render(alone, fleet_of(alone)) and ">–</td>" not in render(other, fleet_of(other))


def fitted(k: int, condition: str, current: float | None) -> LogRow:
    value = Fitted(parameter="fy", value=100.0 + 50.0 * k, unit="N", low=90.0 + 50.0 * k, high=110.0 + 50.0 * k)
    return LogRow(
        log=f"{k}.csv", tests=[OfCondition(condition=condition, current=current, nrmse=0.02, parameters=[value])]
    )


@pytest.mark.parametrize(
    ("currents", "across"), [((0.0, 0.5, 1.0), "Current (A)"), ((None, None, None), "Logs by name")]
)
def test_logs_that_share_no_condition_are_drawn_over_the_current(currents, across) -> None:
    rows = [fitted(k, f"sine-{k}A", current) for k, current in enumerate(currents)]
    page = render(rows, fleet_of(rows))
    assert f">{across}<" in page and ">fy (N)<" in page and "over the median" not in page
    # the values themselves are on the axis, not multiples of their own median
    assert all(f">{n}<" in page for n in (100, 200))


def test_logs_of_one_condition_are_compared() -> None:
    rows = [fitted(k, "sine", 0.5) for k in range(3)]
    assert not fleet_of(rows).is_apart and "Histogram and course" in render(rows, fleet_of(rows))


def test_the_counts_of_a_batch_add_up(capsys: pytest.CaptureFixture[str]) -> None:
    bad = [LogRow(log=f"{k}.csv", error="bad") for k in range(5)]
    show(BatchFile(logs=15, done=12, unchanged=0, failed=bad, most=20))
    said = capsys.readouterr().out
    last = said.splitlines()[-1]
    assert last.startswith(
        "15 logs: 10 fitted, 5 failed (12 processed now, 0 unchanged, 3 refused unread); 0 outliers, 0 drifts"
    )


@pytest.mark.parametrize(
    ("most", "said"),
    [
        (7, "outliers and drifts not looked for, no condition has 8 logs"),
        (19, "2 outliers, drifts not looked for, no condition has 20 logs"),
        (20, "2 outliers, 1 drift"),
    ],
)
def test_what_was_not_looked_for_is_not_counted_as_none(most: int, said: str) -> None:
    assert findings(2, 1, most) == said


def test_values_of_logs_apart_stand_with_log_and_interval_below_model_and_folder() -> None:
    rows = [fitted(k, f"sine-{k}A", 0.5 * k) for k in range(2)]
    page = render(rows, fleet_of(rows), [("Model", "tanh, fitted by auto")])
    assert "tanh, fitted by auto" in page and ">90 to 110<" in page and ">1.csv<" in page and "`mrfit" not in page
    alike = [fitted(k, "sine", 0.5) for k in range(2)]
    assert ">90 to 110<" not in render(alike, fleet_of(alike))
