import pytest

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog
from tests.ingest.samples import tektronix_mso


def test_peak_detect_envelope_is_no_channel(read_log: ReadLog) -> None:
    (record,) = read_log(tektronix_mso().data.replace(b"CH1,CH2", b"CH1,CH1 Peak Detect"))
    assert set(record.channels) == {"ch1"}
    assert "left out the peak-detect envelope" in record.history


def test_labels_and_units_per_channel(read_log: ReadLog) -> None:
    data = tektronix_mso().data.replace(b"Label,,", b"Label,coil current,coil voltage")
    (record,) = read_log(data.replace(b"Vertical Units,V,", b"Vertical Units,A,V"))
    assert record.units == {"current": "A", "voltage": "V"}


def test_printed_times_do_not_override_the_sample_interval(read_log: ReadLog) -> None:
    rows = "".join(f"{k * 1.6e-6:.5f},{k % 7}\n" for k in range(4000))
    head = "Model,MSO2014\nHorizontal Units,S,\nSample Interval,1.6e-06,\nVertical Units,V,\nTIME,CH1\n"
    (record,) = read_log(head + rows)
    assert record.dt == 1.6e-6
    assert record.samples == 4000


def test_wrong_record_length_is_said(read_log: ReadLog) -> None:
    (record,) = read_log(tektronix_mso().data.replace(b"Record Length,240", b"Record Length,241"))
    assert [f.kind for f in record.findings] == ["record-length"]


def test_rows_that_do_not_fit_the_header_are_refused(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="the header names 3 columns but line 11 has 6"):
        read_log(b"".join(_comma(line) for line in tektronix_mso().data.splitlines(keepends=True)))


def _comma(line: bytes) -> bytes:
    return line.replace(b".", b",") if line[:1] in b"-0" else line
