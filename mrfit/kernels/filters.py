"""Operators on sampled signals, of which effects are made: lag, fractional shift, play, release, bend, level.

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


@kernel
def chord_lag(x: Array, here: Array, there: Array, gain: float) -> Array:
    """Return ``lag`` of a signal (N,) whose tau/dt, over each interval, is a gain > 0 times the chord d(there)/d(here).

    Where a chord of the signals ``here`` and ``there``, (N,), has no slope above 0, that before it holds; 0 at first.
    """
    y = np.empty_like(x)
    y[0] = x[0]
    ratio = 0.0
    for j in range(1, len(x)):
        run = here[j] - here[j - 1]
        slope = (there[j] - there[j - 1]) / run if run != 0.0 else 0.0
        ratio = gain * slope if 0.0 < slope < math.inf else ratio
        y[j] = x[j]
        if ratio > 0.0:
            rate = 1.0 / ratio
            y[j] += math.exp(-rate) * (y[j - 1] - x[j - 1]) + ratio * math.expm1(-rate) * (x[j] - x[j - 1])
    return y


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
    """Return what a lag of 1/rate samples gains over one interval from a bend u*(1 - u)/2."""
    if rate < 1e-2:
        return rate * (1.0 / 12.0 - rate / 24.0 + rate**2 / 80.0)
    kept = math.exp(-rate)
    first, second = (1.0 - kept * (1.0 + rate)) / rate, (2.0 - kept * (2.0 + 2.0 * rate + rate**2)) / rate**2
    return 0.5 * (first - second)


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
    """Return what is held of the part above 0 of a signal a sample later: its new value, or what is left if more."""
    old, new = max(before, 0.0), max(now, 0.0)
    return max(new, new + decay * (held - old) - follow * (new - old))


@kernel
def smooth_play(x: Array, half_width: float) -> Array:
    """Return ``play`` of a signal (N,) that is smooth: it turns between the samples, at a parabola's vertex.

    A sampled signal misses up to an eighth of its second difference at every turn, which is travel that a narrow play
    would have seen. The parabola goes through the last three samples; no sample knows of those after it.
    """
    y = np.empty_like(x)
    state = 0.0
    for j in range(len(x)):
        if j > 1:
            before, after = x[j - 1] - x[j - 2], x[j] - x[j - 1]
            # its slopes at the first and at the last of them have unlike signs
            if (3.0 * before - after) * (3.0 * after - before) < 0.0:
                vertex = x[j - 1] - (before + after) ** 2 / (8.0 * (after - before))
                state = max(vertex - half_width, min(vertex + half_width, state))
        state = max(x[j] - half_width, min(x[j] + half_width, state))
        y[j] = state
    return y


def level(x: Array) -> float:
    """Return the mean of a signal (N,) under a Hann window, whose bias by an unfinished cycle falls as 1/cycles^3."""
    weights = 1.0 - np.cos(2.0 * np.pi * (np.arange(len(x)) + 0.5) / len(x))
    return float(weights @ x / len(x))


def running_integral(x: Array, dt: float) -> Array:
    """Return the cumulative integral (N,) of a signal (N,) by the trapezoid rule, 0 at the first sample."""
    integral = np.zeros(len(x))
    np.cumsum((x[1:] + x[:-1]) * (dt / 2.0), out=integral[1:])
    return integral


def bent(x: Array, curvature: Array, power: Array) -> Array:
    """Return x/(1 + |x/s|^p)^(1/p) with 1/s^2 = curvature >= 0: x where it is small, s where it is large.

    Parameters
    ----------
    x
        Signals, in a shape that broadcasts against the curvature's.
    curvature
        1/s^2, in the inverse square of the signal's unit; 0 leaves x as it is.
    power
        p >= 1, how sharp the knee is: 1 Froehlich's curve, 2 to 4 as tanh, many a corner.
    """
    bend: Array = x / (1.0 + (np.sqrt(curvature) * np.abs(x)) ** power) ** (1.0 / power)
    return bend


def soft_sign(x: Array, width: Array | float) -> Array:
    """Return tanh(x/width): the sign of x, but for |x| below the width, where the sign of a noisy x would chatter."""
    sign: Array = np.tanh(x / width)
    return sign
