import numpy as np
import pytest

from tests.ingest.conftest import ReadLog
from tests.ingest.samples import gwinstek, signals


def test_short_form_without_times(read_log: ReadLog) -> None:
    head, _, _ = gwinstek().data.decode().partition("Waveform Data,\r\n")
    rows = "".join(f"{v:.4e},\r\n" for v in signals()[1])
    (record,) = read_log(head + "Waveform Data,\r\n" + rows)
    assert record.dt == 1e-3
    np.testing.assert_allclose(record.channels["ch1"], signals()[1])


def test_current_probe(read_log: ReadLog) -> None:
    (record,) = read_log(gwinstek().data.replace(b"Vertical Units,V", b"Vertical Units,A"))
    assert record.units == {"current": "A"}


@pytest.mark.parametrize("length", [240, 25000])
def test_memory_length_is_checked(length: int, read_log: ReadLog) -> None:
    (record,) = read_log(gwinstek().data.replace(b"Memory Length,240", b"Memory Length,%d" % length))
    assert ("record-length" in {f.kind for f in record.findings}) == (length != 240)
