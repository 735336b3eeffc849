"""Find delimiter, decimal mark, header rows and columns of a text log that no instrument's reader knows."""

import re
from collections import Counter
from dataclasses import dataclass

from mrfit.channels import CHANNELS
from mrfit.ingest import units
from mrfit.ingest.body import EMPTY, NOT_A_NUMBER, number_pattern, split
from mrfit.ingest.head import Head
from mrfit.ingest.refusal import Refusal, excerpt

DELIMITERS = ("\t", ";", ",", "|", "")
COMMENTS = "#%!"
SAMPLE = 200
STAMP = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d(?:[.,]\d+)?(?:Z|[+-]\d\d:?\d\d)?")
CLOCK = re.compile(r"(\d{1,2}):([0-5]\d):([0-5]\d(?:[.,]\d+)?)")
DATE = re.compile(r"\d{4}[-/.]\d\d?[-/.]\d\d?|\d\d?[-/.]\d\d?[-/.](?:\d\d)?\d\d")
TIME_NAMES = {
    *("time", "t", "zeit", "tiempo", "temps", "tempo", "sec", "second", "seconds", "timestamp", "elapsed time", "tout"),
    *("running time", "x-axis", "x_value", "elapsed", "time stamp", "total time", "test time", "relative time"),
}


@dataclass(frozen=True, slots=True)
class Grid:
    """How lines split into fields, and where the first data row stands (line index from 0)."""

    delimiter: str
    decimal: str
    width: int
    first: int


def find_grid(head: Head, start: int = 0) -> Grid:
    """Return how a text log is laid out, looking from line ``start`` on.

    Raises
    ------
    Refusal
        If no row of numbers is found.
    """
    lines = head.lines[start:]
    best, best_score = None, (0.0, 0.0)
    for delimiter in DELIMITERS:
        for decimal in (".", ","):
            if decimal == delimiter:
                continue
            score, width = _score(lines, delimiter, decimal)
            if score > best_score:
                best, best_score = (delimiter, decimal, width), score
    if best is None:
        shown = next((excerpt(line) for line in lines if line.strip()), "")
        raise Refusal(head.path, f"no row of numbers (it begins '{shown}')", "export the log as delimited text")
    delimiter, decimal, width = best
    return Grid(delimiter, decimal, width, start + _first_row(lines, delimiter, decimal, width))


def _score(lines: tuple[str, ...], delimiter: str, decimal: str) -> tuple[tuple[float, float], int]:
    """Rank a reading of the last lines: share of them that are rows of numbers of one width, then numbers per row."""
    number = number_pattern(decimal)
    sample = [line for line in lines[-SAMPLE:] if line.strip()]
    if len(sample) > 3 and len(lines) <= SAMPLE:
        sample = sample[len(sample) // 2 :]
    widths: Counter[int] = Counter()
    numbers = 0
    for line in sample:
        fields = split(line, delimiter)
        found = sum(bool(number.fullmatch(f)) for f in fields)
        if found and not _glued(fields, number):
            widths[len(fields)] += 1
            numbers += found
    if not widths:
        return (0.0, 0.0), 0
    width, count = max(widths.items(), key=lambda item: (item[1], item[0]))
    share = count / len(sample)
    return (round(share, 1), numbers / sum(widths.values())), width


def _glued(fields: list[str], number: re.Pattern[str]) -> bool:
    """Whether a field holds several numbers, so that the delimiter is another one."""
    return any(len(f.split()) > 1 and number.fullmatch(f.split()[0]) and not STAMP.fullmatch(f) for f in fields)


def is_row(fields: list[str], number: re.Pattern[str]) -> bool:
    """Whether fields are those of a data row: mostly numbers, dates and times, or empty, and at least one number."""
    good = [f for f in fields if number.fullmatch(f) or STAMP.fullmatch(f) or f in NOT_A_NUMBER]
    dated = [f for f in fields if CLOCK.fullmatch(f) or DATE.fullmatch(f) and not number.fullmatch(f)]
    filled = [f for f in fields if f not in EMPTY]
    return bool(good) and 2 * (len(good) + len(dated)) > len(filled)


def _first_row(lines: tuple[str, ...], delimiter: str, decimal: str, width: int) -> int:
    number = number_pattern(decimal)

    def fits(place: int) -> bool:
        fields = split(lines[place], delimiter)
        return abs(len(fields) - width) <= 1 and is_row(fields, number)

    for place in range(len(lines)):
        if lines[place].strip()[:1] in COMMENTS or not fits(place):
            continue
        following = [k for k in range(place + 1, min(place + 4, len(lines))) if lines[k].strip()]
        if not following or fits(following[0]):
            return place
    return next((k for k in range(len(lines)) if fits(k)), 0)


@dataclass(frozen=True, slots=True)
class Header:
    """Names and unit texts of the columns; ``names`` is empty where the file has no header row."""

    names: tuple[str, ...]
    units: tuple[str | None, ...]
    rows: frozenset[str]


def find_header(head: Head, grid: Grid, start: int = 0) -> Header:
    """Return the name row and unit row above the first data row."""
    above = [line for line in head.lines[start : grid.first] if line.strip()]
    cells = [(line, _cells(line, grid)) for line in above]
    fitting = [(line, c) for line, c in cells if _covers(c, grid.width)]
    unit_row: list[str] | None = None
    rows = []
    if fitting and _is_unit_row(fitting[-1][1]) and (len(fitting) > 1 or not _is_name_row(fitting[-1][1])):
        line, unit_row = fitting.pop()
        rows.append(line.strip())
    if not fitting or not _is_name_row(fitting[-1][1]):
        return Header((), (), frozenset(rows))
    line, names = fitting[-1]
    rows.append(line.strip())
    return _header(names, unit_row, grid.width, frozenset(rows))


def _header(names: list[str], unit_row: list[str] | None, width: int, rows: frozenset[str]) -> Header:
    parsed = [name_and_unit(n) for n in _padded(names, width)]
    written = [u.strip("[](){} ") or None for u in _padded(unit_row, width)] if unit_row else [None] * width
    return Header(
        tuple(name for name, _ in parsed),
        tuple(w if w is not None else unit for w, (_, unit) in zip(written, parsed, strict=True)),
        rows,
    )


def _padded(fields: list[str], width: int) -> list[str]:
    return (fields + [""] * width)[:width]


def _cells(line: str, grid: Grid) -> list[str]:
    bare = line.strip().lstrip(COMMENTS).strip() if line.strip()[:1] in COMMENTS else line
    cells = split(bare, grid.delimiter)
    if not grid.delimiter and len(cells) != grid.width:
        for apart in (r"\t", r"[ \t]{2,}", r"\s*[,;]\s*"):
            other = [c.strip() for c in re.split(apart, bare.strip())]
            if len(other) == grid.width:
                return other
    return cells


def _covers(cells: list[str], width: int) -> bool:
    """Whether a header line has a cell for every column; empty cells at the end may be more or one fewer."""
    filled = len(cells)
    while filled and not cells[filled - 1]:
        filled -= 1
    return filled <= width and len(cells) >= width - 1 and filled >= max(1, width - 1 if width > 1 else 1) - (width > 3)


def _is_unit_row(cells: list[str]) -> bool:
    filled = [c for c in cells if c]
    bracketed = all(re.fullmatch(r"[\[({].*[\])}]", c) for c in filled)
    return bool(filled) and (bracketed or all(units.known(c) for c in filled))


def _is_name_row(cells: list[str]) -> bool:
    filled = [c for c in cells if c]
    number = number_pattern(".")
    return bool(filled) and not any(number.fullmatch(c.replace(",", ".")) for c in filled)


def name_and_unit(cell: str) -> tuple[str, str | None]:
    """Split a header cell such as ``Force [N]``, ``Time (s)``, ``"Weg" s_A1 / m`` or ``force_N`` into name and unit."""
    text = cell.strip().strip('"').strip()
    if match := re.fullmatch(r"(.*?)\s*[\[({]([^\[\](){}]*)[\])}]", text):
        return match[1].strip() or text, match[2].strip()
    if match := re.fullmatch(r"(.+)[_ ,]+([A-Za-z°µ/%^0-9]+)", text):
        name, unit = match[1].strip(" ,_"), match[2]
        if _is_alias(name) and not unit.isdigit() and units.known(unit) and _belongs(name, unit):
            return name, unit
    if (match := re.fullmatch(r"(.+?)\s*/\s*(\S+)", text)) and units.known(match[2]):
        return match[1].strip(), match[2]
    if (match := re.fullmatch(r"(.*?)\s*\bin (\S+)", text)) and units.known(match[2]):
        return match[1].strip() or "time", match[2]
    return text, None


def _is_alias(name: str) -> bool:
    return name.lower() in TIME_NAMES or bool(aliases_of(name))


def _belongs(name: str, unit: str) -> bool:
    wanted = ["s"] if name.lower() in TIME_NAMES else [CHANNELS[n].unit for n in aliases_of(name)]
    return any(units.compatible(unit, w) for w in wanted)


def aliases_of(name: str) -> list[str]:
    """Return the canonical channels that a header calls by exactly this name."""
    word = re.sub(r"[\s_]+", " ", name.strip().lower())
    return [c.name for c in CHANNELS.values() if word in {a.replace("_", " ") for a in (c.name, *c.aliases)}]
