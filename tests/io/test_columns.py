"""Columns that stay on disk give what the same columns in memory do; where wanted whole, they say what they need."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.io import columns, memory, tables
from mrfit.io.columns import LazyArrays, chunks, extent, is_on_disk, laid_beside, part_of, span
from mrfit.io.tables import read_table, write_table

ROWS = 5000
VALUES = np.cumsum(np.random.default_rng(1).standard_normal(ROWS))


@pytest.fixture(scope="module")
def column(tmp_path_factory: pytest.TempPathFactory) -> Array:
    """A column of a table in row groups of 700."""
    folder = tmp_path_factory.mktemp("columns")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tables, "ROW_GROUP", 700)
        patch.setattr(columns, "LONG_SEGMENT", 1000)
        write_table(folder / "a.parquet", {"time": np.arange(ROWS) * 1.0, "x": VALUES})
        found, _ = read_table(folder / "a.parquet", ("time",), folder / "scratch")
    assert list(found) == ["x"] and is_on_disk(found["x"])
    return found["x"]


@settings(deadline=None)
@given(st.integers(-ROWS - 9, ROWS + 9), st.integers(-ROWS - 9, ROWS + 9), st.integers(1, 9))
def test_a_slice_is_that_of_the_column_in_memory(column: Array, begin: int, end: int, step: int) -> None:
    assert np.array_equal(column[begin:end:step], VALUES[begin:end:step])


@settings(deadline=None)
@given(st.integers(0, ROWS), st.integers(0, ROWS + 99), st.integers(0, 900))
def test_a_part_is_read_when_it_is_asked_for(column: Array, begin: int, end: int, more: int) -> None:
    part, whole = part_of(column, begin, end), VALUES[begin:end]
    assert is_on_disk(part) and len(part) == len(whole)
    assert np.array_equal(part[more:], whole[more:])
    assert np.array_equal(np.asarray(part), whole)


def test_numbers_of_it_are_those_of_the_whole(column: Array, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(columns, "COLUMN_CHUNK", 999)
    assert column[-1] == VALUES[-1] and column[3] == VALUES[3]
    assert np.array_equal(VALUES - column, np.zeros(ROWS)) and np.array_equal(column - VALUES, np.zeros(ROWS))
    assert np.array_equal(np.concatenate(list(chunks(column))), VALUES)
    assert extent(column) == (VALUES.min(), VALUES.max()) and span(column) == np.ptp(VALUES)
    assert [len(part) for part in chunks(VALUES)] == [ROWS]


def test_what_is_made_of_it_is_laid_beside_it(column: Array) -> None:
    made = laid_beside(column, 2.0 * VALUES)
    assert is_on_disk(made) and np.array_equal(made[10:20], 2.0 * VALUES[10:20])
    assert laid_beside(VALUES, made) is made
    several = LazyArrays([made, VALUES])
    assert np.array_equal(several[0], 2.0 * VALUES) and len(several[1:]) == 1


def test_a_table_written_anew_is_another_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(columns, "LONG_SEGMENT", 10)
    for factor in (1.0, 2.0):
        write_table(tmp_path / "a.parquet", {"x": factor * VALUES})
        found, _ = read_table(tmp_path / "a.parquet", (), tmp_path)
        assert np.array_equal(found["x"][:50], factor * VALUES[:50])


def test_what_is_wanted_whole_says_how_much_memory_it_needs(column: Array, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(columns, "LARGE", 1000)
    monkeypatch.setattr(memory, "free_memory", lambda: 1e5)
    with pytest.raises(DataError, match=r"5000 samples of x need about 0.0 GB of memory .* decimate = 2 or more"):
        np.mean(column)
    assert np.mean(column[:1000]) == np.mean(VALUES[:1000])


def test_what_needs_much_is_said_before_it_is_read_and_parts_of_it_are_not_said_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_table(tmp_path / "a.parquet", {"x": VALUES, "y": VALUES})
    told: list[str] = []
    memory.on_need(told.append)
    try:
        read_table(tmp_path / "a.parquet")
        assert told == []
        monkeypatch.setattr(memory, "TOLD_BYTES", memory.SAMPLE_COPIES * 8.0 * ROWS)
        monkeypatch.setattr(memory, "free_memory", lambda: 2e9)
        memory.check_room("all samples", 8e8 / memory.SAMPLE_COPIES)
        read_table(tmp_path / "a.parquet")
    finally:
        memory.on_need(None)
    assert told == ["all samples are held in memory: about 0.8 GB, 2.0 GB are free"]
