"""Long arrays lie on the disk while a log is read, and it gives what it gives when they are held in memory."""

import os
import pickle
import shutil
import tempfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as how
from hypothesis import strategies as st
from scipy.io import savemat

from mrfit.errors import DataError
from mrfit.ingest import series
from mrfit.ingest.containers import shelf, subprocess_reader
from mrfit.ingest.containers.arrays import Arrays, FileArray
from mrfit.ingest.containers.shelf import Shelf, check_disk
from mrfit.ingest.hashes import BLOCKS_IN_MEMORY
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.stage import Settings, preview, run
from mrfit.io.workspace import Workspace
from tests.ingest.binary_mutants import SAMPLES
from tests.ingest.samples import seven_three, signals

WHOLE = 1 << 30
NAMES = sorted(n for n in SAMPLES if "parquet" not in n and n != "json-log")
"""Those whose arrays are shelved; JSON comes in one piece."""


def ingested(path: Path, block: int) -> dict[str, bytes]:
    """Every file of the workspace after one ingest, and how many arrays lay on the disk meanwhile."""
    work = path.parent / "work"
    shutil.rmtree(work, ignore_errors=True)
    run([path], Settings(jobs=1, block=block), Workspace(work))
    return {str(p.relative_to(work)): p.read_bytes() for p in sorted(work.rglob("*")) if p.is_file()}


@pytest.fixture
def shelved(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Read in this process, and note the length of every array put on the disk."""
    lengths: list[int] = []
    put = Shelf.put

    def noting(self: Shelf, array: Any, length: int, width: int) -> Any:
        lengths.append(length)
        return put(self, array, length, width)

    monkeypatch.setattr(Shelf, "put", noting)
    monkeypatch.setattr("mrfit.ingest.reading.read_in_subprocess", subprocess_reader.read_tables)
    return lengths


@pytest.mark.parametrize("chunk", [37, 1 << 20])
@pytest.mark.parametrize("name", NAMES)
def test_on_the_disk_as_in_memory(
    name: str, chunk: int, tmp_path: Path, shelved: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = SAMPLES[name]().write(tmp_path)
    monkeypatch.setattr(series, "SERIES_CHUNK", chunk)
    whole = ingested(path, WHOLE)
    assert not shelved
    assert ingested(path, 1000 // BLOCKS_IN_MEMORY) == whole
    # an array in a struct, or in a table of columns, comes in one piece
    assert shelved


@pytest.mark.parametrize("seven", [False, True])
def test_matrices_long_and_short_variables_and_their_order(seven: bool, tmp_path: Path, shelved: list[int]) -> None:
    time, one, two = signals()
    variables = {"gain": np.arange(3.0), "x": np.column_stack([one, two]), "time": time, "text": "a", "row": two[None]}
    path = tmp_path / "run.mat"
    if seven:
        numeric = {k: np.atleast_2d(v).T for k, v in variables.items() if not isinstance(v, str)}
        path.write_bytes(seven_three(lambda file: [file.create_dataset(k, data=v) for k, v in numeric.items()]))
    else:
        savemat(path, variables)
    whole = ingested(path, WHOLE)
    assert not shelved
    assert ingested(path, 1000 // BLOCKS_IN_MEMORY) == whole
    assert shelved == [len(time)] * 3


def test_a_preview_takes_no_more_memory_and_leaves_nothing(
    tmp_path: Path, shelved: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    path = SAMPLES["hdf5"]().write(tmp_path)
    (row,) = preview([path], Settings(block=1000 // BLOCKS_IN_MEMORY))
    assert row.rows == 240 and shelved
    assert not list((tmp_path / "temporary").iterdir())


def test_the_worker_leaves_its_arrays_to_the_command(tmp_path: Path) -> None:
    path = SAMPLES["hdf5"]().write(tmp_path)
    whole = ingested(path, WHOLE)
    assert ingested(path, 1000 // BLOCKS_IN_MEMORY) == whole
    assert not list(tmp_path.rglob(".ingest-*"))


@how(max_examples=60, deadline=None)
@given(
    rows=st.integers(1, 40), width=st.integers(1, 5), flat=st.booleans(), turned=st.booleans(), chunk=st.integers(1, 50)
)
def test_a_packed_array_is_taken_as_the_array_itself(
    rows: int, width: int, flat: bool, turned: bool, chunk: int, tmp_path_factory: pytest.TempPathFactory
) -> None:
    values = np.arange(rows * width, dtype=np.int32).reshape(-1 if flat else (rows, width))
    if values.size == 1:
        return
    folder = tmp_path_factory.mktemp("shelf")
    with h5py.File(folder / "a.h5", "w") as file, pytest.MonkeyPatch.context() as patch:
        patch.setattr(series, "SERIES_CHUNK", chunk)
        packed = FileArray(file.create_dataset("x", data=values), values.shape)
        on_disk, in_memory, unpacked = Arrays(shelf=Shelf(folder / "s", 0)), Arrays(), Arrays()
        on_disk.add("x", packed.T if turned else packed, "mm")
        unpacked.add("x", packed.T if turned else packed, "mm")
        in_memory.add("x", values.T if turned else values, "mm")
        assert list(on_disk.signals) == list(in_memory.signals) == list(unpacked.signals)
        assert on_disk.units == in_memory.units
        for name, signal in in_memory.signals.items():
            np.testing.assert_array_equal(on_disk.signals[name][:], signal)
            np.testing.assert_array_equal(unpacked.signals[name], signal)


def test_columns_on_the_disk_and_counted_ones_can_be_sent(tmp_path: Path) -> None:
    kept = Shelf(tmp_path, 0).kept(np.arange(9.0))
    assert isinstance(kept, series.StoredSeries) and len(pickle.dumps(kept)) < 1000
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(kept))[2:5], [2.0, 3.0, 4.0])
    assert list(pickle.loads(pickle.dumps(series.counted(5, False)))[1:3]) == [2, 3]
    assert isinstance(Shelf(tmp_path, 72).kept(np.arange(9.0)), np.ndarray)


def test_a_disk_without_room_is_said_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shelf.shutil, "disk_usage", lambda _: SimpleNamespace(free=8e6))
    with pytest.raises(Refusal, match="its 5.1e.05 numbers take 4.08 MB of disk .* and 8 MB are free; choose another"):
        check_disk(Path("a.h5"), 510_000, tmp_path / "not" / "made")
    check_disk(Path("a.h5"), 490_000, tmp_path)


def test_a_full_disk_names_the_folder(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("")
    with pytest.raises(DataError, match="taken: cannot write"):
        Shelf(tmp_path / "taken", 0).put(np.zeros((3, 1)), 3, 1)


def test_long_tables_ask_for_room_on_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = SAMPLES["parquet"]().write(tmp_path)
    monkeypatch.setattr(shelf.shutil, "disk_usage", lambda _: SimpleNamespace(free=9e3))
    with pytest.raises(DataError, match="of disk while they are read"):
        run([path], Settings(block=100), Workspace(tmp_path / "w"))
    assert not os.path.exists(tmp_path / "w")
