"""Digilent WaveForms (Analog Discovery): ``#`` lines with the settings, then one name row with units in brackets."""

from dataclasses import replace

from mrfit.core.specs import ReaderSpec
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.layout import name_and_unit
from mrfit.ingest.text.textlog import Field, fields_at, positive, read_columns
from mrfit.ingest.time.rate import with_rate

SPEC = ReaderSpec("digilent", "Digilent WaveForms CSV", blocks=True)


def sniff(head: Head) -> bool:
    """Whether the first line names Digilent WaveForms."""
    return head.starts("#Digilent WaveForms", "# Digilent WaveForms")


def read(source: Source) -> list[Table]:
    """Return the record.

    Raises
    ------
    Refusal
        If there is no name row after the settings.
    """
    head = source.head
    row = next((k for k, line in enumerate(head.lines) if line.strip() and not line.startswith("#")), None)
    cells = fields_at(head, row, ",") if row is not None else []
    parsed = [name_and_unit(c) for c in cells]
    if row is None or len(parsed) < 2 or (parsed[0][1] or "").lower() not in ("s", "ms", "us"):
        raise Refusal(head.path, "no 'Time (s),Channel 1 (V)' row after its settings", "export the log again")
    fields = [Field(name, unit, k) for k, (name, unit) in enumerate(parsed)]
    table = read_columns(source, row + 1, fields, fields[0], head.lines[row : row + 1])
    samples = [line.partition(":")[2] for line in head.lines[:row] if line.lower().startswith("#samples:")]
    table = replace(table, stated_rows=positive(samples))
    return [with_rate(table, head.lines[:row])]
