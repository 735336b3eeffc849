"""Factors that stand in names and units of columns: ``Force x1000 (N)``, ``Force (10^3 N)``, ``Force (N x 10)``."""

import re
from collections.abc import Sequence
from dataclasses import replace

from mrfit.core.recording import Finding
from mrfit.ingest import series
from mrfit.ingest.meaning import units
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.meaning.chosen import mapped_places
from mrfit.ingest.table import Column
from mrfit.ingest.text.layout import aliases_of, name_and_unit

SUPERSCRIPT_DIGITS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
POWER_OF_TEN = r"10[⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+|10(?:\^|\*\*)\(?[+-]?\d+\)?|10?[eE][+-]?\d+|10+(?:[.,]0+)?|0[.,]0*1"
FACTOR_NUMBER = r"\d+(?:[.,]\d+)?"
ROUND_FACTOR = r"[1-9]\d*[05]|0[.,]\d+"
"""Numbers that a channel is hardly called by, behind an x."""
_END = r"(?=$|[\s_(\[)])"
IN_NAME = (
    re.compile(rf"(?:(?<=[\s_)\]])|^|(?<=\())([xX×*·⋅/÷])\s*({POWER_OF_TEN}|{ROUND_FACTOR}){_END}"),
    re.compile(rf"(?<=[\w)\]])\s*([×*·⋅/÷])\s*({POWER_OF_TEN}|{FACTOR_NUMBER}){_END}"),
    re.compile(rf"^()({POWER_OF_TEN}|{FACTOR_NUMBER})\s*[×*·⋅]\s*(?=[^\W\d])|^()({POWER_OF_TEN})\s*[xX]\s+(?=[^\W\d])"),
    re.compile(rf"(?<=[\s_(])()({POWER_OF_TEN})\s?[xX×]{_END}"),
)
"""An operator and a number behind a name, or before it."""
TIGHT = re.compile(rf"(.*[^\W\d_])x({POWER_OF_TEN}){_END}(.*)")
FACTOR_BEHIND = re.compile(rf"(.*\S)\s*[xX×*·⋅]\s*({POWER_OF_TEN})")
FACTOR_BEFORE = re.compile(rf"[xX×*·⋅]?\s*({POWER_OF_TEN}|[eE][+-]?\d+(?=\s)|[1-9]\d*)\s*[xX×*·⋅]?\s*([^\W\d].*)")


def with_factors(columns: Sequence[Column], rules: Rules) -> tuple[list[Column], list[Finding]]:
    """Return columns multiplied by the factors that their names and units give, and what was done.

    A division in a name can mean either way, and a factor may leave no unit: such a column gets a unit that nothing
    knows, so that it is no channel until a map says what it holds. A column whose unit or scale a map gives stays.
    """
    given, asked = mapped_places(rules, columns, settled=True), mapped_places(rules, columns)
    made, said = [], []
    for column in columns:
        if column.index in given:
            made.append(column)
            continue
        found = _factored(column)
        if found is None:
            made.append(column)
            continue
        changed, factor = found
        if column.index in asked:
            changed = replace(changed, name=column.name)
        made.append(changed)
        if factor is not None:
            text = (
                f"'{column.name}' in '{column.unit or '-'}' has the factor {factor:g}: its numbers are multiplied by it"
            )
            said.append(Finding("factor", "", None, text))
    return made, said


def _factored(column: Column) -> tuple[Column, float | None] | None:
    """Return a column with its numbers multiplied, and the factor; None if it has none."""
    if found := _in_name(column.name):
        bare, sign, number = found
        bare = re.sub(r"[(\[]\s*[)\]]", "", bare).strip(" _")
        name, unit = name_and_unit(bare) if column.unit is None else (bare, column.unit)
        if not unit or sign in ("/", "÷"):
            return replace(column, unit=f"{unit or ''} {sign or 'x'}{number}".strip()), None
        return replace(multiplied(column, value_of(number)), name=name, unit=unit), value_of(number)
    if column.unit is None or units.known(column.unit):
        return None
    for form, number_group, unit_group in ((FACTOR_BEHIND, 2, 1), (FACTOR_BEFORE, 1, 2)):
        match = form.fullmatch(column.unit.strip())
        if match and units.known(match[unit_group]):
            factor = value_of(match[number_group])
            return replace(multiplied(column, factor), unit=match[unit_group]), factor
    return None


def _in_name(text: str) -> tuple[str, str, str] | None:
    """Return a name without its factor, the operator and the number of that; None if it has none."""
    for form in IN_NAME:
        if match := form.search(text):
            sign, number = (g for g in match.groups() if g is not None)
            return text[: match.start()] + text[match.end() :], sign, number
    if (match := TIGHT.fullmatch(text)) and aliases_of(match[1]):
        return match[1] + match[3], "x", match[2]
    return None


def multiplied(column: Column, factor: float) -> Column:
    """Return a column multiplied by a factor."""
    if factor == 1.0:
        return column
    return replace(column, values=series.mapped(lambda v: factor * v, column.values), digits=None)


def value_of(text: str) -> float:
    """Return a factor as a number: ``1000``, ``0,5``, ``10^3``, ``10³``."""
    plain = re.sub(r"^10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)$", lambda m: f"1e{m[1].translate(SUPERSCRIPT_DIGITS)}", text)
    plain = re.sub(r"^(?=[eE])", "1", plain)
    plain = re.sub(r"^10(?:\^|\*\*)\(?([+-]?\d+)\)?$", r"1e\1", plain)
    return float(plain.replace(",", ".").replace("∞", "inf"))
