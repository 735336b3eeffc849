"""Logs of the ACME test bench: a mark, the rate, names with units, then rows separated by semicolons.

ACME bench 2
rate_hz: 1000
displacement [mm]; force [N]
0.0; 12.5
"""

import re

import numpy as np

from mrfit.core.specs import ReaderSpec
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Column, RejectedRow, Source, Table
from mrfit.ingest.text.head import Head, decode

SPEC = ReaderSpec("acme", "ACME test bench")
MARK = "ACME bench "
FIRST_ROW = 3


def sniff(head: Head) -> bool:
    """Whether the first line is the bench's mark."""
    return head.lines[:1] != () and head.lines[0].startswith(MARK)


def read(source: Source) -> list[Table]:
    """Return the record; rows that are not whole are counted, not kept."""
    path = source.head.path
    lines = decode(path.read_bytes(), source.head.encoding).split("\n")
    rate = re.fullmatch(r"rate_hz: ([0-9.]+)", lines[1].strip()) if len(lines) > FIRST_ROW else None
    fields = re.findall(r"(\w+) \[([^]]*)\]", lines[2]) if rate else []
    if not rate or not fields:
        raise Refusal(path, "its header breaks off", "copy it from the bench again")
    rows, numbers, refused = [], [], []
    for number, line in enumerate(lines[FIRST_ROW:], start=FIRST_ROW + 1):
        try:
            row = [float(cell) for cell in line.split(";")]
        except ValueError:
            row = []
        if len(row) == len(fields):
            rows.append(row)
            numbers.append(number)
        elif line.strip():
            refused.append(RejectedRow("incomplete row", number))
    values = np.array(rows).reshape(len(rows), len(fields))
    columns = [Column(name, unit, values[:, k].copy(), k) for k, (name, unit) in enumerate(fields)]
    kept = np.array(numbers, dtype=np.int64)
    return [Table(tuple(columns), kept, dt=1.0 / float(rate[1]), refused=tuple(refused))]
