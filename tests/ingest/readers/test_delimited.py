from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

import mrfit
from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog

ROWS = "".join(f"{k * 0.01:.2f},{np.sin(k / 5):.4f},{np.cos(k / 5):.4f}\n" for k in range(100))


@pytest.mark.parametrize(
    ("header", "names"),
    [
        ("time (s),current (A),voltage (V)\n", {"current", "voltage"}),
        ("t,i,u\ns,mA,mV\n", {"current", "voltage"}),
        ("# rig 3\n# Sample rate: 100 Hz\ntime_s,force_N,x_mm\n", {"force", "displacement"}),
        ("Zeit / s,Kraft / kN,Weg / mm\n", {"force", "displacement"}),
        ("data.time_s,data.force_N,data.disp_mm\n", {"force", "displacement"}),
        ("Root/Time[s]/Out1,Root/Force[N]/Out1,Root/Disp[mm]/Out1\n", {"force", "displacement"}),
    ],
)
def test_headers(header: str, names: set[str], read_log: ReadLog) -> None:
    (record,) = read_log(header + ROWS)
    assert set(record.channels) == names
    assert record.dt == 0.01
    assert record.rows_kept == 100


def test_a_time_named_by_a_path_has_its_unit(read_log: ReadLog) -> None:
    rows = "".join(f"{10 * k},{k},{-k}\n" for k in range(60))
    (record,) = read_log("log.time_ms,log.force_N,log.disp_mm\n" + rows)
    assert record.dt == 0.01


@pytest.mark.parametrize(
    ("name", "first", "step", "dt"),
    [("ts", 0.0, 5e-3, 5e-3), ("ts", 1710412522000.0, 5.0, 5e-3), ("__time", 1710412522.125, 5e-3, 5e-3)],
)
def test_other_names_of_times(name: str, first: float, step: float, dt: float, read_log: ReadLog) -> None:
    rows = "".join(f"{first + step * k:.3f},{k},{-k}\n" for k in range(60))
    (record,) = read_log(f"{name},/rig/force_N,/rig/disp_mm\n{rows}")
    assert record.dt == pytest.approx(dt) and set(record.channels) == {"force", "displacement"}


def test_a_ts_that_does_not_rise_or_stands_beside_times_is_another_quantity(read_log: ReadLog) -> None:
    rows = "".join(f"{5e-3 * k:.3f},{21.5 + k % 3},{k}\n" for k in range(60))
    with pytest.raises(Refusal, match="no time column"):
        read_log("disp_mm,ts,force_N\n" + rows)
    (record,) = read_log("time_s,ts,force_N\n" + rows)
    assert set(record.channels) == {"ts", "force"}


@pytest.mark.parametrize("first", ["", "-", "---", "OVER"])
def test_a_ts_without_a_first_number_refuses_no_log(first: str, read_log: ReadLog) -> None:
    rows = "".join(f"{5e-3 * k:.3f};{k};{k % 7};{25.0 + k if k else first}\n" for k in range(60))
    (record,) = read_log("Time [s];x [mm];F [kN];ts\n" + rows)
    assert {"displacement", "force"} <= set(record.channels)


def test_a_map_names_the_column_of_a_run_as_the_header_does(tmp_path: Path) -> None:
    rows = "".join(f"{5e-3 * k:.3f};{k % 9};{k % 7}\n" for k in range(60))
    (tmp_path / "log.csv").write_text("Run 1: Time (s);Run 1: Position (mm);Run 1: Force (kN)\n" + rows)
    (tmp_path / "mrfit.toml").write_text('time = "Run 1: Time"\n[channels]\nforce = {column = "Run 1: Force"}\n')
    (record,) = mrfit.read(tmp_path / "log.csv")
    assert record.dt == pytest.approx(5e-3) and "force" in record.channels


@pytest.mark.parametrize("names", ["Run 1: Force;Run 2: Force;Run 3: Force", "Test 1:;Test 2:;Test 3:"])
def test_runs_that_alone_tell_columns_apart_stay(names: str, read_log: ReadLog) -> None:
    rows = "".join(f"{k % 9};{k % 7};{k % 5}\n" for k in range(60))
    (record,) = read_log(f"# sample rate: 500 Hz\n{names}\n" + rows)
    assert len(record.channels) == 3 and all("1" in n or "2" in n or "3" in n for n in record.channels)


@pytest.mark.parametrize("header", ["s,mm,N", "ms,kN,mm"])
def test_a_header_of_units_alone_calls_columns_by_them(header: str, read_log: ReadLog) -> None:
    rows = "".join(f"{5e-3 * k:.3f},{k},{k % 7}\n" for k in range(60))
    (record,) = read_log(f"{header}\n{rows}")
    assert record.dt == pytest.approx(5e-6 if "ms" in header else 5e-3)
    assert set(record.channels) == {"force", "displacement"}
    assert "named-by-unit" in {f.kind for f in record.findings}


@pytest.mark.parametrize("header", ["t,s,F", "s,V,A", "h,min,s", "t,mm,s", "d,mm,N", "h,mm,T"])
def test_letters_that_may_be_names_are_no_units(header: str, read_log: ReadLog) -> None:
    rows = "".join(f"{5e-3 * k:.3f},{k},{k % 7}\n" for k in range(60))
    try:
        (record,) = read_log(f"{header}\n{rows}")
    except Refusal:
        return
    assert not {"force", "displacement"} & set(record.channels)
    assert "named-by-unit" not in {f.kind for f in record.findings}


def test_two_units_of_one_column_are_said_to_contradict(read_log: ReadLog) -> None:
    (record,) = read_log("Time (s),Force (kN),Disp (mm)\ns,N,mm\n" + ROWS)
    assert "force" not in record.channels
    assert any("the file gives one column two units: 'Force' in 'kN or N'" in f.text for f in record.findings)


def test_decimal_comma_and_semicolons(read_log: ReadLog) -> None:
    text = "Zeit [s];Strom [A];Spannung [V]\n" + ROWS.replace(",", ";").replace(".", ",")
    (record,) = read_log(text)
    assert record.channels["current"][5] == pytest.approx(np.sin(1.0), abs=1e-4)


def test_time_stamps_become_seconds(read_log: ReadLog) -> None:
    rows = "".join(f"2025-11-14 19:25:35.{k * 10000:06d},{k}\n" for k in range(60))
    (record,) = read_log("Timestamp,Force (N)\n" + rows)
    assert record.dt == pytest.approx(0.01)
    assert record.start == 0.0


def test_rate_in_the_first_row_of_a_column(read_log: ReadLog) -> None:
    rows = "".join(f"{k / 3004.8:.4f},{k},{3004.8 if k == 0 else ''},\n" for k in range(5000))
    (record,) = read_log('"t","Force [N]","fs",\n' + rows)
    assert record.dt == 1 / 3004.8
    assert set(record.channels) == {"force"}
    assert any("3004.8 Hz" in f.text for f in record.findings)


def test_text_column_is_no_channel(read_log: ReadLog) -> None:
    rows = "".join(f"{k * 0.1:.1f},{k},ok\n" for k in range(50))
    (record,) = read_log("time (s),force (N),state\n" + rows)
    assert set(record.channels) == {"force"}
    assert any("'state' holds text" in f.text for f in record.findings)


def test_rate_from_a_comment_where_no_time_column_is(read_log: ReadLog) -> None:
    rows = "".join(f"{k},{k * 2}\n" for k in range(50))
    (record,) = read_log("# Sampling frequency: 2 kHz\nforce (N),stroke (mm)\n" + rows)
    assert record.dt == 5e-4


def test_headerless_log_shows_its_first_row_and_the_map_to_write(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="first row, line 1: '0.00,0.0000,1.0000'") as error:
        read_log(ROWS)
    assert "column 0 rises evenly and may be the time" in error.value.reason
    assert 'time = 0, then [channels] and force = {column = 1, unit = "N"}' in error.value.remedy
    (record,) = read_log(ROWS, channel_map='time = 0\n[channels]\nforce = {column = 1, unit = "N"}\n')
    assert "force" in record.channels


def test_headerless_log_with_a_map(read_log: ReadLog) -> None:
    channel_map = 'time = 0\n[channels]\nforce = {column = 2, unit = "kN"}\n'
    (record,) = read_log(ROWS, channel_map=channel_map)
    assert set(record.channels) == {"column1", "force"}
    assert record.channels["force"][0] == 1000.0
    assert record.columns == {"column1": 1, "force": 2}


def test_map_may_name_the_time_column_and_its_unit(read_log: ReadLog) -> None:
    text = "clock,force (N),x (mm)\n" + ROWS
    (record,) = read_log(text, channel_map='time = {column = "clock", unit = "ms"}\n')
    assert record.dt == pytest.approx(1e-5)
    with pytest.raises(Refusal, match="no column 'tick' to take as time"):
        read_log(text, channel_map='time = "tick"\n')


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "\r\r\n"])
@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_encodings_and_line_ends(end: str, encoding: str, read_log: ReadLog) -> None:
    text = "time (s),Öltemperatur (°C),force (N)\n" + ROWS
    (record,) = read_log(text.replace("\n", end).encode(encoding))
    assert record.units == {"temperature": "degC", "force": "N"}
    assert record.rows_kept == 100


def test_every_kind_of_damage_is_counted_with_its_first_line(read_log: ReadLog) -> None:
    lines = ("time (s),force (N),x (mm)\n" + ROWS).splitlines()
    lines[10] = lines[10].rpartition(",")[0]
    lines[20] = "0.19,-12.0mV,1"
    lines[30] = "0.29,1e38,1"
    lines[40] = "0.39,,1"
    lines[50] = lines[0]
    lines[60] += "\0"
    (record,) = read_log("\n".join(lines) + "\n")
    assert (record.rows_kept, record.rows_refused) == (94, 6)
    assert record.samples == 100
    (said,) = [f.text for f in record.findings if f.kind == "refused-rows"]
    for kind, line in (
        ("short row", 11),
        ("not a number", 21),
        ("overflow", 31),
        ("empty value", 41),
        ("repeated header", 51),
        ("NUL byte", 61),
    ):
        assert f"1 × {kind} (first in line {line})" in said


def clock_rows(count: int, begin: float) -> str:
    """Rows of date, time of day, displacement and force, a millisecond apart."""
    rows = []
    for k in range(count):
        day, second = divmod(begin + k * 1e-3, 86400.0)
        clock = f"{int(second // 3600):02d}:{int(second // 60 % 60):02d}:{second % 60:06.3f}"
        rows.append(f"{5 + int(day):02d}.01.2024,{clock},{k % 7},{k % 5}\n")
    return "".join(rows)


@pytest.mark.parametrize("begin", [36000.0, 86399.95])
def test_date_and_time_of_day_in_columns_of_their_own(begin: float, read_log: ReadLog) -> None:
    """The second begins 50 ms before midnight."""
    (record,) = read_log("Date,Time,Displacement (mm),Force (N)\n" + clock_rows(200, begin))
    assert record.dt == pytest.approx(1e-3, rel=1e-6)
    assert (record.samples, record.start) == (200, 0.0)
    assert list(record.channels) == ["displacement", "force"]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("zone", ["Z", "+01:00", "-0530"])
def test_stamps_of_a_zone(zone: str, read_log: ReadLog) -> None:
    rows = "".join(f"2024-03-01T10:00:{k * 0.01:06.3f}{zone},{k % 7}\n" for k in range(100))
    (record,) = read_log("Time,Force (N)\n" + rows)
    assert record.dt == pytest.approx(0.01)
    assert record.samples == 100


def test_clocks_set_back_by_an_hour_do_not_turn_back_time(read_log: ReadLog) -> None:
    stamps = [f"2024-10-27T02:59:{50 + k / 10:06.3f}+02:00" for k in range(100)]
    stamps += [f"2024-10-27T02:00:{k / 10:06.3f}+01:00" for k in range(100)]
    (record,) = read_log("Time,Force (N)\n" + "".join(f"{s},{k % 7}\n" for k, s in enumerate(stamps)))
    assert record.samples == 200 and record.dt == pytest.approx(0.1)


@pytest.mark.parametrize("milliseconds", [5, 10, 1000])
@pytest.mark.parametrize("quote", ['"', ""])
def test_a_table_of_a_campbell_logger(quote: str, milliseconds: int, read_log: ReadLog) -> None:
    """Four lines of header; the stamps have as many decimals as they need."""
    count = np.arange(600)
    force, motion = np.round(990.0 * np.cos(0.025 * count), 2), np.round(10.0 * np.sin(0.025 * count), 4)
    begin = datetime(2024, 3, 5, 10)
    head = '"TOA5","CR1000X","CR1000X","12345","CR1000X.Std.03.02","CPU:damper.CR1X","54321","Fast"\r\n'
    head += '"TIMESTAMP","RECORD","Load","Stroke","OilTemp_Avg","Load_Max"\r\n"TS","RN","kN","mm","Deg C","kN"\r\n'
    head += '"","","Smp","Smp","Avg","Max"\r\n'
    rows = ""
    for k in count:
        when = (begin + timedelta(milliseconds=milliseconds * int(k))).isoformat(" ").rstrip("0") if k else str(begin)
        when = when + "0" * (19 - len(when))
        rows += f'"{when}",{k},{force[k]:.2f},{motion[k]:.4f},24.5,999\r\n'
    rows = rows.replace(f",{force[300]:.2f},", ',"NAN",', 1)
    (record,) = read_log((head + rows).replace('"', quote), "fast.dat")
    assert (record.dt, record.rows_kept, record.rows_refused) == (pytest.approx(1e-3 * milliseconds), 599, 1)
    sound = np.delete(count, 300)
    np.testing.assert_allclose(record.channels["force"][sound], 1e3 * force[sound])
    np.testing.assert_allclose(record.channels["displacement"][sound], 1e-3 * motion[sound])
    assert record.units["temperature"] == "degC"
