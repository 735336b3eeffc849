r"""Tables for LaTeX (booktabs) that fit a column or a page: wide ones are set across it, wider and longer ones split.

Widths are estimated from what is seen of a cell, on the generous side: a table never sticks out of its column.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from mrfit.report.determined import NEXT_TO_NOTHING
from mrfit.report.numbers import escape_latex, in_html, significant, with_interval

COLUMN, PAGE = 216.0, 340.0
"""Widths in pt that a table may have in one of two columns of A4 or letter paper, and across a page."""
LONGEST_CELL = 36
"""Rows of one table."""
GAP = 6.0
"""Space between columns in pt."""
TEXT_WIDTHS = (60.0, 95.0, 150.0)
"""Widths in pt of columns of text in a narrow and in a wide table, and of names at most."""
HEAD = r"""% \usepackage{booktabs} is needed. Numbers are set by siunitx where it is loaded.
\providecommand{\mrfitvalue}[4]{% value, its uncertain last digits, the same as a number, power of ten
  \ifdefined\num\num{#1(#2)\if\relax\detokenize{#4}\relax\else e#4\fi}\else
  \if\relax\detokenize{#4}\relax$#1\pm #3$\else$(#1\pm #3)\times10^{#4}$\fi\fi}
\providecommand{\mrfitnumber}[2]{\ifdefined\num\num{#1\if\relax\detokenize{#2}\relax\else e#2\fi}\else
  $#1\if\relax\detokenize{#2}\relax\else\times10^{#2}\fi$\fi}
"""
SYMMETRIC = 0.1
"""Share by which the halves of an interval may differ to be written as one."""


@dataclass(frozen=True)
class Cell:
    """A cell: LaTeX, and what is seen of it, by which its width is estimated."""

    latex: str
    seen: str

    @property
    def width(self) -> float:
        """Width in pt in print of footnotes."""
        return sum(map(_advance, self.seen))

    def marked(self, latex: str, seen: str) -> "Cell":
        """Return the cell with something behind it."""
        return Cell(self.latex + latex, self.seen + seen)


def _advance(letter: str) -> float:
    if letter in " .,:;il|'·":
        return 2.9
    if letter in "-()[]":
        return 3.4
    if letter in "±×":
        return 10.4
    return 6.8 if letter.isupper() or letter in "mwΩ%∞–−" else 4.5


EMPTY = Cell("", "")
BREAKS = re.compile(r"(?<=\w-)|(?<=\w[./+])(?=[A-Za-z])")
"""Where a name may be broken into lines."""


def words(text: str) -> Cell:
    """Return plain text as a cell; it may be broken after hyphens, and dots and bars before a letter."""
    parts = BREAKS.split(text)
    return Cell("\\allowbreak{}".join(map(escape_latex, parts)), text)


def number(value: float | None, digits: int = 3) -> Cell:
    """Return a number with significant digits; a dash for none."""
    text = significant(value, digits)
    if not text:
        return Cell("--", "–")
    return Cell(_number(text), in_html(text))


def _number(text: str) -> str:
    mantissa, _, exponent = text.partition("e")
    return rf"\mrfitnumber{{{mantissa}}}{{{exponent}}}"


def with_uncertainty(value: float, low: float | None, high: float | None) -> Cell:
    """Return a value to the digit at which half of its interval has two, with that half behind it.

    Halves that differ by more than a tenth are written one above the other; of an open interval nothing is said.
    """
    shown, *_ = with_interval(value, low, high)
    if low is None or high is None or not math.isfinite(high - low) or low == high:
        return Cell(_number(shown), in_html(shown))
    if abs(value) < NEXT_TO_NOTHING * (high - low) / 2.0:
        # 0 to the digits of the interval, as on a page
        half, _, power = significant((high - low) / 2.0, 2).partition("e")
        value, shown = 0.0, f"{0.0:.{len(half.partition('.')[2])}f}{f'e{power}' if power else ''}"
    mantissa, _, exponent = shown.partition("e")
    scale = 10.0 ** int(exponent or 0)
    digits = len(mantissa.partition(".")[2])
    below, above = ((value - low) / scale, (high - value) / scale)
    if abs(above - below) > SYMMETRIC * (above + below):
        halves = f"{above:.{digits}f}", f"{below:.{digits}f}"
        power = rf"\times10^{{{exponent}}}" if exponent else ""
        seen = f"{mantissa}++{max(halves, key=len)}" + (f"×10{exponent}" if exponent else "")
        return Cell(rf"${mantissa}^{{+{halves[0]}}}_{{-{halves[1]}}}{power}$", seen)
    half = f"{(above + below) / 2.0:.{digits}f}"
    uncertain = half.replace(".", "").lstrip("0") or "0"
    latex = rf"\mrfitvalue{{{mantissa}}}{{{uncertain}}}{{{half}}}{{{exponent}}}"
    seen = f"{mantissa} ± {half}" + (f"()×10{exponent}" if exponent else "")
    return Cell(latex, seen)


@dataclass(frozen=True)
class Table:
    """A table to be laid out.

    Attributes
    ----------
    caption, label
        Plain text, and the name by which the text refers to it.
    header
        Rows of headings.
    rows
        Cells, every row as long as the headings.
    align
        A letter a column: ``l``, ``c``, ``r``, and ``t`` for text that may be broken into lines.
    note
        LaTeX below it.
    fixed
        How many columns on the left stand again in every part of a table that is too wide.
    """

    caption: str
    label: str
    header: Sequence[Sequence[Cell]]
    rows: Sequence[Sequence[Cell]]
    align: str
    note: str = ""
    fixed: int = 1


def tables_tex(table: Table) -> str:
    """Return one float, or as many as it takes for each to fit a page."""
    parts = [long for wide in _split_columns(table) for long in _split_rows(wide)]
    shown = []
    for number_, part in enumerate(parts, start=1):
        suffix = f", part {number_} of {len(parts)}" if len(parts) > 1 else ""
        label = part.label + (f":{number_}" if number_ > 1 else "")
        shown.append(_float(replace(part, caption=part.caption + suffix, label=label)))
    return "\n".join(shown)


def _widths(table: Table, text: float) -> list[float]:
    found = []
    for column, letter in enumerate(table.align):
        widest = max(row[column].width for row in [*table.header, *table.rows])
        found.append(min(widest, max(text, _longest(table, column))) if letter == "t" else widest)
    return found


def _longest(table: Table, column: int) -> float:
    """Return the width of the longest part of a column's texts that cannot be broken."""
    parts = (part for row in table.rows for word in row[column].seen.split() for part in BREAKS.split(word))
    return max((Cell(part, part).width for part in parts), default=0.0)


def _total(widths: Sequence[float]) -> float:
    return sum(widths) + GAP * (len(widths) - 1)


def _split_columns(table: Table) -> list[Table]:
    """Return tables of which each is at most as wide as a page."""
    widths = _widths(table, TEXT_WIDTHS[0])
    if _total(widths) <= PAGE:
        return [table]
    fixed, parts, now = widths[: table.fixed], [], list[int]()
    for column in range(table.fixed, len(widths)):
        if now and _total([*fixed, *(widths[c] for c in now), widths[column]]) > PAGE:
            parts.append(now)
            now = []
        now.append(column)
    parts.append(now)
    return [_columns(table, [*range(table.fixed), *part]) for part in parts]


def _columns(table: Table, chosen: Sequence[int]) -> Table:
    header = [[row[c] for c in chosen] for row in table.header]
    rows = [[row[c] for c in chosen] for row in table.rows]
    rows = [row for row in rows if any(cell.latex for cell in row[table.fixed :])]
    return replace(table, header=header, rows=rows, align="".join(table.align[c] for c in chosen))


def _split_rows(table: Table) -> list[Table]:
    count = -(-len(table.rows) // LONGEST_CELL)
    edges = [round(k * len(table.rows) / count) for k in range(count + 1)]
    return [replace(table, rows=table.rows[a:b]) for a, b in zip(edges, edges[1:], strict=False)]


def _float(table: Table) -> str:
    text = next(w for w in TEXT_WIDTHS[1::-1] if _total(_widths(table, w)) <= PAGE or w == TEXT_WIDTHS[0])
    narrow = next((w for w in TEXT_WIDTHS[::-1] if _total(_widths(table, w)) <= COLUMN), None)
    star = "" if narrow else "*"
    widths = _widths(table, narrow or text)
    align = "".join(_letter(letter, w) for letter, w in zip(table.align, widths, strict=True))
    wrapped = [[_wrapped(c, a) for c, a in zip(row, table.align, strict=True)] for row in table.rows]
    lines = [
        rf"\begin{{table{star}}}[htbp]",
        r"\centering\footnotesize\setlength{\tabcolsep}{3pt}",
        rf"\caption{{{escape_latex(table.caption)}}}",
        rf"\label{{{table.label}}}",
        rf"\begin{{tabular}}{{@{{}}{align}@{{}}}}",
        r"\toprule",
        *(" & ".join(c.latex for c in row) + r" \\" for row in table.header if any(c.latex for c in row)),
        r"\midrule",
        *(" & ".join(row) + r" \\" for row in wrapped),
        r"\bottomrule",
        r"\end{tabular}",
        *(
            [rf"\par\smallskip\parbox{{{COLUMN if narrow else PAGE:.0f}pt}}{{\raggedright {table.note}}}"]
            if table.note
            else []
        ),
        rf"\end{{table{star}}}",
    ]
    return "\n".join(lines) + "\n"


def _letter(letter: str, width: float) -> str:
    return f"p{{{width:.0f}pt}}" if letter == "t" else letter


def _wrapped(cell: Cell, letter: str) -> str:
    return rf"\raggedright\hspace{{0pt}}{cell.latex}" if letter == "t" else cell.latex
