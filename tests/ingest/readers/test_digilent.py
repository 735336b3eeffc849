import pytest

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog
from tests.ingest.samples import digilent


def test_rate_comes_from_the_settings(read_log: ReadLog) -> None:
    (record,) = read_log(digilent().data)
    assert record.dt == 1e-3


def test_false_rate_is_said(read_log: ReadLog) -> None:
    (record,) = read_log(digilent().data.replace(b"1000Hz", b"1500Hz"))
    assert record.dt == 1e-3
    assert [f.kind for f in record.findings] == ["rate-differs"]


def test_settings_without_a_name_row_are_refused(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="no 'Time"):
        read_log(digilent().data.replace(b"Time (s),Channel 1 (V),Channel 2 (V)\n", b""))
