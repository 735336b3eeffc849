"""Rows in which numbers have labels or units, as ``pos_mm:1.2,load_N:300`` of a serial port, and ``1.2 mm;300 N``."""

import re
from collections import defaultdict
from collections.abc import Sequence

from mrfit.ingest.meaning import units
from mrfit.ingest.table import Source
from mrfit.ingest.text.body import NUMBER_ROW, split
from mrfit.ingest.text.head import Text
from mrfit.ingest.text.layout import SAMPLE_LINES
from mrfit.ingest.text.textlog import line_by_line
from mrfit.ingest.text.written_times import FIELD_BEGIN, FIELD_END

LABEL = re.compile(r"(?:^|(?<=[,;\t ]))([^\W\d][\w.\[\]()/]{0,39}) {0,2}[:=] {0,2}(?=[+-]?[.,]?\d)")
UNITED = re.compile(
    rf"({FIELD_BEGIN}[+-]?\d[\d.,]*(?:[eE][+-]?\d+)?) ?([^\W\d][^\s,;|\"]*|[°%µ][^\s,;|\"]*){FIELD_END}"
)
"""A number with its unit, in a field."""
MOST_ROWS = 0.9
"""Share of the sampled lines that have the same labels or units."""


def labels_of(lines: Sequence[str]) -> list[str]:
    """Return the labels that nearly all of the last lines have before their numbers, two at least; or none."""
    sample = [line for line in lines[-SAMPLE_LINES:] if line.strip()]
    found = [tuple(LABEL.findall(line)) for line in sample]
    labels = max(set(found), key=found.count) if found else ()
    is_common = len(labels) > 1 and found.count(labels) >= MOST_ROWS * len(found)
    return list(labels) if is_common and len(set(labels)) == len(labels) else []


def without_labels(source: Source, labels: Sequence[str], data: Text | None) -> tuple[Source, Text]:
    """Return a log, and its text, with numbers alone in the rows that have all labels in their order; others stay."""

    def plain(line: str) -> str:
        return LABEL.sub("", line) if LABEL.findall(line) == labels else line

    return line_by_line(source, plain, data)


def units_behind(lines: Sequence[str]) -> dict[int, str]:
    """Return the units that nearly all of the last lines have behind their numbers, by the place of the column."""
    sample = [line for line in lines[-SAMPLE_LINES:] if line.strip()]
    # lines of a header or a footer are none of the rows
    sample = [line for line in sample if NUMBER_ROW.match(line.encode())] or sample
    mark = next((m for m in "\t;|," if sum(m in line for line in sample) >= MOST_ROWS * len(sample)), "\t")
    found = defaultdict[tuple[int, str], list[str]](list)
    for line in sample:
        for place, cell in enumerate(split(line, mark)):
            if match := UNITED.fullmatch(cell):
                found[place, match[2]].append(match[1])
    # one text in all rows, as ``1A``, may be a name
    most = MOST_ROWS * len(sample)
    varied = [key for key, numbers in found.items() if len(numbers) >= most and len({*numbers}) > 1]
    return {place: unit for place, unit in varied if _is_measured(unit)}


def _is_measured(unit: str) -> bool:
    """Whether a text is a unit of a channel or of times."""
    return units.known(unit) and (units.compatible(unit, "s") or bool(units.channels_of(unit)))


def without_units(source: Source, found: Sequence[str], data: Text | None) -> tuple[Source, Text]:
    """Return a log, and its text, without these units behind the numbers of its rows."""

    def plain(line: str) -> str:
        return UNITED.sub(lambda m: m[1] if m[2] in found else m[0], line) if NUMBER_ROW.match(line.encode()) else line

    return line_by_line(source, plain, data)
