"""A page of sections: words, tables and figures in the report's style, in one file that opens offline."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup, escape

from mrfit.core.counting import number_of
from mrfit.report.figures import Figure
from mrfit.report.key import REPORT_TEMPLATE
from mrfit.report.numbers import in_html, significant
from mrfit.report.svg import inline

if TYPE_CHECKING:
    from jinja2 import Template

SECTIONS_TEMPLATE = REPORT_TEMPLATE.with_name("sections.html.jinja")
VERDICTS = {"pass": "pass", "fail": "fail", "cannot be judged": "open"}
"""Cells that say a verdict -> their class in the page."""
NUMBER_SHOWN = re.compile(r"[−-]?\d[\d.]*(×10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?( \S+)?")
"""A number as a page shows it, with its unit."""
OPEN_ROWS = 400
"""Rows of a table that stand on the page at once; the others are unfolded."""


@dataclass(frozen=True)
class Table:
    """A table; numbers in it are shown with a few significant digits, ``first`` rows before it is unfolded.

    ``name`` is its class in the page; the rows ``best`` stand out.
    """

    caption: str
    heads: Sequence[str]
    rows: Sequence[Sequence[Any]]
    digits: int = 3
    first: int = OPEN_ROWS
    name: str = ""
    best: Collection[int] = ()

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
    narrow: bool = False


@dataclass(frozen=True)
class Section:
    """A section of a page, with ``points`` as a list after its tables; a folded one shows its tables on demand.

    Tables without rows are left out, and so is a section with nothing in it.
    """

    title: str
    words: Sequence[str] = ()
    tables: Sequence[Table] = ()
    figures: Sequence[SectionFigure] = field(default_factory=tuple)
    folded: bool = False
    points: Sequence[str] = ()


def render(
    title: str,
    lead: str,
    facts: Sequence[tuple[str, str]],
    sections: Sequence[Section],
    file: str,
    script: str = "",
) -> str:
    """Return a page; ``file`` is the name of the JSON file with all numbers, ``script`` moves its figures."""
    return template_of(SECTIONS_TEMPLATE).render(
        title=title,
        lead=lead,
        facts=facts,
        sections=[s for s in sections if any((s.words, s.figures, s.points, *(t.rows for t in s.tables)))],
        file=file,
        script=script,
        version=version("mrfit"),
        verdicts=VERDICTS,
    )


def template_of(path: Path) -> "Template":
    """Return a page's template, which may include others of its folder; what is put into it is text, not markup."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(path.parent),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    environment.globals["number_of"] = number_of
    return environment.get_template(path.name)


def exact(value: float | None, shown: str) -> Markup:
    """Return a number as it is shown, with every digit for machines where there is one."""
    shown = in_html(shown)
    return escape(shown) if value is None else Markup('<data value="{}">{}</data>').format(repr(value), shown)


def _is_number(value: object) -> bool:
    if isinstance(value, Markup):
        return value.startswith("<data ")
    if isinstance(value, str):
        return NUMBER_SHOWN.fullmatch(value) is not None
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def figures_in_page(figures: Sequence[Figure], prefix: str) -> list[SectionFigure]:
    """Return figures as parts of a page; the names in their drawings begin with a prefix."""
    return [
        SectionFigure(f"{f.title}.", f.caption, inline(f.svg, f"{prefix}{k}", f.alt), f.narrow)
        for k, f in enumerate(figures, start=1)
    ]


def hover_script() -> str:
    """Return the script by which figures say their values under the pointer, as those of the report do."""
    return REPORT_TEMPLATE.with_name("page.js.jinja").read_text(encoding="utf-8")


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
    return value if isinstance(value, str) else str(value)
