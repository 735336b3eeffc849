"""Numbers spelt in other ways than programs read them: a real minus sign, Fortran's D exponents, marks of thousands.

A point or a comma parts thousands only where no number of the log has it as its decimal mark, and something shows it:
numbers with two marks, decimals with the other mark, or a column that goes from three digits to marked four.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from mrfit.core.recording import Finding
from mrfit.ingest.table import Source
from mrfit.ingest.text.body import split
from mrfit.ingest.text.head import Text, last_lines
from mrfit.ingest.text.textlog import rewritten
from mrfit.ingest.text.wrappings import unwrapped
from mrfit.ingest.text.written_times import FIELD_BEGIN, FIELD_END, written_times

MINUS = re.compile("[\u2212\u2013\u2012\uff0d\ufe63](?=[.,]?\\d)")
FORTRAN = re.compile(r"(?<![\w.])([+-]?(?:\d+\.\d*|\.\d+|\d+(?=[dD][+-])))[dD]([+-]?\d{1,3})(?![\w.])")
FORTRAN_MARK = re.compile(r"[dD][+-]?\d")
"""What each of these holds, which is found sooner."""
TENFOLD = re.compile(r"(?<=\d) ?[×xX*·] ?10\^([+-]?\d+)" + FIELD_END)
SPACES = (" ", "\u00a0", "\u202f", "\u2009", "'", "\u2019")
"""Marks that part thousands and nothing else."""
SPELT = re.compile(r"[+-]?[\d.,'\u2019\s]*(?:[eE][+-]?\d+)?")
LARGE_NUMBER = re.compile(r"(?<![\w.,])[1-9]\d{0,2}[ '\u2019\u00a0\u202f\u2009.,]\d{3}(?!\d)")
"""A number of which a mark may part the thousands."""
NEGATIVE = re.compile(rf"({FIELD_BEGIN})(?:\((\d+[.,]\d+|\d\d+)\)|(\d+(?:[.,]\d+)?)-){FIELD_END}")
"""A negative number as accountants write it: in brackets, or with its sign behind."""
QUOTED_DECIMAL = re.compile(r'(?m:^|(?<=,))"([+-]?\d*),(\d+(?:[eE][+-]?\d+)?)"(?m:(?=[,\r]|$))')
"""A number in quotation marks, with a decimal comma, between fields that commas part."""
SPELLING_LINES, REFUTING_LINES = 400, 20
"""Lines at the beginning by which it is seen how numbers are spelt, and few of them by which most marks are refuted."""


@dataclass(frozen=True, slots=True)
class Thousands:
    """The mark that parts thousands, the decimal mark, and the delimiter of the fields."""

    mark: str
    decimal: str
    delimiter: str

    def pattern(self) -> re.Pattern[str]:
        """Return the pattern of a field with the mark."""
        return re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:{re.escape(self.mark)}\d{{3}})+(?:{self.decimal}\d*)?")

    def without(self, line: str) -> str:
        """Return text without the marks."""
        begin = '(?<=")' if self.delimiter == self.mark else rf'(?m:(?<=["{self.delimiter}])|^)'
        end = rf'(?=(?:{self.decimal}\d*)?[ \t]*(?:["{self.delimiter}\r\n]|$))'
        grouped = re.compile(
            rf"{begin}([ \t]*[+-]?[1-9]\d{{0,2}}(?:{re.escape(self.mark)}\d{{3}})+){end}", re.MULTILINE
        )
        return grouped.sub(lambda m: m[1].replace(self.mark, ""), line)


def plainly_written(source: Source) -> tuple[Source, Text | None, list[Finding]]:
    """Return a log with its numbers as programs write them, its text if that was changed, and what is said of it."""
    lines = source.head.lines
    wrapped = list(unwrapped(lines))
    for change in wrapped:
        lines = tuple(change("\n".join(lines)).split("\n"))
    sample = [*lines[:SPELLING_LINES], *_large_between(lines), *lines[-SPELLING_LINES:], *last_lines(source.head)[:-1]]
    changes: list[Callable[[str], str]] = wrapped
    said: list[Finding] = []
    together = "\n".join(sample)
    if MINUS.search(together):
        changes.append(lambda text: MINUS.sub("-", text))
    if FORTRAN_MARK.search(together) and FORTRAN.search(together):
        changes.append(lambda text: FORTRAN.sub(r"\1e\2", text))
    if NEGATIVE.search(together):
        changes.append(lambda text: NEGATIVE.sub(r"\1-\2\3", text))
    if TENFOLD.search(together):
        changes.append(lambda text: TENFOLD.sub(r"e\1", text))
    changes += written_times(together)
    for thousands in _thousands(sample):
        changes.append(thousands.without)
        shown = {".": "full stops", ",": "commas", "'": "apostrophes", "\u2019": "apostrophes"}.get(
            thousands.mark, "blanks"
        )
        said.append(Finding("thousands", "", None, f"{shown} part the thousands of numbers"))
    if _has_quoted_decimals(together):
        changes.append(lambda text: QUOTED_DECIMAL.sub(r"\1.\2", text))
    if not said and (mark := _may_part_either(sample)):
        text = f"every number with a '{mark}' has three digits behind it: taken as the decimal mark, not as thousands"
        said.append(Finding("decimal-assumed", "", None, f"{text}; a channel map can say scale = 1000"))
    if not changes:
        return source, None, said

    def changed(text: str) -> str:
        for change in changes:
            text = change(text)
        return text

    return *rewritten(source, changed("\n".join(source.head.lines)).split("\n"), changed), said


def _has_quoted_decimals(text: str) -> bool:
    """Whether numbers have decimal commas in quotation marks, which at least one shows to be no mark of thousands."""
    pattern = Thousands(",", "[^.,]", ",").pattern()
    return any(not pattern.fullmatch(f"{whole},{rest}") for whole, rest in QUOTED_DECIMAL.findall(text))


def _may_part_either(lines: Sequence[str]) -> str:
    """Return the only mark in the numbers of rows where it stands as it would to part thousands; empty elsewhere."""
    for delimiter in ("\t", ";", "|"):
        rows = _rows_of_numbers(lines, delimiter)
        if len(rows) < 3 or 2 * len(rows) < sum(bool(line.strip()) for line in lines):
            continue
        fields = [f for row in rows for f in row]
        marks = [m for m in ",." if any(m in f for f in fields)]
        if len(marks) == 1 and _all_grouped(fields, Thousands(marks[0], "[^.,]", delimiter)):
            return marks[0]
    return ""


def _large_between(lines: Sequence[str]) -> list[str]:
    """Return lines between the first and the last with a number that a mark may part: a force seldom reaches 1000."""
    found = [line for line in lines[SPELLING_LINES:-SPELLING_LINES] if LARGE_NUMBER.search(line)]
    return found[:: 1 + len(found) // SPELLING_LINES]


def _thousands(lines: Sequence[str]) -> list[Thousands]:
    """Return the marks that part thousands, at most one of points and commas."""
    text = "\n".join(lines)
    some = lines[:: 1 + len(lines) // REFUTING_LINES]
    before_three = [m for m in (*SPACES, ".", ",") if re.search(rf"{re.escape(m)}\d{{3}}(?!\d)", text)]
    for delimiter in ("\t", ";", "|", ","):
        marks = [m for m in before_three if m != delimiter or '"' in text]
        few = _rows_of_numbers(some, delimiter)
        fields = [f for row in few for f in row]
        if 2 * len(few) > len(some) and not any(all(_grouped(fields, Thousands(m, "[.,]", delimiter))) for m in marks):
            return []
        rows = _rows_of_numbers(lines, delimiter)
        if len(rows) < 3 or 2 * len(rows) < sum(bool(line.strip()) for line in lines):
            continue
        width = max(len(r) for r in rows)
        columns = [[r[k] for r in rows if k < len(r) and r[k]] for k in range(width)]
        fields = [f for column in columns for f in column]
        written = set("".join(fields))
        spaces = [Thousands(m, "[.,]", delimiter) for m in SPACES if m in written]
        return [t for t in spaces if _all_grouped(fields, t)] + _marked(columns, fields, delimiter)
    return []


def _rows_of_numbers(lines: Sequence[str], delimiter: str) -> list[list[str]]:
    """Return the fields of lines that hold numbers alone, however they are spelt."""
    rows = [split(line, delimiter) for line in lines if delimiter in line]
    return [r for r in rows if any(r) and all(map(SPELT.fullmatch, r))]


def _grouped(fields: list[str], thousands: Thousands) -> list[bool]:
    """Return of each number with a mark whether the mark may part thousands there."""
    pattern = thousands.pattern()
    return [bool(pattern.fullmatch(f)) for f in fields if thousands.mark in f]


def _all_grouped(fields: list[str], thousands: Thousands) -> bool:
    """Whether a mark stands in some numbers, and only where it may part thousands."""
    grouped = _grouped(fields, thousands)
    return bool(grouped) and all(grouped)


def _marked(columns: list[list[str]], fields: list[str], delimiter: str) -> list[Thousands]:
    for mark, decimal in ((".", ","), (",", r"\.")):
        thousands = Thousands(mark, decimal, delimiter)
        if not _all_grouped(fields, thousands):
            continue
        other = decimal[-1]
        twice = any(f.count(mark) > 1 or mark in f and other in f for f in fields)
        reverse = Thousands(other, re.escape(mark), delimiter).pattern()
        decimals = any(other in f and not reverse.fullmatch(f) for f in fields)
        if twice or decimals or any(_goes_on(column, mark) for column in columns):
            return [thousands]
    return []


def _goes_on(column: list[str], mark: str) -> bool:
    """Whether a column has whole numbers of three digits at most without the mark, and greater ones with it."""
    whole = [f.lstrip("+-") for f in column if mark not in f]
    return (
        len(whole) < len(column) and any(len(f) == 3 for f in whole) and all(f.isdigit() and len(f) < 4 for f in whole)
    )
