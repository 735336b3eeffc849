"""Columns of times without a unit, or since a date, as text and as arrays: the interval they were made with."""

import io

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog

K = np.arange(400)
FORCE = np.round(800.0 * np.cos(0.05 * K), 1)
NOW = 1709632800.0
"""5 March 2024, 10:00, in s since 1970."""


def _log(head: str, times: list[str]) -> str:
    return f"{head},Force (N)\n" + "".join(f"{t},{f}\n" for t, f in zip(times, FORCE, strict=True))


@pytest.mark.parametrize("dt", [2e-3, 1e-2, 1.0])
@pytest.mark.parametrize(
    ("name", "scale", "digits"),
    [
        ("Time", 1.0, 4),
        ("Timestamp", 1e3, 0),
        ("t", 1e6, 0),
        ("time", 1e9, 0),
        ("Epoch", 1e3, 1),
        ("unix_time", 1.0, 3),
    ],
)
def test_counts_since_1970(name: str, scale: float, digits: int, dt: float, read_log: ReadLog) -> None:
    (record,) = read_log(_log(name, [f"{(NOW + dt * k) * scale:.{digits}f}" for k in K]))
    assert record.dt == pytest.approx(dt, rel=1e-6)
    np.testing.assert_allclose(record.channels["force"], FORCE)
    assert "unit-assumed" in {f.kind for f in record.findings}


@pytest.mark.parametrize(("day", "name"), [(45356.4166667, "Time"), (45356.0, "Date"), (739316.25, "datenum")])
@pytest.mark.parametrize("dt", [2e-3, 1e-2, 1.0])
def test_numbers_of_days(day: float, name: str, dt: float, read_log: ReadLog) -> None:
    (record,) = read_log(_log(name, [f"{day + dt * k / 86400:.11f}" for k in K]))
    assert record.dt == pytest.approx(dt, rel=1e-3 if dt < 0.1 else 1e-5)
    np.testing.assert_allclose(record.channels["force"], FORCE)
    assert any("count" in f.text and "taken as d" in f.text for f in record.findings)


@pytest.mark.parametrize("name", ["Time (ms since epoch)", "Time (us since 1970-01-01)", "Timestamp (s since 1970)"])
def test_units_since_a_date_in_a_header(name: str, read_log: ReadLog) -> None:
    scale = {"ms": 1e3, "us": 1e6, "s ": 1.0}[name.partition("(")[2][:2]]
    (record,) = read_log(_log(name, [f"{(NOW + 2e-3 * k) * scale:.3f}" for k in K]))
    assert record.dt == pytest.approx(2e-3, rel=1e-6)


@pytest.mark.parametrize("begin", [0.0, 300.0, 36000.0, 45000.0, 86000.0])
@pytest.mark.parametrize("dt", [1e-5, 1e-3, 0.5])
def test_seconds_stay_seconds(begin: float, dt: float, read_log: ReadLog) -> None:
    (record,) = read_log(_log("Time", [f"{begin + dt * k:.6f}" for k in K]))
    assert (record.dt, record.start) == (pytest.approx(dt), pytest.approx(begin))


def test_a_unit_that_leads_far_from_now_asks(read_log: ReadLog) -> None:
    text = _log("Time (s)", [f"{(NOW + 2e-3 * k) * 1e3:.0f}" for k in K])
    with pytest.raises(Refusal, match=r"in 's' begin \d+ years from 1970.*channel map"):
        read_log(text)
    (record,) = read_log(text, channel_map='time = {column = "Time", unit = "ms"}\n')
    assert record.dt == pytest.approx(2e-3)


@pytest.mark.parametrize("scale", [1.0, 1e3, 1e6, 1e9])
def test_counts_since_1970_as_whole_numbers_of_hdf5(scale: float, read_log: ReadLog) -> None:
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file["time"] = (NOW * scale + np.round(K * (2e-3 if scale > 1.0 else 1.0) * scale)).astype(np.int64)
        file["force"] = FORCE
    (record,) = read_log(buffer.getvalue(), "run.h5")
    assert record.dt == pytest.approx(2e-3 if scale > 1.0 else 1.0, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "scale"), [("epoch_us", 1e6), ("epoch_ms", 1e3), ("timestamp_ns", 1e9), ("unix_ms", 1e3)]
)
def test_names_that_give_the_unit_of_a_count_since_1970(name: str, scale: float, read_log: ReadLog) -> None:
    times = [int(NOW) * int(scale) + round(2e-3 * scale) * int(k) for k in K]
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file[name], file["force (N)"] = np.array(times), FORCE
    table = io.BytesIO()
    pq.write_table(pa.table({name: times, "force (N)": FORCE}), table)
    logs = {
        "run.csv": _log(name, [str(t) for t in times]),
        "run.h5": buffer.getvalue(),
        "run.parquet": table.getvalue(),
    }
    for file_name, content in logs.items():
        (record,) = read_log(content, file_name)
        assert record.dt == pytest.approx(2e-3, rel=1e-6)
        np.testing.assert_allclose(record.channels["force"], FORCE)


@pytest.mark.parametrize(("name", "begin"), [("Ticks", 638_999_999_990_000_000), ("FILETIME", 134_000_000_000_000_000)])
def test_counts_of_100_ns_are_times_whatever_they_are_called(name: str, begin: int, read_log: ReadLog) -> None:
    (record,) = read_log(_log(name, [str(begin + 20000 * int(k)) for k in K]))
    assert record.dt == pytest.approx(2e-3, rel=1e-6)
    assert any("windows_tick since" in f.text for f in record.findings if f.kind == "unit-assumed")
    with pytest.raises(Refusal, match="no time column"):
        read_log(_log(name, [str(20000 * int(k)) for k in K]))
