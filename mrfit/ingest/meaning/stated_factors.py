"""Factors that lines of a header state: whether the numbers hold them already is not known, so that they are said."""

import re
from collections.abc import Sequence
from dataclasses import replace

from mrfit.core.recording import Finding
from mrfit.ingest.refusal import excerpt
from mrfit.ingest.table import Table

STATED_FACTOR = re.compile(
    r"\b(?:gain|multipl(?:y|ied|ier|icator)|scal(?:e|ing)(?: factor)?|(?:conversion |calibration )?factor|calibration"
    r"|faktor|verst(?:ä|ae)rkung|skalierung|attenuation|in units of|y *=)(?![^\W\d])[^\d\n]*?"
    r"(?P<number>\d+(?:[.,]\d+)?(?:e[+-]?\d+)?)(?![\d:/-])|\brange\b[^\d\n]*(?P<times>\d+)[x×](?!\w)",
    re.IGNORECASE,
)
"""A word and the first number behind it, or a number of times."""
OF_A_SENSOR = re.compile(
    r"\d(?:[.,]\d+)?(?:e[+-]?\d+)? ?(?:[^\W\d]+/(?:m?V|LSB|counts?|bits?|digits?)|mV/[^\W\d]+)\b(?<!/div)",
    re.IGNORECASE,
)
"""What a sensor gives: ``500 N/V``, ``0.01 mm/count``, ``2 mV/N``."""
OF_INSTRUMENTS = re.compile(
    r"\b(?:probe|vertical|horizontal|time ?base|time|full[ -]?scale|grid|zoom|display|div|filter|date|range|y-?scale"
    r"|channel \d|ch ?\d|certificate|valid|due|until|controller|pid|[pid] gain|attenuation)|\d\.\d+\.\d",
    re.IGNORECASE,
)
"""Words of settings that the instrument has applied itself."""


def with_stated_factors(table: Table, lines: Sequence[str]) -> Table:
    """Return a table with a finding on each line of its header that states a factor other than 1."""
    said = [line for line in lines if _states_factor(line)]
    if not said:
        return table
    shown = " and ".join(f"'{excerpt(line)}'" for line in said[:3])
    text = f"the header says {shown}: not applied; a channel map can, by scale = … of a channel"
    return replace(table, findings=(*table.findings, Finding("factor-stated", "", None, text)))


def _states_factor(line: str) -> bool:
    if OF_A_SENSOR.search(line):
        return True
    found = STATED_FACTOR.search(line)
    if found is None or found["number"] is not None and OF_INSTRUMENTS.search(line):
        return False
    return float((found["number"] or found["times"]).replace(",", ".")) != 1.0
