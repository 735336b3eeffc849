"""Rows of names and units in any language: one unknown word costs its column its unit, and no log is refused for it."""

import numpy as np
import pytest

from mrfit.errors import DataError
from tests.ingest.conftest import ReadLog

K = np.arange(200)
ONE, TWO = np.round(np.sin(K / 9), 4), np.round(np.cos(K / 9), 4)
MTS = "MTS793|MPT|ENU|1|2|.|/|:|51|1|1|A\r\n\r\nData Acquisition\t\tTime:\t5.0\ts\r\n"
TESTSUITE = "File Path: C:\\x.txt\nTest: t\nTest Run: Test Run 1\nDate: 10/23/2023\n\n\n"


def rows(delimiter: str, mark: str = ".", end: str = "\n") -> str:
    cells = ([f"{k * 1e-3:.3f}", f"{a:.4f}", f"{b:.4f}"] for k, a, b in zip(K, ONE, TWO, strict=True))
    return "".join(delimiter.join(c).replace(".", mark) + end for c in cells)


@pytest.mark.parametrize("unit", ["kgq", "deg_Q", "%FS", "zoll", "pulse/turn", "½x"])
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("specimen.dat", MTS + "Time\tLoad\tOther\r\ns\tkN\t{unit}\r\n" + rows("\t", ".", "\r\n")),
        ("DAQ- (Timed).txt", TESTSUITE + "Time\tLoad\tOther\nsec\tkN\t{unit}\n" + rows("\t")),
        ("log.csv", "Time,Load,Other\ns,kN,{unit}\n" + rows(",")),
        ("log.csv", "Time [s],Load [kN],Other [{unit}]\n" + rows(",")),
        ("log.txt", "Zeit;Kraft;Other\n\ns;kN;{unit}\n\n" + rows(";", ",")),
        ("pico.csv", "Frequency,Load,Other\n(s),(kN),({unit})\n\n" + rows(",")),
        ("scope.csv", "x-axis,Load,Other\nsecond,kN,{unit}\n" + rows(",")),
        ("X.csv", "X,CH1,CH2\nSecond,kN,{unit}\n" + rows(",")),
    ],
)
def test_an_unknown_unit_keeps_its_column_as_printed(name: str, text: str, unit: str, read_log: ReadLog) -> None:
    (record,) = read_log(text.replace("{unit}", unit), name)
    known, printed = (n for n in record.channels)
    assert (record.dt, record.units[known], record.units[printed]) == (1e-3, "N", "")
    np.testing.assert_allclose(record.channels[known], 1e3 * ONE)
    np.testing.assert_allclose(record.channels[printed], TWO)
    said = [f.text for f in record.findings if f.kind == "unknown-unit"]
    assert len(said) == 1 and f"in '{unit}': kept as printed" in said[0]


@pytest.mark.parametrize(
    "header",
    [
        "Time (s),Load (kN),Other\ns,N,V\n",
        "Time_s,Load_kN,Other\ns,N,V\n",
        "Time (s),Load_kN (N),Other (V)\n",
        "Time (s),Load (kN) [N],Other (V)\n",
    ],
)
def test_a_unit_that_contradicts_the_name_is_asked_for(header: str, read_log: ReadLog) -> None:
    (record,) = read_log(header + rows(","))
    assert "force" not in record.channels and "kN or N" in " ".join(f.text for f in record.findings)


def test_a_row_of_unknown_units_refuses_no_log(read_log: ReadLog) -> None:
    (record,) = read_log("Time,Load,Other\nzoll,deg_Q,qzx\n" + rows(","))
    assert (record.dt, record.units) == (1e-3, {"load": "", "other": ""})
    assert sorted(f.kind for f in record.findings) == ["unit-assumed", "unknown-unit"]


@pytest.mark.parametrize("above", ["Time [s],Load [kN],Other [mm]", "Rig,Tester,Load"])
def test_words_below_names_with_units_or_below_unknown_names_are_no_units(above: str, read_log: ReadLog) -> None:
    with pytest.raises(DataError, match="'LC1', 'LC2', 'LC3'"):
        read_log(f"{above}\nLC1,LC2,LC3\n" + rows(","))


def test_units_of_a_press_are_known(read_log: ReadLog) -> None:
    text = MTS + "Time\tAxial Force\tTemperature\tAxial Segments\r\nSec\tkgf\tdeg_C\tsegments\r\n"
    (record,) = read_log(text + rows("\t", ".", "\t3\r\n"), "specimen.dat")
    assert record.units == {"force": "N", "temperature": "degC", "axial_segments": "1"}
    np.testing.assert_allclose(record.channels["force"], 9.80665 * ONE)
    np.testing.assert_allclose(record.channels["temperature"], TWO)


@pytest.mark.parametrize(
    "header",
    [
        "Zeit / Sekunden;Kraft ( kN );Weg ( mm )\n",
        "Zeit / Sekunden;Kraft;Weg\n;( kN );( mm )\n",
        "Zeit;Kraft;Weg\n\0\0\n( Sekunden );( kN );( mm )\n\0\n",
        "Messprotokoll;;\nPrüfer;N. N.;\n\nZeit;Kraft;Weg\n\ns;kN;mm\n\n",
        "Kanal;Name;Einheit\n1;Kraft;kN\n2;Weg;mm\n\nZeit;Kraft;Weg\ns;kN;mm\n",
    ],
)
def test_headers_of_a_german_logger(header: str, read_log: ReadLog) -> None:
    (record,) = read_log((header + rows(";", ",")).encode("latin-1"), "log.csv")
    assert (record.dt, record.rows_kept, record.rows_refused) == (1e-3, 200, 0)
    np.testing.assert_allclose(record.channels["force"], 1e3 * ONE)
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * TWO)


def test_nul_bytes_between_names_and_units_of_a_press(read_log: ReadLog) -> None:
    header = "Time\tAxial Force\tAxial Displacement\r\n\r\n\0\0\r\ns\tkN\tmm\r\n\0\r\n"
    block = header + rows("\t", ".", "\r\n")
    recordings = read_log(MTS + block + "\r\n" + block, "specimen.dat")
    assert [(r.rows_kept, r.rows_refused) for r in recordings] == [(200, 0), (200, 0)]
    np.testing.assert_allclose(recordings[1].channels["force"], 1e3 * ONE)


@pytest.mark.parametrize(("delimiter", "mark"), [(",", "."), (";", ",")])
def test_x_beside_the_channels_of_a_scope_is_its_time(delimiter: str, mark: str, read_log: ReadLog) -> None:
    header = delimiter.join(["X", "CH 1 (V)", "CH 2 (V)"])
    (record,) = read_log(f"{header}\n{rows(delimiter, mark)}")
    assert record.dt == 1e-3 and list(record.channels) == ["ch_1", "ch_2"]
    assert "'X' no unit: taken as s" in next(f.text for f in record.findings if f.kind == "unit-assumed")


def test_x_beside_other_channels_is_no_time(read_log: ReadLog) -> None:
    """Beside forces it is a position."""
    (record,) = read_log("X,Force (N),CH 2 (V)\n" + rows(","), channel_map="rate = 1000\n")
    assert "x" in record.channels


def test_a_preamble_of_two_cells_is_no_name_row(read_log: ReadLog) -> None:
    """Here V is a name, and Operator and Bob are none."""
    (record,) = read_log(
        "Operator,Bob\nTime,V\n" + "".join(f"{k * 1e-3:.3f},{v}\n" for k, v in zip(K, ONE, strict=True))
    )
    np.testing.assert_allclose(record.channels["v"], ONE)


def test_repeated_header_blocks_begin_new_runs(read_log: ReadLog) -> None:
    block = "Zeit;Kraft;Weg\ns;kN;mm\n" + rows(";", ",")
    recordings = read_log(block + "\n" + block)
    assert [r.rows_kept for r in recordings] == [200, 200]
    assert sum(r.rows_refused for r in recordings) == 2


def test_the_decimal_mark_of_the_rows_counts_where_the_first_line_states_another(read_log: ReadLog) -> None:
    (record,) = read_log(MTS + "Time\tAxial Force\tx\r\ns\tkN\tmm\r\n" + rows("\t", ",", "\r\n"), "specimen.dat")
    np.testing.assert_allclose(record.channels["force"], 1e3 * ONE)


def test_a_lvm_name_too_few_is_refused(read_log: ReadLog) -> None:
    from mrfit.ingest.refusal import Refusal
    from tests.ingest.samples import labview_lvm

    text = labview_lvm().data.decode()
    for names in ("X_Value\tCoil\tComment", "X_Value\tLoad\tCoil\tThird\tComment"):
        with pytest.raises(Refusal, match="its header counts 2 channels but names"):
            read_log(text.replace("X_Value\tLoad\tCoil\tComment", names), "short.lvm")


@pytest.mark.parametrize(
    "header",
    [
        "s,mm,kN\nTime,Disp,Load\n",
        "[s],[mm],[kN]\nTime,Disp,Load\n",
        "(s),(mm),(kN)\n\nTime,Stroke,Force\n",
        "Test 5\n# s,mm,kN\n# Time,Disp,Load\n",
        "s;mm;kN\nZeit;Weg;Kraft\n",
    ],
)
def test_units_above_the_names(header: str, read_log: ReadLog) -> None:
    (record,) = read_log(header + rows(";" if ";" in header else ","))
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * ONE)
    np.testing.assert_allclose(record.channels["force"], 1e3 * TWO)
    assert not [f for f in record.findings if f.kind == "unit-assumed"]


@pytest.mark.parametrize("header", ["Rig,Lab,Load\nTime,Disp,Force\n", "Time,Disp,Force\n"])
def test_other_rows_above_the_names_are_no_units(header: str, read_log: ReadLog) -> None:
    (record,) = read_log(header + rows(","))
    np.testing.assert_allclose(record.channels["force"], TWO)
    assert len([f for f in record.findings if f.kind == "unit-assumed"]) == 3


@pytest.mark.parametrize("labels", ["mm\tkN", "mm\t\tkN"])
def test_units_of_lvm_channels_with_times_of_their_own(labels: str, read_log: ReadLog) -> None:
    """Labels stand under each channel's column, or one behind the other."""
    top = "LabVIEW Measurement\t\nSeparator\tTab\nX_Columns\tMulti\n***End_of_Header***\t\n\nChannels\t2\n"
    text = f"{top}Y_Unit_Label\t{labels}\nDelta_X\t0.001\t\t0.001\n***End_of_Header***\n"
    text += "X_Value\tDisp\tX_Value\tForce\tComment\n"
    text += "".join(
        f"{k * 1e-3:.3f}\t{a:.4f}\t{k * 1e-3:.3f}\t{b:.4f}\t\n" for k, a, b in zip(K, ONE, TWO, strict=True)
    )
    (record,) = read_log(text, "multi.lvm")
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * ONE)
    np.testing.assert_allclose(record.channels["force"], 1e3 * TWO)
    assert not [f for f in record.findings if f.kind == "unit-assumed"]
