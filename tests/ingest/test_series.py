"""A column on disk or computed gives, slice by slice and chunk by chunk, what the array would."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrfit.ingest import series

VALUES = st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=60).map(np.array)
usual = settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(series, "SERIES_CHUNK", 7)


def lazy(values: np.ndarray) -> series.Values:
    return series.mapped(lambda k: values[k.astype(int)], series.ordinals(len(values)))


def test_stored_numbers(tmp_path: Path) -> None:
    values = np.arange(20, dtype=np.int64) * 3
    (tmp_path / "n").write_bytes(values.tobytes())
    column = series.stored(tmp_path / "n", 20, np.int64)
    assert len(column) == 20 and column[-1] == 57 and column[3:6].tolist() == [9, 12, 15]
    assert column[::7].tolist() == [0, 21, 42] and column[5:2].tolist() == []
    with pytest.raises(IndexError):
        column[20]


@usual
@given(values=VALUES, step=st.integers(1, 9), level=st.floats(-1e3, 1e3))
def test_looks_at_a_whole_column(values: np.ndarray, step: int, level: float) -> None:
    column = lazy(values)
    assert series.extremes(column) == (values.min(), values.max())
    assert series.mean(column) == pytest.approx(values.mean(), abs=1e-9)
    assert series.thinned(column, step).tolist() == values[::step].tolist()
    assert series.places(lambda v: v > level, column).tolist() == np.flatnonzero(values > level).tolist()
    assert series.count(lambda v: v > level, column) == np.count_nonzero(values > level)
    steps = np.concatenate([s for _, s in series.steps(column)])
    assert steps.tolist() == np.diff(values).tolist()


@usual
@given(values=VALUES, data=st.data())
def test_rows_left_out(values: np.ndarray, data: st.DataObject) -> None:
    drop = np.array(sorted(data.draw(st.sets(st.integers(0, len(values) - 1)))), dtype=np.int64)
    begin, end = sorted(data.draw(st.tuples(*2 * [st.integers(0, len(values))])))
    kept, column = np.delete(values, drop), series.without(lazy(values), drop)
    assert len(column) == len(kept)
    assert column[begin:end].tolist() == kept[begin:end].tolist()
    stretch = series.part(column, slice(begin, end))
    assert stretch[:].tolist() == kept[begin:end].tolist()


@usual
@given(values=VALUES, data=st.data())
def test_places_and_values_between_them(values: np.ndarray, data: st.DataObject) -> None:
    rows = np.array(sorted(data.draw(st.sets(st.integers(1, len(values) - 1), max_size=4))), dtype=np.int64)
    left_out = np.array(data.draw(st.lists(st.integers(1, 4), min_size=len(rows), max_size=len(rows))), dtype=float)
    whole = np.arange(len(values), dtype=float)
    for row, number in zip(rows, left_out, strict=True):
        whole[row:] += number
    places = series.Places(len(values), rows, left_out)
    begin, end = sorted(data.draw(st.tuples(*2 * [st.integers(0, len(values))])))
    assert places[begin:end].tolist() == whole[begin:end].tolist()
    length = int(whole[-1]) + 1
    expected = np.interp(np.arange(length), whole, values)
    for position in (places, lazy(whole)):
        between = series.interpolated(position, lazy(values), length)  # type: ignore[arg-type]
        np.testing.assert_array_equal(np.concatenate([c for (c,) in series.chunks(between)]), expected)
