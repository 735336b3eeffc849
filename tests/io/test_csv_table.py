"""Tables hold every digit, and nothing where there is no number."""

import csv
import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.io.csv_table import csv_table


@given(st.lists(st.tuples(st.text('xyzµ ,"\n'), st.floats(allow_nan=False)), max_size=5))
def test_what_is_written_is_read_again(rows: list[tuple[str, float]]) -> None:
    text = csv_table(("name", "value"), [{"name": n, "value": np.float64(v), "more": 1} for n, v in rows])
    read = list(csv.DictReader(io.StringIO(text, newline="")))
    shown = [(f"'{n}" if n.startswith("\n") else n, v) for n, v in rows]
    assert [(r["name"], float(r["value"])) for r in read] == shown


@pytest.mark.parametrize(("begin", "shown"), [(c, f"'{c}") for c in "=+-@\n＝"] + [("\t", r"\t"), ("\r", r"\r")])
def test_no_text_is_a_formula_and_numbers_stay_numbers(begin: str, shown: str) -> None:
    text = f"{begin}HYPERLINK(1)"
    written = csv_table(("a", text), [{"a": text, text: 2}])
    assert list(csv.reader(io.StringIO(written, newline=""))) == [
        ["a", f"{shown}HYPERLINK(1)"],
        [f"{shown}HYPERLINK(1)", "2"],
    ]
    assert csv_table(("a", "b"), [{"a": -1.5, "b": "1-2=3"}]) == "a,b\n-1.5,1-2=3\n"


def test_no_number_is_an_empty_cell() -> None:
    assert csv_table(("a", "b", "c"), [{"a": None, "b": np.nan, "c": True}]) == "a,b,c\n,,True\n"
