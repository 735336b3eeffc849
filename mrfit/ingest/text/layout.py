"""Find delimiter, decimal mark, header rows and columns of a text log that no instrument's reader knows."""

import re
from collections import Counter
from dataclasses import dataclass, replace

from mrfit.core.channels import CHANNELS
from mrfit.ingest.meaning import units
from mrfit.ingest.refusal import Refusal, excerpt
from mrfit.ingest.text.body import EMPTY_FIELDS, NOT_A_NUMBER, SHEET_ERRORS, number_pattern, split
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.labelled_rows import begins_rows

FIELD_DELIMITERS = ("\t", ";", ",", "|", "")
COMMENTS = "#%!"
SAMPLE_LINES = 200
# parts of one digit are a ratio, as 1:2:1, unless the last has decimals
_CLOCK = (
    r"(\d{1,2}):(?=[0-5]\d:[0-5]\d|\d\d?:\d\d?[.,]\d)([0-5]?\d):([0-5]?\d(?:[.,]\d+|:\d{3})?)"
    r"(?: ?([AaPp])\.?[Mm]\.?)?"
)
CLOCK = re.compile(_CLOCK)
ISO = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d(?:[.,]\d+)?(?:Z|[+-]\d\d:?\d\d)?")
MONTHS = (
    *("jan|ene", "f[eé][bv]", "m[aä]?r", "apr|avr|abr", "ma[iy]", "jui?n", "jui?l", "aug|ao[uû]|ago", "sep"),
    *("o[ck]t", "nov", "d[eéi][czs]"),
)
"""How the months begin, in English, German, French and Spanish."""
MONTH = rf"(?i:{'|'.join(MONTHS)})[^\W\d_]*"
DATED = re.compile(rf"(\d{{1,4}})([-/.])(\d\d?|{MONTH})\2(\d{{4}}|\d\d)(?:T|,? +){_CLOCK}")
"""Other dates with a time of day: their three numbers, the mark between, and the groups of ``CLOCK``."""
STAMP = re.compile(rf"{ISO.pattern}|{DATED.pattern}")
DATE_ALONE = re.compile(rf"\d{{4}}[-/.]\d\d?[-/.]\d\d?|\d\d?[-/.](?:\d\d?|{MONTH})[-/.](?:\d\d)?\d\d")
OVERLOAD = re.compile(
    r"[+-]?(?:OL|O\.L\.?|0L|OVLD|OVL|OVFL|OFL|(?:OVER|UNDER)[ -]?(?:LOAD|RANGE|FLOW))"
    r"|[+-]?1\.#\w+|#[A-Z0-9/]+[!?]|#N/?[AV]",
    re.IGNORECASE,
)
"""What instruments and spreadsheets print in place of a number, and is no name."""
MARK = re.compile(rf"{OVERLOAD.pattern}|ERR|ERROR|OPEN|FAULT|INVALID|BAD|\*{{2,}}|#{{3,}}|\?+", re.IGNORECASE)
"""What may be printed so."""
SEPARATOR = re.compile(r":?[-=_+]{3,}:?")
TOA5_ROWS = (1, 2)
"""Lines (from 0) of the names and of the units in a Campbell logger's table."""
TIME_NAMES = {
    *("time", "t", "zeit", "tiempo", "temps", "tempo", "sec", "secs", "second", "seconds", "timestamp", "tout"),
    *("elapsed time", "__time"),
    *("elapsed_time", "running_time", "test_time", "time_stamp", "relative_time", "total_time"),
    *("время", "时间", "時間", "시간"),
    *("running time", "x-axis", "x_value", "elapsed", "time stamp", "total time", "test time", "relative time"),
}
DATE_NAMES = {
    *("date", "datetime", "date time", "date_time", "date/time", "datum", "zeitstempel", "uhrzeit", "clock", "utc"),
    *("epoch", "epoch time", "unix", "unix time", "unix_time", "unixtime", "unix timestamp", "posix", "datenum"),
    "absolute time",
}
"""Names of columns that hold times where no other column does."""
CLOCK_OWNERS = {"device", "dev", "mcu", "board", "arduino", "esp32", "teensy", "daq", "plc", "controller"}
"""Words for what has a clock of its own, and rows are taken by it."""
UNIT_FOLLOWS = r"^(?:(?:in|units?:?|einheit:?) +|units? ?= ?)"
"""What may stand before a unit in brackets."""
RUN_NUMBER = re.compile(r"run *#?\d+|@ *[\d.]+ *k?hz", re.IGNORECASE)
"""What may follow a name and its unit: the number of a run, or a rate."""
COUNTED_TIMES = {"millis": "ms", "micros": "us"}
"""Names of clocks in the programs of microcontrollers, which count them in these units."""
MARKS_BEFORE_A_UNIT = r"[\s_.,:;|<@–-]+"
"""What may stand between a name and its unit."""
LONGEST_HEADER_CELL = 300
"""Letters of a cell that may be a name with its unit; a longer one is a text, or hostile."""
FULL_WIDTH = {0xFEE0 + k: chr(k) for k in range(0x21, 0x7F)}
"""Letters and marks as wide as Chinese ones."""
NAME_LABELS = {
    *("name", "names", "signal", "signals", "signal name", "signalname", "channel name", "channel names"),
    *("channelname", "channeltitle", "channel title", "tracename", "trace name", "kanal", "kanalname", "bezeichnung"),
}
UNIT_LABELS = {"unit", "units", "unitname", "unit name", "vunit", "yunit", "y unit", "einheit", "einheiten", "unité"}
"""Words before the names and before the units of all channels, in a header whose lines begin with such a word."""
LABELLED = re.compile(r"([^\W\d][\w ]*?) ?[:=] ?(.+)")
"""A cell with a label of its own, as ``Unit: mm`` in every cell of a line."""


@dataclass(frozen=True, slots=True)
class TextGrid:
    """Split of lines into fields.

    Attributes
    ----------
    delimiter, decimal
        Marks between fields and in numbers.
    width
        Fields of a row.
    first
        Line (from 0) of the first data row.
    named
        Columns that a header has to name: all, but of several empty ones at the right of every row one.
    """

    delimiter: str
    decimal: str
    width: int
    first: int
    named: int = 0


def find_grid(head: Head, start: int = 0) -> TextGrid:
    """Return the layout of a text log from line ``start`` on.

    Raises
    ------
    Refusal
        If no row of numbers is found.
    """
    lines = head.lines[start:]
    best, best_score = None, (0.0, 0.0)
    text = "".join(lines[-SAMPLE_LINES:])
    absent = [mark for mark in FIELD_DELIMITERS if mark not in text]
    for delimiter in FIELD_DELIMITERS:
        if delimiter in absent[1:]:
            continue  # these part no line, as the first of them
        for decimal in (".", ","):
            if decimal == delimiter or decimal not in text and decimal == ",":
                continue  # without any comma, points read all that commas read
            score, width = _score(lines, delimiter, decimal)
            if score > best_score:
                best, best_score = (delimiter, decimal, width), score
    if best is None:
        shown = next((excerpt(line) for line in lines if line.strip()), "")
        raise Refusal(head.path, f"no row of numbers (it begins '{shown}')", "export the log as delimited text")
    delimiter, decimal, width = best
    rows = [split(line, delimiter) for line in lines[-SAMPLE_LINES:]]
    filled = max((k + 1 for r in rows for k, c in enumerate(r[:width]) if c not in EMPTY_FIELDS), default=width)
    first = start + _first_row(lines, delimiter, decimal, width)
    return TextGrid(delimiter, decimal, width, first, min(width, filled + 1))


def _score(lines: tuple[str, ...], delimiter: str, decimal: str) -> tuple[tuple[float, float], int]:
    """Rank a reading of the last lines: share of them that are rows of numbers of one width, then numbers per row."""
    number = number_pattern(decimal)
    sample = [line for line in lines[-SAMPLE_LINES:] if line.strip()]
    if len(sample) > 3 and len(lines) <= SAMPLE_LINES:
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
    good = [f for f in fields if number.fullmatch(f) or f in NOT_A_NUMBER]
    dates = (STAMP, CLOCK, DATE_ALONE)
    dated = [f for f in fields if any(d.fullmatch(f) for d in dates) and not number.fullmatch(f)]
    filled = [f for f in fields if f not in EMPTY_FIELDS]
    sound = 2 * (len(good) + len(dated))
    # a row of one channel may have a time, its name, its unit and a value
    return bool(good) and (sound > len(filled) or sound == len(filled) == 4 and bool(number.fullmatch(filled[0])))


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
    """The header of a text log.

    Attributes
    ----------
    names, units
        Of the columns; ``names`` is empty where the file has no header row.
    rows
        Its name row and unit row, by which a repeated header is known.
    first
        Line (from 0) of the first row, readable or not.
    short
        Whether it has one name fewer than the rows have columns.
    row
        Line (from 0) of the names.
    """

    names: tuple[str, ...]
    units: tuple[str | None, ...]
    rows: frozenset[str]
    first: int
    short: bool = False
    row: int = 0


def find_header(head: Head, grid: TextGrid, start: int = 0) -> Header:
    """Return the name row and unit row above the first data row."""
    if head.starts('"TOA5"', "TOA5") and start == 0 and grid.first >= TOA5_ROWS[1] + 2:
        return _campbell_header(head, grid)
    cells = [(k, _cells(head.lines[k], grid)) for k in range(start, grid.first) if head.lines[k].strip()]
    return _labelled_header(head, grid, cells) or _header_of_rows(head, grid, start, cells)


def _header_of_rows(head: Head, grid: TextGrid, start: int, cells: list[tuple[int, list[str]]]) -> Header:
    """Return the header of a row of names and one of units."""
    cells = [(k, plain) for k, c in cells if (plain := _without_labels(c))]
    fitting = [(k, c) for k, c in cells if _covers(c, grid) and not all(SEPARATOR.fullmatch(f) for f in c if f)]
    fitting = [(k, c) for k, c in fitting if all(f.count("(") == f.count(")") for f in c)]  # else it is a note
    first = grid.first
    times = Counter(tuple(c) for _, c in fitting)
    while fitting and _is_unreadable(fitting, times):
        first = fitting.pop()[0]
    first = _first_of_rows(dict(cells), first)
    unit_row: list[str] | None = None
    rows = []
    if fitting and _is_unit_row([c for _, c in fitting]) and (len(fitting) > 1 or not is_name_row(fitting[-1][1])):
        place, unit_row = fitting.pop()
        rows.append(head.lines[place].strip())
        # marks of overload are a row of data, and units may be given twice: the names stand above
        if fitting and (any(map(OVERLOAD.fullmatch, fitting[-1][1])) or _in_brackets(fitting[-1][1])):
            before = find_header(head, replace(grid, first=place), start)
            unit_row = unit_row if len(unit_row) >= grid.width else None
            found = replace(before, rows=before.rows | {*rows}, first=first)
            return _header(list(before.names), unit_row, grid.width, found) if before.names else before
    if not fitting or not is_name_row(fitting[-1][1]):
        return Header((), (), frozenset(rows), first)
    fitting = _up_to_names(fitting) if unit_row else fitting
    place, names = fitting[-1]
    between = [c for k, c in cells if place < k < first and c != unit_row and not all(map(SEPARATOR.fullmatch, c))]
    if between and not any(is_recognised(c) for c in names if c):
        return Header((), (), frozenset(rows), first)  # a line of settings further up
    rows.append(head.lines[place].strip())
    earlier = next(k for k, c in fitting if c == names)
    if any(earlier < k < place and _begins_row(c) for k, c in cells):
        first = earlier + len(rows)  # a header repeated among rows that cannot be read
    short = len(names) == grid.width - 1 and _last_is_filled(head, grid)
    if unit_row is not None and len(unit_row) < min(len(names), grid.width):
        unit_row = None  # whose units they are cannot be told
    if unit_row is None and len(fitting) > 1 and not any(name_and_unit(n)[1] for n in names):
        place_above, above = fitting[-2]
        if are_units(above):
            unit_row = above
            rows.append(head.lines[place_above].strip())
    if len(fitting) > 1 and (whole := _with_comments(fitting[-2][1], names)):
        names, place = whole, fitting[-2][0]
        rows.append(head.lines[place].strip())
    return _header(names, unit_row, grid.width, Header((), (), frozenset(rows), first, short, place))


def _labelled_header(head: Head, grid: TextGrid, cells: list[tuple[int, list[str]]]) -> Header | None:
    """Return the header of lines that begin with a label, as ``ChannelTitle=`` and ``UnitName=``; None of another.

    A column before those of the channels is the time, which a line of its own may name.
    """
    labels = {k: c[0].rstrip(" :=").lower() for k, c in cells if c}
    values = {k: trimmed(c)[1:] for k, c in cells}
    names = next((k for k, text in labels.items() if text in NAME_LABELS and all(values[k]) and values[k]), None)
    written = next((k for k, text in labels.items() if text in UNIT_LABELS), None)
    if names is None or written is None or len(values[names]) < len(values[written]) or not is_name_row(values[names]):
        return None
    lead = grid.width - len(values[names])
    if lead not in (0, 1) or not any(map(units.known, values[written])):
        return None
    found, stated = list(values[names]), _padded(values[written], len(values[names]))
    # a label before numbers, as that of the channels' rates, begins no row
    first = next((k for k in range(grid.first, len(head.lines)) if not head.lines[k].lstrip('"')[:1].isalpha()), 0)
    time = next((k for k, n in enumerate(values[names], 1) if is_called_time(*name_and_unit(n))), None)
    some = head.lines[first - 1 : first + 2]
    first -= (
        lead == 1 and first > grid.first and begins_rows(some, grid.delimiter, grid.decimal, len(values[names]), time)
    )
    if lead:
        rows = [split(line, grid.delimiter) for line in head.lines[first:] if line.strip()]
        clock = next((c[0] for k, c in cells if k > names and c and is_name(c[0]) and not any(c[1:])), "Time")
        found = [clock if any(r[0] not in EMPTY_FIELDS for r in rows[1:]) else "", *found]
        stated = ["", *stated]
    lines = frozenset(head.lines[k].strip() for k, _ in cells)
    return _header(found, stated, grid.width, Header((), (), lines, first or grid.first, row=names))


def _without_labels(cells: list[str]) -> list[str]:
    """Return a line of a header without the label that every cell repeats; nothing where it tells no units."""
    found = [LABELLED.fullmatch(c) for c in cells if c]
    labels = {m[1].lower() for m in found if m}
    if len(found) < 2 or len(labels) > 1 or any(m is None or is_name(m[2]) for m in found):
        return cells
    return [m[2] if (m := LABELLED.fullmatch(c)) else "" for c in cells] if labels <= UNIT_LABELS else []


def _up_to_names(fitting: list[tuple[int, list[str]]]) -> list[tuple[int, list[str]]]:
    """Return lines up to the last with known names, where words that nobody knows stand between these and the units."""
    known = [sum(map(is_recognised, filter(None, c))) * is_name_row(c) for _, c in fitting]
    named = [k for k, (n, (_, c)) in enumerate(zip(known, fitting, strict=True)) if 2 * n >= len(c)]
    return fitting[: named[-1] + 1] if named and not known[-1] else fitting


def _with_comments(names: list[str], comments: list[str]) -> list[str]:
    """Return names with the comments below them in their place, each with its unit; empty if they are none."""
    units_of = [name_and_unit(n)[1] for n in names[1:]]
    if len(names) != len(comments) or comments[0] or not all(comments[1:]) or not (names[0] and all(units_of)):
        return []
    return [names[0], *(f"{c} [{u}]" for c, u in zip(comments[1:], units_of, strict=True))]


def _campbell_header(head: Head, grid: TextGrid) -> Header:
    """Return the header of a Campbell logger: names, units, and whether numbers are samples, means or extremes."""
    names, written = (split(head.lines[k], grid.delimiter) for k in TOA5_ROWS)
    written = ["" if u in ("TS", "RN") else u for u in _padded(written, grid.width)]  # time stamp, record number
    rows = frozenset(head.lines[k].strip() for k in range(TOA5_ROWS[1] + 2))
    return _header(names, written, grid.width, Header((), (), rows, TOA5_ROWS[1] + 2, row=TOA5_ROWS[0]))


def _first_of_rows(cells: dict[int, list[str]], first: int) -> int:
    """Return the line of the first row, too long or too short ones counted, that begin with a number."""
    while first - 1 in cells and _begins_row(cells[first - 1]):
        first -= 1
    return first


def _begins_row(cells: list[str]) -> bool:
    filled = [c for c in cells if c]
    return bool(filled) and (is_number(filled[0]) or any(OVERLOAD.fullmatch(c) for c in filled))


def _last_is_filled(head: Head, grid: TextGrid) -> bool:
    """Whether most of the first rows have something in their last column."""
    rows = [split(line, grid.delimiter) for line in head.lines[grid.first : grid.first + SAMPLE_LINES] if line.strip()]
    filled = sum(len(r) >= grid.width and r[grid.width - 1] not in EMPTY_FIELDS for r in rows)
    return 2 * filled > len(rows)


def _is_unreadable(fitting: list[tuple[int, list[str]]], times: Counter[tuple[str, ...]]) -> bool:
    """Whether the last of the lines above the first row of numbers is a row that cannot be read, and no header.

    It begins with a number, or has a mark of overload or nothing but marks, or stands there several times, or below
    the names it has a number. ``times`` says how often each stands there.
    """
    place, cells = fitting[-1]
    filled = [c for c in cells if c]
    marked = [bool(MARK.fullmatch(c)) or c in NOT_A_NUMBER for c in filled]
    counted = [is_number(c) for c in filled]
    if not filled or all(marked) or any(OVERLOAD.fullmatch(c) for c in filled) or counted[0] and len(filled) > 1:
        return bool(filled)
    others = [(k, c) for k, c in fitting if c != cells]
    if not others or not is_name_row(others[-1][1]):
        return False
    line, above = others[-1]
    if any(counted):
        return line == place - 1 and (any(is_recognised(c) for c in above) or all(units.known(c) for c in above))
    if any(is_recognised(c) for c in filled) or all(units.known(c) for c in filled):
        return False  # a header given twice
    return times[tuple(cells)] > 1 and any(times[tuple(c)] == 1 for _, c in others)


def is_number(text: str) -> bool:
    """Whether a cell is a number, with a point or a comma."""
    return any(number_pattern(mark).fullmatch(text) for mark in ".,")


def is_recognised(cell: str) -> bool:
    """Whether a cell is a known name, or a name with its unit."""
    name, unit = name_and_unit(cell)
    return unit is not None or len(name) > 1 and _is_alias(name)


def _header(names: list[str], unit_row: list[str] | None, width: int, found: Header) -> Header:
    written = [u.strip("[](){} ") or None for u in _padded(unit_row, width)] if unit_row else [None] * width
    parsed = [name_and_units(n, w) for n, w in zip(_padded(names, width), written, strict=True)]
    return replace(found, names=tuple(n for n, _ in parsed), units=tuple(unit for _, unit in parsed))


def trimmed(cells: list[str]) -> list[str]:
    """Return cells without empty ones at the end."""
    while cells and not cells[-1]:
        cells = cells[:-1]
    return cells


def _padded(fields: list[str], width: int) -> list[str]:
    return (fields + [""] * width)[:width]


def _cells(line: str, grid: TextGrid) -> list[str]:
    commented = line.strip()[:1] in COMMENTS and not line.strip().startswith(SHEET_ERRORS)
    bare = line.strip().lstrip(COMMENTS).strip() if commented else line
    cells = split(bare, grid.delimiter)
    written = [c.strip("()[]") for c in cells[1::2]]
    if len(cells) == 2 * grid.width and all(map(units.known, written)) and is_name_row(cells):
        return [f"{name} [{unit}]" for name, unit in zip(cells[::2], written, strict=True)]
    if not grid.delimiter and bare.count('"') > 1:
        quoted = [a or b for a, b in re.findall(r'"([^"]*)"|(\S+)', bare)]
        if grid.width - len(quoted) in (0, 1):
            return quoted
    if not grid.delimiter and len(each := re.findall(r"[^()\[\]]+[(\[][^()\[\]]*[)\]]", bare)) == grid.width:
        return [c.strip() for c in each]  # numpy's savetxt parts names with blanks as it parts the numbers
    if not grid.delimiter and len(cells) != grid.width:
        for apart in (r"\t", r"[ \t]{2,}", r"\s*[,;]\s*"):
            other = [c.strip() for c in re.split(apart, bare.strip())]
            if len(other) == grid.width:
                return other
    return cells


def _covers(cells: list[str], grid: TextGrid) -> bool:
    """Whether a header line has a cell for every column; empty cells at the end may be more or one fewer."""
    filled, width = len(trimmed(cells)), grid.named or grid.width
    return filled <= grid.width and min(len(cells), width) >= width - 1 and filled >= max(1, width - 1) - (width > 3)


def _is_unit_row(rows: list[list[str]]) -> bool:
    """Whether the last of the rows above the numbers holds units.

    They are in brackets or known; or, none being a name, half of them are known, or one below a known name, or half of
    the names above are known and have no unit.
    """
    filled = [c for c in rows[-1] if c]
    known = [units.known(c) for c in filled]
    if not filled or _in_brackets(filled) or all(known):
        return bool(filled)
    above = [c for c in rows[-2] if c] if len(rows) > 1 else []
    if len(above) < len(filled) or not is_name_row(rows[-2]):
        return False
    clocked = 2 * sum(known) >= len(filled) > 2  # a row of units may have words for the times
    # pulses/turn has a unit behind its stroke, but is no name
    for cell, is_unit in zip(filled, known, strict=True):
        if is_recognised(cell) and "/" not in cell and not is_unit and not (clocked and cell.lower() in TIME_NAMES):
            return False
    named = sum(map(is_recognised, above))
    wholly = 2 * named >= len(above) and not any(name_and_unit(c)[1] for c in above)
    return 2 * sum(known) >= len(filled) or any(known) and named > 0 or wholly


def _in_brackets(cells: list[str]) -> bool:
    filled = [c for c in cells if c]
    return bool(filled) and all(re.fullmatch(r"[\[({].*[\])}]", c) for c in filled)


def are_units(cells: list[str]) -> bool:
    """Whether cells are units, and can stand above names: half of them known, none a name."""
    filled = [c for c in cells if c]
    known = [units.known(c) for c in filled]
    return 2 * sum(known) > len(filled) and all(k or not is_recognised(c) for c, k in zip(filled, known, strict=True))


def is_name(cell: str) -> bool:
    """Whether a header cell is a known name, with or without a unit, or any name with a known unit."""
    name, unit = name_and_unit(cell)
    return len(name) > 1 and (_is_alias(name) if unit is None else units.known(unit))


def is_name_row(cells: list[str]) -> bool:
    """Whether cells are names: none is a number."""
    filled = [c for c in cells if c]
    number = number_pattern(".")
    return bool(filled) and not any(number.fullmatch(c.replace(",", ".")) for c in filled)


def name_and_unit(cell: str) -> tuple[str, str | None]:
    """Split a header cell such as ``Force [N]``, ``Time (s)``, ``"Weg" s_A1 / m`` or ``force_N`` into name and unit."""
    text = cell.strip().strip('"').strip().translate(FULL_WIDTH)
    if len(text) > LONGEST_HEADER_CELL:
        return text, None
    if match := re.fullmatch(r"\('([^']*)', '([^']*)'\)", text):
        return match[1], match[2]  # two levels of column names, as pandas writes them
    if match := re.fullmatch(r"(.*?)\s*[\[({]([^\[\](){}]*)[\])}]", text):
        if match[2] or match[1].lower() not in COUNTED_TIMES:
            return _unit_among_words(match[1].strip() or text, match[2].strip())
        text = match[1]  # micros()
    if text[-1:] in ("_", ".") and (found := _of_programs(text)):
        return found
    if (match := re.fullmatch(r"(.*?)\s*\bin (\S+)", text)) and units.known(match[2]):
        return match[1].strip() or "time", match[2]
    if found := _parted(text):
        return found
    if (match := re.fullmatch(r"(.+?)\s*/\s*(\S+)", text)) and units.known(match[2]):
        return match[1].strip(), match[2]
    return text, COUNTED_TIMES.get(text.lower())


def _unit_among_words(name: str, bracketed: str) -> tuple[str, str]:
    """Return name and unit of ``Force (in kN)``, ``Force (unit: kN)`` and ``Force (kN, tension positive)``."""
    unit, comma, more = re.sub(UNIT_FOLLOWS, "", bracketed, flags=re.IGNORECASE).partition(",")
    if unit == bracketed or not units.known(unit) or comma and (units.known(more) or re.search(r"[\d=]", more)):
        return name, bracketed
    return (f"{name} {more.strip()}" if comma else name), unit


def name_and_units(cell: str, stated: str | None) -> tuple[str, str | None]:
    """Return name and unit of a column by its header cell and a unit that stands elsewhere, which comes first.

    Where two contradict, as in ``Force (kN)`` above ``N``, both are the unit: nobody knows it, so that it is asked for.
    """
    name, unit = name_and_unit(cell)
    within, inner = name_and_unit(name) if unit is not None else (name, None)
    if unit and inner and units.known(inner) and not units.known(unit):
        name, unit = f"{within} {unit}", inner  # Force (kN) [filtered]
    return name, one_unit(stated, one_unit(unit, inner))


def one_unit(first: str | None, second: str | None, alike: bool = False) -> str | None:
    """Return the first unit of two that may be stated, or both where they contradict: also in kind, if ``alike``."""
    if first and second and units.known(first) and units.known(second):
        if units.contradict(first, second) or alike and not units.compatible(first, units.spelled(second)):
            return f"{second} or {first}"
    return first if first is not None else second


def _parted(text: str) -> tuple[str, str] | None:
    """Return a known name and its unit, parted by a mark or with the unit in brackets amid the name."""
    if match := re.fullmatch(r"(.*?)[\s_]*[\[({<]([^\[\](){}<>]+)[\])}>][\s_]*(.*)", text):
        cut = [(f"{match[1]} {RUN_NUMBER.sub('', match[3])}".strip(), match[2].strip())]
    else:
        cut = [(text[: m.start()].rstrip("/ "), text[m.end() :]) for m in re.finditer(MARKS_BEFORE_A_UNIT, text)]
    for whole, unit in reversed(cut):
        name = whole if _is_alias(whole) else re.sub(r"[.\s-]+", " ", whole)
        named = _is_alias(name) or re.split(r"[\s_]+", name.lower())[0] in (TIME_NAMES | CLOCK_OWNERS) - {"t"}
        if named and not unit.isdigit() and units.known(unit) and _belongs(name, unit):
            return name, unit
    return None


def unit_words(name: str) -> list[str]:
    """Return the words of a name that may be units."""
    words = re.split(rf"(?:{MARKS_BEFORE_A_UNIT}|[>()\[\]{{}}])+", name)
    return [w for w in words if w and w != name and not w.isdigit() and units.known(w)]


def _of_programs(text: str) -> tuple[str, str] | None:
    """Return name and unit of a header that MATLAB or R made a variable of: ``Force_kN_``, ``Force..kN.``."""
    other: tuple[str, str] | None = None
    for match in re.finditer(r"[_.]+", text[:-1]):
        name, written = text[: match.start()].replace(".", " ").strip(" _"), text[match.end() : -1].strip("._")
        plain = re.sub(r"[._](\d)$", r"^\1", written)
        spelt = [written, *(re.sub(r"[._]", mark, plain) for mark in ("/", "*"))]
        known = [u for u in spelt if u and not u.isdigit() and units.known(u)]
        if name and _is_alias(name) and (fitting := [u for u in known if _belongs(name, u)]):
            return name, fitting[0]
        if name and known and (text.endswith("_") or len(match[0]) > 1):
            other = name, known[0]
    return other


def _is_alias(name: str) -> bool:
    return name.lower() in {*TIME_NAMES, *DATE_NAMES} or bool(aliases_of(name))


def is_called_time(name: str, unit: str | None) -> bool:
    """Return whether a column is called as times are; a letter in a unit of another quantity, ``T`` in degC, is not."""
    name, unit = name.strip(), unit or "s"
    of_time = len(name) > 1 or units.compatible(unit, "s") or not units.known(unit)
    return name.lower() in TIME_NAMES and of_time


def _belongs(name: str, unit: str) -> bool:
    wanted = [CHANNELS[n].unit for n in aliases_of(name)]
    if name.lower() in {*TIME_NAMES, *DATE_NAMES} or not wanted:
        wanted = ["s"]
    return any(units.compatible(unit, w) for w in wanted)


CHANNEL_WORDS = {c.name: {a.replace("_", " ") for a in (c.name, *c.aliases)} for c in CHANNELS.values()}
"""Canonical channel -> the words by which a header calls it."""


def aliases_of(name: str) -> list[str]:
    """Return the canonical channels that a header calls by exactly this name."""
    word = " ".join(words_of(name))
    return [channel for channel, words in CHANNEL_WORDS.items() if word in words]


def words_of(name: str) -> list[str]:
    """Return the words of a name in lower-case letters: of ``Coil current``, ``coil_current`` and ``CoilCurrent``."""
    return re.sub(r"(?<=[a-zà-ÿ])(?=[A-Z][a-zà-ÿ])", " ", name.strip()).lower().replace("_", " ").split()
