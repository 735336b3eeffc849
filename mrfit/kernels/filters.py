"""Operators on sampled signals, of which effects are made: lag, fractional shift, play, release, level.

Every operator is the identity, to the last bit, at the parameter value that makes it vanish.
"""

import math

import numpy as np

from mrfit.core.specs import Array, Index
from mrfit.kernels.jit import kernel


@kernel
def lag(x: Array, ratio: Array) -> Array:
    """Pass signals through y + tau*dy/dt = x, exact for x linear between samples, with y = x at the first.

    Parameters
    ----------
    x
        Signals, shape (P, N).
    ratio
        tau/dt >= 0, shape (P,); 0 leaves the signal as it is.
    """
    y = np.empty_like(x)
    samples = x.shape[1]
    for p in range(len(x)):
        decay = math.exp(-1.0 / ratio[p])
        follow = -ratio[p] * math.expm1(-1.0 / ratio[p])
        y[p, 0] = x[p, 0]
        for j in range(1, samples):
            y[p, j] = x[p, j] + decay * (y[p, j - 1] - x[p, j - 1]) - follow * (x[p, j] - x[p, j - 1])
    return y


def chord_lag(x: Array, here: Array, there: Array, gain: float, steps: Array) -> tuple[Array, float]:
    """Return ``lag`` of a signal (N,) whose tau, over each step, is a gain > 0 in s times the chord d(there)/d(here).

    The second result is its largest distance from ``here``. Where a chord of the signals ``here`` and ``there``, (N,),
    has no slope above 0, that before it holds; 0 at first. ``steps`` in s > 0, (1,) or (N,), is the time from each
    sample to that before.
    """
    exponent = _chord_exponents(here, there, gain, steps)
    # numpy's takes a tenth of the time of that of the C library, where the processor has vectors
    return _lagged_by(x, here, exponent, np.expm1(exponent))


@kernel
def _chord_exponents(here: Array, there: Array, gain: float, steps: Array) -> Array:
    """Return -dt/tau of each step, (N,); minus infinity before the first chord."""
    exponent = np.empty_like(here)
    exponent[0] = -math.inf
    # of the last chord that rises; before there is one, one of no slope
    run, rise = 1.0, 0.0
    for j in range(1, len(here)):
        along, up = here[j] - here[j - 1], there[j] - there[j - 1]
        rising = 0.0 < along * up < math.inf
        run, rise = along if rising else run, up if rising else rise
        exponent[j] = -steps[min(j, len(steps) - 1)] * run / (gain * rise)
    return exponent


@kernel
def _lagged_by(x: Array, here: Array, exponent: Array, left: Array) -> tuple[Array, float]:
    """Return ``chord_lag`` of which -dt/tau and expm1(-dt/tau) are known, (N,)."""
    y = np.empty_like(x)
    y[0] = x[0]
    change, distance = abs(x[0] - here[0]), 0.0
    for j in range(1, len(x)):
        distance = _lag_distance(distance, x[j] - x[j - 1], exponent[j], left[j])
        y[j] = x[j] + distance
        moved = abs(y[j] - here[j])
        # one that is not finite is taken, too: neither is any that follows
        change = change if moved <= change else moved
    return y, change


@kernel
def lagged_bends(x: Array, ratio: Array) -> tuple[Array, Array]:
    """Return by how much ``lag`` of signals (P, N) overshoots that of signals which are parabolas between samples.

    Straight lines would blur such signals by dt^2/6: between two samples they are off the line by c*u*(1 - u)/2, c the
    mean of the second differences at both and u the share of the interval that has passed. That at the later one takes
    one sample more. The first result knows it; the second does not, as what is simulated while it happens: there c is
    the second difference at the earlier one. What that is off at one sample the next makes up for.
    """
    settled, now = np.zeros_like(x), np.zeros_like(x)
    last = x.shape[1] - 1
    for p in range(len(x)):
        if ratio[p] == 0.0:
            continue
        decay, gained, before = math.exp(-1.0 / ratio[p]), gained_from_bend(1.0 / ratio[p]), 0.0
        for j in range(1, last + 1):
            here = x[p, j + 1] - 2.0 * x[p, j] + x[p, j - 1] if j < last else 0.0
            now[p, j] = decay * settled[p, j - 1] + gained * before
            settled[p, j] = decay * settled[p, j - 1] + gained * 0.5 * (before + here)
            before = here
    return settled, now


def smooth_lag(x: Array, ratio: Array) -> Array:
    """Return ``lag`` of signals (P, N) that are parabolas between samples; no sample knows of those after it."""
    smooth: Array = lag(x, ratio) - lagged_bends(x, ratio)[1]
    return smooth


@kernel
def gained_from_bend(rate: float) -> float:
    """Return the gain of a lag of 1/rate samples over one interval from a bend u*(1 - u)/2."""
    if rate < 1e-2:
        return rate * (1.0 / 12.0 - rate / 24.0 + rate**2 / 80.0)
    kept = math.exp(-rate)
    first, second = (1.0 - kept * (1.0 + rate)) / rate, (2.0 - kept * (2.0 + 2.0 * rate + rate**2)) / rate**2
    return 0.5 * (first - second)


@kernel
def lag_step(y: float, before: float, now: float, tau: float, dt: float) -> float:
    """Return the output of ``lag`` after a step of dt s, over which its input goes from ``before`` to ``now``."""
    if tau <= 0.0 or dt <= 0.0:
        return y if dt <= 0.0 and tau > 0.0 else now
    exponent = -dt / tau
    return now + _lag_distance(y - before, now - before, exponent, math.expm1(exponent))


@kernel
def _lag_distance(distance: float, rise: float, exponent: float, left: float) -> float:
    """Return the distance of ``lag`` above its input after a step, from that before it and the input's rise.

    ``exponent`` is -dt/tau < 0 and ``left`` its expm1.
    """
    return (1.0 + left) * distance - left / exponent * rise


@kernel
def bend_step(
    bend: tuple[float, float, float, float], before: float, now: float, tau: float, dt: float
) -> tuple[float, float, float, float, float]:
    """Return the value of ``lagged_bends`` at a step's end before more is known, and the ``bend`` behind it.

    That is what it says of the sample at the step's beginning, the second derivative there, and slope and length of the
    step; a length of 0 if there was none.
    """
    settled, curvature, slope, length = bend
    if dt <= 0.0 or tau <= 0.0:
        return 0.0, settled, curvature, slope, length
    rising, here = (now - before) / dt, 0.0
    if length > 0.0:
        here = 2.0 * (rising - slope) / (dt + length)
        settled = math.exp(-length / tau) * settled
        settled += gained_from_bend(length / tau) * length * length * 0.5 * (curvature + here)
    guess = math.exp(-dt / tau) * settled + gained_from_bend(dt / tau) * dt * dt * here
    return guess, settled, here, rising, dt


@kernel
def play_step(
    y: float, chord: tuple[float, float], before: float, now: float, half_width: float, dt: float
) -> tuple[float, float, float]:
    """Return ``play`` at a step's end, smooth at turns; travel and length of the step, as ``chord`` of the last."""
    turn, travel, length = turning(chord, before, now, dt)
    return carried(y, turn, now, half_width), travel, length


@kernel
def carried(y: float, turn: float, now: float, half_width: float) -> float:
    """Return the play at ``now``, from y, of a signal that has turned at ``turn`` meanwhile."""
    y = max(turn - half_width, min(turn + half_width, y))
    return max(now - half_width, min(now + half_width, y))


@kernel
def turning(chord: tuple[float, float], before: float, now: float, dt: float) -> tuple[float, float, float]:
    """Return the turning point in a step, or ``before``; travel and length of the step, as ``chord`` of the last.

    A sampled signal misses up to an eighth of its second difference at every turn, which is travel that a narrow play
    would have seen. So it turns between the samples, at the vertex of the parabola through the last three; no sample
    knows of those after it.
    """
    travel, length = now - before, dt
    turn = before
    if chord[1] > 0.0 and dt > 0.0:
        one, other = chord[0] / chord[1], travel / dt
        slope, bend = (chord[1] * other + dt * one) / (chord[1] + dt), 2.0 * (other - one) / (chord[1] + dt)
        # slopes at the first and at the last of the three samples
        if (slope - bend * chord[1]) * (slope + bend * dt) < 0.0:
            turn = before - slope * slope / (2.0 * bend)
    if dt <= 0.0:
        travel, length = chord
    return turn, travel, length


@kernel
def shifted(x: Array, shift: Array) -> Array:
    """Delay signals by a number of samples that need not be whole, by cubic Lagrange interpolation.

    Source: T. I. Laakso et al., Splitting the unit delay, IEEE Signal Processing Magazine 13 (1996) 30.

    Parameters
    ----------
    x
        Signals, shape (P, N); beyond its ends a signal holds its end value.
    shift
        Delay in samples, either sign, shape (P,); 0 leaves the signal as it is.
    """
    y = np.empty_like(x)
    last = x.shape[1] - 1
    for p in range(len(x)):
        if shift[p] == 0.0:
            y[p] = x[p]
            continue
        bounded = min(max(shift[p], -2.0 - last), 2.0 + last)
        whole = math.floor(-bounded)
        f = -bounded - whole
        before = -f * (f - 1.0) * (f - 2.0) / 6.0
        here = (f + 1.0) * (f - 1.0) * (f - 2.0) / 2.0
        after = -(f + 1.0) * f * (f - 2.0) / 2.0
        beyond = (f + 1.0) * f * (f - 1.0) / 6.0
        for j in range(last + 1):
            k = j + int(whole)
            if k < 0 or k >= last:
                y[p, j] = x[p, 0] if k < 0 else x[p, last]
            else:
                y[p, j] = before * x[p, max(k - 1, 0)] + here * x[p, k] + after * x[p, k + 1]
                y[p, j] += beyond * x[p, min(k + 2, last)]
    return y


@kernel
def held_back(x: Array, shift: Array) -> Array:
    """Delay signals as ``shifted`` does, by samples that are not after the moment: what a causal model can do.

    Within one sample the cubic goes through the last four samples, beyond it through two on either side.

    Parameters
    ----------
    x
        Signals, shape (P, N); before its first value a signal has that value.
    shift
        Delay in samples >= 0, shape (P,); 0 leaves the signal as it is.
    """
    y = np.empty_like(x)
    samples = x.shape[1]
    for p in range(len(x)):
        if shift[p] == 0.0:
            y[p] = x[p]
            continue
        bounded = min(shift[p], 2.0 + samples)
        whole = math.floor(-bounded)
        f = -bounded - whole
        # the second of the four
        second = min(int(whole), -2)
        f += whole - second
        before = -f * (f - 1.0) * (f - 2.0) / 6.0
        here = (f + 1.0) * (f - 1.0) * (f - 2.0) / 2.0
        after = -(f + 1.0) * f * (f - 2.0) / 2.0
        beyond = (f + 1.0) * f * (f - 1.0) / 6.0
        for j in range(samples):
            if j + whole < 0:
                y[p, j] = x[p, 0]
            else:
                k = j + second
                y[p, j] = before * x[p, max(k - 1, 0)] + here * x[p, max(k, 0)]
                y[p, j] += after * x[p, max(k + 1, 0)] + beyond * x[p, k + 2]
    return y


def place(samples: int, shift: float) -> tuple[Index, Array]:
    """Return the sample before every time that lies a number of samples earlier, and how far behind it that is.

    Times outside the record are its ends; below 0 ``shift`` is a time to come.
    """
    at = np.clip(np.arange(samples) - shift, 0.0, samples - 1)
    before = np.minimum(at.astype(np.int64), samples - 2)
    return before, at - before


def times_of(steps: Array) -> Array:
    """Return the time of every sample in s, (N,), 0 at the first."""
    times = np.zeros(len(steps))
    np.cumsum(steps[1:], out=times[1:])
    return times


def place_unevenly(steps: Array, age: float) -> tuple[Index, Array]:
    """Return the sample before every time that lies ``age`` s earlier, (N,), and its share of the step after that.

    Times outside the record are its ends; below 0 ``age`` is a time to come.
    """
    times = times_of(steps)
    at = np.clip(times - age, 0.0, times[-1])
    before = np.clip(np.searchsorted(times, at, "right") - 1, 0, len(times) - 2)
    return before, (at - times[before]) / steps[before + 1]


@kernel
def _cubic(x: Array, times: Array, newest: int, at: float) -> float:
    """Return the cubic through samples newest - 3 to newest at a time; beyond its ends a signal holds its end value."""
    last = len(x) - 1
    t, y = np.empty(4), np.empty(4)
    for k in range(4):
        m = newest - k
        inside = min(max(m, 0), last)
        y[k], t[k] = x[inside], times[inside]
        if m < 0:
            t[k] += m * (times[1] - times[0])
        elif m > last:
            t[k] += (m - last) * (times[last] - times[last - 1])
    total = 0.0
    for k in range(4):
        weight = y[k]
        for j in range(4):
            if j != k:
                weight *= (at - t[j]) / (t[k] - t[j])
        total += weight
    return total


@kernel
def moved_unevenly(x: Array, age: float, times: Array, causal: bool) -> Array:
    """Delay a signal (N,) at uneven times by a time in s, by the cubic through two samples on either side.

    ``causal`` through samples that are not after the moment, as ``held_back`` does; else of either sign.
    """
    y = np.empty_like(x)
    last, k = len(x) - 1, 0
    for j in range(last + 1):
        at = times[j] - age
        while k < last and times[k + 1] <= at:
            k += 1
        if at < times[0] or at >= times[last]:
            y[j] = x[0] if at < times[0] else x[last]
        else:
            y[j] = _cubic(x, times, min(k + 2, j) if causal else k + 2, at)
    return y


@kernel
def play(x: Array, half_width: float) -> Array:
    """Pass a signal (N,) through a play of half-width w >= 0, in the signal's unit, which rests at 0 before sample 0.

    y[j] = max(x[j] - w, min(x[j] + w, y[j-1])); w = 0 leaves the signal as it is.

    Source: M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis (1989), ch. 1.
    """
    y = np.empty_like(x)
    state = 0.0
    for j in range(len(x)):
        state = max(x[j] - half_width, min(x[j] + half_width, state))
        y[j] = state
    return y


@kernel
def released(x: Array, ratio: float) -> Array:
    """Return a signal (N,) that moves away from 0 with x at once and back behind a lag, exact for x linear in between.

    The parts of x above and below 0 are followed each by itself. Both are at rest at the first sample.

    Parameters
    ----------
    x
        Signal, shape (N,).
    ratio
        tau/dt > 0 of the release.
    """
    y = np.empty_like(x)
    decay = math.exp(-1.0 / ratio)
    follow = -ratio * math.expm1(-1.0 / ratio)
    above, below = max(x[0], 0.0), max(-x[0], 0.0)
    y[0] = x[0]
    for j in range(1, len(x)):
        above = release(above, x[j - 1], x[j], decay, follow)
        below = release(below, -x[j - 1], -x[j], decay, follow)
        y[j] = above - below
    return y


@kernel
def release(held: float, before: float, now: float, decay: float, follow: float) -> float:
    """Return the held part above 0 of a signal a sample later: its new value, or what is left if more."""
    old, new = max(before, 0.0), max(now, 0.0)
    return max(new, new + decay * (held - old) - follow * (new - old))


def level(x: Array) -> float:
    """Return the mean of a signal (N,) under a Hann window, whose bias by an unfinished cycle falls as 1/cycles^3."""
    weights = 1.0 - np.cos(2.0 * np.pi * (np.arange(len(x)) + 0.5) / len(x))
    return float(weights @ x / len(x))


def level_of(x: Array, steps: Array) -> float:
    """Return the mean over time of a signal (N,) under a Hann window; a sample stands for half the steps beside it."""
    beside = np.concatenate([steps[1:2], steps[1:], steps[-1:]])
    extent = 0.5 * (beside[:-1] + beside[1:])
    middle = np.cumsum(extent) - 0.5 * extent
    weights = extent * (1.0 - np.cos(2.0 * np.pi * middle / np.sum(extent)))
    return float(weights @ x / np.sum(weights))


def running_integral(x: Array, dt: float) -> Array:
    """Return the cumulative integral (N,) of a signal (N,) by the trapezoid rule, 0 at the first sample."""
    integral = np.zeros(len(x))
    np.cumsum((x[1:] + x[:-1]) * (dt / 2.0), out=integral[1:])
    return integral
