"""How much of a channel is noise, estimated from the channel itself."""

from math import comb, sqrt

import numpy as np

from mrfit.core.remembered import remembered
from mrfit.core.specs import Array
from mrfit.signal.harmonics import harmonic_fit

# Ratio of a normal deviate's standard deviation to its median absolute value.
NORMAL_MEDIAN = 1.482602218505602
DIFFERENCE_ORDERS = (2, 4, 6, 8)
UNIQUE_SAMPLES = 20_000
STAYING = 0.1
# So few levels, each left no sooner than after so many samples, are commands that are held and not an amplitude grid
HELD_LEVELS, HELD_SAMPLES = 16, 10
# Share of the samples on ramps at which a computed ramp may bend
RAMP_BENDS = 0.1
# Fewest cycles over which a trend from cycle to cycle can be told from noise
TREND_CYCLES = 4
# Cycles and trends over few of them are not quite orthogonal
TREND_PASSES = 3
# Channels of more samples than this are judged by windows of so many samples at so many places spread over them
LONG_SEGMENT = 1 << 21
NOISE_WINDOW, WINDOWS = 1 << 16, 16
# Share of a spectrum (2·sin(ω/2))⁻⁴ that differences of order 8 over one and over two samples let through
FALLING = (comb(12, 6) / comb(16, 8), 0.3077748916)


@remembered
def noise_level(values: Array) -> float:
    """Return the rms of a channel's white noise or, where that is larger, of its quantisation.

    Differences of order p remove what is smooth and turn white noise of variance σ² into variance C(2p, p)·σ²; the
    median makes them blind to jumps, and the smallest of several orders is taken. Noise that has little power near the
    Nyquist frequency, as after an anti-aliasing filter, is underestimated; a signal with fewer than about 8 samples per
    cycle is taken for noise.

    Parameters
    ----------
    values
        Channel (N,), in any unit; 0 is returned for fewer than 3 samples.
    """
    orders = [p for p in DIFFERENCE_ORDERS if len(values) > 2 * p]
    levels = [_difference_level(windows(values), p) for p in orders]
    return max(min(levels, default=0.0), quantisation(values) / sqrt(12.0))


def robust_rms(values: Array) -> float:
    """Return the rms of white noise (N,) of which up to a half may be something larger."""
    return float(NORMAL_MEDIAN * np.median(np.abs(values)))


def windows(values: Array) -> list[Array]:
    """Return the parts of a channel (N,) by which it is judged: all of it, or windows spread over a long one."""
    if len(values) <= LONG_SEGMENT:
        return [values]
    starts = np.linspace(0, len(values) - NOISE_WINDOW, WINDOWS).astype(np.int64)
    return [values[start : start + NOISE_WINDOW] for start in starts]


def _difference_level(parts: list[Array], order: int) -> float:
    difference = np.concatenate([np.diff(part, order) for part in parts])
    return float(robust_rms(difference) / np.sqrt(comb(2 * order, order)))


def quantisation(values: Array) -> float:
    """Return the step of a channel's amplitude grid, or 0 if its samples do not stay on levels of one.

    Where hardly any sample equals the one before, quantisation is white noise and ``noise_level`` sees it as such. A
    few levels, each of them held, are exact, as those of a commanded current: a measured one flickers between levels.
    So are ramps whose steps are all alike, as those of a computed trapezoid: a rounded one waits for its next level.
    Of a long channel the middle is looked at.
    """
    begin = max(len(values) - LONG_SEGMENT, 0) // 2
    values = values[begin : begin + LONG_SEGMENT]
    if np.mean(values[1:] == values[:-1]) < STAYING:
        return 0.0
    levels = np.unique(values[:UNIQUE_SAMPLES])
    if len(levels) < 3 or len(levels) > min(len(values), UNIQUE_SAMPLES) // 2:
        return 0.0
    runs = np.diff(np.flatnonzero(np.diff(values)))
    if len(levels) <= HELD_LEVELS and np.min(runs, initial=HELD_SAMPLES) >= HELD_SAMPLES:
        return 0.0
    steps = np.diff(levels)
    steps = steps[steps > 1e-9 * (levels[-1] - levels[0])]
    step = float(np.min(steps))
    moves, bends = (float(np.mean(np.abs(np.diff(values, order)) > step / 2)) for order in (1, 2))
    if bends < RAMP_BENDS * moves:
        return 0.0
    # On a grid every distance between levels is a whole number of steps.
    off_grid = np.abs(steps / step - np.round(steps / step))
    return step if np.max(off_grid) < 0.05 else 0.0


@remembered
def noise_floor(values: Array, dt: float, frequency: float, cycles: int, trending: bool = False) -> float:
    """Return the rms of what does not repeat from cycle to cycle: no model driven by the same cycles can explain it.

    A Fourier series takes away the repeated part; of the rest, whatever lies on multiples of the fundamental is
    repeated too. Noise that lies there by chance, one part in M of it, is put back by the factor M/(M − 1), whatever
    the noise's colour, so long as its spectrum is smooth over one multiple of the fundamental; by M/(M − 2) where a
    trend is taken away as well. Cycles need not be a whole number of samples.

    Parameters
    ----------
    values
        Channel (N,) over a segment.
    dt
        Sample interval in s.
    frequency
        Fundamental in Hz, 0 for a segment without one.
    cycles
        Whole cycles M in the segment. Below 2, and without a fundamental, ``noise_level`` is returned instead, which
        knows white noise only.
    trending
        Whether what grows or falls steadily from cycle to cycle is taken away too, as drift and warming do: a model
        that knows the time or the temperature can explain it. Otherwise it counts as noise.
    """
    whole = min(cycles, int((len(values) + 1.0) * frequency * dt))
    if whole < 2 or frequency <= 0.0 or frequency * dt > 0.25:
        return noise_level(values)
    fit = harmonic_fit(values, dt, frequency, refine=False)
    samples = min(len(values), round(whole / (frequency * dt)))
    time = np.arange(samples, dtype=np.float64) * dt
    residual = values[:samples] - fit.evaluate(time)
    taken = -1
    if trending and whole >= TREND_CYCLES:
        for _ in range(TREND_PASSES):
            trend, harmonics = _trend(residual, time, frequency)
            residual, taken = residual - trend, max(taken, harmonics)
            residual = residual - harmonic_fit(residual, dt, frequency, refine=False).evaluate(time)
    power = np.abs(np.fft.rfft(residual)) ** 2
    power[1:] *= 2.0
    if samples % 2 == 0:
        power[-1] /= 2.0
    power[::whole] = 0.0
    # about a harmonic whose trend was taken, two parts in M of the noise went with it
    removed = np.where(np.round(np.arange(len(power)) / whole) <= taken, 2, 1)
    return float(np.sqrt(np.sum(power * whole / (whole - removed)))) / samples


def _trend(residual: Array, time: Array, frequency: float) -> tuple[Array, int]:
    """Return the part of a residual (N,) that is a cycle growing with the time from the middle, and its harmonics."""
    since = (time - time.mean()) / time.std()
    # a cycle times the time is nearly orthogonal to all that repeats, and its mean product with the time is the cycle
    growth = harmonic_fit(residual * since, float(time[1]), frequency, refine=False)
    return since * growth.evaluate(time), growth.harmonics


def white_part(values: Array) -> float:
    """Return the rms of a channel's white noise, less what is a rough signal's own, or its quantisation.

    ``noise_level`` takes a spectrum that falls by 12 dB per octave up to the Nyquist frequency, as after a filter of
    second order, for noise. White noise is as strong at half the Nyquist frequency; differences over two samples
    measure it there.

    Parameters
    ----------
    values
        Channel (N,), in any unit; 0 is returned for fewer than 3 samples.
    """
    level, order = noise_level(values), DIFFERENCE_ORDERS[-1]
    grid = quantisation(values) / sqrt(12.0)
    if len(values) <= 4 * order or level <= grid:
        return level
    difference = values
    for _ in range(order):
        difference = difference[2:] - difference[:-2]
    middle = float(robust_rms(difference) / np.sqrt(comb(2 * order, order)))
    falling = max(middle**2 - level**2, 0.0) / (FALLING[1] - FALLING[0])
    return max(sqrt(max(level**2 - FALLING[0] * falling, 0.0)), grid)
