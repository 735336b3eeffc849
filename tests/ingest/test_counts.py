"""Rows in are rows kept and rows refused, for every reader of text and any damage to rows."""

import re

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrfit.core import registry
from tests.ingest.samples import NO_LINES, ROWS, WRITERS
from tests.ingest.test_fuzz import read_damaged

TEXT_READERS = sorted(set(registry.names("reader")) - set(NO_LINES))
LINES = {
    name: re.sub("\r\r?\n|\r", "\n", WRITERS[name]().data.decode("utf-8-sig")).rstrip("\n").split("\n")
    for name in TEXT_READERS
}
HEADERS_AMID_ROWS = ("labview-lvm", "mts-mpt")
"""Here a repeated header begins a new run and is no row."""
SOUND = 30
"""First rows left alone: by them a reader sees how the log is laid out."""
DAMAGE = st.tuples(
    st.integers(SOUND, ROWS - 1),
    st.sampled_from(["lose", "twice", "cut", "prose", "overflow", "more", "blank line", "nan", "header"]),
    st.integers(0, 60),
)


def damaged(name: str, damage: list[tuple[int, str, int]]) -> list[str]:
    """The sample's lines after its first sound rows, with some of them damaged."""
    lines = list(LINES[name])
    first = len(lines) - ROWS
    for place, what, where in damage:
        if what == "header" and name in HEADERS_AMID_ROWS:
            continue
        line = lines[first + place]
        number = re.search(r"[\d.,eE+-]+\s*$", line)
        last = line[: number.start()] if number else line
        lines[first + place] = {
            "lose": "",
            "twice": f"{line}\n{line}",
            "cut": line[: where % max(len(line), 1)],
            "prose": "the pump was switched on",
            "overflow": f"{last}9.9e37",
            "more": f"{line};1,2\t3,4",
            "blank line": f"\n{line}",
            "nan": f"{last}NaN",
            "header": f"{lines[first - 1]}\n{line}",
        }[what]
    return "\n".join(lines).split("\n")


@pytest.mark.parametrize("name", TEXT_READERS)
@settings(max_examples=12, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
@given(damage=st.lists(DAMAGE, max_size=12), ends=st.sampled_from(["\n", "\r\n"]))
def test_rows_in_are_rows_kept_and_rows_refused(name: str, damage: list[tuple[int, str, int]], ends: str) -> None:
    lines = damaged(name, damage)
    first = len(LINES[name]) - ROWS
    there = sum(bool(line.strip()) for line in lines[first:])
    records = read_damaged(name, (ends.join(lines) + ends).encode())
    assert records
    assert sum(r.rows_kept + r.rows_refused for r in records) == there
