"""Flux linkage as the integral of the induced voltage, and the drift that offsets and noise leave in it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array
from mrfit.signal.cycles import Stretch

# Time and current that go together this closely cannot be told apart by regression.
COLLINEAR = 0.98
# Mean currents of stretches that differ by less than this share of the largest amplitude are one bias; the flux between
# two biases is known where what the drift may add to it is less than this share of its range.
NEGLIGIBLE = 0.02


@dataclass(frozen=True, slots=True)
class Drift:
    """What was taken from an integral besides its true value.

    Attributes
    ----------
    method
        In words.
    offset_volt
        Slope of the drift in V: the mean of u − R·i that is no flux.
    constant
        λ0 in Wb, the flux linkage at the first sample, such that λ has zero mean over whole cycles (over the record,
        where there are none).
    closure
        λ at the end minus λ at the start of every whole cycle, in Wb; shape (cycles,).
    finding
        What a reader must know of it, empty if nothing.
    """

    method: str
    offset_volt: float
    constant: float
    closure: Array
    finding: str = ""


def integrate(voltage: Array, dt: float, rule: str) -> Array:
    """Return the cumulative integral (N,) of a voltage (N,), 0 at the first sample, by ``trapezoid`` or ``simpson``."""
    if rule == "simpson":
        from scipy.integrate import cumulative_simpson

        return np.asarray(cumulative_simpson(voltage, dx=dt, initial=0.0))
    # as scipy's, whose import takes longer than a fit
    return np.concatenate([[0.0], np.cumsum(dt * (voltage[1:] + voltage[:-1]) / 2.0)])


def remove_drift(
    integral: Array, current: Array, dt: float, stretches: Sequence[Stretch], method: str
) -> tuple[Array, Drift]:
    """Return flux linkage without drift, and what was taken away.

    ``cycle`` takes away the line through the integral's means over whole cycles, which leaves a steady periodic λ as it
    is and removes offset and the integrator's random walk alike. Where the current's own mean still moves, as after
    switching on, the mean of λ moves with it by λ/i: that part stays. ``linear`` takes away one straight line, ``none``
    only the constant. Where the bias changes from stretch to stretch, so does the mean of λ: the drift in between is
    then what the drift within the stretches on both sides goes on to, and zero is the mean at the least bias.

    Parameters
    ----------
    integral, current
        ∫(u − R·i)dt in Wb and i in A, (N,).
    dt
        Sample interval in s.
    stretches
        Steady cycles of the current; without them every method but ``none`` fits a line beside a function of i.
    method
        ``cycle``, ``linear`` or ``none``.
    """
    time = np.arange(len(integral), dtype=np.float64) * dt
    knots = [_knots(integral, current, dt, s) for s in stretches]
    steps, finding = _steps(knots, integral, current, dt, stretches)
    if steps is not None:
        knots = [(times, heights - step) for (times, heights), step in zip(knots, steps, strict=True)]
    if method == "none":
        line, slope, text = 0.0 * time, 0.0, "none removed"
    elif knots and method == "cycle":
        line, slope = _through_cycles(time, knots)
        pieces = f" in each of {len(knots)} periodic stretches" if len(knots) > 1 else ""
        pieces += ", carried over changes of bias" if steps is not None else ""
        text = f"line through the means of whole cycles{pieces}"
    elif knots:
        slope = _slope(*(np.concatenate(part) for part in zip(*knots, strict=True)))
        line, text = slope * time, "straight line through the means of whole cycles"
    else:
        slope, text = _beside_current(integral, current, time)
        line = slope * time
    flux = integral - line
    if not (knots and method == "cycle"):
        means = [np.mean(_cycle_means(flux, s.boundaries(dt))) for s in stretches]
        if steps is not None:
            means = list(np.array(means) - steps)
        flux = flux - float(np.mean(means) if means else np.mean(flux))
    ends = [np.diff(_between(flux, s.boundaries(dt))) for s in stretches]
    closure = np.concatenate(ends) if ends else np.empty(0)
    finding = "" if method == "none" else finding
    return flux, Drift(text, slope, float(flux[0] - integral[0]), closure, finding)


def _between(values: Array, positions: Array) -> Array:
    """Return values at fractional sample positions, linearly; the last boundary may lie a sample past the end."""
    whole = np.minimum(positions.astype(np.int64), len(values) - 2)
    at: Array = values[whole] + (positions - whole) * (values[whole + 1] - values[whole])
    return at


def _cycle_means(values: Array, boundaries: Array) -> Array:
    """Return means between fractional sample positions, by the trapezoid rule."""
    running = np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2)])
    whole = np.minimum(boundaries.astype(np.int64), len(values) - 2)
    share = boundaries - whole
    at = running[whole] + share * values[whole] + share**2 / 2 * (values[whole + 1] - values[whole])
    means: Array = np.diff(at) / np.diff(boundaries)
    return means


def _knots(integral: Array, current: Array, dt: float, stretch: Stretch) -> tuple[Array, Array]:
    """Return times and heights of the drift at the centres of a stretch's cycles."""
    boundaries = stretch.boundaries(dt)
    centres = (boundaries[1:] + boundaries[:-1]) / 2 * dt
    heights = _cycle_means(integral, boundaries)
    means = _cycle_means(current, boundaries)
    slope = _slope(centres, heights)
    swing = _swing(integral, dt, stretch, slope)
    inductance = float(swing / max(np.ptp(current[stretch.start : stretch.stop]), 1e-300))
    return centres, heights - inductance * (means - np.median(means))


def _swing(integral: Array, dt: float, stretch: Stretch, slope: float) -> float:
    """Return the peak-to-peak value of a stretch's integral beside a drift of this slope."""
    within = np.arange(stretch.start, stretch.stop)
    return float(np.ptp(integral[stretch.start : stretch.stop] - slope * dt * within))


def _steps(
    knots: Sequence[tuple[Array, Array]], integral: Array, current: Array, dt: float, stretches: Sequence[Stretch]
) -> tuple[Array | None, str]:
    """Return the mean flux linkage (S,) in Wb of each stretch against that at the least bias, and what to say of it.

    None where there is one bias, or where the drift between two stretches is not known well enough: it is what the
    lines through the knots on both sides go on to, and uncertain by their standard errors and by where one turns into
    the other.
    """
    biases = np.array([np.median(_cycle_means(current, s.boundaries(dt))) for s in stretches])
    if len(knots) < 2 or np.ptp(biases) <= NEGLIGIBLE * max(s.fit.amplitude for s in stretches):
        return None, ""
    steps, variance = [0.0], 0.0
    for before, after in zip(knots[:-1], knots[1:], strict=True):
        gap = float(after[0][0] - before[0][-1])
        (left, error_left), (right, error_right) = (_go_on(*k, before[0][-1] + gap / 2) for k in (before, after))
        steps.append(steps[-1] + right - left)
        turning = (_slope(*after) - _slope(*before)) * gap / np.sqrt(12)
        variance += error_left**2 + error_right**2 + turning**2
    swing = max(_swing(integral, dt, s, _slope(*k)) for s, k in zip(stretches, knots, strict=True))
    if np.sqrt(variance) <= NEGLIGIBLE * swing:
        return np.array(steps) - steps[int(np.argmin(np.abs(biases)))], ""
    return None, (
        f"the mean of the current changes between periodic stretches, from {np.min(biases):.3g} to {np.max(biases):.3g}"
        " A, and the flux of that change cannot be told from drift: flux is about zero in each stretch; give "
        "--drift none, or cut the log where the mean changes"
    )


def _go_on(times: Array, heights: Array, at: float) -> tuple[float, float]:
    """Return where the line through knots is at a time, and its standard error; infinite for fewer than three knots."""
    slope, centre = _slope(times, heights), float(np.mean(times))
    height = float(np.mean(heights)) + slope * (at - centre)
    if len(times) < 3:
        return height, float("inf")
    rest = heights - np.mean(heights) - slope * (times - centre)
    spread = float(np.sum((times - centre) ** 2))
    return height, float(np.sqrt(rest @ rest / (len(times) - 2) * (1 / len(times) + (at - centre) ** 2 / spread)))


def _slope(times: Array, heights: Array) -> float:
    centred = times - np.mean(times)
    return float(centred @ heights / (centred @ centred))


def _through_cycles(time: Array, knots: Sequence[tuple[Array, Array]]) -> tuple[Array, float]:
    """Return the polyline through all knots, going on at its ends with the mean slope of the stretch there."""
    times, heights = (np.concatenate(part) for part in zip(*knots, strict=True))
    line = np.interp(time, times, heights)
    early, late = time < times[0], time > times[-1]
    line[early] += _slope(*knots[0]) * (time[early] - times[0])
    line[late] += _slope(*knots[-1]) * (time[late] - times[-1])
    slopes = [_slope(*k) for k in knots]
    return line, float(np.average(slopes, weights=[len(k[0]) for k in knots]))


def _beside_current(integral: Array, current: Array, time: Array) -> tuple[float, str]:
    """Return the slope in time that is left beside a cubic in the current."""
    span = float(np.ptp(current))
    if span <= 0.0 or abs(float(np.corrcoef(time, current)[0, 1])) > COLLINEAR:
        return 0.0, "none removed: time and current go together, so that drift cannot be told from flux"
    scaled = (current - np.mean(current)) / span
    scaled_time = time / time[-1]
    basis = np.stack([np.ones_like(time), scaled_time, scaled, scaled**2, scaled**3], axis=1)
    slope = float(np.linalg.lstsq(basis, integral, rcond=None)[0][1] / time[-1])
    return slope, "straight line, fitted beside a cubic in the current"
