"""Tables hold every digit, and nothing where there is no number."""

import csv
import io

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mrfit.csv_table import csv_table


@given(st.lists(st.tuples(st.text('xyzµ ,"\n'), st.floats(allow_nan=False)), max_size=5))
def test_what_is_written_is_read_again(rows: list[tuple[str, float]]) -> None:
    text = csv_table(("name", "value"), [{"name": n, "value": np.float64(v), "more": 1} for n, v in rows])
    read = list(csv.DictReader(io.StringIO(text, newline="")))
    assert [(r["name"], float(r["value"])) for r in read] == rows


def test_no_number_is_an_empty_cell() -> None:
    assert csv_table(("a", "b", "c"), [{"a": None, "b": np.nan, "c": True}]) == "a,b,c\n,,True\n"
