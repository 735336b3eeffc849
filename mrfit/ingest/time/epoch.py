"""The unit of a column of times: the map's, the file's, or the one that its numbers show; times from the first one."""

from collections.abc import Mapping

import numpy as np

from mrfit.core.recording import Finding
from mrfit.core.specs import Array
from mrfit.ingest import series
from mrfit.ingest.meaning import units
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.meaning.chosen import clocks_meant
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Column
from mrfit.ingest.text.layout import unit_words

SINCE_1970: Mapping[str, float] = {"ns": 1e9, "us": 1e6, "ms": 1e3}
"""Units in which computers count time since 1970, per second."""
EPOCH_SECONDS = (0.3e9, 4.1e9)
"""Seconds since 1970 of the years 1979 to 2099."""
TICK_UNIT = "windows_tick"
TICKS = {" since the year 1 (100 ns)": (6.3e17, 6.6e17), " since 1601 (100 ns)": (1.2e17, 1.5e17)}
"""Counts of 100 ns of this century, as .NET and Windows files have them."""
DAYS = {"as spreadsheets count them": (20000.0, 80000.0), "as MATLAB counts them": (700000.0, 780000.0)}
"""Numbers of days of this century."""
SHORTEST_DAY = 2e-5
"""Longest sample interval in days, 1.7 s, by which a number of days is known; as seconds it would be far too short."""
SAME_STEP = 0.01
"""Relative departure of a step of the times from the interval that the header states."""
ROUND_STEP = 1e-4
"""Relative departure of a step in seconds from two digits, from which it is none of seconds."""


def in_seconds(
    time: Column, rules: Rules, path: str, stated: float | None = None
) -> tuple[Array, float, list[Finding]]:
    """Return the times of a column in s, the length of its unit in s, and what was assumed.

    A unit that is not written is the one in which the steps are the interval that the header states.

    Raises
    ------
    Refusal
        If the unit is none of time, or the times are thousands of years from now.
    """
    rule = rules.time
    named = rule is not None and (
        str(rule.column) == str(time.index) or clocks_meant(rule.column, {time.index: time.name})
    )
    if rule is not None and rule.unit is not None and named:
        return _scaled(time, rule.unit, path), units.to_unit(rule.unit, "s").scale, []
    said: list[Finding] = []
    unit = time.unit or ""
    if unit and not units.known(unit):
        text = f"'{time.name}' is in the unknown unit '{unit}': taken as {{}}; a channel map can say another"
        unit = ""
    else:
        worded = any(units.compatible(w, "s") for w in unit_words(time.name))
        told = f"the unit of '{time.name}' cannot be told" if worded else f"the file gives '{time.name}' no unit"
        text = told + ": taken as {}; a channel map can say another"
    first, since = _first(time.values), ""
    if not unit:
        guess, since = _guessed(time.values, first, stated)
        told = f"{guess}{since}"
        if since or not (rule is not None and not time.unit or time.name.lower() in ("second", "seconds", "sec")):
            said.append(Finding("unit-assumed", "", None, text.format(told)))
        unit = guess
    seconds = _scaled(time, unit, path)
    scale = units.to_unit(unit, "s").scale
    counted = scale == 86400.0 and any(low <= first < high for low, high in DAYS.values())
    if not (since or counted) and abs(first * scale) > EPOCH_SECONDS[1]:
        remedy = f'write the true one in the channel map: time = {{column = "{time.name}", unit = "ms"}} or the like'
        raise Refusal(path, f"its times in '{unit}' begin {abs(first * scale) / 3.156e7:.0f} years from 1970", remedy)
    if scale != 1.0 and abs(first * scale) >= EPOCH_SECONDS[0]:  # or the last digits are lost
        return series.mapped(lambda t: (t - first) * scale, time.values), scale, said
    return seconds, scale, said


def _scaled(time: Column, unit: str, path: str) -> Array:
    if not units.known(unit) or not units.compatible(unit, "s"):
        remedy = 'write the true one in the channel map: time = {column = …, unit = "ms"}'
        raise Refusal(path, f"time column '{time.name}' is in '{unit}'", remedy)
    scale = units.to_unit(unit, "s").scale
    return time.values if scale == 1.0 else series.mapped(lambda t: t * scale, time.values)


def _first(values: Array) -> float:
    """Return the first number; 0 if there is none."""
    found = (float(v[np.isfinite(v)][0]) for (v,) in series.chunks(values) if np.isfinite(v).any())
    return next(found, 0.0)


def counted_since(first: float) -> tuple[str, str]:
    """Return unit and date of a count of times that begins at a number; empty where it is none, or in s since 1970."""
    ticks = [(TICK_UNIT, since) for since, (low, high) in TICKS.items() if low <= first < high]
    (low, high), since = EPOCH_SECONDS, " since 1970"
    return [*ticks, *((u, since) for u, each in SINCE_1970.items() if low * each <= first < high * each), ("", "")][0]


def counts_since(values: Array) -> bool:
    """Whether values (N,) rise as times or a count of them since a date."""
    first, (low, high) = float(values[0]), EPOCH_SECONDS
    return (low <= first < high or counted_since(first)[0] != "") and series.rises(values)


def _guessed(values: Array, first: float, stated: float | None) -> tuple[str, str]:
    """Return the unit that numbers without one show, and by what or since when they count."""
    unit, since = counted_since(first)
    if unit:
        return unit, f"{since}, and given from its first value"
    some = values[0 : series.SERIES_CHUNK]
    steps = np.diff(some[np.isfinite(some)])
    step = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 0.0
    for unit in ("ms", "us"):
        if stated and abs(step * units.to_unit(unit, "s").scale / stated - 1.0) < SAME_STEP:
            return unit, ", in which its steps are the interval that the header states"
    for said, (low, high) in DAYS.items():
        if low <= first < high and 0.0 < step < SHORTEST_DAY and not _is_round(step):
            return "d", f" ({said}), and given from its first value"
    return "s", ""


def _is_round(step: float) -> bool:
    """Whether a step has two digits only, as one in seconds may."""
    return abs(float(f"{step:.1e}") / step - 1.0) < ROUND_STEP
