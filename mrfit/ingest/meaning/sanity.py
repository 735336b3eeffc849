"""Findings on a recording: constant, dead or clipped channels, offsets, signs, exchanged columns, skew."""

from collections.abc import Callable, Iterator, Set
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from mrfit.core.channels import ELECTRICAL, POSITIONS, unit_of
from mrfit.core.recording import Finding, Recording
from mrfit.core.specs import Array
from mrfit.ingest import series
from mrfit.ingest.meaning.conditions import main_frequency
from mrfit.signal.clipping import CUT_GAP, stands
from mrfit.signal.runs import runs

LEVELS_OF_A_DEAD_CHANNEL = 3
OFFSET_SHARE = 0.25
RIPPLE = 0.02
"""A swing of less than this share of its mean is ripple on a held level."""
FLANK, FLANKS, STRAIGHT_FLANK = 8, 20, 1e-3
"""Least samples of a way between two ends, so many of them, and a bend in their height that is none."""
OUTPUTS_WITH_NOISE = ("force", "torque", "acceleration")
"""Channels that are no commands: these are held at a limit by their controllers."""
CUT_GAPS, CUT_SHARE = 10, 0.2
"""Fewest times that it does so, and least share of all times that the signal leaves its limit."""
CUT_DEPTH, CUT_TAIL = 0.2, 2.2
"""Share of the range by which it usually does so at most, and how much farther at least once: between two codes 2."""
OUTLIER, MECHANICAL_OUTLIER = 1000.0, 100.0
"""So many times as far from the median as all others lie no samples of a switching spike, but garbled numbers do."""
FEW_OUTLIERS = 3
MECHANICAL = ("displacement", "velocity", "force", "angle", "torque")
ALTERNATING = ("displacement", "velocity", "force", "current", "voltage", "flux", "angle", "torque")


def channel_findings(record: Recording) -> list[Finding]:
    """Return findings on each channel by itself, over all its samples, with the time concerned."""
    # a damper's coil is fed from zero up, where a coil on a bench is driven about zero
    fed = ELECTRICAL if {"force", "torque"} & record.channels.keys() else ()
    about_zero = set(ALTERNATING).difference(fed)
    return [f for name, values in record.channels.items() for f in _channel(name, values, record.dt, about_zero)]


def relation_findings(record: Recording) -> list[Finding]:
    """Return findings on channels against each other; ``record`` is a whole one or one from ``shortened``."""
    return [finding for check in SANITY_CHECKS for finding in check(record)]


def shortened(record: Recording) -> Recording:
    """Return a recording in memory: itself, or the means over so many samples that about a million remain."""
    each = -(-record.samples // series.SERIES_CHUNK)
    if each == 1:
        return replace(record, channels={n: v[:] for n, v in record.channels.items()})
    channels = {n: _means(v, each) for n, v in record.channels.items()}
    return replace(record, channels=channels, dt=each * record.dt)


def shortening(record: Recording, short: Recording) -> list[Finding]:
    """Say it where a recording was shortened to be judged."""
    if short.samples == record.samples:
        return []
    each = round(short.dt / record.dt)
    text = (
        f"{record.samples} samples: signs, phases and measured conditions are judged on means over {each} samples, "
        f"which show nothing above {0.5 / short.dt:.3g} Hz"
    )
    return [Finding("judged-on-means", "", None, text)]


def _means(values: Array, each: int) -> Array:
    whole = len(values) - len(values) % each
    size = each * max(1, series.SERIES_CHUNK // each)
    parts = [values[k : min(k + size, whole)].reshape(-1, each).mean(axis=1) for k in range(0, whole, size)]
    return np.concatenate(parts)


def _channel(name: str, values: Array, dt: float, about_zero: Set[str]) -> Iterator[Finding]:
    low, high = series.extremes(values)
    if low == high:
        yield Finding("constant", name, 0.0, f"{name} is {low:.6g} all along")
        return
    few = series.thinned(values, max(1, len(values) // 20000))
    if outlier := _outlier(name, values, float(np.median(few)), dt):
        yield outlier  # its size hides all else
        return
    levels = len(np.unique(few))
    if levels <= LEVELS_OF_A_DEAD_CHANNEL and len(values) >= 100 and _flickers(few):
        yield Finding("dead", name, 0.0, f"{name} flickers between {levels} levels only, from {low:.6g} to {high:.6g}")
        return
    yield from _clipped(name, values, dt, (low, high))
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    # the ends of a random motion are apart from zero by chance, its mean is not
    offset = min(abs(middle), float(few.mean() * np.sign(middle)))
    if name in about_zero and offset > OFFSET_SHARE * half and not _held(values, half / abs(middle)):
        unit = f" {unit_of(name)}".rstrip()
        text = f"{name} swings by ±{half:.4g}{unit} about {middle:.4g}{unit}, not about zero"
        if name in POSITIONS and abs(middle) > half:
            yield Finding("away-from-zero", name, None, f"{text}, from where models count: `offset` in a map moves it")
        else:
            yield Finding("offset", name, None, text)


def _outlier(name: str, values: Array, middle: float, dt: float) -> Finding | None:
    """Return a finding on one to three outliers, None if there are none or more."""
    rows, far = np.empty(0, dtype=np.int64), np.empty(0)
    for (begin, _), (some,) in zip(series.spans(len(values)), series.chunks(values), strict=True):
        away = np.abs(some - middle)
        count = min(FEW_OUTLIERS + 1, len(away))
        top = np.argpartition(away, -count)[-count:]
        rows, far = np.append(rows, begin + top), np.append(far, away[top])
        order = np.argsort(-far, kind="stable")[: FEW_OUTLIERS + 1]
        rows, far = rows[order], far[order]
    usual, least = np.maximum(far, abs(middle)), MECHANICAL_OUTLIER if name in MECHANICAL else OUTLIER
    alone = [n for n in range(1, len(far)) if usual[n] > 0.0 and far[n - 1] > least * usual[n]]
    if not alone or len(values) < 16:
        return None
    first = int(rows[: alone[-1]].min())
    are = "samples lie" if alone[-1] > 1 else "sample lies"
    text = (
        f"{alone[-1]} {are} {far[alone[-1] - 1] / usual[alone[-1]]:.2g} times as far from the median of {name} as all "
        f"others, the first is {values[first]:.6g} at {first * dt:.6g} s: a garbled number or an overflow, kept; "
        "empty its cell to have it interpolated"
    )
    return Finding("outlier", name, first * dt, text)


def _held(values: Array, swing: float) -> bool:
    """Whether a signal is held at a level and merely carries ripple or noise, whose samples do not follow each other.

    The sum of squared steps over that of squared departures from the mean is 2 for white noise, (ωΔt)² for a sine.
    """
    if swing < RIPPLE:
        return True
    middle = series.mean(values)
    steps = sum(float(step @ step) for _, step in series.steps(values))
    departures = sum(float((v - middle) @ (v - middle)) for (v,) in series.chunks(values))
    return steps > 0.5 * departures


def _flickers(values: Array) -> bool:
    """Whether a signal of few levels changes too often to be a rectangular wave."""
    return int(np.count_nonzero(np.diff(values))) > 0.05 * len(values)


def _clipped(name: str, values: Array, dt: float, ends: tuple[float, float]) -> Iterator[Finding]:
    first: dict[float, int] = {}
    count = dict.fromkeys(ends, 0)
    for (begin, _), (some,) in zip(series.spans(len(values)), series.chunks(values), strict=True):
        for end in ends:
            at_end = away_from_the_ends(some == end)
            count[end] += int(np.count_nonzero(at_end))
            if end not in first and _stands(some, at_end, end, ends, name in OUTPUTS_WITH_NOISE):
                first[end] = begin + int(np.argmax(at_end))
    for end, word in ((ends[1], "highest"), (ends[0], "lowest")):
        if end in first:
            share = 100.0 * count[end] / len(values)
            text = f"{name} stands at its {word} value {end:.6g} for {share:.2g} % of the time: clipped or saturated"
            yield Finding("clipped", name, first[end] * dt, text)


def _stands(values: Array, at_end: np.ndarray, end: float, ends: tuple[float, float], noisy: bool) -> bool:
    """Whether a signal stands at one of its ends longer than its shape explains, or its noise where it is ``noisy``."""
    count = int(np.count_nonzero(at_end))
    if not stands(at_end):
        return False
    near = values[np.abs(values - end) < 0.05 * (ends[1] - ends[0])]
    _, counts = np.unique(near, return_counts=True)
    others = counts[:-1] if end == ends[1] else counts[1:]
    # a rounded sine stands on its last level 2.4 times as long as on the next
    if count <= 6 * int(others.max(initial=1)):
        return False
    if noisy and _amid_noise(values, at_end, end):
        return True
    flanks = Flanks.of(values, ends)
    return flanks.curved if rectangular(values, ends) else not flanks.straight


def _amid_noise(values: Array, at_end: np.ndarray, end: float) -> bool:
    """Whether a signal leaves its end for a few samples again and again, as a hold with noise that is cut off.

    A hold without noise is not left. One that flickers goes to the next code, a switched one through the range.
    """
    visits = runs(at_end)
    gaps = np.stack([visits[:-1, 1], visits[1:, 0]], axis=1)
    brief = gaps[np.diff(gaps)[:, 0] <= CUT_GAP]
    if len(brief) < max(CUT_GAPS, CUT_SHARE * len(gaps)):
        return False
    depths = np.concatenate([np.abs(values[first:stop] - end) for first, stop in brief])
    usual = float(np.median(depths))
    return bool(depths.max() > CUT_TAIL * usual and usual < CUT_DEPTH * np.ptp(values))


@dataclass(frozen=True, slots=True)
class Flanks:
    """Ways between the ends of a signal: how much they bend before both, in their height, and its standard error."""

    bend: float = np.nan
    error: float = 0.0

    @classmethod
    def of(cls, values: Array, ends: tuple[float, float]) -> "Flanks":
        """Measure the first ways from one end of a signal to the other that take several samples."""
        part = (values - ends[0]) / (ends[1] - ends[0])
        found: list[float] = []
        for first, end in runs((part > 0.1) & (part < 0.9)):
            way = part[end] - part[first - 1] if 0 < first and end < len(part) else 0.0
            if abs(way) > 0.7 and end - first >= FLANK:
                found.append(-float(np.sign(way) * (_cubic_weights(int(end - first)) @ part[first:end])))
            if len(found) == FLANKS:
                break
        return cls(float(np.mean(found)), float(np.std(found, ddof=1)) / len(found) ** 0.5) if len(found) > 2 else cls()

    @property
    def straight(self) -> bool:
        """Whether they are ramps from hold to hold, as a trapezoid has and a clipped wave has not."""
        return self.bend <= max(3.0 * self.error, STRAIGHT_FLANK)

    @property
    def curved(self) -> bool:
        """Whether they are seen to bend, as those of a wave clipped far down do and those of a square wave cannot."""
        return self.bend > max(3.0 * self.error, STRAIGHT_FLANK)


@cache
def _cubic_weights(count: int) -> Array:
    """Return the weights (N,) by which samples from -1 to 1 give the cubic term of their polynomial."""
    return np.asarray(np.linalg.pinv(np.vander(np.linspace(-1.0, 1.0, count), 4))[0])


def away_from_the_ends(mask: np.ndarray) -> np.ndarray:
    """Leave out the stretches at the beginning and the end of a record, where a machine stands still."""
    inside = mask.copy()
    if mask.all():
        return inside
    inside[: int(np.argmin(mask))] = False
    inside[len(mask) - int(np.argmin(mask[::-1])) :] = False
    return inside


def rectangular(values: Array, ends: tuple[float, float]) -> bool:
    """Whether a signal is nearly always close to one of its ends."""
    low, high = ends
    inside = (values > low + 0.1 * (high - low)) & (values < high - 0.1 * (high - low))
    return bool(np.mean(inside) < 0.2)


def _power_sign(record: Recording) -> list[Finding]:
    """A damper takes power in: the mean of force times velocity is positive."""
    if "force" not in record.channels or record.samples < 16:
        return []
    channels = record.channels
    if "velocity" in channels:
        velocity = channels["velocity"]
    elif "displacement" in channels:
        velocity = np.gradient(channels["displacement"], record.dt)
    else:
        return []
    force = channels["force"] - np.mean(channels["force"])
    mean = float(np.mean(force * velocity))
    size = float(np.std(force) * np.std(velocity))
    if mean >= -0.1 * size or size == 0.0:
        return []
    text = (
        f"force and velocity are out of phase (mean power {mean:.3g} W): "
        "one has the wrong sign, or force and displacement are exchanged in the channel map"
    )
    return [Finding("sign", "force", None, text)]


def _velocity_matches(record: Recording) -> list[Finding]:
    """The velocity channel is the slope of the displacement channel."""
    if not {"displacement", "velocity"} <= set(record.channels) or record.samples < 16:
        return []
    slope = np.gradient(record.channels["displacement"], record.dt)
    velocity = record.channels["velocity"]
    if not np.std(slope) or not np.std(velocity):
        return []
    alike = float(np.corrcoef(slope, velocity)[0, 1])
    if alike > 0.5:
        ratio = float(slope @ velocity / (velocity @ velocity))
        if 0.5 < ratio < 2.0:
            return []
        text = f"velocity is {1.0 / ratio:.4g} times the slope of displacement: check their units and the sample rate"
        return [Finding("velocity-differs", "velocity", None, text)]
    if alike > -0.5:
        text = f"velocity does not follow the slope of displacement (correlation {alike:.2f}): check the channel map"
        return [Finding("velocity-differs", "velocity", None, text)]
    return [Finding("sign", "velocity", None, "velocity is opposite to the slope of displacement: check its sign")]


def _flux_sign(record: Recording) -> list[Finding]:
    if not {"current", "flux"} <= set(record.channels) or record.samples < 16:
        return []
    current, flux = record.channels["current"], record.channels["flux"]
    if not np.std(current) or not np.std(flux):
        return []
    if float(np.corrcoef(current, flux)[0, 1]) >= -0.3:
        return []
    return [Finding("sign", "flux", None, "flux falls where the current rises: one of them has the wrong sign")]


def _voltage_phase(record: Recording) -> list[Finding]:
    """A coil's current lags its voltage by 0 to 90 degrees at the drive frequency."""
    if not {"current", "voltage"} <= set(record.channels) or record.samples < 64:
        return []
    current, voltage = record.channels["current"], record.channels["voltage"]
    if not np.std(current) or not np.std(voltage):
        return []
    turns = main_frequency(current, record.dt) * record.dt * np.arange(record.samples)
    line = np.hanning(record.samples) * np.exp(-2j * np.pi * turns)
    i, u = np.sum((current - current.mean()) * line), np.sum((voltage - voltage.mean()) * line)
    if abs(u) < 0.05 * np.std(voltage) * record.samples:
        return []
    lag = float(np.degrees(np.angle(u / i)))
    if -2.0 <= lag <= 92.0:
        return []
    if abs(lag) > 92.0:
        return [Finding("sign", "current", None, f"current is {lag:.0f}° from voltage: one has the wrong sign")]
    text = f"current leads voltage by {-lag:.1f}°, which no coil does: the channels are skewed in time"
    return [Finding("skew", "current", None, text)]


SANITY_CHECKS: tuple[Callable[[Recording], list[Finding]], ...] = (
    _power_sign,
    _velocity_matches,
    _flux_sign,
    _voltage_phase,
)
