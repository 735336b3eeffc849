"""Names and units of columns that lines of a header state one by one, as ``CH1 = Force [kN]`` or ``Force unit: kN``."""

import re
from collections.abc import Sequence
from dataclasses import replace

from mrfit.core.channels import CHANNELS
from mrfit.core.recording import Finding
from mrfit.ingest.meaning import units
from mrfit.ingest.text.body import split
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.layout import TIME_NAMES, Header, TextGrid, aliases_of, is_name, name_and_unit

NUMBERED_COLUMN = re.compile(r"(?:ch|chan|channel|kanal|canal|voie|ai|col|column|spalte)[ _.#-]*(\d+)", re.IGNORECASE)
LISTED_COLUMN = re.compile(
    r"[#%! ]{0,5}(?:col(?:umn)?|ch(?:annel)?|spalte)?\.?[ #]{0,3}(\d{1,4}) ?[:=.)-]? (\S.*)", re.IGNORECASE
)
"""A line that names a column by its number."""
LIST_TITLE = re.compile(r"[#%! ]{0,5}(?:columns?|channels?|spalten|format) ?[:=]", re.IGNORECASE)
OTHER_WORDS = {"displacement": "length"}
"""Quantities that a note on units may be on, beside a channel's own names."""


def with_stated_names(head: Head, grid: TextGrid, header: Header) -> tuple[Header, list[Finding]]:
    """Return a header with the names and units that lines above the rows state one by one, and what is said of it."""
    lines = [line for line in head.lines[: grid.first] if line.strip()]
    if not header.names:
        return _listed(lines, grid, header), []
    lines = [line for line in lines if line.strip() not in header.rows]
    names, written = list(header.names), list(header.units)
    for k, name in enumerate(names):
        if NUMBERED_COLUMN.fullmatch(name) and (title := _title(name, lines, grid.delimiter)):
            names[k], unit = name_and_unit(title[0])
            written[k] = written[k] or unit or title[1]
    stated = {k: u for k, n in enumerate(names) if (u := _stated_unit(n, lines))}
    other = {k: u for k, u in stated.items() if (own := written[k]) and units.known(own) and units.contradict(own, u)}
    stated = {k: u for k, u in stated.items() if written[k] is None}
    said = []
    for found, kind, told in (
        (stated, "unit-stated", "units as a line of the header states them"),
        (other, "units-contradict", "units of the columns are taken, though a line of the header states others"),
    ):
        if text := ", ".join(f"'{names[k]}' in {unit}" for k, unit in found.items()):
            said.append(Finding(kind, "", None, f"{told}: {text}"))
    units_of = tuple(stated.get(k, unit) for k, unit in enumerate(written))
    return replace(header, names=tuple(names), units=units_of), said


def _listed(lines: Sequence[str], grid: TextGrid, header: Header) -> Header:
    """Return the header that a list of numbered columns gives, counted from 0 or 1; the same one without a list."""
    for parts in (lines, *(LIST_TITLE.sub("", line).split(mark) for line in lines for mark in ";,")):
        found = [m for part in parts if (m := LISTED_COLUMN.fullmatch(part.strip()))]
        numbers = [int(m[1]) for m in found]
        whole = numbers in (list(range(grid.width)), list(range(1, grid.width + 1)))
        if whole and any(is_name(m[2]) for m in found):
            names, written = zip(*(name_and_unit(m[2]) for m in found), strict=True)
            return replace(header, names=names, units=written, first=grid.first)
    return header


def _title(name: str, lines: Sequence[str], delimiter: str) -> tuple[str, str | None] | None:
    """Return the known name that a line gives a numbered column, and a unit that stands in it apart."""
    for line in lines:
        plain = line.strip().lstrip("#%!").strip()
        cells = split(plain, delimiter) if delimiter else [plain]
        if len(cells) > 1 and cells[0].lower() == name.lower() and is_name(cells[1]):
            return cells[1], next(
                (c for c in reversed(cells[2:]) if not c.isdigit() and _may_be_unit(cells[1], c)), None
            )
        pair = re.fullmatch(rf"{re.escape(name)}\s*[=:]\s*(\S.*)", plain, re.IGNORECASE)
        if pair and is_name(pair[1]):
            return pair[1], None
    return None


def _may_be_unit(name: str, text: str) -> bool:
    return any(units.compatible(text, CHANNELS[n].unit) for n in aliases_of(name_and_unit(name)[0]))


def _stated_unit(name: str, lines: Sequence[str]) -> str | None:
    """Return the one unit that lines state of a known name, as ``force in kN`` and ``Force unit: kN``; or None."""
    channels = aliases_of(name)
    wanted = [CHANNELS[n].unit for n in channels] or (["s"] if name.lower() in TIME_NAMES else [])
    words = [re.escape(w) for w in (name, *(OTHER_WORDS[n] for n in channels if n in OTHER_WORDS))]
    found = set()
    for line in lines if wanted else ():
        mark = "?" if re.search(r"\b(?:units?|einheit)", line, re.IGNORECASE) else ""
        pattern = rf"(?<!\w)(?:{'|'.join(words)})s?(?: *[-_]?units?| *einheit)?(?: *[:=] *| +(?:is |are )?in +){mark} *"
        for match in re.finditer(
            rf"{pattern}([^\W\d][^\s,;()\[\]]*?)(?=\.?\s*(?:[,;)\]]|$|and\b))", line, re.IGNORECASE
        ):
            if any(units.compatible(match[1], w) for w in wanted):
                found.add(match[1])
    return found.pop() if len(found) == 1 else None
