"""Guesses of columns without a name, from their numbers: for the user to confirm, never to be read by."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array
from mrfit.ingest.table import Column

GUESS_ROWS = 20_000
SAME_GUESS = 0.98
"""Least correlation of a column with the integral of another that it may be the displacement of."""
RATIO = 0.05
"""How much the factor between them may differ from a power of ten: a force is no multiple of the velocity's unit."""
FOLLOWS = 0.3
"""Least correlation of a force with the velocity or the displacement."""
GUESSED_SPEEDS = {1.0: ("mm", "mm/s"), 1e3: ("mm", "m/s"), 1e-3: ("m", "mm/s")}
"""Units of displacement and velocity, by the factor between the one's slope and the other."""


@dataclass(frozen=True)
class Guess:
    """Channel and unit that a column may have, and why."""

    channel: str
    unit: str
    why: str


def size_unit(channel: str, values: Array) -> str:
    """Return the unit in which a channel of a laboratory has numbers of that size; empty where size tells nothing."""
    swing = float(np.nanmax(np.abs(values - np.nanmedian(values)), initial=0.0)) if np.isfinite(values).any() else 0.0
    if channel == "displacement":
        return "mm" if swing > 0.5 else "m"
    if channel == "velocity":
        return "mm/s" if swing > 5.0 else "m/s"
    if channel == "force":
        return "N" if swing > 30.0 else "kN"
    if channel == "current":
        return "mA" if swing > 50.0 else "A"
    return ""


def guesses(columns: Sequence[Column], dt: float | None) -> dict[int, Guess]:
    """Return the guesses of columns, by their places: motion, then the force it makes, then what is held at a level.

    Parameters
    ----------
    columns
        Those that no name and no unit describes.
    dt
        Sample interval in s; without it no column is the slope of another.
    """
    sound = {c.index: v for c in columns if (v := _sound(c)) is not None}
    found = _motion(sound, dt) if dt else {}
    left = {k: v for k, v in sound.items() if k not in found and np.ptp(v) > 0.0}
    if (
        not found
        and (place := max(left, key=lambda k: _smoothness(left[k]), default=None)) is not None
        and len(left) > 1
    ):
        found[place] = Guess("displacement", size_unit("displacement", left[place]), "it is the smoothest")
    motion = [sound[k] for k in found]
    if dt and motion:
        motion.append(np.gradient(motion[0]))
    driven = {k: max(abs(_correlation(v, m)) for m in motion) for k, v in left.items() if k not in found and motion}
    if driven and max(driven.values()) > FOLLOWS:
        place = max(driven, key=lambda k: driven[k])
        found[place] = Guess("force", size_unit("force", sound[place]), "it follows the motion")
    for place, values in sound.items():
        if place not in found and (held := _level(values)):
            found[place] = held
            break
    return found


def _sound(column: Column) -> Array | None:
    """Return the first rows of a column; None where one is no number."""
    values = np.asarray(column.values[:GUESS_ROWS], dtype=float)
    return values if len(values) > 2 and np.isfinite(values).all() else None


def _correlation(one: Array, other: Array) -> float:
    if not np.std(one) or not np.std(other):
        return 0.0
    return float(np.corrcoef(one, other)[0, 1])


def _motion(sound: dict[int, Array], dt: float) -> dict[int, Guess]:
    """Return the pair of columns of which one is the slope of the other, in units that laboratories use."""
    best: tuple[float, int, int, float] = (SAME_GUESS, -1, -1, 1.0)
    for rate, velocity in sound.items():
        line = np.linspace(-1.0, 1.0, len(velocity))
        travelled = _without_line(np.cumsum(velocity) * dt, line)
        for place, travel in sound.items():
            moved = _without_line(travel, line)
            if place == rate or not np.std(travelled):
                continue
            # not its absolute value: of a sine, displacement is the slope of velocity too, with the other sign
            ratio = float(moved @ travelled / (travelled @ travelled))
            nearest = min(GUESSED_SPEEDS, key=lambda r: abs(np.log(max(ratio, 1e-300) / r)))
            alike = _correlation(moved, travelled)
            if alike > best[0] and abs(ratio / nearest - 1.0) < RATIO:
                best = (alike, place, rate, nearest)
    _, place, rate, ratio = best
    if place < 0:
        return {}
    units = GUESSED_SPEEDS[ratio]
    if ratio == 1.0 and size_unit("displacement", sound[place]) == "m":
        units = ("m", "m/s")
    return {
        place: Guess("displacement", units[0], f"column {rate} is its slope"),
        rate: Guess("velocity", units[1], f"it is the slope of column {place}"),
    }


def _without_line(values: Array, line: Array) -> Array:
    """Return values without mean and slope: an integral has a constant, and drifts with an offset."""
    centred = values - values.mean()
    flat: Array = centred - line * float(centred @ line / (line @ line))
    return flat


def _smoothness(values: Array) -> float:
    """Return the change of the steps of a signal as a share of its range; a level that is held has none."""
    bend = float(np.std(np.diff(values, 2))) if len(values) > 3 else 0.0
    return float(np.std(values)) / bend if bend else 0.0


def _level(values: Array) -> Guess | None:
    """Return current or temperature for a signal that is held, or moves between levels above zero."""
    low, high = float(values.min()), float(values.max())
    if low > 12.0 and high < 150.0 and high - low < 0.5 * high:
        return Guess("temperature", "degC", "it is of that size and moves little")
    if low > -0.2 * max(high, 0.1) and high < 20.0:
        return Guess("current", "A", "it is of that size and not negative")
    return None
