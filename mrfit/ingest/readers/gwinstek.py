"""GW Instek GDS oscilloscopes: ``name,value,`` lines, then ``Waveform Data,`` and rows without a name row."""

from dataclasses import replace

from mrfit.core.specs import ReaderSpec
from mrfit.ingest.meaning import units
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.textlog import Field, fields_at, first_of, found_line, meta_of, positive, read_columns

SPEC = ReaderSpec("gwinstek", "GW Instek GDS oscilloscope CSV", blocks=True)


def sniff(head: Head) -> bool:
    """Whether settings as this instrument writes them end in ``Waveform Data``."""
    return head.starts("Memory Length,", "Format,") and _data_line(head) is not None


def _data_line(head: Head) -> int | None:
    return next((k for k, line in enumerate(head.lines[:60]) if line.lower().startswith("waveform data")), None)


def read(source: Source) -> list[Table]:
    """Return the channel; a file without time column counts from its horizontal position.

    Raises
    ------
    Refusal
        If the settings lack the sampling period or the rows do not fit.
    """
    head = source.head
    row = found_line(head, _data_line(head), "'Waveform Data' line")
    meta = meta_of(head, row)
    name, unit = first_of(meta, "source", "CH1"), first_of(meta, "vertical units", "V")
    dt = _interval(meta)
    timed = len(fields_at(head, row + 1, ",")) == 2
    clock = Field("time", first_of(meta, "horizontal units", "s"), 0) if timed else None
    fields = [clock, Field(name, unit, 1)] if clock else [Field(name, unit, 0)]
    table = read_columns(source, row + 1, fields, clock)
    if not timed and dt is None:
        raise Refusal(head.path, "neither a time column nor a sampling period", "write rate = HZ in a channel map")
    return [replace(table, stated_rows=positive(meta.get("memory length", [])), dt=dt)]


def _interval(meta: dict[str, list[str]]) -> float | None:
    values = meta.get("sampling period", [])
    found = units.seconds(values[0]) if values else None
    return found if found is not None and found > 0.0 else None
