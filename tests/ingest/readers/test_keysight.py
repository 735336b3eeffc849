import numpy as np

from tests.ingest.conftest import ReadLog
from tests.ingest.samples import keysight, signals


def test_gaps_in_channel_numbers_are_kept(read_log: ReadLog) -> None:
    (record,) = read_log(keysight().data)
    assert list(record.channels) == ["ch1", "ch4"]


def test_engineering_exponents_with_plus_signs(read_log: ReadLog) -> None:
    time, one, _ = signals()
    rows = "".join(f"{t * 1e3:+.4f}E-03,{v * 1e3:+.4f}E-03\n" for t, v in zip(time, one, strict=True))
    (record,) = read_log("x-axis,2\nsecond,Ampere\n" + rows)
    np.testing.assert_allclose(record.channels["current"], one, atol=1e-12)


def test_leading_rows_without_values_are_refused_and_counted(read_log: ReadLog) -> None:
    lines = keysight().data.split(b"\n")
    lines[2:12] = [line.split(b",")[0] + b",," for line in lines[2:12]]
    (record,) = read_log(b"\n".join(lines))
    assert (record.rows_kept, record.rows_refused) == (230, 10)
    assert record.start == -0.04
    assert "10 × empty value (first in line 3)" in record.findings[0].text
