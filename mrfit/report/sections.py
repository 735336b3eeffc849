"""A page of sections: words, tables and figures in the report's style, in one file that opens offline."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import version
from typing import Any

from mrfit.report.key import TEMPLATE
from mrfit.report.numbers import in_html, significant
from mrfit.report.page import template_of

VERDICTS = {"pass": "pass", "fail": "fail", "cannot be judged": "open"}
"""Cells that say a verdict -> their class in the page."""
NUMBER_SHOWN = re.compile(r"[−-]?\d[\d.]*(×10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?( \S+)?")
"""A number as a page shows it, with its unit."""
OPEN_ROWS = 400
"""Rows of a table that stand on the page at once; the others are unfolded."""


@dataclass(frozen=True)
class Table:
    """A table; numbers in it are shown with a few significant digits, ``first`` rows before it is unfolded."""

    caption: str
    heads: Sequence[str]
    rows: Sequence[Sequence[Any]]
    digits: int = 3
    first: int = OPEN_ROWS

    @cached_property
    def numeric(self) -> list[bool]:
        """Whether there is a number in each column, given as one or as text."""
        return [any(_is_number(row[k]) for row in self.rows) for k in range(len(self.heads))]

    @cached_property
    def cells(self) -> list[list[str]]:
        """The rows as they are shown."""
        return [[cell(value, self.digits) for value in row] for row in self.rows]


@dataclass(frozen=True)
class SectionFigure:
    """A figure as part of the page."""

    title: str
    caption: str
    svg: str


@dataclass(frozen=True)
class Section:
    """A section of a page; a folded one shows its tables on demand."""

    title: str
    words: Sequence[str] = ()
    tables: Sequence[Table] = ()
    figures: Sequence[SectionFigure] = field(default_factory=tuple)
    folded: bool = False


def render(
    title: str,
    lead: str,
    facts: Sequence[tuple[str, str]],
    sections: Sequence[Section],
    file: str,
    script: str = "",
) -> str:
    """Return a page; ``file`` is the name of the JSON file with all numbers, ``script`` moves its figures."""
    template = template_of(TEMPLATE.with_name("sections.html.jinja"))
    return template.render(
        title=title,
        lead=lead,
        facts=facts,
        sections=sections,
        file=file,
        script=script,
        version=version("mrfit"),
        verdicts=VERDICTS,
    )


def _is_number(value: object) -> bool:
    if isinstance(value, str):
        return NUMBER_SHOWN.fullmatch(value) is not None
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def hover_script() -> str:
    """Return the script by which figures say their values under the pointer, as those of the report do."""
    return TEMPLATE.with_name("page.js.jinja").read_text(encoding="utf-8")


def cell(value: Any, digits: int = 3) -> str:
    """Return a value as it stands in a table."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:d}"
    if isinstance(value, float):
        return in_html(significant(value, digits)) if value == value else "–"
    return str(value)
