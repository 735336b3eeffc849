"""Time stamps and times of day, as text, to instants."""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrfit.core.specs import Array
from mrfit.ingest.text.layout import CLOCK, DATED, ISO, MONTHS

OFFSET = re.compile(r"([+-]\d\d):?(\d\d)")
HALF_DAY, DAY = np.timedelta64(12, "h"), np.timedelta64(24, "h")


def instants(texts: Sequence[str], carry: dict[str, Any]) -> NDArray[Any]:
    """Return ISO stamps as times in UTC, other stamps as they are, or times of day as times since the first midnight.

    NaT stands where a text is empty. ``carry`` keeps for the next block the last time of day, the days gone, and
    whether dates begin with the day or the month.

    Raises
    ------
    ValueError
        If a text is neither.
    """
    first = next((t for t in texts if t), "")
    if CLOCK.fullmatch(first):
        return _since_midnight(texts, carry)
    if first and not ISO.fullmatch(first):
        return _dated(texts, carry)
    bare = [t.replace(" ", "T", 1).replace(",", ".").removesuffix("Z") if t else "NaT" for t in texts]
    ahead = [OFFSET.fullmatch(t, max(len(t) - 6 + (t[-3:-2] != ":"), 11)) for t in bare]
    stamps = np.array([t[: a.start()] if a else t for t, a in zip(bare, ahead, strict=True)], dtype="datetime64[ns]")
    minutes = [int(a[1]) * 60 + int(a[1][0] + a[2]) if a else 0 for a in ahead]
    return np.asarray(stamps - np.array(minutes, dtype="timedelta64[m]"))


def since_first(texts: Sequence[str], carry: dict[str, Any]) -> Array:
    """Return time stamps, or times of day, as seconds from the first one, which ``carry`` keeps for the next block.

    Raises
    ------
    ValueError
        If a text is neither.
    """
    stamps = instants(texts, carry)
    valid = stamps[~np.isnat(stamps)]
    first = carry.setdefault("first stamp", valid[0]) if len(valid) else stamps.dtype.type(0, "ns")
    return np.asarray((stamps - first) / np.timedelta64(1, "ns") / 1e9, dtype=np.float64)


def _time_of_day(hour: str, minute: str, second: str, half: str | None) -> float:
    """Return seconds since midnight; ``half`` is the first letter of AM or PM."""
    hours = int(hour) if not half else int(hour) % 12 + 12 * (half in "pP")
    return (hours * 60 + int(minute)) * 60 + float(re.sub("[,:]", ".", second))


def _dated(texts: Sequence[str], carry: dict[str, Any]) -> NDArray[Any]:
    """Return stamps as 05.03.2024 10:00:00,5 or 3/5/2024 10:00:00.5 AM or 5-Mar-2024 10:00:00.5.

    What comes first, day or month, is seen in the numbers, or else makes the log the shorter one.
    """
    found = [DATED.fullmatch(t) for t in texts]
    if odd := next((t for t, f in zip(texts, found, strict=True) if t and not f), ""):
        raise ValueError(f"'{odd}'")
    orders = [carry["order"]] if "order" in carry else ["day", "month"]
    read = {}
    for order in orders:
        try:
            read[order] = np.array([_instant(f, order) if f else "NaT" for f in found], dtype="datetime64[ns]")
        except ValueError:
            continue
    if not read:
        raise ValueError(f"'{next(t for t in texts if t)}'")
    spans = {order: np.ptp(stamps[~np.isnat(stamps)]) for order, stamps in read.items()}
    chosen = min(spans, key=lambda order: (spans[order], order))
    carry["order"] = chosen
    return read[chosen]


def _instant(found: re.Match[str], order: str) -> np.datetime64:
    one, mark, two, three = found.group(1, 2, 3, 4)
    if len(one) == 4:
        year, month, day = one, two, three
    elif mark == "." or order == "day" or not two.isdigit():
        year, month, day = three, two, one
    else:
        year, month, day = three, one, two
    if mark == "." and order == "month" and len(one) < 4:
        raise ValueError(found[0])
    if not month.isdigit():
        month = str(1 + next(k for k, name in enumerate(MONTHS) if re.match(name, month, re.IGNORECASE)))
    date = np.datetime64(f"{int(year) + 2000 * (len(year) == 2):04d}-{int(month):02d}-{int(day):02d}", "ns")
    return date + np.timedelta64(round(_time_of_day(*found.group(5, 6, 7, 8)) * 1e9), "ns")


def _since_midnight(texts: Sequence[str], carry: dict[str, Any]) -> NDArray[Any]:
    found = [CLOCK.fullmatch(t) for t in texts]
    if odd := next((t for t, f in zip(texts, found, strict=True) if t and not f), ""):
        raise ValueError(f"'{odd}'")
    seconds = [f and _time_of_day(f[1], f[2], f[3], f[4]) for f in found]
    times = np.array(["NaT" if s is None else round(s * 1e9) for s in seconds], dtype="timedelta64[ns]")
    valid = np.flatnonzero(~np.isnat(times))
    if len(valid):
        last, days = carry.get("clock", (times[valid[0]], 0))
        gone = days + np.cumsum(np.diff(times[valid], prepend=last) < -HALF_DAY)
        carry["clock"] = (times[valid[-1]], int(gone[-1]))
        times[valid] += gone * DAY
    return times
