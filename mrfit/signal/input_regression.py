"""What of an output its inputs explain, by a regression that knows no law, and how much noise is left.

The output is regressed on a library of the inputs: powers, smoothed signs of the rate, plays, lags and their products,
times what else varies. A ridge penalty is chosen by cross-validation over blocks that are longer than the noise is
correlated. The noise is the least power that a half of the samples has, chosen by the size of an input on other blocks:
noise is the same everywhere, and what the library cannot follow is not. It is believed only if neighbours in the space
of inputs tell nothing of each other's residual there.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from mrfit.core.remembered import remembered
from mrfit.core.specs import Array, Index, Mask
from mrfit.kernels.filters import play
from mrfit.kernels.memory import decayed
from mrfit.signal.convolution import correlation_time
from mrfit.signal.noise import noise_level, quantisation
from mrfit.signal.noise_floor import NoiseFloor, measured_samples, not_known

# Fewest measured samples, and the most that are looked at
REGRESSION_SAMPLES_MIN, REGRESSION_SAMPLES_MAX = 600, 20_000
# Samples of all channels of the longest record of which the floor is remembered
REMEMBERED_CHANNELS_MAX = 2_000_000
# Widths of the smoothed signs as shares of the highest rate, and of the plays as shares of the largest stroke
SIGNS = (0.01, 0.03, 0.08, 0.2, 0.5)
PLAYS = np.geomspace(0.005, 0.8, 8)
# Time constants of the lags, in units of the time in which the fastest part of the drive turns by a radian
INPUT_LAGS = (0.05, 0.15, 0.4, 1.2)
PENALTIES = (1e-9, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
FOLDS = 8
# Blocks of the cross-validation: a share of the samples, and at least so many correlation times of the residual
BLOCK_SHARE, BLOCK_TIMES = 80, 5.0
# Bins of the size of an input, of which the quieter half is the noise's
INPUT_BINS = 8
# Rate, as a share of the highest, at which a specimen hardly moves
CREEP_SHARE = 0.05
# Columns that also grow with time, as gains drift (rate, stroke, a sign), and how many any other input scales
TREND_ORDERS, VARIED, LATE_COLUMNS = (0, 3, 9), 35, 13
# Seconds by which an output may follow another input late
LATENESS = (0.003, 0.01, 0.03, 0.1)
NEIGHBOURS = 10
# Correlation of a residual over a lag below which it is none
UNCORRELATED = 0.05
# Correlation of a residual with its neighbours' mean that noise does not reach by chance
INPUT_CORRELATION = 0.13
# A quieter quarter with less than this share of the RMS of the quieter half, but for chance, says that neither is quiet
UNEVEN = 0.9
# Nor is a half believed where all samples together have so many times its RMS: the library follows too little
MOSTLY = 1.5
# Fewest samples, in independent ones, that tell a power, and bounds so close that what lies between is known
FEWEST_WORTH, CLOSE_BOUNDS_RATIO = 16, 1.3


@dataclass(frozen=True)
class DrivingInput:
    """The input that drives a specimen, at every sample (N,): what moves, its rate and the rate of that.

    ``others`` are further inputs that vary: current beside a stroke, temperature.
    """

    moved: Array
    rate: Array
    acceleration: Array
    others: Sequence[Array]
    dt: float


def regression_floor(values: Array, motion: DrivingInput) -> NoiseFloor:
    """Return the noise floor of an output (N,) by regression on its inputs; not known where that explains too little.

    Parameters
    ----------
    values
        Output (N,), dropouts filled by straight lines or held values included: they are left out.
    motion
        Inputs at the same samples.
    """
    content = np.stack([values, motion.moved, motion.rate, motion.acceleration, *motion.others])
    return _floor_of(content.ravel(), len(content), motion.dt)


def _regression_floor(content: Array, channels: int, dt: float) -> NoiseFloor:
    """Return the same for an output and its inputs one after the other (C*N,)."""
    values, moved, rate, acceleration, *others = content.reshape(channels, -1)
    motion = DrivingInput(moved, rate, acceleration, others, dt)
    measured = measured_samples(values)
    stride = max(1, -(-int(np.sum(measured)) // REGRESSION_SAMPLES_MAX))
    rows = np.flatnonzero(measured)[::stride]
    if len(rows) < REGRESSION_SAMPLES_MIN or float(np.ptp(motion.moved)) == 0.0:
        return not_known(values)
    columns = library(motion, rows)
    target = values[rows] - values[rows].mean()
    found = _cross_validated(columns, target, max(len(rows) // BLOCK_SHARE, 1))
    longer = int(BLOCK_TIMES * found.correlation_time)
    if longer > found.block:
        found = _cross_validated(columns, target, min(longer, len(rows) // (2 * FOLDS)))
    high = float(np.sqrt(max(np.mean(found.power), np.mean(found.residual**2))))
    sizes = _sizes(motion, rows, target - found.fitted_residual)
    quiet, where = _quiet(found, sizes, INPUT_BINS // 2)
    worth = len(rows) / max(found.correlation_time, 1.0)
    width = quiet * np.sqrt(2.0 / worth)
    even = _quiet(found, sizes, INPUT_BINS // 4)[0] > quiet * (UNEVEN - np.sqrt(2.0 / worth))
    states = _states(motion, rows, target, found)
    even = even and high <= MOSTLY * quiet
    if worth > FEWEST_WORTH and even and _neighbours_agree(found, states, where) < INPUT_CORRELATION:
        return NoiseFloor(quiet, "regression", max(quiet - 2.0 * width, 0.0), max(high, quiet + 2.0 * width))
    least, rounding = noise_level(values[measured]), quantisation(values) / sqrt(12.0)
    if 0.0 < rounding and high <= CLOSE_BOUNDS_RATIO * rounding:
        # a regression follows rounding errors, which are a function of the output
        return NoiseFloor(max(rounding, sqrt(rounding * high)), "regression", rounding, max(high, rounding))
    if least < high <= CLOSE_BOUNDS_RATIO * least:
        return NoiseFloor(sqrt(least * high), "regression", least, high)
    return not_known(values, high)


_floor_of = remembered(_regression_floor, longest=REMEMBERED_CHANNELS_MAX)


def library(motion: DrivingInput, rows: Index) -> Array:
    """Return the columns (R, M) on which an output is regressed, at the samples ``rows`` (R,)."""
    moved, turn = _scaled(motion.moved), 1.0 / _bandwidth(motion)
    rate, acceleration = _scaled(motion.rate), _scaled(motion.acceleration)
    lagged = []
    for signal in (rate, *(np.tanh(rate / SIGNS[k]) for k in (0, 2, 3)), *(_stop(moved, PLAYS[k]) for k in (2, 4))):
        lagged += [(_lagged(signal, share * turn, motion.dt) - signal)[rows] for share in INPUT_LAGS]
    lagged += [(_lagged(acceleration, share * turn, motion.dt) - acceleration)[rows] for share in INPUT_LAGS]
    stops = [_stop(moved, half_width)[rows] for half_width in PLAYS]
    q, r, a = moved[rows], rate[rows], acceleration[rows]
    signs = [np.tanh(r / width) for width in SIGNS]
    columns = [r, r * np.abs(r), r**3, q, q**2, q**3, q**4, a, *signs]
    columns += [q * signs[1], q * signs[3], q * r, q * q * r, a * np.abs(r), a * q, *stops]
    for factor in (None, np.abs(r), np.exp(-np.abs(r) / CREEP_SHARE)):
        columns += [s * (np.abs(s) if factor is None else factor) for s in stops]
    found = np.stack([*columns, *lagged], axis=1)
    time = np.linspace(-1.0, 1.0, len(moved))[rows, None]
    parts = [found, np.ones_like(time), time, time * found[:, list(TREND_ORDERS)]]
    for other in motion.others:
        level = _scaled(other)
        for factor in (level, level**2):
            parts += [factor[rows, None], factor[rows, None] * found[:, :VARIED]]
        # what follows an input late does so at its own pace
        for late in _late(level, motion.dt):
            parts += [late[rows, None], late[rows, None] * found[:, :LATE_COLUMNS]]
    return np.hstack(parts)


@dataclass(frozen=True)
class _Fit:
    """A regression: residual (N,) where each block was left out and where none was, and the blocks' length."""

    residual: Array
    fitted_residual: Array
    block: int

    @property
    def correlation_time(self) -> float:
        """Samples over which the residual is correlated."""
        return correlation_time(self.fitted_residual - self.fitted_residual.mean(), UNCORRELATED)

    @property
    def power(self) -> Array:
        """Residual power (N,): one residual is as much too large as the other is too small."""
        return self.residual * self.fitted_residual

    @property
    def fold(self) -> Index:
        """Fold of every sample (N,)."""
        return (np.arange(len(self.residual)) // self.block) % FOLDS


def _scaled(values: Array) -> Array:
    values = values - values.mean()
    return values / max(float(np.quantile(np.abs(values), 0.99)), 1e-300)


def _late(level: Array, dt: float) -> list[Array]:
    """Return by how much an input's value lags behind it with several time constants, (N,) each."""
    return [_lagged(level, seconds, dt) - level for seconds in LATENESS]


def _stop(moved: Array, half_width: float) -> Array:
    return (moved - play(moved, float(half_width))) / half_width


def _bandwidth(motion: DrivingInput) -> float:
    """Return the angular frequency in rad/s below which lies 95 % of the rate's power."""
    rate = (motion.rate - motion.rate.mean()) * np.hanning(len(motion.rate))
    power = np.cumsum(np.abs(np.fft.rfft(rate)) ** 2)
    line = max(int(np.searchsorted(power, 0.95 * power[-1])), 1)
    return float(2.0 * np.pi * line / (len(rate) * motion.dt))


def _lagged(signal: Array, seconds: float, dt: float) -> Array:
    keep = float(np.exp(-dt / seconds))
    driven = (1.0 - keep) * signal
    driven[0] = signal[0]
    return decayed(driven[:, None], keep)[:, 0]


def _cross_validated(columns: Array, target: Array, block: int) -> _Fit:
    """Return the ridge regression with the penalty that predicts blocks left out best."""
    columns = columns / np.maximum(np.sqrt(np.mean(columns**2, axis=0)), 1e-300)
    fold = (np.arange(len(target)) // block) % FOLDS
    parts = [(columns[fold == k], target[fold == k]) for k in range(FOLDS)]
    grams, moments = [c.T @ c for c, _ in parts], [c.T @ t for c, t in parts]
    gram, moment = sum(grams), sum(moments)
    unit = len(target) * np.eye(columns.shape[1])
    best, least, chosen = np.zeros(len(target)), np.inf, PENALTIES[-1]
    for penalty in PENALTIES:
        residual = np.empty(len(target))
        for k, (own, measured) in enumerate(parts):
            rest = np.linalg.solve(gram - grams[k] + penalty * unit, moment - moments[k])
            residual[fold == k] = measured - own @ rest
        error = float(residual @ residual)
        if error < least:
            best, least, chosen = residual, error, penalty
    fitted = columns @ np.linalg.solve(gram + chosen * unit, moment)
    return _Fit(best, target - fitted, block)


def _sizes(motion: DrivingInput, rows: Index, fitted: Array) -> list[Array]:
    """Return by what the samples are sorted into bins."""
    sizes = [np.abs(motion.rate[rows]), np.abs(motion.acceleration[rows]), motion.moved[rows], np.abs(fitted)]
    for other in motion.others:
        sizes += [other[rows], np.abs(_late(_scaled(other), motion.dt)[1][rows])]
    return sizes


def _quiet(found: _Fit, sizes: Sequence[Array], kept: int) -> tuple[float, Mask]:
    """Return the residual's RMS in the quietest bins of one size, ``kept`` of them, and which samples these are (N,).

    Which bins are quiet is told by one half of the blocks and their power by the other, so that chance does not choose.
    """
    even = (np.arange(len(found.power)) // found.block) % 2 == 0
    least, where = np.inf, np.ones(len(found.power), dtype=bool)
    for size in sizes:
        edges = np.quantile(size, np.linspace(0.0, 1.0, INPUT_BINS + 1)[1:-1])
        place = np.searchsorted(edges, size, side="right")
        total, inside = 0.0, np.zeros(len(place), dtype=bool)
        for half in (even, ~even):
            counts = np.maximum(np.bincount(place[half], minlength=INPUT_BINS), 1)
            order = np.argsort(np.bincount(place[half], found.power[half], INPUT_BINS) / counts)
            quiet = np.isin(place, order[:kept]) & ~half
            total += float(np.mean(found.power[quiet])) if np.any(quiet) else np.inf
            inside |= quiet
        if total < least:
            least, where = total, inside
    return float(np.sqrt(max(0.5 * least, 0.0))), where


def _states(motion: DrivingInput, rows: Index, target: Array, found: _Fit) -> tuple[Array, Array]:
    """Return two spaces (N, D) in which samples with the same residual would be near each other."""
    fitted = target - found.fitted_residual
    moved, r, turn = _scaled(motion.moved), _scaled(motion.rate), 1.0 / _bandwidth(motion)
    more = [np.tanh(2.0 * r), motion.acceleration, *(_stop(moved, PLAYS[k]) for k in (2, 4, 6))]
    more += [_lagged(r, share * turn, motion.dt) for share in INPUT_LAGS[1::2]]
    others = [o[rows] for o in motion.others]
    late = [_late(_scaled(o), motion.dt)[k][rows] for o in motion.others for k in (0, 2)]
    few = [fitted, r[rows], *others, *late]
    wide = [fitted, *(m[rows] for m in more), *others, *late]
    return _unit(few), _unit(wide)


def _unit(columns: Sequence[Array]) -> Array:
    return np.stack([c / max(float(np.std(c)), 1e-300) for c in columns], axis=1)


def _neighbours_agree(found: _Fit, spaces: Sequence[Array], where: Mask) -> float:
    """Return the largest correlation of residuals with those of their neighbours in other folds, at some samples."""
    from scipy.spatial import cKDTree

    agreement, fold, residual = 0.0, found.fold, found.residual
    for space in spaces:
        mean = np.zeros(len(residual))
        for k in range(FOLDS):
            own = np.flatnonzero((fold == k) & where)
            others = np.flatnonzero(fold != k)
            if len(own):
                _, near = cKDTree(space[others]).query(space[own], k=NEIGHBOURS)
                mean[own] = residual[others[near]].mean(axis=1)
        size = float(np.linalg.norm(mean[where]) * np.linalg.norm(residual[where]))
        agreement = max(agreement, float(mean[where] @ residual[where]) / max(size, 1e-300))
    return agreement
