"""Rohde & Schwarz RTO/RTP: bare rows in ``NAME.Wfm.csv``, explained by ``NAME.csv`` or ``NAME.bin`` beside it.

Without that second file the rows have neither rate nor units, and a channel map is needed.
"""

import re
from dataclasses import replace
from pathlib import Path

from mrfit.core.specs import ReaderSpec
from mrfit.ingest.meaning import units
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.body import NUMBER_ROW, Layout, split
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.layout import find_grid
from mrfit.ingest.text.textlog import Field, check_width, read_table

SPEC = ReaderSpec("rohde-schwarz", "Rohde & Schwarz RTO/RTP waveform CSV with its settings file", blocks=True)
PROPERTY = re.compile(r'Name="(\w+)"[^>]*?\bValue="([^"]*)"|^(\w+):([^:\r\n]*):', re.MULTILINE)
LONGEST_SETTINGS = 1 << 18
NEEDED = ("Resolution", "XStart")


def sniff(head: Head) -> bool:
    """Whether the file's name ends in ``.Wfm.csv``, its settings file is there, and it begins with bare numbers."""
    first = next((line for line in head.lines if line.strip()), "")
    return bool(NUMBER_ROW.match(first.encode())) and _settings(head.path) is not None


def _settings(path: Path) -> dict[str, str] | None:
    match = re.fullmatch(r"(.*)\.wfm(\.\w+)?", path.name, re.IGNORECASE)
    if match is None:
        return None
    for ending in (".csv", ".CSV", ".bin", ".xml"):
        beside = path.with_name(match[1] + ending)
        if beside.is_file():
            with beside.open("rb") as handle:
                text = handle.read(LONGEST_SETTINGS).decode("utf-8", errors="replace")
            found = PROPERTY.findall(text)
            settings = {a or c: (b or d).strip() for a, b, c, d in found}
            if all(units.quantity(settings.get(key, "")) for key in NEEDED):
                return settings
    return None


def read(source: Source) -> list[Table]:
    """Return the record; times, where the rows have them, stand in the first column.

    Raises
    ------
    Refusal
        If the rows do not fit the settings.
    """
    head = source.head
    settings = _settings(head.path) or {}
    resolution, start = units.quantity(settings.get("Resolution", "")), units.quantity(settings.get("XStart", ""))
    if resolution is None or start is None or resolution[0] <= 0.0:
        raise Refusal(head.path, "its settings file states no resolution", "copy both files of the record again")
    grid = find_grid(head)
    columns = check_width(head, grid.first, grid.delimiter, grid.width)
    timed = _rises(head, grid.first, grid.delimiter, resolution[0])
    names = re.findall(r"C\d+W\d+", settings.get("Source", "")) or [f"CH{k + 1}" for k in range(columns)]
    if columns - timed > len(names):
        what = f"its settings file names {len(names)} channels ({', '.join(names)}) for {columns - timed} columns"
        raise Refusal(head.path, what, "check its decimal mark, and export both files of the record again")
    fields = [Field(names[k] if k < len(names) else f"CH{k + 1}", "V", k + timed) for k in range(columns - timed)]
    layout = Layout(0, grid.delimiter, grid.decimal, columns, tuple(range(columns)))
    table = read_table(source, layout, fields, Field("time", "s", 0) if timed else None)
    length = units.quantity(settings.get("RecordLength", ""))
    return [replace(table, stated_rows=length[0] if length else None, dt=resolution[0], start=start[0])]


def _rises(head: Head, first: int, delimiter: str, resolution: float) -> bool:
    """Whether the first column steps by the resolution."""
    rows = [split(line, delimiter)[0] for line in head.lines[first : first + 20] if line.strip()]
    found = [units.quantity(r) for r in rows]
    numbers = [f[0] for f in found if f is not None]
    steps = [b - a for a, b in zip(numbers[:-1], numbers[1:], strict=True)]
    return len(steps) > 2 and all(abs(s - resolution) < 0.1 * resolution for s in steps)
