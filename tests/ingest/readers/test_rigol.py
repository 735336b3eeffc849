import numpy as np
import pytest

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog
from tests.ingest.samples import ROWS, rigol, signals


def test_count_that_does_not_begin_at_zero(read_log: ReadLog) -> None:
    rows = "".join(f"{k},{k % 5}e-2,\r\n" for k in range(22, 300))
    (record,) = read_log("X,CH1,Start,Increment,\r\nSequence,Volt,-1.4e-03,2e-06\r\n" + rows)
    assert record.start == pytest.approx(-1.4e-3 + 22 * 2e-6)
    assert record.dt == 2e-6


@pytest.mark.parametrize("head", ["X,CH1,CH2,\nSecond,Volt,Volt,\n", ",CH1,CH2\nSecond,Volt,Volt\n"])
@pytest.mark.parametrize("tail", [",", ", ", ""])
def test_headers_with_a_time_column(head: str, tail: str, read_log: ReadLog) -> None:
    time, one, two = signals()
    rows = "".join(f"{t:.5e},{a:.4e},{b:.4e}{tail}\n" for t, a, b in zip(time, one, two, strict=True))
    (record,) = read_log(head + rows)
    assert record.reader == "rigol"
    assert record.dt == pytest.approx(1e-3)
    np.testing.assert_array_equal(record.channels["ch2"], two)


def test_export_of_the_pc_software(read_log: ReadLog) -> None:
    head = f'"Number of Data points =",{ROWS},\n"Sampling Frequency (Hz)=",1000,\n"Channel Data","CH 1","CH 2"\n'
    head += '"Inverted = ","NO","NO"\n"Time (s)","Voltage (V)","Voltage (V)"\n'
    time, one, two = signals()
    rows = "".join(f"{t:g},{a:g},{b:g}\n" for t, a, b in zip(time, one, two, strict=True))
    (record,) = read_log(head + rows + ",,\n")
    assert list(record.channels) == ["ch1", "ch2"]
    assert (record.rows_kept, record.rows_refused) == (ROWS, 1)


def test_lost_row_leaves_a_hole_that_is_filled_and_said(read_log: ReadLog) -> None:
    lines = rigol().data.split(b"\r\n")
    del lines[100]
    (record,) = read_log(b"\r\n".join(lines))
    assert record.samples == ROWS
    assert record.rows_kept == ROWS - 1
    assert "dropped-samples" in {f.kind for f in record.findings}


def test_header_without_increment_is_refused(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="no start and increment"):
        read_log(rigol().data.replace(b"-5.000000e-02,1.000000e-03", b""))
