"""The sample interval that a header states as rate or interval."""

import re
from collections.abc import Sequence
from dataclasses import replace

from mrfit.core.recording import Finding
from mrfit.ingest.meaning import units
from mrfit.ingest.table import Table
from mrfit.ingest.text.layout import name_and_unit

STATED = re.compile(
    r"((?:sampl(?:e|ing)|acquisition|scan)[ _]*(rate|frequency|interval|period|time)\b[^0-9+-]*?)"
    r"\+?((?:\d(?:\d|[.,'](?=\d))*\.?|\.\d+)(?:[ \u00a0\u202f]\d{3}(?!\d))*)(e[+-]?\d+)?(?!\d|[:/-]\d)"
    r"[ \u00a0]*([a-zµ/]*)[\s,;]*([a-zµ/]*)",
    re.IGNORECASE,
)
"""Label with its word, number, power of ten, the unit behind it, and what stands in the next field."""
GROUPED = re.compile(r"[1-9]\d{0,2}([., '\u00a0\u202f])\d{3}((?:\1\d{3})*(?:[.,]\d+)?)")
"""A number whose first mark may part thousands, and what follows on the first group."""


def stated_interval(
    lines: Sequence[str], delimiter: str = ",", decimal: str = "."
) -> tuple[float | None, tuple[Finding, ...]]:
    """Return the sample interval in s that a header line states, or None, and a finding if it can be read in two ways.

    Parameters
    ----------
    lines
        The header.
    delimiter, decimal
        Of the rows; ``decimal`` is empty where they do not show it.
    """
    for line in lines:
        if not (match := STATED.search(line)):
            continue
        label, word, number, power, behind, beside = match.groups("")
        kind = "Hz" if word.lower() in ("rate", "frequency") else "s"
        unit = _unit(behind, name_and_unit(label.rstrip(' \t:=,;"'))[1], beside, kind)
        if unit is None:
            continue
        plain = _plain(number.rstrip("."), delimiter, decimal, bool(behind))
        if plain is None:
            text = f"the header's '{match[0].strip(' ,;')}' can be read in more than one way: not used"
            return None, (Finding("rate-unclear", "", None, text),)
        if (value := float(plain + power)) > 0.0:
            return interval(value, unit), ()
    return None, ()


def with_rate(table: Table, lines: Sequence[str], delimiter: str = ",", decimal: str = ".") -> Table:
    """Return a table with the interval that its header states, if it states one."""
    dt, findings = stated_interval(lines, delimiter, decimal)
    return replace(table, dt=dt, findings=(*table.findings, *findings))


def interval(value: float, unit: str) -> float:
    """Return the sample interval in s of a rate or an interval."""
    if units.compatible(unit, "s"):
        return value * units.to_unit(unit, "s").scale
    return 1.0 / (value * units.to_unit(unit, "Hz").scale)


def _unit(behind: str, before: str | None, beside: str, kind: str) -> str | None:
    """Return the unit of a number: what is written behind it, before it in brackets, or in the next field; else SI."""
    if behind:
        return _of_kind(behind, kind)
    return _of_kind(before or "", kind) or _of_kind(beside, kind) or kind


def _of_kind(text: str, kind: str) -> str | None:
    unit = re.sub(r"([kM]?)(?i:sps|sa/s|s/s|samples/s)", r"\1Hz", text) if kind == "Hz" else text
    return unit if unit and units.compatible(unit, kind) else None


def _plain(number: str, delimiter: str, decimal: str, united: bool) -> str | None:
    """Return ``1000``, ``1,000``, ``0,001`` or ``1 000`` with a decimal point only; None if a mark may mean two things.

    A mark before three digits parts thousands where it can be neither the decimal mark nor the delimiter: of two fields
    the second is no ``000``, and has no unit of its own (``united``).
    """
    if (grouped := GROUPED.fullmatch(number)) and (grouped[1] != "." or decimal == ","):
        mark, rest = grouped.groups()
        if mark == (delimiter or " ") and not united and number[number.index(mark) + 1] != "0":
            return None
        if mark in ".," and not rest and decimal != ".":
            return number.replace(",", ".") if mark == decimal else None
        return number.replace(mark, "").replace(",", ".")
    if delimiter == "," and not united and not number.startswith("0,"):
        number = number.partition(",")[0]
    plain = number.replace(",", ".")
    return plain if plain.count(".") < 2 else None
