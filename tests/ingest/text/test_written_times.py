"""Times in forms that people and programs print give the clock that they were printed from."""

from datetime import datetime, timedelta

import numpy as np
import pytest

from mrfit.ingest.text.written_times import written_times
from tests.ingest.conftest import ReadLog

FORCE = np.round(800.0 * np.cos(0.05 * np.arange(300)), 1)
BEGIN = datetime(2026, 11, 28, 23, 59, 59, 500000)
FORMS = {
    "basic": "{t:%Y%m%dT%H%M%S}.{ms}",
    "basic, apart": "{t:%Y%m%d %H:%M:%S}.{ms}",
    "dashes": "{t:%Y-%m-%d_%H-%M-%S}.{ms}",
    "ctime": "{t:%a %b %d %H:%M:%S}.{ms} {t:%Y}",
    "month first": '"{t:%b %d, %Y %I:%M:%S}.{ms} {t:%p}"',
    "month first, no comma": "{t:%B %d %Y %H:%M:%S}.{ms}",
    "day first": "{t:%d %b %Y %H:%M:%S}.{ms}",
    "french": "{t:%d} nov. {t:%Y %H:%M:%S}.{ms}",
    "german": "{t:%d}. November {t:%Y %H:%M:%S}.{ms}",
    "chinese": "{t:%Y}年{t:%m}月{t:%d}日 {t:%H}时{t:%M}分{t:%S}.{ms}秒",
    "japanese": "{t:%Y}年{t:%m}月{t:%d}日 {t:%H}時{t:%M}分{t:%S}.{ms}秒",
    "letters": "{t:%H}h{t:%M}m{t:%S}.{ms}s",
    "day of the year": "{t:%j:%H:%M:%S}.{ms}",
    "year and day": "{t:%Y-%jT%H:%M:%S}.{ms}",
    "days": "{days} days {t:%H:%M:%S}.{ms}",
    "minutes": "{t:%M:%S}.{ms}",
    "brackets": "[{t:%H:%M:%S}.{ms}]",
    "an apostrophe": "'{t:%Y-%m-%d %H:%M:%S}.{ms}",
    "seconds": "{seconds:.3f} s",
    "sec": "{seconds:.3f} sec",
}


def _log(form: str, begin: datetime, delimiter: str, comma: bool) -> str:
    rows = []
    for k, force in enumerate(FORCE):
        now = begin + timedelta(milliseconds=5 * k)
        ms, days = f"{now.microsecond // 1000:03d}", (now.date() - begin.date()).days
        text = form.format(t=now, ms=ms, days=days, seconds=5e-3 * k)
        row = f"{text}{delimiter}{force}"
        rows.append(row.replace(f".{ms}", f",{ms}").replace(str(force), str(force).replace(".", ",")) if comma else row)
    return "\n".join([f"Time{delimiter}Force (N)", *rows, ""])


@pytest.mark.parametrize("name", FORMS)
def test_the_interval_and_every_row(name: str, read_log: ReadLog) -> None:
    # without hours the clock begins anew each hour
    begin = BEGIN - timedelta(minutes=20 if name == "minutes" else 0)
    (record,) = read_log(_log(FORMS[name], begin, ",", comma=False))
    assert (record.dt, record.samples) == (pytest.approx(5e-3, rel=1e-6), len(FORCE))
    np.testing.assert_allclose(record.channels["force"], FORCE)


@pytest.mark.parametrize("name", ["ctime", "day first", "letters", "minutes"])
def test_semicolons_and_decimal_commas(name: str, read_log: ReadLog) -> None:
    (record,) = read_log(_log(FORMS[name], BEGIN - timedelta(minutes=20), ";", comma=True))
    assert record.dt == pytest.approx(5e-3, rel=1e-6)
    np.testing.assert_allclose(record.channels["force"], FORCE)


@pytest.mark.parametrize(
    "text",
    [
        "0.002,1.5,3\n",
        "12:00:00.5,1\n",
        "2026-11-28T12:00:00.002Z,1.5\n",
        "sampling interval,0.002 s\n",
        "Runs 3 s long\n",
        "date 28.11.2026;12:00\n",
        "20261128,12.5\n",
        "run_2026-11-28_12-00-00.5,1\n",
    ],
)
def test_plain_times_and_statements_of_a_header_are_left(text: str) -> None:
    assert not list(written_times(text))


def test_a_stated_interval_keeps_its_unit(read_log: ReadLog) -> None:
    rows = "".join(f"{f}\n" for f in FORCE)
    (record,) = read_log(f"# sampling interval: 2 ms\n# 10 s of test\nForce (N)\n{rows}")
    assert record.dt == 2e-3


@pytest.mark.parametrize("form", ["PT{:.3f}S", "0h 1m {:.3f}s", "12:0:{:.3f}"])
def test_durations_and_clocks_without_zeros(form: str, read_log: ReadLog) -> None:
    rows = "".join(f"{form.format(3 + 2e-3 * k)},{k % 7}\n" for k in range(400))
    (record,) = read_log(f"Time,Force (N)\n{rows}")
    assert record.dt == pytest.approx(2e-3)
