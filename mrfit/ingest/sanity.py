"""What looks wrong with a recording: constant, dead or clipped channels, offsets, signs, exchanged columns, skew."""

from collections.abc import Callable, Iterator

import numpy as np

from mrfit.ingest.conditions import main_frequency
from mrfit.recording import Finding, Recording
from mrfit.specs import Array

LEVELS_OF_A_DEAD_CHANNEL = 3
CLIPPED_SHARE = 0.005
OFFSET_SHARE = 0.25
ALTERNATING = ("displacement", "velocity", "force", "current", "voltage", "flux", "angle", "torque")


def sanity_findings(record: Recording) -> list[Finding]:
    """Return the findings on a recording's channels, each with the channel and the time it concerns."""
    found = [f for name, values in record.channels.items() for f in _channel(name, values, record.dt)]
    for check in CHECKS:
        found += check(record)
    return found


def _channel(name: str, values: Array, dt: float) -> Iterator[Finding]:
    low, high = float(values.min()), float(values.max())
    if low == high:
        yield Finding("constant", name, 0.0, f"{name} is {low:.6g} all along")
        return
    few = values[:: max(1, len(values) // 20000)]
    levels = len(np.unique(few))
    if levels <= LEVELS_OF_A_DEAD_CHANNEL and len(values) >= 100 and _flickers(few):
        yield Finding("dead", name, 0.0, f"{name} flickers between {levels} levels only, from {low:.6g} to {high:.6g}")
        return
    yield from _clipped(name, values, dt, (low, high))
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    if name in ALTERNATING and abs(middle) > OFFSET_SHARE * half:
        yield Finding("offset", name, None, f"{name} swings by ±{half:.4g} about {middle:.4g}, not about zero")


def _flickers(values: Array) -> bool:
    """Whether a signal of few levels changes too often to be a rectangular wave."""
    return int(np.count_nonzero(np.diff(values))) > 0.05 * len(values)


def _clipped(name: str, values: Array, dt: float, ends: tuple[float, float]) -> Iterator[Finding]:
    low, high = ends
    for end, word in ((high, "highest"), (low, "lowest")):
        at_end = _away_from_the_ends(values == end)
        count = int(np.count_nonzero(at_end))
        if count < max(10, CLIPPED_SHARE * len(values)):
            continue
        near = values[np.abs(values - end) < 0.05 * (high - low)]
        _, counts = np.unique(near, return_counts=True)
        others = counts[:-1] if end == high else counts[1:]
        # a rounded sine stands on its last level 2.4 times as long as on the next
        if count > 6 * int(others.max(initial=1)) and _longest_run(at_end) >= 5 and not _rectangular(values, ends):
            at = float(np.argmax(at_end)) * dt
            share = 100.0 * count / len(values)
            text = f"{name} stands at its {word} value {end:.6g} for {share:.2g} % of the time: clipped or saturated"
            yield Finding("clipped", name, at, text)


def _away_from_the_ends(mask: np.ndarray) -> np.ndarray:
    """Leave out the stretches at the beginning and the end of a record, where a machine stands still."""
    inside = mask.copy()
    if mask.all():
        return inside
    inside[: int(np.argmin(mask))] = False
    inside[len(mask) - int(np.argmin(mask[::-1])) :] = False
    return inside


def _rectangular(values: Array, ends: tuple[float, float]) -> bool:
    low, high = ends
    inside = (values > low + 0.1 * (high - low)) & (values < high - 0.1 * (high - low))
    return bool(np.mean(inside) < 0.2)


def _longest_run(mask: np.ndarray) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return int(np.max(edges[1::2] - edges[::2], initial=0))


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
        text = f"velocity is 1/{ratio:.3g} of the slope of displacement: check their units and the sample rate"
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


CHECKS: tuple[Callable[[Recording], list[Finding]], ...] = (_power_sign, _velocity_matches, _flux_sign, _voltage_phase)
