"""Columns hold what was put in, and making them does not import pandas."""

import subprocess
import sys

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.io.arrow import ARROW_PART, codes, floats, numbers, repeated, table, texts


@given(st.lists(st.text()))
def test_texts_are_those_put_in(values: list[str]) -> None:
    column = texts(values)
    column.validate(full=True)
    assert column.to_pylist() == values


@pytest.mark.parametrize("count", [0, 1, ARROW_PART - 1, ARROW_PART, 2 * ARROW_PART + 3])
def test_a_text_is_there_as_often_as_asked_for(count: int) -> None:
    column = repeated("sine-5Hz-1A µ", count)
    column.validate(full=True)
    assert len(column) == count
    assert set(column.to_pylist()) <= {"sine-5Hz-1A µ"}


@settings(deadline=None)
@given(st.lists(st.floats(allow_nan=False)), st.lists(st.integers(-(2**63), 2**63 - 1), min_size=1))
def test_numbers_keep_their_type(fractions: list[float], whole: list[int]) -> None:
    assert numbers(fractions).equals(pa.array(fractions, pa.float64()))
    assert numbers(whole).equals(pa.array(whole, pa.int64()))
    assert numbers(np.array([1.0, np.nan, 2.0])[::2]).equals(pa.array([1.0, 2.0]))


@given(st.lists(st.sampled_from("abc")), st.integers(0, 3))
def test_codes_are_places_in_the_dictionary(values: list[str], first: int) -> None:
    words = pa.array(values, pa.string()).dictionary_encode()[first:]
    assert [words.dictionary[k].as_py() for k in codes(words).tolist()] == values[first:]


def test_pandas_is_not_imported() -> None:
    program = (
        "import sys; from mrfit.io.arrow import numbers, repeated, table, texts;"
        "table({'a': numbers([1.0]), 'b': texts(['x']), 'c': repeated('x', 1)}); sys.exit('pandas' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_a_table_has_the_columns_by_name() -> None:
    assert table({"a": numbers([1.5, 2.5]), "b": texts(["x", "y"])}).to_pylist() == [
        {"a": 1.5, "b": "x"},
        {"a": 2.5, "b": "y"},
    ]


@given(st.lists(st.lists(st.none() | st.floats(allow_nan=False), max_size=5), max_size=3))
def test_floats_are_read_as_they_are_and_null_as_nan(chunks: list[list[float | None]]) -> None:
    column = pa.chunked_array([pa.array([0.0, *chunk], pa.float64())[1:] for chunk in chunks], pa.float64())
    expected = [np.nan if value is None else value for chunk in chunks for value in chunk]
    assert np.array_equal(floats(column), np.array(expected, dtype=np.float64), equal_nan=True)
