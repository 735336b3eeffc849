"""Flux linkage as the integral of the induced voltage, and the drift that offsets and noise leave in it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array
from mrfit.flux.channel import OnDisk, SampleSource, Taken, swing
from mrfit.io.columns import COLUMN_CHUNK
from mrfit.signal.cycles import SteadyCycles

# Time and current that go together this closely cannot be told apart by regression.
COLLINEAR = 0.98
# Mean currents of stretches that differ by less than this share of the largest amplitude are one bias; the flux between
# two biases is known where what the drift may add to it is less than this share of its range.
NEGLIGIBLE_DRIFT = 0.02


@dataclass(frozen=True, slots=True)
class IntegralDrift:
    """Drift that was taken from an integral.

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


def integral_on_disk(induced: Callable[[int, int], Array], samples: int, dt: float, rule: str) -> OnDisk:
    """Return the same integral of a voltage that is read piece by piece, from what it is where each piece begins.

    Parameters
    ----------
    induced
        Gives the voltage of samples [begin, end).
    samples
        How many there are.
    dt, rule
        As for ``integrate``.
    """
    carried = [0.0]

    def read(begin: int, end: int) -> Array:
        found, place = [], begin
        while place < end:
            chunk = place // COLUMN_CHUNK
            last = min((chunk + 1) * COLUMN_CHUNK, end)
            found.append(whole(chunk, last)[place - chunk * COLUMN_CHUNK :])
            place = last
        return np.concatenate(found) if found else np.empty(0)

    def whole(chunk: int, end: int) -> Array:
        """Return the integral from a chunk's first sample to any within it."""
        begin = chunk * COLUMN_CHUNK
        if rule == "simpson":
            # parabolas go through three samples, in the whole as from two samples before
            lead, beyond = min(begin, 2), min(end + 2, samples)
            values = integrate(induced(begin - lead, beyond), dt, rule)
            parts: Array = carried[chunk] + (values[lead : end - begin + lead] - values[lead])
            return parts
        values = induced(begin, end)
        steps = dt * (values[1:] + values[:-1]) / 2.0
        return np.cumsum(np.concatenate([[carried[chunk]], steps]))

    for begin in range(COLUMN_CHUNK, samples, COLUMN_CHUNK):
        last = float(whole(begin // COLUMN_CHUNK - 1, begin)[-1])
        if rule == "simpson":
            around = integrate(induced(begin - 2, min(begin + 3, samples)), dt, rule)
            carried.append(last + float(around[2] - around[1]))
        else:
            pair = induced(begin - 1, begin + 1)
            carried.append(last + float(dt * (pair[1] + pair[0]) / 2.0))
    return OnDisk(samples, read)


def drift_removed(
    integral: SampleSource, current: SampleSource, dt: float, stretches: Sequence[SteadyCycles], method: str
) -> tuple[SampleSource, IntegralDrift]:
    """Return flux linkage without drift, and what was taken away.

    ``cycle`` takes away the line through the integral's means over whole cycles, which leaves a steady periodic λ as it
    is and removes offset and the integrator's random walk alike. Where the current's own mean still moves, as after
    switching on, the mean of λ moves with it by λ/i: that part stays. ``linear`` takes away one straight line, ``none``
    only the constant. Where the bias changes from stretch to stretch, so does the mean of λ: the drift in between is
    then what the drift within the stretches on both sides goes on to, and zero is the mean at the least bias.

    Parameters
    ----------
    integral, current
        ∫(u − R·i)dt in Wb and i in A.
    dt
        Sample interval in s.
    stretches
        Steady cycles of the current; without them every method but ``none`` fits a line beside a function of i.
    method
        ``cycle``, ``linear`` or ``none``.
    """
    knots = [_knots(integral, current, dt, s) for s in stretches]
    steps, finding = _steps(knots, integral, current, dt, stretches)
    if steps is not None:
        knots = [(times, heights - step) for (times, heights), step in zip(knots, steps, strict=True)]
    line: Taken
    if method == "none":
        line, slope, text = lambda places: 0.0 * (places * dt), 0.0, "none removed"
    elif knots and method == "cycle":
        slopes = [_slope(*k) for k in knots]
        slope = float(np.average(slopes, weights=[len(k[0]) for k in knots]))
        line = lambda places: _through_cycles(places * dt, knots, integral.samples * dt)  # noqa: E731
        pieces = f" in each of {len(knots)} periodic stretches" if len(knots) > 1 else ""
        pieces += ", carried over changes of bias" if steps is not None else ""
        text = f"line through the means of whole cycles{pieces}"
    else:
        if knots:
            slope = _slope(*(np.concatenate(part) for part in zip(*knots, strict=True)))
            text = "straight line through the means of whole cycles"
        else:
            slope, text = _beside_current(integral, current, dt)
        line = lambda places: slope * (places * dt)  # noqa: E731
    flux = integral.less(line)
    if not (knots and method == "cycle"):
        means = [np.mean(flux.means(s.boundaries(dt))) for s in stretches]
        if steps is not None:
            means = list(np.array(means) - steps)
        level = float(np.mean(means) if means else flux.mean())
        flux = flux.less(lambda places: level)
    ends = [np.diff(flux.between(s.boundaries(dt))) for s in stretches]
    closure = np.concatenate(ends) if ends else np.empty(0)
    finding = "" if method == "none" else finding
    return flux, IntegralDrift(text, slope, _first(flux) - _first(integral), closure, finding)


def _first(channel: SampleSource) -> float:
    return float(next(channel.pieces(0, 1))[1][0])


def _knots(integral: SampleSource, current: SampleSource, dt: float, stretch: SteadyCycles) -> tuple[Array, Array]:
    """Return times and heights of the drift at the centres of a stretch's cycles."""
    boundaries = stretch.boundaries(dt)
    centres = (boundaries[1:] + boundaries[:-1]) / 2 * dt
    heights = integral.means(boundaries)
    means = current.means(boundaries)
    slope = _slope(centres, heights)
    moved = swing(integral, stretch.start, stretch.stop, slope * dt)
    inductance = float(moved / max(swing(current, stretch.start, stretch.stop), 1e-300))
    return centres, heights - inductance * (means - np.median(means))


def _steps(
    knots: Sequence[tuple[Array, Array]],
    integral: SampleSource,
    current: SampleSource,
    dt: float,
    stretches: Sequence[SteadyCycles],
) -> tuple[Array | None, str]:
    """Return the mean flux linkage (S,) in Wb of each stretch against that at the least bias, and what to say of it.

    None where there is one bias, or where the drift between two stretches is not known well enough: it is what the
    lines through the knots on both sides go on to, and uncertain by their standard errors and by where one turns into
    the other.
    """
    biases = np.array([np.median(current.means(s.boundaries(dt))) for s in stretches])
    if len(knots) < 2 or np.ptp(biases) <= NEGLIGIBLE_DRIFT * max(s.fit.amplitude for s in stretches):
        return None, ""
    steps, variance = [0.0], 0.0
    for before, after in zip(knots[:-1], knots[1:], strict=True):
        gap = float(after[0][0] - before[0][-1])
        (left, error_left), (right, error_right) = (_go_on(*k, before[0][-1] + gap / 2) for k in (before, after))
        steps.append(steps[-1] + right - left)
        turning = (_slope(*after) - _slope(*before)) * gap / np.sqrt(12)
        variance += error_left**2 + error_right**2 + turning**2
    most = max(swing(integral, s.start, s.stop, _slope(*k) * dt) for s, k in zip(stretches, knots, strict=True))
    if np.sqrt(variance) <= NEGLIGIBLE_DRIFT * most:
        return np.array(steps) - steps[int(np.argmin(np.abs(biases)))], ""
    return None, (
        f"the mean of the current changes between periodic stretches, from {np.min(biases):.3g} to {np.max(biases):.3g}"
        " A, and the flux of that change cannot be told from drift: flux is about zero in each stretch; give "
        "--drift none, or cut the log where the mean changes"
    )


def _go_on(times: Array, heights: Array, at: float) -> tuple[float, float]:
    """Return the line through knots at a time, and its standard error; infinite for fewer than three knots."""
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


def _through_cycles(time: Array, knots: Sequence[tuple[Array, Array]], end: float) -> Array:
    """Return the polyline through all knots, and beyond them, to the ends of the record at 0 and ``end`` s, lines.

    A line has the mean slope of the knots over as long a time as it goes on, or over the stretch there if that is
    longer: two cycles of a sweep do not tell where the drift is after seconds.
    """
    times, heights = (np.concatenate(part) for part in zip(*knots, strict=True))
    line: Array = np.interp(time, times, heights)
    early, late = time < times[0], time > times[-1]
    first = times <= max(knots[0][0][-1], 2 * times[0])
    last = times >= min(knots[-1][0][0], 2 * times[-1] - end)
    line[early] += _slope(times[first], heights[first]) * (time[early] - times[0])
    line[late] += _slope(times[last], heights[last]) * (time[late] - times[-1])
    return line


def _beside_current(integral: SampleSource, current: SampleSource, dt: float) -> tuple[float, str]:
    """Return the slope in time that is left beside a cubic in the current."""
    span = swing(current, 0, current.samples)
    if span <= 0.0 or abs(_correlation_with_time(current, dt)) > COLLINEAR:
        return 0.0, "none removed: time and current go together, so that drift cannot be told from flux"
    last, mean = (current.samples - 1) * dt, current.mean()
    rows, pairs = [], zip(integral.pieces(0, integral.samples), current.pieces(0, current.samples), strict=True)
    for (begin, values), (_, amps) in pairs:
        scaled = (amps - mean) / span
        scaled_time = np.arange(begin, begin + len(amps), dtype=np.float64) * dt / last
        columns = [np.ones_like(scaled), scaled_time, scaled, scaled**2, scaled**3]
        rows.append((np.stack(columns, axis=1), values))
        if len(rows) > 1 or len(amps) < current.samples:
            # of several pieces only the triangular factors are kept
            basis, right = (np.concatenate(part) for part in zip(*rows, strict=True))
            q, factor = np.linalg.qr(basis)
            rows = [(factor, q.T @ right)]
    slope = float(np.linalg.lstsq(*rows[0], rcond=None)[0][1] / last)
    return slope, "straight line, fitted beside a cubic in the current"


def _correlation_with_time(current: SampleSource, dt: float) -> float:
    """Return the correlation of a current with time."""
    mean, middle = current.mean(), (current.samples - 1) / 2.0 * dt
    sums = np.zeros(3)
    for begin, amps in current.pieces(0, current.samples):
        moved, time = amps - mean, np.arange(begin, begin + len(amps), dtype=np.float64) * dt - middle
        sums += [float(moved @ time), float(moved @ moved), float(time @ time)]
    return float(sums[0] / np.sqrt(sums[1] * sums[2])) if sums[1] > 0.0 else 0.0
