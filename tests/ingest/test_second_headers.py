"""Second headers: which one holds is asked for, or told by the rows between; names are never made of units or marks."""

from pathlib import Path

import numpy as np
import pytest

import mrfit
from mrfit.errors import DataError

ROWS = [(-50.0 + k, np.sin(k / 9.0), 1500.0 * np.cos(k / 9.0)) for k in range(240)]
PICOSCOPE = ["Time,Channel A,Channel B", "(ms),(V),(qzx)", ""]
KEYSIGHT = ["x-axis,1,4", "second,qzx,Volt"]
SEMICOLONS = ["Time;Force;Displacement", "s;deg_Q;mm"]
CASSY = ["MIN=0\t-5\t-5", "MAX=1\t5\t5", "SCALE=1\t1\t1", "DEC=1\t3\t4"]


def _rows(delimiter: str, count: int, begin: int = 0) -> list[str]:
    return [delimiter.join(f"{x:.4f}" for x in row) for row in ROWS[begin:count]]


@pytest.mark.parametrize(
    ("first", "second", "delimiter", "between"),
    [
        (PICOSCOPE, ["(ms),(V),(V)"], ",", 0),
        (PICOSCOPE, ["Time,Channel A,Channel B", "(ms),(mV),(mV)"], ",", 1),
        (KEYSIGHT, ["second,Volt,mV"], ",", 0),
        (SEMICOLONS, SEMICOLONS, ";", 1),
        (
            [*CASSY, 'DEF="Zeit" t / s\t"Weg" s_A1 / m\t"Spannung" U_B1 / V', "OL\tOL\tOL"],
            ['DEF="Zeit" t / s\t"Weg" s_A1 / mm\t"Spannung" U_B1 / V', "OL\tOL\tOL"],
            "\t",
            0,
        ),
    ],
    ids=["units again", "header again", "units of an oscilloscope", "unknown unit", "overload"],
)
@pytest.mark.filterwarnings("ignore:left out")
def test_which_header_holds_is_asked(
    first: list[str], second: list[str], delimiter: str, between: int, tmp_path: Path
) -> None:
    log = tmp_path / "log.csv"
    text = [*first, *_rows(delimiter, between), *second, *_rows(delimiter, 240, between)]
    log.write_text("\n".join(text) + "\n", encoding="utf-8")
    with pytest.raises(DataError, match="is another header right below the first"):
        mrfit.read(log, progress=False)


def test_a_header_that_is_repeated_below_its_rows_is_left_out(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    text = [*SEMICOLONS, *_rows(";", 2), *SEMICOLONS, *_rows(";", 240, 2)]
    log.write_text("\n".join(text) + "\n", encoding="utf-8")
    (read,) = mrfit.read(log, progress=False)
    assert read.samples == 240 and read.rows_refused == 2


def _read(text: list[str], tmp_path: Path) -> list[mrfit.Recording]:
    log = tmp_path / "log.csv"
    log.write_text("\n".join(text) + "\n", encoding="utf-8")
    return mrfit.read(log, progress=False)


@pytest.mark.parametrize("between", [2, 100])
@pytest.mark.parametrize("time", ["second", "Second"])
@pytest.mark.filterwarnings("ignore:left out")
def test_units_that_none_knows_are_no_names_for_a_second_header(time: str, between: int, tmp_path: Path) -> None:
    text = ["x-axis,1,4", f"{time},%FS,qzx", *_rows(",", between), f"{time},Volt,mV", *_rows(",", 240, between)]
    (read,) = _read(text, tmp_path)
    assert read.units == {"ch1": "", "ch4": ""} and read.samples == between
    assert [f"line {between + 3} begins another header" in f.text for f in read.findings].count(True) == 1


@pytest.mark.parametrize("between", [2, 100])
def test_a_second_unit_row_below_unknown_units_is_read_where_names_stand_above(between: int, tmp_path: Path) -> None:
    text = ["Zeit;Kraft;Weg", "zoll;deg_Q;qzx", *_rows(";", between), "s;kN;mm", *_rows(";", 240, between)]
    first, second = _read(text, tmp_path)
    assert first.units == {"kraft": "", "weg": ""} and first.samples == between
    assert second.units == {"force": "N", "displacement": "m"} and second.samples == 240 - between
    np.testing.assert_allclose(second.channels["force"], [1e3 * round(r[1], 4) for r in ROWS[between:]])


OVERLOADED = [
    (["Source,CH1,CH2", "Volt,Volt", "OL,OL,OL", "Second,Volt,mV", "OL,OL,OL"], {"ch1": "V", "ch2": "V"}, 1.0),
    (["Zeit,Kraft,Weg", "s,kN,mm", "OL,OL,OL", "s,N,mm", "OL,OL,OL"], {"force": "N", "displacement": "m"}, 1.0),
    (["Zeit,Kraft,Weg", "s,kN,mm", "-9,OL,OL", "s,N,mm", "-8,OL,OL"], {"force": "N", "displacement": "m"}, 1.0),
    (
        ["Zeit,Kraft,Weg", "(s),(qzx),(zoll)", "OL,OL,OL", "(s),(kN),(mm)", "OL,OL,OL"],
        {"force": "N", "displacement": "m"},
        1e3,
    ),
    (["Rig,N. N.,", "t,F,s", "s,kN,mm", "OL,OL,OL", "OL,OL,OL"], {"force": "N", "displacement": "m"}, 1e3),
]


@pytest.mark.parametrize(
    ("header", "units", "first"), OVERLOADED, ids=["scope", "marks", "time is there", "unknown", "once"]
)
def test_marks_of_overload_between_two_rows_of_units_are_no_names(
    header: list[str], units: dict[str, str], first: float, tmp_path: Path
) -> None:
    (read,) = _read([*header, *_rows(",", 240)], tmp_path)
    assert read.units == units and (read.rows_kept, read.rows_refused) == (240, 2)
    for values, column, scale in zip(read.channels.values(), (1, 2), (first, 1e-3), strict=True):
        np.testing.assert_allclose(values, [scale * round(r[column], 4) for r in ROWS], atol=1e-12)


LOG = "Time (s),Displacement (mm),Force (N)\n" + "\n".join(_rows(",", 240)) + "\n"
PEAKS = "Cycle,Peak force (N),Energy (J)\n1,703,12.1\n2,702,12.0\n3,702,12.0\n"


@pytest.mark.parametrize(
    "text", [f"{PEAKS}\n{LOG}", f"{LOG}\n{PEAKS}", f"Results\nPeak (kN),Stroke at peak (mm)\n0.7,16\n\n{LOG}"]
)
def test_a_small_table_without_times_refuses_no_log(text: str, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(text, encoding="utf-8")
    (record,) = mrfit.read(tmp_path / "log.csv")
    assert record.rows_kept == 240 and set(record.channels) == {"displacement", "force"}
    assert "not read" in " ".join(f.text for f in record.findings)


def test_a_table_without_times_as_long_as_the_log_is_asked_for(tmp_path: Path) -> None:
    peaks = "Cycle,Peak force (N)\n" + "".join(f"{k},{700 + k % 7}\n" for k in range(240))
    (tmp_path / "log.csv").write_text(f"{LOG}\n{peaks}", encoding="utf-8")
    with pytest.raises(DataError, match="no time column"):
        mrfit.read(tmp_path / "log.csv")
