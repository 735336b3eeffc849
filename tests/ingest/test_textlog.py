import numpy as np
import pytest

from mrfit.ingest.table import Column, Refused, Table
from mrfit.ingest.textlog import side_by_side, stated_interval


@pytest.mark.parametrize(
    ("line", "interval"),
    [
        ("#Sample rate: 160000Hz", 6.25e-6),
        ("Sampling Rate:  200", 5e-3),
        ("Sample Interval,1.6e-06,", 1.6e-6),
        ("Sampling Interval:  0.005", 5e-3),
        ("Sample rate = 2 kHz", 5e-4),
        ("Scan rate 100 Sa/s", 1e-2),
        ("sample period: 4 ms", 4e-3),
        ("Sample Count: 7420", None),
        ("Sampling Rate:  0", None),
        ("Trigger: Source: Channel 1", None),
    ],
)
def test_rates_and_intervals_in_headers(line: str, interval: float | None) -> None:
    assert stated_interval([line]) == (None if interval is None else pytest.approx(interval))


def _table(name: str, rows: int = 100, dt: float = 1e-3, lost: int | None = None) -> Table:
    lines = np.arange(1, rows + 1)
    refused: tuple[Refused, ...] = ()
    if lost is not None:
        lines, refused = np.delete(lines, lost), (Refused("short row", lost + 1),)
    return Table((Column(name, "V", lines * 1.0, 1),), lines, time=Column("t", "s", lines * dt, 0), refused=refused)


def test_channels_of_one_time_base_stand_side_by_side() -> None:
    joined = side_by_side([_table("CH1"), _table("CH2", lost=40), _table("CH3", lost=60)])
    assert joined is not None
    assert [c.name for c in joined.columns] == ["CH1", "CH2", "CH3"]
    assert joined.rows == 98
    assert sorted(r.line for r in joined.refused) == [41, 61]
    assert all(np.array_equal(c.values, joined.lines) for c in joined.columns)


def test_channels_of_different_time_bases_stay_apart() -> None:
    assert side_by_side([_table("CH1"), _table("CH2", dt=2e-3)]) is None
    assert side_by_side([_table("CH1"), _table("CH2", rows=20)]) is None
