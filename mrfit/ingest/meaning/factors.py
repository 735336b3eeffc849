"""Factors that stand in names and units of columns: ``Force x1000 (N)``, ``Force (10^3 N)``, ``Force (N x 10)``."""

import re
from collections.abc import Sequence
from dataclasses import replace

from mrfit.core.recording import Finding
from mrfit.ingest import series
from mrfit.ingest.meaning import units
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.table import Column
from mrfit.ingest.text.layout import name_and_unit

SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
POWER = r"10[⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+|10(?:\^|\*\*)\(?[+-]?\d+\)?|10?[eE][+-]?\d+|10+(?:[.,]0+)?|0[.,]0*1"
IN_NAME = re.compile(rf"(?:(?<=[\s_)\]])|^|(?<=\())([x×*·⋅/÷])\s*({POWER})(?=$|[\s_(\[)])")
BEHIND = re.compile(rf"(.*\S)\s*[x×*·⋅]\s*({POWER})")
BEFORE = re.compile(rf"[x×*·⋅]?\s*({POWER}|[1-9]\d*)\s*[x×*·⋅]?\s*([^\W\d].*)")


def with_factors(columns: Sequence[Column], rules: Rules) -> tuple[list[Column], list[Finding]]:
    """Return columns multiplied by the factors that their names and units give, and what was done.

    A division in a name can mean either way, and a factor may leave no unit: such a column gets a unit that nothing
    knows, so that it is no channel until a map says what it holds. A column whose unit or scale a map gives stays.
    """
    given = {c for r in rules.channels.values() if r.unit is not None or r.scale != 1.0 for c in _wanted(r.column)}
    asked = {c for r in rules.channels.values() for c in _wanted(r.column)}
    made, said = [], []
    for column in columns:
        if column.name.lower() in given or column.index in given:
            made.append(column)
            continue
        found = _factored(column)
        if found is None:
            made.append(column)
            continue
        changed, factor = found
        if column.name.lower() in asked:
            changed = replace(changed, name=column.name)
        made.append(changed)
        if factor is not None:
            text = (
                f"'{column.name}' in '{column.unit or '-'}' has the factor {factor:g}: its numbers are multiplied by it"
            )
            said.append(Finding("factor", "", None, text))
    return made, said


def _wanted(column: str | int | list[str]) -> list[str | int]:
    return [c.lower() if isinstance(c, str) else c for c in (column if isinstance(column, list) else [column])]


def _factored(column: Column) -> tuple[Column, float | None] | None:
    """Return a column with its numbers multiplied, and the factor; None if it has none."""
    if match := IN_NAME.search(column.name):
        bare = re.sub(r"[(\[]\s*[)\]]", "", column.name[: match.start()] + column.name[match.end() :]).strip(" _")
        name, unit = name_and_unit(bare) if column.unit is None else (bare, column.unit)
        if not unit or match[1] in "/÷":
            return replace(column, unit=f"{unit or ''} {match[1]}{match[2]}".strip()), None
        return _multiplied(column, name, unit, match[2])
    if column.unit is None or units.known(column.unit):
        return None
    for form, number, unit_group in ((BEHIND, 2, 1), (BEFORE, 1, 2)):
        match = form.fullmatch(column.unit.strip())
        if match and units.known(match[unit_group]):
            return _multiplied(column, column.name, match[unit_group], match[number])
    return None


def _multiplied(column: Column, name: str, unit: str, text: str) -> tuple[Column, float]:
    factor = _value(text)
    values = series.mapped(lambda v: factor * v, column.values)
    return replace(column, name=name, unit=unit, values=values, digits=None), factor


def _value(text: str) -> float:
    plain = re.sub(r"^10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)$", lambda m: f"1e{m[1].translate(SUPERSCRIPTS)}", text)
    plain = re.sub(r"^10(?:\^|\*\*)\(?([+-]?\d+)\)?$", r"1e\1", plain)
    return float(plain.replace(",", "."))
