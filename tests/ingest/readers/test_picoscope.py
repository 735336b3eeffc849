import numpy as np
import pytest

from tests.ingest.conftest import ReadLog
from tests.ingest.samples import signals


@pytest.mark.parametrize(("delimiter", "decimal"), [(",", "."), ("\t", "."), (";", ","), ("\t", ",")])
def test_delimiters_and_decimal_marks(delimiter: str, decimal: str, read_log: ReadLog) -> None:
    time, one, _ = signals()
    rows = [f"{t * 1e6:.1f}{delimiter}{v * 1e3:.1f}".replace(".", decimal) for t, v in zip(time, one, strict=True)]
    head = f"Frequenz{delimiter}Kanal A\r\n(µs){delimiter}(mV)\r\n\r\n"
    (record,) = read_log((head + "\r\n".join(rows) + "\r\n").encode())
    assert record.reader == "picoscope"
    assert record.dt == 1e-3
    np.testing.assert_allclose(record.channels["kanal_a"], one, rtol=1e-12)


def test_over_range_marks_are_overflow(read_log: ReadLog) -> None:
    rows = "".join(f"{k},{'∞' if k == 40 else k}\n" for k in range(100))
    (record,) = read_log("Time,Channel A\n(ms),(A)\n\n" + rows)
    assert record.rows_refused == 1
    assert "1 × overflow (first in line 44)" in record.findings[0].text
