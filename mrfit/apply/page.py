"""The facts of a damper that the pages of ``mrfit apply`` begin with."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias, TypeVar

from mrfit.apply.damper import Damper
from mrfit.core import registry
from mrfit.core.specs import ModelSpec
from mrfit.report.numbers import in_html, significant, unit_html
from mrfit.report.sections import Table

Row = TypeVar("Row")
Columns: TypeAlias = dict[str, Callable[[Row], Any]]
"""A table's columns: head -> the cell of a row."""


def table_of(caption: str, columns: Mapping[str, Callable[[Row], Any]], rows: Sequence[Row]) -> Table:
    """Return a table of rows."""
    return Table(caption, list(columns), [[of(row) for of in columns.values()] for row in rows])


def facts_of(damper: Damper) -> list[tuple[str, str]]:
    """Return the facts of a damper for its page, as labels and words."""
    spec = damper.assembly.spec
    varying = ", ".join(f"{n} (order {o})" for n, o in damper.orders) or "the current is an input of the model"
    return [
        ("Damper", f"{damper.name}: {damper.model}"),
        ("Equation", "; ".join([spec.equation, *registry.equations_of_effects(damper.model)])),
        ("Current", f"{in_html(f'{damper.low:.4g}')} to {damper.high:.4g} A; depends on it: {varying}"),
        ("Parameters", values_of(damper.parameters, spec)),
    ]


def values_of(parameters: Sequence[tuple[str, float]], spec: ModelSpec) -> str:
    """Return parameters with their values and units in words."""
    known = zip(parameters, spec.params, strict=True)
    return ", ".join(f"{n} {significant(v)} {unit_html(p.unit)}".strip() for (n, v), p in known)
