"""Tektronix MSO, DPO and MDO oscilloscopes: ``Model,`` header lines, then ``TIME,CH1,…`` and rows."""

from dataclasses import replace

from mrfit.core.specs import ReaderSpec
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.body import Layout, number_pattern, split
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.textlog import Field, check_width, fields_at, first_of, found_line, meta_of, positive, read_table

SPEC = ReaderSpec("tektronix-mso", "Tektronix MSO/DPO/MDO oscilloscope CSV", blocks=True)


def sniff(head: Head) -> bool:
    """Whether the file begins as these instruments write it."""
    return head.starts("Model,") and _column_line(head) is not None


def _column_line(head: Head) -> int | None:
    """Return the line of the column names; one below a row of numbers is a repeated header."""
    for place, line in enumerate(head.lines[:60]):
        if line.strip().upper().startswith("TIME,"):
            return place
        if number_pattern(".").fullmatch(split(line, ",")[0]):
            return None
    return None


def read(source: Source) -> list[Table]:
    """Return the record; a peak-detect column is the envelope of its neighbour and no channel of its own.

    Raises
    ------
    Refusal
        If the rows do not fit the header.
    """
    head = source.head
    row = found_line(head, _column_line(head), "TIME row")
    names = fields_at(head, row, ",")
    meta = meta_of(head, row)
    check_width(head, row + 1, ",", len(names))
    labels, written = meta.get("label", []), [u for u in meta.get("vertical units", []) if u]
    fields: list[Field] = []
    for k, name in enumerate(names[1:], start=1):
        if "peak detect" in name.lower():
            continue
        unit = written[min(len(fields), len(written) - 1)] if written else "V"
        label = labels[k - 1] if k - 1 < len(labels) else ""
        fields.append(Field(label or name, unit, k))
    header = frozenset(line.strip() for line in head.lines[: row + 1] if line.strip(", "))
    layout = Layout(row + 1, ",", ".", len(names), (0, *(f.index for f in fields)), header=header)
    time = Field("TIME", first_of(meta, "horizontal units", "s"), 0)
    table = read_table(source, layout, fields, time)
    if len(fields) < len(names) - 1:
        table = replace(table, history=("left out the peak-detect envelope",))
    rows, interval = (positive(meta.get(key, [])) for key in ("record length", "sample interval"))
    return [replace(table, stated_rows=rows, dt=interval)]
