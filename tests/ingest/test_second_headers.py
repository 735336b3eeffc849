"""Two headers with hardly a row between them: the log is refused, not read by the wrong one."""

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
