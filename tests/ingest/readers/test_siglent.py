import pytest

from tests.ingest.conftest import ReadLog
from tests.ingest.samples import siglent, table


@pytest.mark.parametrize("lead", ["", " "])
def test_short_header(lead: str, read_log: ReadLog) -> None:
    (record,) = read_log("Source,CH1,CH2\nSecond,Volt,Volt\n" + table(lead=lead))
    assert record.reader == "siglent"
    assert list(record.channels) == ["ch1", "ch2"]


def test_long_header_states_interval_and_length(read_log: ReadLog) -> None:
    (record,) = read_log(siglent().data.replace(b"Analog:240", b"Analog:500"))
    assert record.dt == 1e-3
    assert [f.kind for f in record.findings] == ["record-length"]
