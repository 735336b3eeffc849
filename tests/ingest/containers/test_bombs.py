"""Files of a few kilobytes that unpack to much, and have no sample rate, are refused before they are unpacked."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.io import savemat

from mrfit.core import registry
from mrfit.ingest.containers.arrays import Arrays, check_times
from mrfit.ingest.meaning.channel_map import Rules, TimeRule
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Source
from mrfit.ingest.text.head import Head, open_head

ROWS = 1_200_000


def _hdf(path: Path, **columns: Any) -> None:
    with h5py.File(path, "w") as file:
        for name, values in columns.items():
            file.create_dataset(name, data=values, compression="gzip")


def _matlab73(path: Path, **columns: Any) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in columns.items():
            file.create_dataset(name, data=np.atleast_2d(values), compression="gzip")
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as handle:
        handle.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def _matlab5(path: Path, **columns: Any) -> None:
    savemat(path, columns, do_compression=True)


def _parquet(path: Path, **columns: Any) -> None:
    pq.write_table(pa.table(columns), path)


WRITERS: dict[str, tuple[str, Callable[..., None]]] = {
    "run.h5": ("hdf5", _hdf),
    "run73.mat": ("matlab", _matlab73),
    "run5.mat": ("matlab", _matlab5),
    "run.parquet": ("parquet", _parquet),
}


@pytest.fixture
def unpacked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the names of the arrays that were unpacked, or of the batches."""
    names: list[str] = []
    add = Arrays.add
    monkeypatch.setattr(Arrays, "add", lambda self, name, *more: (names.append(name), add(self, name, *more))[1])
    batches = pq.ParquetFile.iter_batches
    monkeypatch.setattr(
        pq.ParquetFile, "iter_batches", lambda self, *a, **k: (names.append("batch"), batches(self, *a, **k))[1]
    )
    return names


@pytest.mark.parametrize("name", WRITERS)
def test_no_number_is_unpacked_for_nothing(name: str, tmp_path: Path, unpacked: list[str]) -> None:
    reader, write = WRITERS[name]
    path = tmp_path / name
    write(path, force=np.zeros(ROWS), position=np.zeros(ROWS))
    module = registry.load("reader", reader)
    with pytest.raises(Refusal, match=r"no time column and no sample rate \(columns: 'force', 'position'\).*rate = HZ"):
        module.read(Source(open_head(path), Rules()))
    assert unpacked == []


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("way", ["map", "map of times", "time", "short"])
def test_others_are_read(way: str, name: str, tmp_path: Path, unpacked: list[str]) -> None:
    reader, write = WRITERS[name]
    rows = 100 if way == "short" else ROWS
    columns = {"time": np.arange(rows) * 1e-3} if way == "time" else {}
    write(tmp_path / name, force=np.ones(rows), count=np.arange(rows) * 1e-3, **columns)
    rules = {"map": Rules(dt=1e-3), "map of times": Rules(time=TimeRule(column="count"))}.get(way, Rules())
    (table,) = registry.load("reader", reader).read(Source(open_head(tmp_path / name), rules))
    assert table.rows == rows and unpacked


@pytest.mark.parametrize("name", ["time_force", "Time2", "rig.time", "epoch", "Zeit (ms)", "fs"])
def test_names_that_may_be_times_or_rates_are_looked_into(name: str) -> None:
    check_times(_source(), [("force", "N"), (name, "")], [], 1e9)
    check_times(_source(), [("force", "N"), ("clocked", "s")], [], 1e9)
    check_times(_source(), [("force", "N")], ["Sample_Rate"], 1e9)
    check_times(_source(), [("force", "N")], [], 1e3)


@pytest.mark.parametrize("name", ["position", "timer_setting", "rated"])
def test_names_that_are_neither_times_nor_rates_are_refused(name: str) -> None:
    with pytest.raises(Refusal, match="no time column and no sample rate"):
        check_times(_source(), [("force", "N"), (name, "mm")], ["units"], 1e9)
    with pytest.raises(Refusal, match="no time column and no sample rate"):
        check_times(_source(), [(name, "")], [], 1e9)


def _source() -> Source:
    return Source(Head(Path("run.h5"), 0, b"", "", ()), Rules())
