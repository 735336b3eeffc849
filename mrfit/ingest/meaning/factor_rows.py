"""Rows of factors beside the names of a text log: applied where they say that they multiply, else refused by line."""

import re
from dataclasses import dataclass, replace

from mrfit.ingest.meaning.channel_map import FILE_NAME, Rules
from mrfit.ingest.meaning.chosen import mapped_places
from mrfit.ingest.meaning.factors import FACTOR_NUMBER, POWER_OF_TEN, multiplied, value_of
from mrfit.ingest.refusal import Refusal, excerpt
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.body import number_pattern, split
from mrfit.ingest.text.layout import COMMENTS, TextGrid, is_name, is_name_row

FACTOR_WORDS = re.compile(
    r"(?:(?:cal(?:ibration)?|conv(?:ersion)?|channel|column|data|unit|apply|use)[\W_]+)?(?:scal(?:e|ed|es|ing)|gains?|factors?|\w*faktor(?:en)?|facteurs?|fattor[ei]|mult|multipl\w*|"
    r"divi(?:de|ded|sor)|offsets?|skalierung|sensitivit\w*|times)(?: ?(?:factor|value|by|with|mit|par)s?)*",
    re.IGNORECASE,
)
"""What begins a row of factors."""
MULTIPLY = re.compile(r"multiply(?: (?:by|with|all by|values by))?|multipliziere(?:n)?(?: mit)?", re.IGNORECASE)
"""Words that say what is to be done with them."""
WORD = re.compile(r"([^\d:=]*[^\d\s:=+-])\s*[:=]?\s*(\S*)")
OPERATED = re.compile(
    rf"[(\[]?\s*(?:([xX×*·⋅/÷])\s*({POWER_OF_TEN}|{FACTOR_NUMBER})|({POWER_OF_TEN}|{FACTOR_NUMBER})\s*([xX×]))\s*[)\]]?"
)
MOST_WORDS = 4
LINES_BELOW = 3
"""Lines below the first row of numbers in which factors are looked for."""


@dataclass(frozen=True, slots=True)
class FactorRow:
    """A row that gives a factor for every column; the line counts from 0."""

    line: int
    factors: tuple[float, ...]

    def left_out(self, source: Source) -> Source:
        """Return a log with the row blank."""
        lines = list(source.head.lines)
        lines[self.line] = ""
        return replace(source, head=replace(source.head, lines=tuple(lines)))

    def applied(self, table: Table, rules: Rules) -> Table:
        """Return a table multiplied by the factors, but for columns whose scale or unit a map gives."""
        given = mapped_places(rules, table.columns, settled=True)
        columns = [c if c.index in given else multiplied(c, self.factors[c.index]) for c in table.columns]
        time = table.time
        if time is not None and rules.time is None:
            time = multiplied(time, self.factors[time.index])
        shown = ", ".join(f"{f:g}" for f in self.factors)
        text = f"line {self.line + 1} says that the columns are to be multiplied by {shown}: they are"
        return replace(table, columns=tuple(columns), time=time).finding("factor", text)


def factor_row(source: Source, grid: TextGrid) -> FactorRow | None:
    """Return the row of factors in the header of a log, or None if it has none.

    Raises
    ------
    Refusal
        If it has one that does not say what is to be done with its factors, and no map says how channels are scaled.
    """
    lines = source.head.lines[: grid.first + LINES_BELOW]
    cells = [[c for c in split(line.strip(" \r\n").lstrip(COMMENTS), grid.delimiter)] for line in lines]
    naming = {k for k, row in enumerate(cells) if any(map(is_name, row)) and is_name_row(row)}
    for place, row in enumerate(cells):
        found = _operated(row, grid, bool(naming - {place})) or _worded(row, grid)
        if found is None:
            continue
        factors, multiplies = found
        if factors is not None and (multiplies or source.rules.channels):
            return FactorRow(place, factors if multiplies else (1.0,) * grid.width)
        if source.rules.channels:
            return None
        shown = excerpt(lines[place])
        what = f"line {place + 1} gives scale factors or offsets ('{shown}'), which may be in the numbers already"
        remedy = f"write scale or unit of each channel in a channel map ({FILE_NAME} or --map), or delete the line"
        raise Refusal(source.head.path, what, remedy)
    return None


Factors = tuple[tuple[float, ...] | None, bool]


def _operated(cells: list[str], grid: TextGrid, named: bool) -> Factors | None:
    """Return the factors of a row as ``x1,x10,x1000``, and whether all multiply; None if it is none.

    ``x1,x2,x3`` are names, and so is such a row where no other row gives names.
    """
    if not named or len(cells) != grid.width:
        return None
    filled = [c for c in cells if c not in ("", "-", "--")]
    found = [OPERATED.fullmatch(c) for c in filled]
    plain = number_pattern(grid.decimal)
    # beside them 1 stands plain; other numbers are those of a row of which a cell is garbled
    ones = [bool(plain.fullmatch(c)) and _factor(c) == 1.0 for c in filled]
    if not any(found) or not all(m or one for m, one in zip(found, ones, strict=True)):
        return None
    factors = [_factor(c) for c in cells]
    if sorted(factors) in ([float(k + first) for k in range(len(factors))] for first in (0, 1)) and len(factors) > 1:
        return None
    return tuple(factors), not any(m and m[1] in ("/", "÷") for m in found)


def _factor(cell: str) -> float:
    match = OPERATED.fullmatch(cell)
    text = (match[2] or match[3]) if match else cell
    return value_of(text) if text not in ("", "-", "--") else 1.0


def _worded(cells: list[str], grid: TextGrid) -> Factors | None:
    """Return the factors behind a word as ``multiply by``, None where they are not one for each column; or None."""
    match = WORD.fullmatch(cells[0])
    if match is None or not FACTOR_WORDS.fullmatch(match[1].strip()) or len(match[1].split()) > MOST_WORDS:
        return None
    texts = [match[2], *cells[1:]] if match[2] else cells[1:]
    numbers = [number_pattern(mark) for mark in ".,"]
    plain = [t for t in texts if OPERATED.fullmatch(t) or any(n.fullmatch(t) for n in numbers)]
    if len(plain) < 2 or {_factor(t) for t in plain} == {1.0}:
        return None
    if len(plain) < len(texts) or len(texts) not in (grid.width - 1, grid.width):
        return None, False
    factors = [_factor(t) for t in texts]
    return tuple([1.0] * (grid.width - len(factors)) + factors), bool(MULTIPLY.fullmatch(match[1].strip()))
