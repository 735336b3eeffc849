"""Text logs that once gave wrong numbers in silence: each is read as its formula says, or refused by its line."""

import re
from pathlib import Path

import numpy as np
import pytest

from mrfit.core.recording import Recording
from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog

HOSTILE = Path(__file__).parents[1] / "data" / "hostile"
K = np.arange(1000)
VOLTAGE, CURRENT = 5.0 * np.sin(K / 15.0), 3.0 * np.cos(K / 15.0)
RATE = "rate = 1000\n"
FOUR_DECIMALS = 5.1e-5


def _read(read_log: ReadLog, name: str, channel_map: str = "") -> list[Recording]:
    return read_log((HOSTILE / name).read_bytes(), name, channel_map)


def _said(record: Recording) -> dict[str, str]:
    return {f.kind: f.text for f in record.findings}


def test_a_thousand_missing_rows_split_a_nanosecond_log(read_log: ReadLog) -> None:
    first, second = _read(read_log, "gap_ns.csv")
    assert (first.dt, second.dt) == (1e-9, 1e-9)
    assert (first.start, second.start) == (0.0, pytest.approx(2e-6))
    for record in (first, second):
        np.testing.assert_allclose(record.channels["voltage"], np.sin(2 * np.pi * K / 100), atol=1e-6)
    assert "gap" in _said(first)


def test_missing_rows_do_not_stretch_a_nanosecond_log(read_log: ReadLog) -> None:
    (record,) = _read(read_log, "drop50_ns.csv")
    assert (record.dt, record.samples, record.rows_kept) == (1e-9, 3000, 2950)
    np.testing.assert_allclose(record.channels["voltage"], np.sin(2 * np.pi * np.arange(3000) / 100), atol=2.5e-3)
    assert _said(record)["dropped-samples"].startswith("50 samples are missing")


def test_a_garbled_time_costs_its_row_only(read_log: ReadLog) -> None:
    first, second = _read(read_log, "timebomb.csv")
    assert (first.samples, second.samples) == (300, 399)
    assert first.rows_refused + second.rows_refused == 1
    np.testing.assert_allclose(first.channels["current"], np.cos(0.05 * K[:300]), atol=FOUR_DECIMALS)
    np.testing.assert_allclose(second.channels["current"], np.cos(0.05 * K[301:700]), atol=FOUR_DECIMALS)


def test_row_numbers_of_r_shift_no_name(read_log: ReadLog) -> None:
    (record,) = _read(read_log, "r_style.csv")
    assert record.dt == 1e-3 and set(record.channels) == {"voltage", "current"}
    np.testing.assert_allclose(record.channels["voltage"], VOLTAGE, atol=FOUR_DECIMALS)
    np.testing.assert_allclose(record.channels["current"], CURRENT, atol=FOUR_DECIMALS)
    assert "numbers the rows" in _said(record)["no-channel"]


def test_quoted_row_names_of_r_shift_no_name(read_log: ReadLog) -> None:
    rows = "".join(f'"{k + 1}",{k * 1e-3:.3f},{k * 0.5}\n' for k in range(50))
    (record,) = read_log('"time","voltage"\n' + rows)
    np.testing.assert_allclose(record.channels["voltage"], 0.5 * np.arange(50))


def test_a_name_too_few_is_refused_where_no_column_numbers_the_rows(read_log: ReadLog) -> None:
    rows = "".join(f"{k * 1e-3:.3f},{k * 0.5},{k * 0.1:.1f}\n" for k in range(50))
    with pytest.raises(Refusal, match=r"2 names \(voltage, current\) for 3 columns.*channel map"):
        read_log("voltage (V),current (A)\n" + rows)
    (record,) = read_log("time (s),voltage (V),\n" + rows)  # its last cell is empty: the name is left out on purpose
    np.testing.assert_allclose(record.channels["voltage"], 0.5 * np.arange(50))
    (record,) = read_log("time (s),voltage (V)\n" + re.sub(r",[0-9.]+\n", ",\n", rows))  # nothing in the last column
    np.testing.assert_allclose(record.channels["voltage"], 0.5 * np.arange(50))


def test_decimal_commas_of_a_daq_log(read_log: ReadLog) -> None:
    (record,) = _read(read_log, "daq_comma.txt")
    assert (record.dt, record.rows_kept) == (1e-3, 1000)
    np.testing.assert_allclose(record.channels["channel0"], VOLTAGE, atol=FOUR_DECIMALS)


def test_decimal_commas_of_a_daq_log_without_blanks_are_refused(read_log: ReadLog) -> None:
    text = (HOSTILE / "daq_comma.txt").read_text().replace(", ", ",").replace(",  ", ",")
    with pytest.raises(Refusal, match=r"decimal commas.*line 8.*set the logger to decimal points"):
        read_log(text, "daq_comma.txt")


def test_one_decimal_comma_in_a_daq_log_costs_its_row(read_log: ReadLog) -> None:
    head = (HOSTILE / "daq_comma.txt").read_text().split("\n")[:7]
    rows = [f"{k + 1},   04/29/2022 12:11:{14 + k * 1e-3:06.3f} PM, {v:.4f}" for k, v in enumerate(VOLTAGE)]
    rows[500] = rows[500].rpartition(".")[0] + "," + rows[500].rpartition(".")[2]
    (record,) = read_log("\n".join([*head, *rows, ""]), "daq.txt")
    assert (record.rows_kept, record.rows_refused) == (999, 1)
    assert "number for an event (first in line 508)" in _said(record)["refused-rows"]


def test_decimal_commas_without_header(read_log: ReadLog) -> None:
    channels = '[channels]\nforce = {column = 0, unit = "N"}\ndisplacement = {column = 1, unit = "mm"}\n'
    (record,) = _read(read_log, "headerless_comma.csv", RATE + channels)
    assert set(record.channels) == {"force", "displacement"}
    np.testing.assert_allclose(record.channels["force"], VOLTAGE, atol=FOUR_DECIMALS)
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * CURRENT, atol=1e-3 * FOUR_DECIMALS)
    assert "decimal-comma" in _said(record)


def test_whole_numbers_between_commas_stay_whole(read_log: ReadLog) -> None:
    """Counts of a converter, one column of which is never negative: no field is written as no whole number is."""
    rows = "".join(f"{round(2000 * np.sin(k / 9))},{k * 7 % 50},{-k},{k % 3}\n" for k in range(200))
    channels = "".join(f'ch{c} = {{column = {c}, unit = "V"}}\n' for c in range(4))
    (record,) = read_log(rows, channel_map=RATE + "[channels]\n" + channels)
    np.testing.assert_allclose(record.channels["ch1"], np.arange(200) * 7 % 50)
    assert "decimal-comma" not in _said(record)


def test_a_row_that_lost_a_field_between_decimal_commas_is_refused(read_log: ReadLog) -> None:
    rows = (HOSTILE / "headerless_comma.csv").read_text().split("\n")
    rows[100] = ",".join(rows[100].split(",")[:2])
    rows[200] = ",".join(rows[200].split(",")[:3])
    channels = '[channels]\nforce = {column = 0, unit = "N"}\n'
    (record,) = read_log("\n".join(rows), channel_map=RATE + channels)
    assert (record.rows_kept, record.rows_refused) == (998, 2)
    np.testing.assert_allclose(record.channels["force"], VOLTAGE, atol=0.02)


def test_spreadsheet_errors_cost_their_rows(read_log: ReadLog) -> None:
    (record,) = _read(read_log, "excel_error.csv", RATE)
    assert (record.rows_kept, record.rows_refused, record.samples) == (998, 2, 1000)
    sound = np.delete(K, [500, 501])
    np.testing.assert_allclose(record.channels["voltage"][sound], VOLTAGE[sound], atol=FOUR_DECIMALS)
    assert "2 × not a number (first in line 502)" in _said(record)["refused-rows"]


def test_overload_marks_are_no_header(read_log: ReadLog) -> None:
    (record,) = _read(read_log, "overload.csv", RATE)
    assert (record.rows_kept, record.rows_refused) == (900, 100)
    assert record.start == pytest.approx(0.1)
    np.testing.assert_allclose(record.channels["voltage"], VOLTAGE[100:], atol=FOUR_DECIMALS)
    assert "100 × not a number (first in line 2)" in _said(record)["refused-rows"]


@pytest.mark.parametrize(
    "first",
    ["0.000,OL\n", "OL,OL\n0.001,OL\n", "x.1,0.5\n", "0.000,#DIV/0!\n", "ready,ready\nready,ready\n", "--,--\n"],
)
@pytest.mark.parametrize("header", ["time (s),voltage (V)\n", "time,voltage\ns,V\n", "# note\ntime [s],voltage [mV]\n"])
def test_unreadable_first_rows_are_counted(header: str, first: str, read_log: ReadLog) -> None:
    rows = "".join(f"{k * 1e-3:.3f},{np.sin(k / 9):.4f}\n" for k in range(5, 100))
    (record,) = read_log(header + first + rows)
    assert (record.rows_kept, record.rows_refused) == (95, first.count("\n"))
    assert list(record.channels) == ["voltage"] and record.units["voltage"] == "V"


def test_a_line_of_dashes_below_the_names_is_no_row(read_log: ReadLog) -> None:
    rows = "".join(f"{k * 1e-3:.3f} {np.sin(k / 9):.4f}\n" for k in range(100))
    (record,) = read_log("time voltage\n----- -------\n" + rows)
    assert (record.rows_kept, record.rows_refused) == (100, 0) and list(record.channels) == ["voltage"]


def test_a_file_that_ends_inside_its_last_number_loses_that_row(read_log: ReadLog) -> None:
    text = "time (s),voltage (V)\n" + "".join(f"{k * 1e-3:.3f},{np.sin(k / 9):.4f}\n" for k in range(100))
    (record,) = read_log(text[:-3])
    assert (record.rows_kept, record.rows_refused) == (99, 1)
    assert "line 101, the last" in _said(record)["last-line-open"]
    assert "1 × cut-off row (first in line 101)" in _said(record)["refused-rows"]
    (record,) = read_log(text[:-1])  # all its digits are there
    assert (record.rows_kept, record.rows_refused) == (100, 0) and "last-line-open" not in _said(record)


def test_comments_among_rows_are_named(read_log: ReadLog) -> None:
    rows = [f"{k * 1e-3:.3f},{np.sin(k / 9):.4f}" for k in range(100)]
    rows[40] += "\n# the pump was switched on"
    rows[60] += "\n! and off"
    (record,) = read_log("\n".join(["time (s),voltage (V)", *rows, ""]))
    assert (record.rows_kept, record.rows_refused) == (100, 0)
    assert _said(record)["comments"] == "2 comment lines stand among the rows, the first in line 43"


def test_a_number_out_of_all_proportion_is_said(read_log: ReadLog) -> None:
    rows = [f"{k * 1e-3:.3f},{np.sin(k / 9):.4f}" for k in range(100)]
    rows[50] = "0.050,1e12"
    (record,) = read_log("\n".join(["time (s),voltage (V)", *rows, ""]))
    assert record.rows_kept == 100 and "the first is 1e+12 at 0.05 s" in _said(record)["outlier"]


def test_a_header_repeated_among_unreadable_first_rows_is_counted_with_them(read_log: ReadLog) -> None:
    rows = "".join(f"{k * 1e-3:.3f},{np.sin(k / 9):.4f}\n" for k in range(100))
    header = "time,voltage\ns,V\n"
    (record,) = read_log(header + "OL,OL\n" * 5 + header + "OL,OL\n" * 3 + rows)
    assert (record.rows_kept, record.rows_refused) == (100, 10)


def test_a_header_given_twice_is_a_header(read_log: ReadLog) -> None:
    rows = "".join(f"{k * 1e-3:.3f},{np.sin(k / 9):.4f}\n" for k in range(100))
    (record,) = read_log("Operator,Bob\ntime,voltage\ns,V\n\ntime,voltage\ns,V\n" + rows)
    assert (record.rows_kept, record.rows_refused, list(record.channels)) == (100, 0, ["voltage"])


def test_settings_further_up_are_no_names(read_log: ReadLog) -> None:
    """The name row has lost two of its three names."""
    rows = "".join(f"{k * 1e-3:.3f},{np.sin(k / 9):.4f},{np.cos(k / 9):.4f}\n" for k in range(100))
    with pytest.raises(Refusal, match="no header says what its 3 columns are"):
        read_log("Sample Interval,0.001,\nVertical Units,V,\nLabel,,\nCH2\n" + rows)
    (record,) = read_log("time,voltage,current\nrecorded in the morning\n" + rows)  # known names
    assert list(record.channels) == ["voltage", "current"]


@pytest.mark.parametrize("first", ["%\tOL\tOL\n", "\tOL\tOL\n", "OL\tOLxOL\tOL\n", "OL\tOL\tOL\n%\tOL\tOL\n"])
def test_overload_rows_are_no_units_of_a_press(first: str, read_log: ReadLog) -> None:
    head = "File Path: C:\\x.txt\nTest: t\nTest Run: Test Run 1\n\nCrosshead \tLoad \tTime \nmm\tN\tsec\n"
    rows = "".join(f"{np.sin(k / 9):.4f}\t{np.cos(k / 9):.4f}\t{k * 1e-3:.3f}\n" for k in range(100))
    (record,) = read_log(head + first + rows, "DAQ- (Timed).txt")
    assert (record.dt, record.rows_kept, record.rows_refused) == (1e-3, 100, first.count("\n"))
    assert record.units == {"displacement": "m", "force": "N"}


def test_a_sheet_error_in_the_first_row_of_decimal_commas_is_counted(read_log: ReadLog) -> None:
    rows = "".join(f"{k * 1e-3:.3f},{np.sin(k / 9):.4f}\n".replace(".", ",") for k in range(100))
    (record,) = read_log("time [s],voltage [V]\n#REF!,0,1234\n" + rows)
    assert (record.rows_kept, record.rows_refused) == (100, 1)


def test_a_repeated_header_of_a_scope_is_not_its_header(read_log: ReadLog) -> None:
    """The header proper has lost its first name: all rows above the repeated one would be gone."""
    rows = [f"{k * 1e-3:.6f},{np.sin(k / 9):.4f},{np.cos(k / 9):.4f}" for k in range(100)]
    text = "\n".join(["Model,MSO2014", "Sample Interval,0.001,", "CH1,CH2", *rows[:25], "TIME,CH1,CH2", *rows[25:], ""])
    with pytest.raises(Refusal, match=r"2 names \(CH1, CH2\) for 3 columns"):
        read_log(text, "tek0000.csv")


def test_a_first_row_of_a_scope_with_an_unreadable_time_is_counted(read_log: ReadLog) -> None:
    from tests.ingest.samples import tektronix_tds

    first, _, rest = tektronix_tds().data.decode().partition("\r\n")
    (record,) = read_log(first.replace("-00000.050000000", "#") + "\r\n" + first + "\r\n" + rest, "F0004CH1.CSV")
    assert (record.rows_kept, record.rows_refused) == (240, 1)
