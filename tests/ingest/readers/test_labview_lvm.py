import numpy as np
import pytest

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog
from tests.ingest.samples import labview_lvm

TOP = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\t{x}\n***End_of_Header***\t\n\t\n"
ONE = "Channels\t2\t\t\nY_Unit_Label\tVolts\tAmps\t\nX0\t0.0\t0.0\t\nDelta_X\t0.5\t0.5\t\n***End_of_Header***\t\t\t\n"


def test_time_column_wins_over_a_false_delta(read_log: ReadLog) -> None:
    rows = "".join(f"{k * 0.1:.1f}\t{k}\t{-k}\tOK\n" for k in range(40))
    (record,) = read_log(TOP.format(x="One") + ONE + "X_Value\tU\tI\tComment\n" + rows)
    assert record.dt == pytest.approx(0.1)
    assert record.units == {"voltage": "V", "current": "A"}
    assert "rate-differs" in {f.kind for f in record.findings}


@pytest.mark.parametrize("columns", ["One", "No"])
def test_x_values_have_the_unit_of_their_axis(columns: str, read_log: ReadLog) -> None:
    channels = ONE.replace("0.5\t0.5", "5.0\t5.0").replace("X0\t", "X_Unit_Label\tms\tms\t\nX0\t")
    rows = "".join(f"{5 * k if columns == 'One' else ''}\t{k}\t{-k}\n" for k in range(40))
    (record,) = read_log(TOP.format(x=columns) + channels + "X_Value\tU\tI\tComment\n" + rows)
    assert record.dt == pytest.approx(0.005)
    assert "rate-differs" not in {f.kind for f in record.findings}


def test_segments_are_runs(read_log: ReadLog) -> None:
    rows = "".join(f"\t{k}\t{-k}\n" for k in range(40))
    segment = ONE.replace("\nX0", "\nSamples\t40\t40\t\nX0") + "X_Value\tU\tI\tComment\n" + rows + "\n"
    recordings = read_log(TOP.format(x="No") + segment + segment)
    assert "record-length" not in {f.kind for r in recordings for f in r.findings}  # each segment states its own
    assert [r.rows_kept for r in recordings] == [40, 40]
    assert sum(r.rows_refused for r in recordings) == 0


MULTI = "Channels\t2\t\t\t\nY_Unit_Label\tVolts\t\tAmps\t\nDelta_X\t0.1\t\t0.1\t\n***End_of_Header***\t\t\t\t\n"


@pytest.mark.parametrize("later", [0.0, 0.05])
def test_a_time_column_per_channel(later: float, read_log: ReadLog) -> None:
    """Both channels are on the first clock: a current that is printed half a sample later is interpolated."""
    rows = "".join(f"{k * 0.1:.2f}\t{k}\t{k * 0.1 + later:.2f}\t{-k}\n" for k in range(40))
    (found,) = read_log(TOP.format(x="Multi") + MULTI + "X_Value\tU\tX_Value\tI\tComment\n" + rows)
    first = 1 if later else 0
    np.testing.assert_array_equal(found.channels["voltage"], np.arange(first, 40.0))
    np.testing.assert_allclose(found.channels["current"], -np.arange(first, 40.0) + 10.0 * later)
    assert found.start == pytest.approx(0.1 * first)


def test_rounded_delta_is_said(read_log: ReadLog) -> None:
    data = labview_lvm().data.replace(b"Delta_X\t0,001000\t0,001000", b"Delta_X\t0,000977\t0,000977")
    (record,) = read_log(data)
    assert "rounded-rate" in {f.kind for f in record.findings}


def test_neither_times_nor_delta_is_refused(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="neither X values nor Delta_X"):
        read_log(labview_lvm().data.replace(b"Delta_X", b"Omega_X"))


def test_header_line_among_the_rows_is_no_row(read_log: ReadLog) -> None:
    lines = labview_lvm().data.split(b"\n")
    (record,) = read_log(b"\n".join([*lines[:60], b"Samples\t240\t240\t", *lines[60:]]))
    assert record.rows_refused == 1
    assert abs(record.channels["force"]).max() < 3.0


@pytest.mark.parametrize("delta", ["∞", "1e999", "NaN", "0", "-0,001"])
def test_impossible_interval_is_no_interval(delta: str, read_log: ReadLog) -> None:
    text = labview_lvm().data.decode().replace("Delta_X\t0,001000\t0,001000", f"Delta_X\t{delta}\t{delta}")
    with pytest.raises(Refusal, match="neither X values nor Delta_X"):
        read_log(text, "short.lvm")


@pytest.mark.parametrize("key", ["Delta_X\t0,001000\t0,001000", "X0\t"])
def test_channels_on_other_grids_without_times_are_refused(key: str, read_log: ReadLog) -> None:
    text = labview_lvm().data.decode()
    line = next(x for x in text.split("\n") if x.startswith(key))
    name, first, *_ = line.split("\t")
    with pytest.raises(Refusal, match=f"differ in {name.title()}"):
        read_log(text.replace(line, f"{name}\t{first}\t7,5\t"), "two.lvm")
