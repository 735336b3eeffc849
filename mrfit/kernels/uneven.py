"""The operators of ``filters`` and ``lti`` for samples at uneven times.

``steps`` (N,) in s is the time from each sample to that before; its first value is not read. At equal steps every
operator is that of the same name there, but for rounding.
"""

import math

import numpy as np

from mrfit.core.specs import Array, Index
from mrfit.kernels.filters import gained_from_bend, release
from mrfit.kernels.jit import kernel
from mrfit.kernels.lti import advance, cascade, passed


def times_of(steps: Array) -> Array:
    """Return the time of every sample in s, (N,), 0 at the first."""
    times = np.zeros(len(steps))
    np.cumsum(steps[1:], out=times[1:])
    return times


@kernel
def lag(x: Array, tau: Array, steps: Array) -> Array:
    """Pass signals (P, N) through y + tau*dy/dt = x, tau (P,) in s; exact for x linear between samples."""
    y = np.empty_like(x)
    for p in range(len(x)):
        y[p, 0] = x[p, 0]
        for j in range(1, x.shape[1]):
            ratio = tau[p] / steps[j]
            y[p, j] = x[p, j]
            if ratio > 0.0:
                y[p, j] += math.exp(-1.0 / ratio) * (y[p, j - 1] - x[p, j - 1])
                y[p, j] += ratio * math.expm1(-1.0 / ratio) * (x[p, j] - x[p, j - 1])
    return y


@kernel
def lagged_bends(x: Array, tau: Array, steps: Array) -> tuple[Array, Array]:
    """Return by how much ``lag`` overshoots where signals (P, N) are parabolas between samples, see ``filters``."""
    settled, now = np.zeros_like(x), np.zeros_like(x)
    last = x.shape[1] - 1
    for p in range(len(x)):
        if tau[p] == 0.0:
            continue
        before = 0.0
        for j in range(1, last + 1):
            here, h = 0.0, steps[j]
            if j < last:
                after, ago = (x[p, j + 1] - x[p, j]) / steps[j + 1], (x[p, j] - x[p, j - 1]) / h
                here = 2.0 * (after - ago) / (h + steps[j + 1])
            kept = math.exp(-h / tau[p]) * settled[p, j - 1]
            gained = gained_from_bend(h / tau[p]) * h * h
            now[p, j] = kept + gained * before
            settled[p, j] = kept + gained * 0.5 * (before + here)
            before = here
    return settled, now


def smooth_lag(x: Array, tau: Array, steps: Array) -> Array:
    """Return ``lag`` of signals (P, N) that are parabolas between samples; no sample knows of those after it."""
    smooth: Array = lag(x, tau, steps) - lagged_bends(x, tau, steps)[1]
    return smooth


@kernel
def chord_lag(x: Array, here: Array, there: Array, gain: float, steps: Array) -> Array:
    """Return ``filters.chord_lag`` of a signal (N,), its time constant ``gain`` in s times the chord."""
    y = np.empty_like(x)
    y[0] = x[0]
    chord = 0.0
    for j in range(1, len(x)):
        run = here[j] - here[j - 1]
        slope = (there[j] - there[j - 1]) / run if run != 0.0 else 0.0
        chord = slope if 0.0 < slope < math.inf else chord
        y[j] = x[j]
        if chord > 0.0:
            ratio = gain * chord / steps[j]
            y[j] += math.exp(-1.0 / ratio) * (y[j - 1] - x[j - 1]) + ratio * math.expm1(-1.0 / ratio) * (
                x[j] - x[j - 1]
            )
    return y


@kernel
def released(x: Array, tau: float, steps: Array) -> Array:
    """Return ``filters.released`` of a signal (N,), tau > 0 of the release in s."""
    y = np.empty_like(x)
    above, below = max(x[0], 0.0), max(-x[0], 0.0)
    y[0] = x[0]
    for j in range(1, len(x)):
        ratio = tau / steps[j]
        decay, follow = math.exp(-1.0 / ratio), -ratio * math.expm1(-1.0 / ratio)
        above = release(above, x[j - 1], x[j], decay, follow)
        below = release(below, -x[j - 1], -x[j], decay, follow)
        y[j] = above - below
    return y


@kernel
def smooth_play(x: Array, half_width: float, steps: Array) -> Array:
    """Return the play of a smooth signal (N,): it turns at the vertex of a parabola through three samples."""
    y = np.empty_like(x)
    state = 0.0
    for j in range(len(x)):
        if j > 1:
            h0, h1 = steps[j - 1], steps[j]
            before, after = (x[j - 1] - x[j - 2]) / h0, (x[j] - x[j - 1]) / h1
            slope, bend = (h0 * after + h1 * before) / (h0 + h1), 2.0 * (after - before) / (h0 + h1)
            # slopes at the first and at the last of the three samples
            if (slope - bend * h0) * (slope + bend * h1) < 0.0:
                vertex = x[j - 1] - slope * slope / (2.0 * bend)
                state = max(vertex - half_width, min(vertex + half_width, state))
        state = max(x[j] - half_width, min(x[j] + half_width, state))
        y[j] = state
    return y


def level(x: Array, steps: Array) -> float:
    """Return the mean over time of a signal (N,) under a Hann window; a sample stands for half the steps beside it."""
    beside = np.concatenate([steps[1:2], steps[1:], steps[-1:]])
    extent = 0.5 * (beside[:-1] + beside[1:])
    middle = np.cumsum(extent) - 0.5 * extent
    weights = extent * (1.0 - np.cos(2.0 * np.pi * middle / np.sum(extent)))
    return float(weights @ x / np.sum(weights))


def place(steps: Array, age: float) -> tuple[Index, Array]:
    """Return the sample before every time that lies ``age`` s earlier, (N,), and its share of the step after that.

    Times outside the record are its ends; below 0 ``age`` is a time to come.
    """
    times = times_of(steps)
    at = np.clip(times - age, 0.0, times[-1])
    before = np.clip(np.searchsorted(times, at, "right") - 1, 0, len(times) - 2)
    return before, (at - times[before]) / steps[before + 1]


def delayed(u: Array, age: Array, steps: Array) -> Array:
    """Return one signal (N,) by delays (P,) >= 0 in s later, (P, N), linear between samples, its first value before."""
    out = np.empty((len(age), len(u)))
    for row, late in zip(out, age, strict=True):
        before, share = place(steps, float(late))
        row[:] = u if late == 0.0 else u[before] + share * (u[before + 1] - u[before])
    return out


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
def _moved(x: Array, times: Array, age: Array, causal: bool) -> Array:
    y = np.empty_like(x)
    last = x.shape[1] - 1
    for p in range(len(x)):
        if age[p] == 0.0 or last == 0:
            y[p] = x[p]
            continue
        k = 0
        for j in range(last + 1):
            at = times[j] - age[p]
            while k < last and times[k + 1] <= at:
                k += 1
            if at < times[0] or at >= times[last]:
                y[p, j] = x[p, 0] if at < times[0] else x[p, last]
            else:
                y[p, j] = _cubic(x[p], times, min(k + 2, j) if causal else k + 2, at)
    return y


def shifted(x: Array, age: Array, steps: Array) -> Array:
    """Delay signals (P, N) by times (P,) in s of either sign, by the cubic through two samples on either side."""
    moved: Array = _moved(x, times_of(steps), age, False)
    return moved


def held_back(x: Array, age: Array, steps: Array) -> Array:
    """Delay signals (P, N) by times (P,) >= 0 in s, by the cubic through samples that are not after the moment."""
    moved: Array = _moved(x, times_of(steps), age, True)
    return moved


@kernel
def unit_gain_filter(u: Array, poles: Array, zeros: Array, steps: Array) -> Array:
    """Return ``lti.unit_gain_filter`` of signals (P, N), exact for signals that are linear between samples."""
    out = np.empty_like(u)
    for p in range(len(poles)):
        step, made = cascade(poles[p], 0.0), 0.0
        state, rest = np.zeros(poles.shape[1]), u[p, 0]
        for j in range(u.shape[1]):
            if j > 0:
                if steps[j] != made:
                    step, made = cascade(poles[p], steps[j]), steps[j]
                advance(step, state, u[p, j - 1] - rest, u[p, j] - u[p, j - 1])
            out[p, j] = passed(poles[p], zeros[p], state, u[p, j], rest)
    return out
