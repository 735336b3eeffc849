"""The page of many logs: what comes first stands open, the rest is there to unfold."""

from mrfit.batch.fleet import fleet_of
from mrfit.batch.page import FIRST, ROWS, render
from mrfit.io.schemas.batch import LogRow


def failed(count: int) -> str:
    rows = [LogRow(log=f"logs/{k:04d}.csv", error=f"logs/{k:04d}.csv: cut <b> in line {k}") for k in range(count)]
    return render(rows, fleet_of([]))


def test_the_first_rows_stand_open_and_the_others_unfold() -> None:
    page = failed(60)
    open_part, _, folded = page.partition("<details>")
    assert open_part.count("cut &lt;b&gt;") == FIRST and folded.count("cut &lt;b&gt;") == 60 - FIRST
    assert f"{60 - FIRST} more rows" in page and "60 failed; 0 outliers, 0 drifts" in page
    # the log's name stands in its row once
    assert page.count("logs/0007.csv") == 1


def test_few_rows_need_no_unfolding_and_too_many_stay_in_the_table_of_all() -> None:
    assert "<details>" not in failed(FIRST)
    assert f"Logs that failed ({ROWS} of {ROWS + 1})" in failed(ROWS + 1)
