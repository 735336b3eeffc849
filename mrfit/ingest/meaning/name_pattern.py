"""The pattern that the names of logs follow, proposed from numbers with units in them: ``2mm5Hz0x25A``."""

import re
from collections.abc import Sequence

from mrfit.ingest.meaning.conditions import NAMED_NUMBER, from_name

CONDITION_OF_UNIT = {
    **{"mm": "amplitude", "cm": "amplitude", "deg": "amplitude", "Hz": "frequency", "A": "current", "mA": "current"},
    **{"degC": "temperature", "bar": "pressure", "V": "voltage", "mm/s": "velocity", "m/s": "velocity"},
}
"""Units in names of logs, and what they are units of."""
SPELLED = {unit.lower(): unit for unit in CONDITION_OF_UNIT} | {
    "c": "degC",
    "mms": "mm/s",
    "mmps": "mm/s",
    "mps": "m/s",
}
STATED_IN_NAME = re.compile(
    rf"({NAMED_NUMBER})([ _-]?(?:{'|'.join(sorted(map(re.escape, SPELLED), key=len, reverse=True))}))(?![a-z])",
    re.IGNORECASE,
)
"""A number with its unit."""


def pattern_of(stems: Sequence[str]) -> str:
    """Return the pattern that all names follow, as for ``--pattern``; empty where they state nothing alike."""
    read = [_stated(stem) for stem in stems]
    if not read or not read[0] or any([one[:2] for one in r] != [one[:2] for one in read[0]] for r in read):
        return ""
    pattern = ""
    for place, (key, written, _) in enumerate(read[0]):
        between = {r[place][2] for r in read}
        (text,) = between if len(between) == 1 else ("*",)
        last = place == len(read[0]) - 1
        unit = SPELLED[written.strip(" _-").lower()]
        pattern += f"{{{key}:{unit}}}{written}{'' if last else re.sub('[{}*]+', '*', text)}"
    return pattern if all(from_name(stem, pattern) for stem in stems) else ""


def _stated(stem: str) -> list[tuple[str, str, str]]:
    """Return quantity, unit as written, and the text up to the next of every quantity that a name states."""
    first: dict[str, re.Match[str]] = {}
    for match in STATED_IN_NAME.finditer(stem):
        first.setdefault(CONDITION_OF_UNIT[SPELLED[match[2].strip(" _-").lower()]], match)
    starts = [m.start() for m in first.values()]
    ends = [*starts[1:], len(stem)]
    return [(key, m[2], stem[m.end() : end]) for (key, m), end in zip(first.items(), ends, strict=False)]
