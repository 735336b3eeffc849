import numpy as np

from mrfit.ingest.table import Column, RejectedRow, Table
from mrfit.ingest.text.textlog import side_by_side


def _table(name: str, rows: int = 100, dt: float = 1e-3, lost: int | None = None) -> Table:
    lines = np.arange(1, rows + 1)
    refused: tuple[RejectedRow, ...] = ()
    if lost is not None:
        lines, refused = np.delete(lines, lost), (RejectedRow("short row", lost + 1),)
    return Table((Column(name, "V", lines * 1.0, 1),), lines, time=Column("t", "s", lines * dt, 0), refused=refused)


def test_channels_of_one_time_base_stand_side_by_side() -> None:
    joined = side_by_side([_table("CH1"), _table("CH2", lost=40), _table("CH3", lost=60)])
    assert joined is not None
    assert [c.name for c in joined.columns] == ["CH1", "CH2", "CH3"]
    assert joined.rows == 98
    assert sorted(r.line for r in joined.refused) == [41, 61]
    assert all(np.array_equal(c.values, joined.lines) for c in joined.columns)


def test_rows_that_one_channel_has_and_another_lacks_are_counted() -> None:
    joined = side_by_side([_table("CH1"), _table("CH2", rows=90)])
    assert joined is not None
    assert joined.rows == 90
    assert [r.line for r in joined.refused] == list(range(91, 101))


def test_channels_of_different_time_bases_stay_apart() -> None:
    assert side_by_side([_table("CH1"), _table("CH2", dt=2e-3)]) is None
    assert side_by_side([_table("CH1"), _table("CH2", rows=20)]) is None
