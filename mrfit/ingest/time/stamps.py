"""Time stamps and times of day, as text, to instants."""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrfit.ingest.text.layout import CLOCK

OFFSET = re.compile(r"([+-]\d\d):?(\d\d)")
HALF_DAY, DAY = np.timedelta64(12, "h"), np.timedelta64(24, "h")


def instants(texts: Sequence[str], carry: dict[str, Any]) -> NDArray[Any]:
    """Return ISO stamps as times in UTC, or times of day as times since the first midnight; NaT where a text is empty.

    ``carry`` keeps the last time of day and the days gone for the next block.

    Raises
    ------
    ValueError
        If a text is neither.
    """
    if CLOCK.fullmatch(next((t for t in texts if t), "")):
        return _since_midnight(texts, carry)
    bare = [t.replace(" ", "T", 1).replace(",", ".").removesuffix("Z") if t else "NaT" for t in texts]
    ahead = [OFFSET.fullmatch(t, max(len(t) - 6 + (t[-3:-2] != ":"), 11)) for t in bare]
    stamps = np.array([t[: a.start()] if a else t for t, a in zip(bare, ahead, strict=True)], dtype="datetime64[ns]")
    minutes = [int(a[1]) * 60 + int(a[1][0] + a[2]) if a else 0 for a in ahead]
    return np.asarray(stamps - np.array(minutes, dtype="timedelta64[m]"))


def _since_midnight(texts: Sequence[str], carry: dict[str, Any]) -> NDArray[Any]:
    found = [CLOCK.fullmatch(t) for t in texts]
    if odd := next((t for t, f in zip(texts, found, strict=True) if t and not f), ""):
        raise ValueError(f"'{odd}'")
    seconds = [f and (int(f[1]) * 60 + int(f[2])) * 60 + float(f[3].replace(",", ".")) for f in found]
    times = np.array(["NaT" if s is None else round(s * 1e9) for s in seconds], dtype="timedelta64[ns]")
    valid = np.flatnonzero(~np.isnat(times))
    if len(valid):
        last, days = carry.get("clock", (times[valid[0]], 0))
        gone = days + np.cumsum(np.diff(times[valid], prepend=last) < -HALF_DAY)
        carry["clock"] = (times[valid[-1]], int(gone[-1]))
        times[valid] += gone * DAY
    return times
