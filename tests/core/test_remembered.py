"""Results remembered by the content of an array, against the function itself."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.core.remembered import MOST_REMEMBERED, remembered
from mrfit.core.specs import Array


@given(st.lists(st.floats(-1e6, 1e6), max_size=30), st.floats(-3.0, 3.0), st.booleans())
def test_what_is_remembered_is_what_the_function_returns(values: list[float], factor: float, ends: bool) -> None:
    def scaled(array: Array, by: float, last: bool = False) -> list[float]:
        return [*(by * array).tolist(), by] if last else (by * array).tolist()

    array, kept = np.array(values), remembered(scaled)
    for _ in range(2):
        assert kept(array, factor, last=ends) == scaled(array, factor, last=ends)


@pytest.mark.parametrize(("samples", "calls"), [(MOST_REMEMBERED, 1), (MOST_REMEMBERED + 1, 3)])
def test_only_results_of_short_arrays_are_remembered_and_by_content(samples: int, calls: int) -> None:
    seen = []

    @remembered
    def total(array: Array) -> float:
        seen.append(len(array))
        return float(array.sum())

    values = np.arange(samples, dtype=np.float64)
    assert total(values) == total(values.copy()) == total(values)
    assert len(seen) == calls
    changed = values.copy()
    changed[-1] += 1.0
    assert total(changed) == total(values) + 1.0


def test_more_is_remembered_where_a_function_asks_for_it() -> None:
    seen = []

    def total(array: Array) -> float:
        seen.append(len(array))
        return float(array.sum())

    kept, values = remembered(total, longest=MOST_REMEMBERED + 1), np.ones(MOST_REMEMBERED + 1)
    assert kept(values) == kept(values.copy()) == len(values)
    assert len(seen) == 1


def test_a_result_that_holds_its_array_stays_what_it_was_where_the_caller_writes_into_his() -> None:
    kept, values = remembered(lambda array: array[1:]), np.arange(5.0)
    kept(values)
    values *= 0.0
    assert kept(np.arange(5.0)).tolist() == [1.0, 2.0, 3.0, 4.0]
