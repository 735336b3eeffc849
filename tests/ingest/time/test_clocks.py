"""Tables with several time columns: each channel by its own clock, on one of them, or refused."""

import io

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from mrfit.core.recording import Recording
from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog

K = np.arange(600)


def disp(time: np.ndarray) -> np.ndarray:
    return 10.0 * np.sin(2 * np.pi * time)


def force(time: np.ndarray) -> np.ndarray:
    return 900.0 * np.cos(2 * np.pi * time)


def log(names: str, one: np.ndarray, two: np.ndarray, scale: float = 1.0) -> str:
    """Columns time, displacement in mm, time, force in N; nan prints nothing."""
    rows = zip(one, disp(one), two, force(two), strict=True)
    lines = [f"{a:.6f},{b:.6f},{scale * c:.6f},{d:.6f}\n".replace("nan", "") for a, b, c, d in rows]
    return f"{names}\n{''.join(lines)}"


@pytest.mark.parametrize(
    "names",
    [
        "X_Value,disp (mm),X_Value,force (N)",
        "Time (s),disp (mm),Time (s),force (N)",
        "Time 1 (s),disp (mm),Time 2 (s),force (N)",
        "Time,disp (mm),Time.1,force (N)",
        "t_disp (s),disp (mm),t_force (s),force (N)",
    ],
)
@pytest.mark.parametrize(
    "two", [0.01 * K, 0.002 * K + 0.001, 0.002 * K * 1.001, np.where(K < 300, 0.002 * K, 0.002 * K + 0.0007)]
)
def test_each_channel_by_the_clock_before_it(names: str, two: np.ndarray, read_log: ReadLog) -> None:
    (record,) = read_log(log(names, 0.002 * K, two))
    time = record.start + record.dt * np.arange(record.samples)
    assert record.dt == pytest.approx(0.002) and set(record.channels) == {"displacement", "force"}
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * disp(time), atol=1e-5)
    np.testing.assert_allclose(record.channels["force"], force(time), atol=1.0)
    assert {f.kind for f in record.findings} >= {"two-clocks"}
    assert any("interpolated linearly on the times of column 0" in line for line in record.history)


def test_the_quicker_clock_is_the_common_one_whatever_its_place_and_length(read_log: ReadLog) -> None:
    two = np.where(K < 500, 0.002 * K, np.nan)
    (record,) = read_log(log("Time (s),disp (mm),Time (ms),force (N)", 0.01 * K, two, 1000.0))
    time = record.start + record.dt * np.arange(record.samples)
    assert (record.dt, record.samples) == (0.002, 500)
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * disp(time), atol=1e-5)
    np.testing.assert_allclose(record.channels["force"], force(time), atol=1e-3)


def test_clocks_of_lvm_channels(read_log: ReadLog) -> None:
    top = "LabVIEW Measurement\t\nSeparator\tTab\nX_Columns\tMulti\n***End_of_Header***\t\n\nChannels\t2\n"
    top += "Y_Unit_Label\tmm\t\tN\nDelta_X\t0.002\t\t0.01\n***End_of_Header***\n"
    text = log("X_Value,Disp,X_Value,Force,Comment", 0.002 * K, 0.01 * K).replace(",", "\t")
    (record,) = read_log(top + text, "multi.lvm")
    time = record.dt * np.arange(record.samples)
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * disp(time), atol=1e-5)
    np.testing.assert_allclose(record.channels["force"], force(time), atol=0.5)


@pytest.mark.parametrize(
    ("names", "two", "scale"),
    [
        ("Time (s),disp (mm),Time (s),force (N)", 0.002 * K, 1.0),
        ("Time (s),disp (mm),Time (ms),force (N)", 0.002 * K, 1000.0),
        ("Time (s),disp (mm),Timestamp,force (N)", 0.002 * K, 1000.0),
        ("Time (s),disp (mm),Timestamp (s),force (N)", 0.002 * K + 1.7e9, 1.0),
    ],
)
def test_clocks_that_agree_are_one(names: str, two: np.ndarray, scale: float, read_log: ReadLog) -> None:
    text = log(names, 0.002 * K, two, scale)
    (record,) = read_log(text)
    assert (record.dt, record.samples) == (0.002, 600)
    assert "two-clocks" not in {f.kind for f in record.findings}


def columns(names: str, *values: np.ndarray) -> str:
    return names + "\n" + "".join(",".join(f"{v:.6f}" for v in row) + "\n" for row in zip(*values, strict=True))


@pytest.mark.parametrize("names", ["Time (s),Timestamp (s),disp (mm)", "Time (s),disp (mm),Elapsed (s)"])
def test_clocks_without_channels_of_their_own_that_differ_are_refused(names: str, read_log: ReadLog) -> None:
    values = {"Time (s)": 0.002 * K, "disp (mm)": disp(0.002 * K)}
    text = columns(names, *(values.get(n, 0.01 * K) for n in names.split(",")))
    with pytest.raises(Refusal, match="times that differ, and which holds cannot be told"):
        read_log(text)
    (record,) = read_log(text, channel_map='time = "Time"\n')
    assert record.dt == 0.002


@pytest.mark.parametrize(
    ("time", "unit"),
    [('"Time"', "s"), ('"time (s)"', "s"), ('{column = "Time", unit = "ms"}', "ms"), ('{column = "Time"}', "")],
)
def test_a_map_that_names_several_clocks_means_each_for_its_own_channels(
    time: str, unit: str, read_log: ReadLog
) -> None:
    scale = 1000.0 if unit == "ms" else 1.0
    name = f"Time ({unit})" if unit == "s" else "Time"
    text = log(f"{name},disp (mm),{name},force (N)", scale * 0.002 * K, 0.004 * K, scale)
    (record,) = read_log(text, channel_map=f"time = {time}\n")
    own = record.start + record.dt * np.arange(record.samples)
    assert record.dt == pytest.approx(0.002) and set(record.channels) == {"displacement", "force"}
    np.testing.assert_allclose(record.channels["force"], force(own), atol=1.0)


def test_counts_of_milliseconds_since_1970_are_clocks_as_others(read_log: ReadLog) -> None:
    since = 1.7e12
    text = log("Time,disp (mm),Time,force (N)", since + 2.0 * K, (since + 4.0 * K), 1.0)
    (record,) = read_log(text, channel_map='time = "Time"\n')
    assert record.dt == pytest.approx(0.002)


def test_a_third_clock_that_a_map_does_not_name_has_its_own_channels(read_log: ReadLog) -> None:
    names = "Time (s),disp (mm),Time (s),force (N),Elapsed (s),current (A)"
    columns_of = (0.002 * K, disp(0.002 * K), 0.004 * K, force(0.004 * K), 0.005 * K, np.sin(0.005 * K))
    (record,) = read_log(columns(names, *columns_of), channel_map='time = "Time"\n')
    own = record.start + record.dt * np.arange(record.samples)
    assert set(record.channels) == {"displacement", "force", "current"}
    np.testing.assert_allclose(record.channels["current"], np.sin(own), atol=1e-4)


@pytest.mark.parametrize(
    ("name", "channel_map"), [("No", ""), ("Sample", 'time = "Time"\n'), ("Batch", 'ignore = ["Batch"]\n')]
)
def test_numbers_of_rows_and_columns_left_out_before_the_first_clock(
    name: str, channel_map: str, read_log: ReadLog
) -> None:
    text = columns(
        f"{name},Time (s),disp (mm),Time (s),force (N)", K, 0.002 * K, disp(0.002 * K), 0.004 * K, force(0.004 * K)
    )
    (record,) = read_log(text, channel_map=channel_map)
    own = record.start + record.dt * np.arange(record.samples)
    np.testing.assert_allclose(record.channels["force"], force(own), atol=1.0)


def test_a_map_that_names_several_clocks_without_channels_asks_for_a_place(read_log: ReadLog) -> None:
    text = columns("Time,disp (mm),Time", 0.002 * K, disp(0.002 * K), 0.01 * K)
    with pytest.raises(Refusal, match="write time = 0 or another place from 0 in"):
        read_log(text, channel_map='time = "Time"\n')


@pytest.mark.parametrize(
    ("names", "unit", "said"),
    [
        ("Time (ms),disp (mm),Time (s),force (N)", "ms", "have different units, and a map gives one; write time = 0"),
        ("Time,disp (mm),Time,force (N)", "mm", "time column 'Time' is in 'mm'"),
        ("Time,disp (mm),Time,force (N)", "foo", "time column 'Time' is in 'foo'"),
    ],
)
def test_a_unit_of_a_map_that_does_not_fit_its_clocks_is_refused(
    names: str, unit: str, said: str, read_log: ReadLog
) -> None:
    with pytest.raises(Refusal, match=said):
        read_log(log(names, 0.002 * K, 0.004 * K), channel_map=f'time = {{column = "Time", unit = "{unit}"}}\n')


def two_clocks(record: Recording) -> list[str]:
    return [f.text for f in record.findings if f.kind == "two-clocks"]


@pytest.mark.parametrize(("two", "said"), [(0.004 * K, True), (0.002 * K, False)])
def test_the_clock_of_a_map_is_that_of_all_channels_and_one_that_differs_is_said(
    two: np.ndarray, said: bool, read_log: ReadLog
) -> None:
    text = log("Time (s),disp (mm),Time (s),force (N)", 0.002 * K, two)
    (record,) = read_log(text, channel_map="time = 0\n")
    assert record.dt == pytest.approx(0.002)
    np.testing.assert_allclose(record.channels["force"], force(two), atol=1e-3)
    assert (
        two_clocks(record)
        == [
            "'Time' (column 0) and 'Time' (column 2) are times that differ: "
            "the channel map takes column 0 for all channels"
        ]
        * said
    )


@pytest.mark.parametrize(
    ("names", "other", "channel_map"),
    [
        ("Time (s),Step time (s),disp (mm)", 0.002 * (K % 200), 'time = "Time"\n'),
        ("Time (s),Elapsed (s),disp (mm)", 0.002 * K + 1.0, 'time = "Time"\n'),
        ("Time,Elapsed (min),disp (mm)", 0.002 * K, 'time = {column = "Time", unit = "min"}\n'),
        ("Time (s),Delay (s),disp (mm)", 0.01 * K, 'time = "Time"\n'),
    ],
)
def test_times_that_are_of_no_channels_are_no_other_clock(
    names: str, other: np.ndarray, channel_map: str, read_log: ReadLog
) -> None:
    (record,) = read_log(columns(names, 0.002 * K, other, disp(0.002 * K)), channel_map=channel_map)
    assert not two_clocks(record)


@pytest.mark.parametrize("names", ["Time (s),disp (mm),Time 2 (s),force (N)", "Time (s),disp (mm),Age (s),force (N)"])
def test_a_clock_that_a_map_leaves_out_or_makes_a_channel_is_none(names: str, read_log: ReadLog) -> None:
    named = names.split(",")[2]
    given = f'ignore = ["{named}"]\n' if "2" in named else f'[channels]\nage = {{column = "{named}"}}\n'
    (record,) = read_log(log(names, 0.002 * K, 0.004 * K), channel_map=f'time = "Time"\n{given}')
    assert not two_clocks(record)


def test_dates_of_a_second_clock_are_not_read_and_this_is_said(read_log: ReadLog) -> None:
    rows = "".join(f"12:00:{0.002 * k:09.6f},{k % 7},12:00:{0.004 * k:09.6f},{k % 5}\n" for k in range(600))
    (record,) = read_log(f"Time,disp (mm),Time,force (N)\n{rows}")
    assert two_clocks(record) == ["'Time' (column 2) holds times, too: those of column 0 are taken for all channels"]


def test_a_clock_with_gaps_in_every_second_row_is_compared_without_a_word_of_numpys(read_log: ReadLog) -> None:
    text = log("Time (s),disp (mm),Time (s),force (N)", np.where(K % 2, np.nan, 0.002 * K), 0.002 * K)
    assert read_log(text, channel_map="time = 2\n")


def test_clocks_of_one_name_in_parquet_are_those_of_the_columns_behind_them(read_log: ReadLog) -> None:
    values = [0.002 * K, disp(0.002 * K), 0.004 * K, force(0.004 * K)]
    table = pa.Table.from_arrays(
        [pa.array(v) for v in values], names=["Time (s)", "disp (mm)", "Time (s)", "force (N)"]
    )
    buffer = io.BytesIO()
    pq.write_table(table, buffer)
    (record,) = read_log(buffer.getvalue(), "run.parquet")
    own = record.start + record.dt * np.arange(record.samples)
    assert record.columns == {"displacement": 1, "force": 3}
    np.testing.assert_allclose(record.channels["force"], force(own), atol=1.0)


def test_two_clocks_in_a_group_of_tdms(read_log: ReadLog) -> None:
    nptdms = pytest.importorskip("nptdms")
    values = {"Time": 0.002 * K, "disp (mm)": disp(0.002 * K), "time": 0.004 * K, "force (N)": force(0.004 * K)}
    buffer = io.BytesIO()
    with nptdms.TdmsWriter(buffer) as writer:
        writer.write_segment([nptdms.ChannelObject("log", name, v) for name, v in values.items()])
    (record,) = read_log(buffer.getvalue(), "run.tdms")
    own = record.start + record.dt * np.arange(record.samples)
    np.testing.assert_allclose(record.channels["force"], force(own), atol=1.0)


def test_a_clock_that_starts_again_with_every_step_is_the_same_clock(read_log: ReadLog) -> None:
    text = columns("Time (s),Step time (s),disp (mm)", 0.002 * K, 0.002 * (K % 200), disp(0.002 * K))
    (record,) = read_log(text)
    assert (record.dt, record.samples) == (0.002, 600)


def test_clocks_without_a_common_stretch_are_refused(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="no stretch in common"):
        read_log(log("Time (s),disp (mm),Time (s),force (N)", 0.002 * K, 0.01 * K + 3.0))


def contained(form: str, named: dict[str, np.ndarray]) -> bytes:
    buffer = io.BytesIO()
    if form == "run.parquet":
        pq.write_table(pa.table(named), buffer)
    else:
        with h5py.File(buffer, "w") as file:
            for name, values in named.items():
                file[name] = values
    return buffer.getvalue()


@pytest.mark.parametrize("form", ["run.h5", "run.parquet"])
@pytest.mark.parametrize("two", [0.01 * K, 0.002 * K * 1.01 + 0.0005])
@pytest.mark.parametrize(
    "names",
    [
        ("time_displacement", "displacement (mm)", "time_force", "force (N)"),
        ("Time disp", "Disp (mm)", "Time force", "Force (N)"),
        ("Time disp (s)", "Disp (mm)", "Time force (s)", "Force (N)"),
        ("t_disp", "Disp (mm)", "t_load", "Force (N)"),
        ("time", "displacement (mm)", "time_force", "force (N)"),
    ],
)
def test_clocks_named_after_their_channels(
    names: tuple[str, ...], two: np.ndarray, form: str, read_log: ReadLog
) -> None:
    one = 0.002 * K
    (record,) = read_log(contained(form, dict(zip(names, (one, disp(one), two, force(two)), strict=True))), form)
    time = record.start + record.dt * np.arange(record.samples)
    assert record.dt == pytest.approx(0.002) and set(record.channels) == {"displacement", "force"}
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * disp(time), atol=1e-5)
    np.testing.assert_allclose(record.channels["force"], force(time), atol=1.0)


@pytest.mark.parametrize("form", ["run.h5", "run.parquet"])
def test_clocks_of_unknown_channels_are_refused_by_name(form: str, read_log: ReadLog) -> None:
    named = {"ch_a": disp(0.002 * K), "ch_b": force(0.01 * K), "time_one": 0.002 * K, "time_two": 0.01 * K}
    with pytest.raises(Refusal, match=r"'time_one'.*'time_two'.*write time = COLUMN"):
        read_log(contained(form, named), form)


@pytest.mark.parametrize("form", ["run.h5", "run.parquet"])
def test_a_slow_channel_that_begins_with_t_is_no_clock(form: str, read_log: ReadLog) -> None:
    named = {"time": 0.002 * K, "force (N)": force(0.002 * K), "t_coil": 24.0 + np.sin(K)}
    (record,) = read_log(contained(form, named), form)
    assert record.dt == 0.002 and "two-clocks" not in {f.kind for f in record.findings}


RECEIVED = 0.08 * (np.arange(400) // 40) + 1e-5 * (np.arange(400) % 40)


@pytest.mark.parametrize("header", ["PC time (s),Device time (ms)", "timestamp,mcu_ms", "Host time (s),Time (ms)"])
def test_times_of_the_device_come_before_those_of_the_computer_and_this_is_said(header: str, read_log: ReadLog) -> None:
    received = [f"2026-11-28T10:00:{3 + t:09.6f}" if "timestamp" in header else f"{t:.5f}" for t in RECEIVED]
    rows = "".join(f"{t},{2 * k},{k % 7}\n" for k, t in enumerate(received))
    (record,) = read_log(f"{header},Force (N)\n{rows}")
    assert record.dt == pytest.approx(2e-3) and list(record.channels) == ["force"]
    assert any("computer's clock" in f.text for f in record.findings if f.kind == "two-clocks")


def test_a_computers_times_alone_are_taken(read_log: ReadLog) -> None:
    rows = "".join(f"{2e-3 * k:.3f},{k % 7}\n" for k in range(400))
    (record,) = read_log(f"PC time (s),Force (N)\n{rows}")
    assert record.dt == pytest.approx(2e-3) and not record.findings
