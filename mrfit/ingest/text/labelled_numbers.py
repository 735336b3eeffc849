"""Rows in which every number has a label before it, as ``pos_mm:1.2,load_N:300`` of a microcontroller's serial port."""

import re
from collections.abc import Sequence

from mrfit.ingest.table import Source
from mrfit.ingest.text.head import Text
from mrfit.ingest.text.layout import SAMPLE_LINES
from mrfit.ingest.text.textlog import rewritten

LABEL = re.compile(r"(?:^|(?<=[,;\t ]))([^\W\d][\w.\[\]()/]{0,39}) {0,2}[:=] {0,2}(?=[+-]?[.,]?\d)")
MOST_ROWS = 0.9
"""Share of the sampled lines that have the same labels."""


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

    lines = map(plain, source.head.lines)
    return rewritten(source, lines, lambda text: "\n".join(map(plain, text.split("\n"))), data)
