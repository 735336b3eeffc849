"""Parts of a clock in columns of their own add up where they make it rise, and stay columns elsewhere."""

import numpy as np
import pytest

from tests.ingest.conftest import ReadLog

K = np.arange(1200)
FORCE = np.round(800.0 * np.cos(0.05 * K), 1)
MILLIS = 2 * K + 58_600


def _log(header: str, *columns: object) -> str:
    cells = [np.asarray(c).astype(str) for c in (*columns, FORCE)]
    return f"{header},Force (N)\n" + "".join(",".join(row) + "\n" for row in zip(*cells, strict=True))


CLOCK = [f"10:{11 + m // 60000}:{m // 1000 % 60:02d}" for m in MILLIS]


@pytest.mark.parametrize(
    ("header", "columns"),
    [
        ("Date,Time,ms", (["2026/11/13"] * len(K), CLOCK, MILLIS % 1000)),
        ("Time,Microseconds", (CLOCK, 1000 * (MILLIS % 1000))),
        ("Sec,Msec", (MILLIS // 1000, MILLIS % 1000)),
        ("sec,nanosec", (1763028672 + MILLIS // 1000, 1000000 * (MILLIS % 1000))),
        ("header.stamp.secs,header.stamp.nsecs", (1763028672 + MILLIS // 1000, 1000000 * (MILLIS % 1000))),
        ("min,s", (MILLIS // 60000, np.round(MILLIS % 60000 / 1000, 3))),
        ("Minutes,Seconds", (MILLIS // 60000, np.round(MILLIS % 60000 / 1000, 3))),
        ("Hour,Min,Sec", ([10] * len(K), 11 + MILLIS // 60000, np.round(MILLIS % 60000 / 1000, 3))),
    ],
)
def test_parts_of_a_clock(header: str, columns: tuple[object, ...], read_log: ReadLog) -> None:
    (record,) = read_log(_log(header, *columns))
    assert record.dt == pytest.approx(2e-3) and list(record.channels) == ["force"]
    np.testing.assert_allclose(record.channels["force"], FORCE)


def test_a_column_beside_a_clock_that_rises_by_itself_is_none_of_its_parts(read_log: ReadLog) -> None:
    (record,) = read_log(_log("Time (s),ms", np.round(2e-3 * K, 3), K % 7))
    assert record.dt == pytest.approx(2e-3) and "ms" in record.channels


def test_minutes_that_do_not_make_the_clock_rise_are_none_of_it(read_log: ReadLog) -> None:
    (record,) = read_log(_log("min,Sec", K % 7, np.round(2e-3 * K, 3)))
    assert record.dt == pytest.approx(2e-3) and "min" in record.channels


def test_a_clock_in_another_unit_than_seconds_has_no_parts(read_log: ReadLog) -> None:
    (record,) = read_log(_log("Time (min),ms", np.round(2e-3 * K, 3), K % 1000))
    assert record.dt == pytest.approx(0.12) and "ms" in record.channels


def test_hours_and_minutes_are_of_the_clock_within_one_minute_too(read_log: ReadLog) -> None:
    (record,) = read_log(_log("Hour,Min,Sec", [10] * len(K), [11] * len(K), np.round(2e-3 * K, 3)))
    assert list(record.channels) == ["force"]


@pytest.mark.parametrize("stated", ["Sample rate: 500 Hz", "Sampling interval: 2 ms"])
def test_a_clock_in_whole_seconds_leaves_the_rate_to_the_header(stated: str, read_log: ReadLog) -> None:
    (record,) = read_log(f"{stated}\n" + _log("Time", CLOCK))
    assert record.dt == pytest.approx(2e-3)
    assert [f.text for f in record.findings if f.kind == "times-unused"] == [
        "the times in 'Time' stand still from row to row: the rows are counted at the header's rate"
    ]


def test_a_clock_that_does_not_last_as_the_header_says_is_asked_for(read_log: ReadLog) -> None:
    with pytest.raises(Exception, match="time stands still"):
        read_log("Sample rate: 100 Hz\n" + _log("Time", CLOCK))
