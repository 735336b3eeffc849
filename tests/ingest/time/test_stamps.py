"""Time stamps as laboratories print them, against the times they were printed from."""

from datetime import datetime, timedelta

import numpy as np
import pytest

from mrfit.ingest.time.stamps import instants
from tests.ingest.conftest import ReadLog

K = np.arange(400)
FORCE = np.round(800.0 * np.cos(0.05 * K), 1)
FORMATS = {
    "german": "%d.%m.%Y %H:%M:%S.{ms}",
    "german, comma": "%d.%m.%Y %H:%M:%S,{ms}",
    "short year": "%d.%m.%y %H:%M:%S.{ms}",
    "american": "%m/%d/%Y %I:%M:%S.{ms} %p",
    "american, small": "%m/%d/%Y %I:%M:%S.{ms}p",
    "british": "%d/%m/%Y %H:%M:%S.{ms}",
    "slashes": "%Y/%m/%d %H:%M:%S.{ms}",
    "points": "%Y.%m.%d %H:%M:%S:{ms}",
    "matlab": "%d-%b-%Y %H:%M:%S.{ms}",
    "month by name": "%d.%B.%Y %H:%M:%S.{ms}",
    "clock": "%I:%M:%S.{ms} %p",
}


@pytest.mark.parametrize(
    "begin", [datetime(2024, 3, 5, 10, 0), datetime(2024, 3, 5, 23, 59, 59), datetime(2024, 1, 31, 11, 59, 59)]
)
@pytest.mark.parametrize("name", FORMATS)
def test_stamps_give_the_interval(name: str, begin: datetime, read_log: ReadLog) -> None:
    whens = [begin + timedelta(milliseconds=5 * int(k)) for k in K]
    form = FORMATS[name]
    if name == "american, small":
        form = form.replace("p", " %p", 1)
    texts = [w.strftime(form.replace("{ms}", f"{w.microsecond // 1000:03d}")) for w in whens]
    delimiter = ";" if "comma" in name else ","
    rows = "".join(f"{t}{delimiter}{f}\n" for t, f in zip(texts, FORCE, strict=True))
    if delimiter == ";":
        rows = rows.replace(".", ",").replace("05,03,2024", "05.03.2024").replace("06,03,2024", "06.03.2024")
        rows = rows.replace("31,01,2024", "31.01.2024").replace("01,02,2024", "01.02.2024")
    (record,) = read_log(f"Zeit{delimiter}Kraft (N)\n{rows}")
    assert record.dt == pytest.approx(5e-3, rel=1e-6)
    np.testing.assert_allclose(record.channels["force"], FORCE)


def test_day_and_month_make_the_log_the_shorter_one() -> None:
    for texts in (["03/05/2024 23:59:59", "03/06/2024 00:00:00"], ["05/03/2024 23:59:59", "06/03/2024 00:00:00"]):
        one, two = instants(texts, {})
        assert (two - one) / np.timedelta64(1, "s") == 1.0


@pytest.mark.parametrize(
    ("name", "month"), [("Mär", 3), ("mai", 5), ("May", 5), ("OKT", 10), ("Dez", 12), ("September", 9)]
)
def test_months_by_name_are_english_or_german(name: str, month: int) -> None:
    (when,) = instants([f"28-{name}-2026 10:00:00.25"], {})
    assert when == np.datetime64(f"2026-{month:02d}-28T10:00:00.25")


def test_a_date_with_its_month_by_name_may_have_a_column_of_its_own(read_log: ReadLog) -> None:
    whens = [datetime(2026, 11, 28, 23, 59, 59) + timedelta(milliseconds=5 * int(k)) for k in K]
    rows = "".join(f"{w:%d-%b-%Y,%H:%M:%S.%f},{f}\n" for w, f in zip(whens, FORCE, strict=True))
    (record,) = read_log(f"Date,Time,Force (N)\n{rows}")
    assert record.dt == pytest.approx(5e-3, rel=1e-6)


def test_stamps_above_the_rows_are_none_of_them(read_log: ReadLog) -> None:
    """As programs write waveforms: the first instant and the interval of each stand above."""
    whens = [datetime(2026, 11, 28, 23, 59, 59) + timedelta(milliseconds=5 * int(k)) for k in K]
    head = "waveform\t[0]\t[1]\nt0\t28.11.2026 23:59:59.000\t28.11.2026 23:59:59.000\ndelta t\t0.005\t0.005\n\n"
    rows = "".join(f"{w:%d.%m.%Y %H:%M:%S.%f}\t{f}\t{-f}\n" for w, f in zip(whens, FORCE, strict=True))
    (record,) = read_log(f"{head}time\tForce (N)\tOther (N)\n{rows}")
    assert record.dt == pytest.approx(5e-3, rel=1e-6)
    np.testing.assert_allclose(record.channels["force"], FORCE)


def test_what_is_no_stamp_is_said() -> None:
    with pytest.raises(ValueError, match="5-Moon"):
        instants(["05-Mar-2024 10:00:00", "5-Moon-2024 10:00:00"], {})
    with pytest.raises(ValueError, match="yesterday"):
        instants(["05.03.2024 10:00:00", "yesterday"], {})
    with pytest.raises(ValueError, match="35.03"):
        instants(["35.03.2024 10:00:00"], {})
