import numpy as np
import pytest

from mrfit.core.recording import Recording
from mrfit.ingest.build import LogOrigin, build
from mrfit.ingest.meaning.channel_map import ChannelRule, Rules, TimeRule
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Column, RejectedRow, Table
from tests.ingest.conftest import ReadLog

N = 200


def _table(values: np.ndarray, time: np.ndarray | None = None, **more: object) -> Table:
    clock = Column("time", "s", np.arange(N) * 1e-3 if time is None else time, 0)
    columns = (Column("force", "kN", values, 1),)
    return Table(columns, np.arange(2, len(values) + 2), time=clock, **more)  # type: ignore[arg-type]


def _build(table: Table, rules: Rules | None = None) -> list[Recording]:
    return build(table, LogOrigin("log.csv", "abc", "delimited", rules or Rules()))


WAVE = np.sin(0.1 * np.arange(N))


def test_recording_is_in_si_and_says_where_it_came_from() -> None:
    (record,) = _build(_table(WAVE))
    np.testing.assert_allclose(record.channels["force"], 1e3 * WAVE)
    assert (record.source, record.sha256, record.reader) == ("log.csv", "abc", "delimited")
    assert record.columns == {"force": 1}
    assert (record.rows_kept, record.rows_refused) == (N, 0)


@pytest.mark.parametrize("mark", [np.nan, np.inf, -np.inf, 1e30, -9.9e37])
def test_rows_without_a_number_are_refused_counted_and_bridged(mark: float) -> None:
    values = WAVE.copy()
    values[50:52] = mark
    (record,) = _build(_table(values))
    assert (record.rows_kept, record.rows_refused) == (N - 2, 2)
    assert record.samples == N
    np.testing.assert_allclose(record.channels["force"][50:52], 1e3 * WAVE[50:52], atol=12.0)
    kinds = {f.kind: f.text for f in record.findings}
    assert "first in line 52" in kinds["refused-rows"]
    assert "2 samples are missing" in kinds["dropped-samples"]


def test_a_long_hole_splits_and_its_rows_are_counted_once() -> None:
    values = WAVE.copy()
    values[50:80] = np.nan
    first, second = _build(_table(values))
    assert (first.rows_kept, second.rows_kept) == (50, 120)
    assert first.rows_refused + second.rows_refused == 30
    assert second.start == pytest.approx(0.08)


def test_channel_without_any_number_is_named() -> None:
    with pytest.raises(Refusal, match="channel 'force' holds no number at all"):
        _build(_table(np.full(N, np.nan)))


def test_mostly_damaged_file_is_refused() -> None:
    values = WAVE.copy()
    values[: N // 2 + 1] = np.nan
    with pytest.raises(Refusal, match="only 99 of 200 rows can be read: 101 × empty value"):
        _build(_table(values))


def test_holes_of_an_unnamed_column_cost_no_rows() -> None:
    table = _table(WAVE)
    odd = Column("junk", None, np.where(np.arange(N) < 40, np.nan, 1.0), 2)
    (record,) = _build(Table((*table.columns, odd), table.lines, time=table.time))
    assert record.rows_kept == N
    assert "junk" not in record.channels
    assert any(f.kind == "not-read" and f.channel == "junk" for f in record.findings)


def test_rows_refused_by_the_reader_leave_holes_where_there_is_no_time_column() -> None:
    lines = np.delete(np.arange(2, N + 2), 100)
    table = Table(
        (Column("force", "N", np.delete(WAVE, 100), 0),), lines, dt=1e-3, refused=(RejectedRow("short row", 102),)
    )
    (record,) = _build(table)
    assert record.samples == N
    assert (record.rows_kept, record.rows_refused) == (N - 1, 1)
    np.testing.assert_array_equal(record.channels["force"][101:], WAVE[101:])


def test_neither_time_nor_rate_is_refused_with_the_remedy() -> None:
    table = Table((Column("force", "N", WAVE, 0),), np.arange(N))
    with pytest.raises(Refusal, match="no time column and no sample rate") as error:
        _build(table)
    assert "rate = HZ" in error.value.remedy
    (record,) = _build(table, Rules(dt=0.002))
    assert record.dt == 0.002


def test_rows_refused_at_even_spacing_do_not_slow_the_clock() -> None:
    values = WAVE.copy()
    values[10::20] = np.nan
    (record,) = _build(_table(values))
    assert record.dt == 1e-3 and record.samples == N
    assert {"rounded-time", "resampled"}.isdisjoint(f.kind for f in record.findings)


def test_repeated_rows_are_left_out() -> None:
    time = np.arange(N) * 1e-3
    time = np.round(time - np.where(np.arange(N) >= 60, 1e-3, 0.0), 6)  # row 60 stands twice
    values = WAVE.copy()
    values[60] = values[59]
    (record,) = _build(_table(values, time))
    assert (record.rows_kept, record.rows_refused) == (N - 1, 1)
    assert record.samples == N - 1


def test_time_in_a_unit_that_is_none_of_time_is_refused() -> None:
    table = _table(WAVE)
    with pytest.raises(Refusal, match="time column 'time' is in 'mm'"):
        _build(Table(table.columns, table.lines, time=Column("time", "mm", np.arange(N) * 1.0, 0)))


def test_time_without_a_unit_is_taken_as_seconds_and_said_once() -> None:
    table = _table(WAVE)
    bare = Table(table.columns, table.lines, time=Column("time", None, np.arange(N) * 1.0, 0))
    (record,) = _build(bare)
    assert record.dt == 1.0
    assert [f.text for f in record.findings if f.kind == "unit-assumed"] == [
        "the file gives 'time' no unit: taken as s; a channel map can say another"
    ]
    (record,) = _build(bare, Rules(time=TimeRule(column="time", unit="ms")))
    assert record.dt == pytest.approx(1e-3)
    assert not [f for f in record.findings if f.kind == "unit-assumed"]


def test_backward_times_are_refused_with_the_line() -> None:
    time = np.tile([0.0, 2.0, 1.0, 3.0], N // 4)
    with pytest.raises(Refusal, match=r"time runs backwards .* \(line 4\)"):
        _build(_table(WAVE, time))


def test_a_row_between_two_gaps_is_refused() -> None:
    time = np.arange(N) * 1e-3
    time[100:] += 1.0
    time[101:] += 1.0
    records = _build(_table(WAVE, time))
    assert [r.rows_kept for r in records] == [100, 99]
    assert sum(r.rows_refused for r in records) == 1


def test_findings_lie_in_the_piece_they_concern() -> None:
    time = np.arange(N) * 1e-3
    time[100:] += 1.0
    time = np.delete(time, 150)
    first, second = _build(_table(np.delete(WAVE, 150), time))
    assert [f.kind for f in first.findings if f.kind in ("gap", "dropped-samples")] == ["gap"]
    (dropped,) = [f for f in second.findings if f.kind == "dropped-samples"]
    assert dropped.at == pytest.approx(0.049)


def test_map_offset_and_sign_reach_the_recording() -> None:
    rules = Rules(channels={"force": ChannelRule(column="force", unit="N", scale=2.0, offset=1.0, sign=-1)})
    (record,) = _build(_table(WAVE), rules)
    np.testing.assert_allclose(record.channels["force"], 1.0 - 2.0 * WAVE)


@pytest.mark.parametrize(("unit", "dt"), [("Ms", None), ("d", None), ("ms", 2e-5)])
def test_an_interval_of_hours_asks_for_the_unit_of_time(unit: str, dt: float | None, read_log: ReadLog) -> None:
    text = f"Time ({unit}),Force (N)\n" + "".join(f"{0.02 * k:.2f},{k % 7}\n" for k in range(50))
    if dt is None:
        with pytest.raises(Refusal, match=rf"in '{unit}' make .* from sample to sample.*channel map"):
            read_log(text)
    (record,) = read_log(text, channel_map="time = {column = 0, unit = 'ms'}\n")
    assert record.dt == pytest.approx(2e-5)


@pytest.mark.parametrize(
    ("top", "again"),
    [
        ("Disp (mm),Force (N)\n", "Disp (mm),Force (N)\n"),
        ("Disp,Force\nmm,N\n", "Disp,Force\nmm,N\n"),
        ("Disp (mm),Force (N)\n", "Sample rate: 500 Hz\nDisp (mm),Force (N)\n"),
        ("Disp (mm),Force (N)\n", "\nDisp (mm),Force (N)\n"),
    ],
)
def test_a_header_again_begins_a_run_where_nothing_tells_the_time(top: str, again: str, read_log: ReadLog) -> None:
    rows = [f"{np.sin(k / 9):.4f},{90 * np.cos(k / 9):.3f}\n" for k in range(600)]
    parts = ["".join(rows[a:b]) for a, b in ((0, 300), (300, 500), (500, 600))]
    records = read_log("Sample rate: 500 Hz\n" + top + again.join(parts))
    assert [r.samples for r in records] == [300, 200, 100]
    assert [f.kind for r in records for f in r.findings].count("repeated-header") == 1
    np.testing.assert_allclose(records[2].channels["force"], [90 * np.cos(k / 9) for k in range(500, 600)], atol=1e-3)


def test_a_header_again_is_left_out_where_a_count_or_a_time_goes_on(read_log: ReadLog) -> None:
    for name, step in (("Sample", 1), ("Time (ms)", 2)):
        rows = [f"{step * k},{90 * np.cos(k / 9):.3f}\n" for k in range(600)]
        top = f"{name},Force (N)\n"
        (record,) = read_log("Sample rate: 500 Hz\n" + top + "".join(rows[:300]) + top + "".join(rows[300:]))
        assert record.samples == 600


@pytest.mark.parametrize("stamp", [lambda k: f"19:07:{8 + k // 200:02d}", lambda k: str(1764356828 + k // 200)])
def test_the_rate_that_a_message_asks_for_is_enough_where_times_stand_still(stamp: object, read_log: ReadLog) -> None:
    assert callable(stamp)
    rows = [f"{stamp(k)},{np.sin(k / 9):.4f},{90 * np.cos(k / 9):.3f}\n" for k in range(2000)]
    text = "Time,Disp (mm),Force (N)\n" + "".join(rows)
    with pytest.raises(Refusal, match=r"give the rate \(rate = "):
        read_log(text)
    (record,) = read_log(text, channel_map="rate = 200\n")
    assert (record.samples, record.dt) == (2000, 0.005)
    assert "times-unused" in {f.kind for f in record.findings}


def test_a_log_with_every_row_twice_is_that_with_every_row_once(read_log: ReadLog) -> None:
    rows = [f"{0.002 * k:.3f},{1e3 * np.sin(0.05 * k):.2f}\n" for k in range(400)]
    (once,), (twice,) = (
        read_log("time (s),force (N)\n" + "".join(rows)),
        read_log("time (s),force (N)\n" + "".join(row + row for row in rows)),
    )
    assert (twice.dt, twice.samples) == (once.dt, once.samples) == (2e-3, 400)
    np.testing.assert_array_equal(twice.channels["force"], once.channels["force"])
    assert "400 × repeated time" in {f.kind: f.text for f in twice.findings}["refused-rows"]


def test_coarse_times_keep_their_rows(read_log: ReadLog) -> None:
    rows = "".join(f"{0.002 * (k // 2):.3f},{1e3 * np.sin(0.05 * k):.2f}\n" for k in range(400))
    (record,) = read_log("time (s),force (N)\n" + rows)
    assert (record.samples, record.rows_refused) == (400, 0)
    assert record.dt == pytest.approx(1e-3, rel=1e-2)


def test_runs_of_other_rates_in_one_log(read_log: ReadLog) -> None:
    header = "time (s),force (N)\n"
    text = "".join(
        header + "".join(f"{dt * k:.3f},{1e3 * np.sin(20.0 * dt * k):.2f}\n" for k in range(400)) for dt in (2e-3, 5e-3)
    )
    first, second = read_log(text)
    assert (first.dt, second.dt) == (2e-3, 5e-3)
    np.testing.assert_allclose(second.channels["force"], 1e3 * np.sin(0.1 * np.arange(400)), atol=0.01)


@pytest.mark.parametrize(("step", "dt"), [(1, 2e-3), (3, 3.0)])
def test_times_that_go_up_by_one_count_the_samples_where_a_rate_is_stated(
    step: int, dt: float, read_log: ReadLog
) -> None:
    rows = "".join(f"{step * k},{1e3 * np.sin(0.05 * k):.2f}\n" for k in range(300))
    (record,) = read_log(f"Sample rate (Hz): 500\nTime,Force (N)\n{rows}")
    assert record.dt == dt
    assert ("rate-differs" in {f.kind for f in record.findings}) == (step != 1)


def test_rows_that_stand_newest_first_are_turned_round(read_log: ReadLog) -> None:
    rows = [f"{0.002 * k:.3f},{1e3 * np.sin(0.05 * k):.2f}\n" for k in range(300)]
    (plain,), (turned,) = (read_log("time (s),force (N)\n" + "".join(r)) for r in (rows, rows[::-1]))
    np.testing.assert_array_equal(turned.channels["force"], plain.channels["force"])
    assert (turned.dt, [f.kind for f in turned.findings]) == (2e-3, ["newest-first"])
