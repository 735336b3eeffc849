"""Tables of samples come back to the last bit, group by group, and a damaged one is named."""

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from mrfit.errors import DataError
from mrfit.io import tables
from mrfit.io.dataset import Dataset, content
from mrfit.io.residuals import read_residuals
from mrfit.io.tables import read_table, write_table
from mrfit.io.workspace import Workspace
from tests.io.test_outdated import SEGMENT, log


def test_columns_come_back_with_their_metadata_and_some_may_be_left_out(tmp_path: Path) -> None:
    path, rng = tmp_path / "a.parquet", np.random.default_rng(0)
    columns = {"time": np.arange(1000.0), "force": rng.standard_normal(1000), "nan": np.full(1000, np.nan)}
    write_table(path, columns, {"mrfit": "text"})
    found, metadata = read_table(path)
    assert list(found) == list(columns) and metadata["mrfit"] == "text"
    assert all(np.array_equal(found[n], values, equal_nan=True) for n, values in columns.items())
    assert list(read_table(path, ("time", "nan"))[0]) == ["force"]


@pytest.mark.parametrize("group", [1, 7, 100, 1000])
def test_the_size_of_a_row_group_changes_nothing(group: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, values = tmp_path / "a.parquet", np.random.default_rng(1).standard_normal(100)
    monkeypatch.setattr(tables, "ROW_GROUP", group)
    write_table(path, {"a": values, "b": -values})
    found, _ = read_table(path)
    assert np.array_equal(found["a"], values) and np.array_equal(found["b"], -values)


def test_more_metadata_is_made_of_the_hashes_of_the_columns(tmp_path: Path) -> None:
    values = np.arange(5.0)
    write_table(tmp_path / "a", {"a": values}, more=lambda hashes: {"hash": hashes["a"]})
    assert read_table(tmp_path / "a")[1]["hash"] == hashlib.sha256(values.data).hexdigest()


@pytest.mark.parametrize("damage", [b"", b"PAR1", b"no table at all"])
def test_a_damaged_or_missing_table_is_named(damage: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    with pytest.raises(DataError, match="a.parquet: missing "):
        read_table(path)
    path.write_bytes(damage)
    with pytest.raises(DataError, match="a.parquet: damaged, or another"):
        read_table(path)


def residuals(path: Path, words: list[tuple[str, str, str]], groups: int) -> None:
    columns = {name: [w[k] for w in words] for k, name in enumerate(("condition", "segment", "role"))}
    numbers = {"measured": np.arange(float(len(words))), "simulated": -np.arange(float(len(words)))}
    pq.write_table(pa.table({**columns, **numbers}), path, row_group_size=groups)


@pytest.mark.parametrize("groups", [2, 3, 100])
def test_rows_of_residuals_that_stand_together_come_together(groups: int, tmp_path: Path) -> None:
    a, b = ("sine", "log#0", "train"), ("sine", "log#1", "holdout")
    residuals(tmp_path / "r", [a, a, a, b, b, a], groups)
    found = list(read_residuals(tmp_path / "r"))
    joined = {key: np.concatenate([c["measured"] for k, c in found if k == key]).tolist() for key in (a, b)}
    assert joined == {a: [0.0, 1.0, 2.0, 5.0], b: [3.0, 4.0]}
    assert all(np.array_equal(c["simulated"], -c["measured"]) for _, c in found)


def test_residuals_that_cannot_be_read_lead_to_a_new_fit(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="run `mrfit fit` again"):
        list(read_residuals(tmp_path / "missing"))
    pq.write_table(pa.table({"measured": [1.0]}), tmp_path / "r")
    with pytest.raises(DataError, match="cannot be read"):
        list(read_residuals(tmp_path / "r"))


def test_data_in_memory_have_the_hashes_of_the_same_data_on_disk(tmp_path: Path) -> None:
    workspace, recording = Workspace(tmp_path), log("log")
    workspace.write_recording(recording)
    data = Dataset([SEGMENT], {"log": recording, "unused": log("unused")})
    assert data.made_from()[0] == {"log": workspace.content("log")} == {"log": content(recording)}
    assert content(log("log", scale=1.0 + 1e-15)) != content(recording)


def test_a_number_of_numpy_in_a_segment_is_the_plain_one() -> None:
    odd = replace(SEGMENT, start=np.int64(0), frequency=np.float64(5.0))
    (plain,) = Dataset([odd], {"log": log("log")}).made_from()[1]
    assert type(plain.start) is int and type(plain.frequency) is float and repr(plain) == repr(SEGMENT)
