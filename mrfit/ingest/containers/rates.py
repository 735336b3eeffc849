"""Sample rates and intervals that attributes, properties and fields of a file state, by one rule for all formats."""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrfit.core.recording import Finding
from mrfit.ingest.containers.attributes import decoded, unit_beside, units_in
from mrfit.ingest.meaning import units
from mrfit.ingest.refusal import excerpt
from mrfit.ingest.time.rate import (
    DECIMATION,
    LONG_BARE,
    LONG_PERIOD,
    OF_SAMPLING,
    OTHERWISE,
    STATED_RATE,
    interval,
    kind_stated,
    of_kind,
)

UNIT_SUFFIXES = ("hz", "khz", "mhz", "s", "sec", "seconds", "ms", "us", "ns")
"""Words at the end of a name that say the unit of its number; ``mhz`` is MHz, since nobody counts samples in mHz."""
DECIMATIONS = ("decimation", "decimate", "downsampling", "downsample")
PLAIN_WORDS = re.compile(
    r"(?:(?:samples?|sampling|scan|acquisition|rate|freq(?:uency)?|interval|period|time|fs|dt|ts|delta ?t|daq|data"
    r"|ai|ch|channels?|signals?|file|actual|nominal|measurement|device) ?)*"
)
"""Words of the name of a rate, and those that may stand beside it where it is that of the rows."""
WITH_UNIT = re.compile(rf"(?:.* )?{OF_SAMPLING}[ \d]*", re.IGNORECASE)
"""Names that tell a rate or an interval only where a unit stands with the number, as the unit says."""
WORDS_OF_HEADERS = frozenset(
    "meta metadata header info information attributes properties settings setup test log".split()
)
"""Words for what a file states of all its numbers."""
SAME_INTERVAL = 1e-3
"""Relative difference of intervals that are one, printed or computed differently."""
LONGEST_STATEMENT = 60
"""Characters of a text that may state a number with its unit, and of a name."""
DEEPEST_STATEMENT = 4
"""Objects inside each other in which a rate is looked for."""
MARKED = re.compile(r"\d[\d.,' ]*[.,' ]\d+\s*[A-Za-z/]+")
"""A number with marks that may part thousands, and a unit."""


@dataclass(frozen=True, slots=True)
class StatedNumber:
    """A number with its name and unit, as a file states them; both may be texts, and the unit empty.

    ``within`` names what of the file it is part of, where that is not what the table is made of.
    """

    name: str
    value: Any
    unit: str = ""
    within: str = ""


@dataclass(frozen=True, slots=True)
class _Statement:
    text: str
    interval: float
    sort: str
    bare: bool


MAY_TELL = re.compile(r"fs|ts|dt|delta|increment|rate|freq|interval|period|time|sampl|decimat|thin|averag|divi", re.I)
"""Letters without which no name states a rate, nor what speaks against one."""


def may_tell(name: str) -> bool:
    """Whether a name may be that of a rate, or of what speaks against one."""
    return len(name) <= LONGEST_STATEMENT and bool(MAY_TELL.search(name))


def told_in(about: Mapping[Any, Any], within: str = "", deepest: int = DEEPEST_STATEMENT) -> list[StatedNumber]:
    """Return the numbers in attributes that may state a rate: also of objects in them, and with value and unit apart.

    ``within`` is where the attributes stand.
    """
    texts = texts_in(about)
    told: list[StatedNumber] = []
    for key, value in about.items():
        name = decoded(key)
        if isinstance(value, Mapping):
            if may_tell(name) and "value" in value:
                told.append(StatedNumber(name, value["value"], "".join(units_in(value)), within))
            elif deepest:
                told += told_in(value, f"{within}.{name}".strip("."), deepest - 1)
        elif may_tell(name):
            beside = texts.get("unit", "") if _words(name) == ["rate"] else ""  # of a ramp, as mm/s
            told.append(StatedNumber(name, value, unit_beside(name, texts, ("_", ".", " ", "")) or beside, within))
    return told


def texts_in(about: Mapping[Any, Any]) -> dict[str, str]:
    """Return the texts in attributes by name; those of objects in them behind the innermost one's name and a dot."""
    return _texts(about) | _texts_of_objects(about, DEEPEST_STATEMENT)


def _texts(about: Mapping[Any, Any]) -> dict[str, str]:
    return {decoded(key): decoded(value) for key, value in about.items() if isinstance(value, (str, bytes))}


def _texts_of_objects(about: Mapping[Any, Any], deepest: int) -> dict[str, str]:
    found: dict[str, str] = {}
    for key, inner in about.items() if deepest else ():
        if isinstance(inner, Mapping):
            found |= {f"{decoded(key)}.{name}": text for name, text in _texts(inner).items()}
            found |= _texts_of_objects(inner, deepest - 1)
    return found


def kind_of(name: str) -> str:
    """Return ``Hz`` for the name of a sample rate, ``s`` for that of an interval, with or without a unit; else ""."""
    kind, plain, _ = _named(_words(name)) if may_tell(name) else ("", False, "")
    return kind if plain else ""


def _words(name: str) -> list[str]:
    """Return the words of ``SampleRate``, ``sample_rate_hz`` or ``Sample Rate (Hz)`` in lower-case letters."""
    return [w.lower() for w in re.split(r"[\W_]+", re.sub(r"(?<=[a-z]{2})(?=[A-Z][a-z])", " ", name)) if w]


def _named(words: list[str]) -> tuple[str, bool, str]:
    """Return the kind of what words name, whether it can be of the rows only, and the unit that the last of them is.

    The words of headers of text hold here, too: a label is tried with a rate and with an interval.
    """
    unit = words[-1] if len(words) > 1 and words[-1] in UNIT_SUFFIXES else ""
    label = re.sub(r"\d", "", " ".join(words[:-1] if unit else words)).removeprefix("wf ").replace("increment", "dt")
    unit = {"khz": "kHz", "mhz": "MHz", "hz": "Hz"}.get(unit, unit)
    for tried in ("Hz", "ms"):
        match = STATED_RATE.search(f"{label}: 1 {tried}")
        if match and match.end("number") > len(label):
            return kind_stated(match), not match["other"] and PLAIN_WORDS.fullmatch(label) is not None, unit
    return "", False, unit


def stated_rate(told: Iterable[StatedNumber]) -> tuple[float | None, tuple[Finding, ...]]:
    """Return the sample interval in s that a file states, or None, and a finding if it states none without a doubt.

    In doubt are, as in a header of text, rates that differ, a rate beside a decimation, and rates of a camera, a
    filter or a display; a number without a unit that makes an interval above 1 s may be in ms or kHz.
    """
    found = [statement for one in told if (statement := _statement(one))]
    clear = [s for s in found if s.sort == "clear"]
    if not any(math.isfinite(s.interval) for s in clear):
        return None, _unclear(_one_of_each(s for s in found if s.sort != "thinned"))
    if all(s.bare for s in clear):
        return None, _unclear([f"{s.text} without a unit" for s in clear])
    rivals = [s for s in found if s.sort in ("clear", "rival", "thinned")]
    first = next(s for s in clear if math.isfinite(s.interval)).interval
    if all(abs(s.interval / first - 1.0) < SAME_INTERVAL for s in rivals):
        return first, ()
    return None, _unclear(_one_of_each(rivals))


def _one_of_each(found: Iterable[_Statement]) -> list[str]:
    """Return the texts of statements, one for each interval: many channels may state the same."""
    return list({f"{s.interval:.6g} {s.sort}": s.text for s in found}.values())


def _unclear(texts: list[str]) -> tuple[Finding, ...]:
    shown = " and ".join(texts[:3]) + (f" and {len(texts) - 3} more" if len(texts) > 3 else "")
    return (Finding("rate-unclear", "", None, f"the file states {shown}: not used"),) if texts else ()


def _statement(told: StatedNumber) -> _Statement | None:
    """Return the statement of a number on the rate; None where it makes none."""
    words = _words(told.name)
    kind, plain, suffix = _named(words)
    number, written, odd = _number(told.value)
    written = written or told.unit or suffix
    shown = f"{told.within}.{told.name}".lstrip(".")
    text = excerpt(f"{shown} = {told.value if odd else f'{number:g}'} {'' if odd else written}".strip())
    if odd:
        return _Statement(text, np.nan, "clear", False) if plain else None
    if not (math.isfinite(number) and number > 0.0):
        return None
    around = " ".join([*_words(told.within), *words])
    if "".join(w for w in words if w != "factor") in DECIMATIONS or DECIMATION.fullmatch(" ".join(words)):
        return _Statement(text, np.nan, "thinned", False) if number != 1.0 else None
    if not kind:
        return None
    sort = "clear" if plain else "rival"
    unit = (of_kind(written, kind) or of_kind(written, "s") if written else kind) or ""
    dt = interval(number, unit) if unit else np.nan
    inner = "".join(_words(told.within)[-1:])
    of_other = words == ["rate"] and not (PLAIN_WORDS.fullmatch(inner) or inner in WORDS_OF_HEADERS)
    is_long = kind == "s" and words[-1] in ("time", "period") and dt >= LONG_PERIOD
    of_none = not written and WITH_UNIT.fullmatch(" ".join(words))
    sort = "doubtful" if OTHERWISE.search(around) or of_other or is_long or of_none else sort
    return _Statement(text, dt, sort, not written and dt > LONG_BARE)


def _number(value: Any) -> tuple[float, str, bool]:
    """Return a number, its unit, and whether a text may mean two numbers; nan for what is no number."""
    if isinstance(value, (str, bytes)):
        text = decoded(value).strip()
        if len(text) > LONGEST_STATEMENT:
            return math.nan, "", False
        said = units.quantity(text)
        return (*said, False) if said else (math.nan, "", bool(MARKED.fullmatch(text)))
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        return math.nan, "", False
    try:
        return float(value), "", False
    except OverflowError:
        return math.nan, "", False
