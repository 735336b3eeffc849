"""Measured segments as least-squares blocks: what drives the model, what it is compared with, in how many numbers.

Where the drive is periodic, all cycles see the same input, so one simulated cycle is compared with the data folded onto
one cycle: samples are collected in phase bins, each represented by its mean phase and mean value. The cost over the
bins differs from that over the samples by a constant (the scatter inside bins), which is carried along, so both have
the same minimum; the work no longer grows with the length of the log.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, Protocol

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from mrfit.core.recording import Segment
from mrfit.core.specs import Array, Index, Mask
from mrfit.kernels.folding import compare
from mrfit.optimizers.cost.objective import Coordinates
from mrfit.search.cube import Cube, FreeParameters
from mrfit.signal.smoothing import Drive
from mrfit.simulate.assembly import Assembly

PHASE_BINS = 1024
SETTLE_CYCLES = 2
# Cycles simulated beyond what is compared, for effects that look ahead: those that make up for a late record. A whole
# one, since other effects take means over the drive, which an unfinished cycle would bias.
AHEAD_CYCLES = 1
# Half the span of the slope within which samples of a bin move; wide, so that noise does not pass for slope
SLOPE_BINS = 8
# Distance from a jump up to which the range about it is taken, in those at which the jump is over
FAR = 8


@dataclass(frozen=True)
class SegmentBlock:
    """One segment to be simulated and compared.

    Attributes
    ----------
    segment
        The segment it stands for.
    drive, dt
        Inputs (C, W + M) in the order of the model's SPEC, and their sample interval in s.
    target
        Measured output (B,), compared with the simulation at ``nodes``.
    nodes, weights
        Target b stands beside Σ_k weights[b, k]·simulated[nodes[b, k]], both (B, S): one sample itself, or four on the
        grid of a folded cycle, of the cubic through which the mean is taken over the target's samples.
    counts
        Samples each target stands for (B,); 0 where a sample is not compared.
    scatter
        Sum of squares of the samples about their targets: what no model can remove.
    method
        How the drive was smoothed.
    bins
        Target that each measured sample is part of (N,), or None where every sample is one.
    cycle
        Samples after which the drive of a full block repeats itself, rounded up; 0 where it does not.
    """

    segment: Segment
    drive: Array
    dt: float
    target: Array
    nodes: Index
    weights: Array
    counts: Array
    scatter: float
    method: str
    bins: NDArray[np.integer] | None = None
    cycle: int = 0

    @property
    def samples(self) -> int:
        """Number of measured samples the block stands for."""
        return int(self.counts.sum())

    @cached_property
    def shares(self) -> Array:
        """Share of the samples that each target stands for (B,)."""
        shares: Array = self.counts / self.counts.sum()
        return shares

    @property
    def period(self) -> float:
        """Samples per cycle of a full block's drive, 0 where it is not periodic."""
        return period_of(self.segment, self.dt)

    def at_targets(self, simulated: Array) -> Array:
        """Pick the simulated values (P, W + M) that stand beside the targets, (P, B)."""
        picked = np.empty((len(simulated), len(self.target)))
        ones, none = np.ones(len(self.target)), np.empty(0)
        compare(simulated, self.nodes, self.weights, (np.zeros(len(self.target)), none, ones), 1, picked)
        return picked

    def folded(self, values: Array) -> Array:
        """Return the means (B,) of sample values (N,) over the samples of each target."""
        if self.bins is None:
            return values
        return np.bincount(self.bins, values) / np.bincount(self.bins)

    def inputs(self, row: int) -> Array:
        """Return one input at the targets of a full block, (N,)."""
        values: Array = self.drive[row, self.nodes[:, 0]]
        return values


def period_of(segment: Segment, dt: float) -> float:
    """Return the samples per cycle of a segment's drive, 0 where it is not periodic."""
    return 1.0 / (segment.frequency * dt) if segment.cycles and segment.frequency > 0.0 else 0.0


def full_block(segment: Segment, drive: Drive, output: Array) -> SegmentBlock:
    """Return a block that compares every sample; a periodic drive is led in by two of its own cycles.

    Parameters
    ----------
    segment
        The segment.
    drive
        Its smoothed inputs over warm-up and segment.
    output
        Measured output over [segment.start, segment.stop), shape (N,).
    """
    values, warm_up, cycle = drive.values, drive.warm_up, 0
    if drive.fits is not None:
        cycle = math.ceil(1.0 / (segment.frequency * drive.dt))
        lead = int(round((SETTLE_CYCLES + drive.entry) / (segment.frequency * drive.dt)))
        ahead = int(round(AHEAD_CYCLES / (segment.frequency * drive.dt)))
        values, warm_up = _series(drive, lead, lead + len(output) + ahead), lead
    # of an excitation in its steady state all cycles are one
    nodes = warm_up + np.arange(len(output))[:, None] % (values.shape[1] - warm_up)
    return SegmentBlock(
        segment=segment,
        drive=np.ascontiguousarray(values),
        dt=drive.dt,
        target=output,
        nodes=nodes,
        weights=np.ones((len(output), 1)),
        counts=np.ones(len(output)),
        scatter=0.0,
        method=drive.method,
        cycle=cycle,
    )


def _series(drive: Drive, lead: int, count: int) -> Array:
    """Return the inputs of a periodic drive at so many samples (C, N), ``lead`` of them before the segment."""
    assert drive.fits is not None
    first = drive.warm_up - lead
    if not drive.values.size:
        # a piece of a long segment, whose inputs are made again and again
        return np.stack([fit.sampled(first * drive.dt, drive.dt, count) for fit in drive.fits])
    times = np.arange(first, first + count, dtype=np.float64) * drive.dt
    return np.stack([fit.evaluate(times) for fit in drive.fits])


def folded_block(
    segment: Segment, drive: Drive, output: Array, ahead: int = 0, jumps: Sequence[int] = ()
) -> SegmentBlock:
    """Return a block with the samples of a periodic drive folded onto one cycle; any other drive gives a full block.

    An excitation in its steady state is folded sample by sample.

    Parameters
    ----------
    segment, drive, output
        As of a full block.
    ahead
        Cycles that are simulated beyond the one compared.
    jumps
        Inputs at whose change of sign the model jumps. Where the grid of a target lies on both sides, a cubic
        overshoots: a line takes its place, and where the output jumps as well the target is not compared.
    """
    cycle = drive.values.shape[1] - drive.warm_up
    if drive.fits is None and cycle < len(output):
        return beside_jumps(_mean_cycle(full_block(segment, drive, output[:cycle]), output), jumps)
    if drive.fits is None or len(output) <= PHASE_BINS:
        return beside_jumps(full_block(segment, drive, output), jumps)
    frequency = frequency_of(drive)
    cycles = np.arange(len(output)) * drive.dt * frequency + drive.entry
    phase = (cycles - np.floor(cycles)) * PHASE_BINS
    bins = np.minimum(phase.astype(np.int64), PHASE_BINS - 1)
    counts = np.bincount(bins, minlength=PHASE_BINS)
    full = counts > 0
    places = np.cumsum(full)[bins] - 1
    weight = counts[full].astype(np.float64)
    mean_phase = np.bincount(bins, phase, PHASE_BINS)[full] / weight
    target = np.bincount(bins, output, PHASE_BINS)[full] / weight
    lead, last = SETTLE_CYCLES * PHASE_BINS, (1 + ahead) * PHASE_BINS
    times = (np.arange(-lead, last, dtype=np.float64) / PHASE_BINS - drive.entry) / frequency + drive.warm_up * drive.dt
    values = np.stack([fit.evaluate(times) for fit in drive.fits])
    nodes = lead + (np.flatnonzero(full)[:, None] + np.arange(-1, 3)) % PHASE_BINS
    across = _changes_sign(values, nodes, jumps)
    lost = _jumps(target, across, 3, "wrap")
    # within a bin the output also moves along its slope, which is no scatter
    spread = np.bincount(bins, phase**2, PHASE_BINS)[full] - weight * mean_phase**2
    # few bins are filled where the sampling is a multiple of the frequency: a span of a whole cycle would be none
    reach = min(SLOPE_BINS, (len(target) - 1) // 2)
    run = (np.roll(mean_phase, -reach) - np.roll(mean_phase, reach)) % PHASE_BINS
    slope = (np.roll(target, -reach) - np.roll(target, reach)) / run
    # a jump is no slope
    slope[np.any([np.roll(lost, k) for k in range(-reach, reach + 1)], axis=0)] = 0.0
    scatter = float(
        np.sum(output[~lost[places]] ** 2) - np.sum((weight * target**2)[~lost]) - np.sum((slope**2 * spread)[~lost])
    )
    # the mean of the curve over a bin, not the curve at the mean phase, which its curvature sets apart
    within = phase - bins
    means = [np.bincount(bins, within**k, PHASE_BINS)[full] / weight for k in (1, 2, 3)]
    return SegmentBlock(
        segment=segment,
        drive=values,
        dt=1.0 / (PHASE_BINS * frequency),
        target=target,
        nodes=nodes,
        weights=np.where(across[:, None], line_weights(means[0]), cubic_weights(*means)),
        counts=np.where(lost, 0.0, weight),
        scatter=max(scatter, 0.0),
        method=drive.method,
        # one of them for every sample: small numbers
        bins=places.astype(np.int16),
    )


def frequency_of(drive: Drive) -> float:
    """Return the frequency in Hz of a periodic drive."""
    assert drive.fits is not None
    return next(fit.frequency for fit in drive.fits if fit.harmonics)


def entering_at_mean(drive: Drive, row: int) -> Drive:
    """Return a periodic drive whose simulation begins where one of its inputs rises through its mean."""
    if drive.fits is None or not drive.fits[row].harmonics:
        return drive
    before = np.arange(-PHASE_BINS, 1) / PHASE_BINS
    path = drive.fits[row].evaluate(before / frequency_of(drive) + drive.warm_up * drive.dt)
    path = path - path[1:].mean()
    rising = np.flatnonzero((path[:-1] < 0.0) & (path[1:] >= 0.0))
    nearest = rising[np.argmin(np.abs(path[rising]))] if len(rising) else PHASE_BINS
    return replace(drive, entry=float(-before[nearest]))


def beside_jumps(block: SegmentBlock, jumps: Sequence[int]) -> SegmentBlock:
    """Return a full block without samples next to a jump of model and output, none of which tells its side of it."""
    if not jumps:
        return block
    around = block.nodes + np.array([-1, 0, 1])
    across = _changes_sign(block.drive, np.clip(around, 0, block.drive.shape[1] - 1), jumps)
    counts = np.where(_jumps(block.target, across, 2), 0.0, block.counts)
    return replace(block, counts=counts) if counts.any() else block


def _changes_sign(drive: Array, nodes: Index, rows: Sequence[int]) -> Mask:
    """Return at which targets (B,) one of some inputs changes its sign among the nodes (B, S)."""
    side = np.sign(drive[list(rows)])[:, nodes]
    changes: Mask = np.any(side.min(axis=2) != side.max(axis=2), axis=0)
    return changes


def _jumps(output: Array, across: Mask, reach: int, beyond: Literal["wrap", "edge"] = "edge") -> Mask:
    """Return at which of some targets (B,) a measured output jumps: most of its range about them is next to them.

    ``beyond`` says what is beside the last one: the first, as in a cycle, or nothing.
    """
    jumps, far = across.copy(), FAR * reach
    about = sliding_window_view(np.pad(output, far, mode=beyond), 2 * far + 1)[across]
    jumps[across] = np.abs(about[:, far + reach] - about[:, far - reach]) > 0.5 * np.ptp(about, axis=1)
    return jumps if not jumps.all() else np.zeros_like(jumps)


def _mean_cycle(block: SegmentBlock, output: Array) -> SegmentBlock:
    """Return a block of one cycle that stands for all cycles of an output (N,) by their mean."""
    bins = np.arange(len(output)) % len(block.target)
    counts = np.bincount(bins).astype(np.float64)
    target = np.bincount(bins, output) / counts
    scatter = float(np.sum((output - target[bins]) ** 2))
    return replace(block, target=target, counts=counts, scatter=scatter, bins=bins)


def line_weights(first: Array) -> Array:
    """Return the weights (B, 4) of the same samples for the line between those at 0 and 1."""
    none = np.zeros_like(first)
    return np.stack([none, 1.0 - first, first, none], axis=1)


def cubic_weights(first: Array, second: Array, third: Array) -> Array:
    """Return the Lagrange weights (B, 4) of samples at −1, 0, 1, 2 for the mean over points between 0 and 1.

    They follow from the mean of the points' places (B,), of their squares and of their cubes.
    """
    columns = (
        -(third - 3.0 * second + 2.0 * first) / 6.0,
        (third - 2.0 * second - first + 2.0) / 2.0,
        -(third - second - 2.0 * first) / 2.0,
        (third - first) / 6.0,
    )
    return np.stack(columns, axis=1)


def differences(block: SegmentBlock, assembly: Assembly, theta: Array) -> Array:
    """Return simulated − measured at the targets of a block, (P, K) -> (P, B); 0 at those that stand for no sample.

    The unknown constant of a flux record is removed: it is the mean difference, since that is what least squares gives.
    """
    with np.errstate(all="ignore"):
        delta = differences_of(block, assembly, assembly.simulate(block.drive, theta, block.dt))
    return delta if block.counts.all() else np.where(block.counts > 0.0, delta, 0.0)


def differences_of(block: SegmentBlock, assembly: Assembly, simulated: Array) -> Array:
    """Return simulated − measured at all targets, of outputs that are simulated already, (P, W + M) -> (P, B)."""
    delta = np.empty((len(simulated), len(block.target)))
    with np.errstate(all="ignore"):
        _compare(block, assembly, simulated, np.ones(len(block.target)), 1, delta)
    return delta


def _compare(block: SegmentBlock, assembly: Assembly, simulated: Array, scale: Array, every: int, out: Array) -> None:
    """Set out (P, B) to scale (B,) times simulated (P, W + M) − measured, see ``folding.compare``."""
    # each record of an integrated flux has an unknown constant, that of a load cell's force has none
    shares = block.shares if assembly.spec.free_offset else np.empty(0)
    compare(simulated, block.nodes, block.weights, (block.target, shares, scale), every, out)


@dataclass(frozen=True)
class ResidualScales:
    """Factors of ``row_scales``, and the residual that stands for what no model can remove."""

    factors: list[Array]
    scatter: float


def residual_function(
    blocks: list[SegmentBlock], assembly: Assembly, to_theta: Callable[[Array], Array], weights: Array
) -> Callable[[Array], Array]:
    """Return the map from points (P, F) of the cube to weighted residuals (P, M) with the mean square of the samples.

    Parameters
    ----------
    blocks
        What is compared.
    assembly
        The model.
    to_theta
        Map from the cube to parameters.
    weights
        Factor on the error of each block, shape (len(blocks),).
    """
    scales = _scales(blocks, weights)

    def residuals(points: Array) -> Array:
        theta = to_theta(points)
        simulated = (assembly.simulate(b.drive, theta, b.dt) for b in blocks)
        with np.errstate(all="ignore"):
            return _weighted(blocks, assembly, scales, simulated, len(points))

    return residuals


def _weighted(
    blocks: Sequence[SegmentBlock],
    assembly: Assembly,
    scales: ResidualScales,
    simulated: Iterable[Array],
    count: int,
    every: int = 1,
) -> Array:
    """Return weighted residuals (P, M) of rows (P, W + M): a response in every so many, its derivatives behind it."""
    values, place = np.empty((count, sum(len(f) for f in scales.factors) + 1)), 0
    values[:, -1] = 0.0
    values[::every, -1] = scales.scatter
    for block, factor, rows in zip(blocks, scales.factors, simulated, strict=True):
        _compare(block, assembly, rows, factor, every, values[:, place : place + len(factor)])
        place += len(factor)
    return values


def _scales(blocks: Sequence[SegmentBlock], weights: Array) -> ResidualScales:
    """Return the scales of the residuals of blocks by their weights."""
    samples = sum(b.samples for b in blocks)
    rows = sum(len(b.target) for b in blocks) + 1
    scatter = np.sqrt(sum(w**2 * b.scatter for b, w in zip(blocks, weights, strict=True)) * rows / samples)
    return ResidualScales(row_scales(blocks, weights), float(scatter))


def row_scales(blocks: Sequence[SegmentBlock], weights: Array) -> list[Array]:
    """Return the factor (B,) on each block's differences that gives rows with the mean square of the samples."""
    samples = sum(b.samples for b in blocks)
    rows = sum(len(b.target) for b in blocks) + 1
    return [w * np.sqrt(b.counts * rows / samples) for b, w in zip(blocks, weights, strict=True)]


class Problem(Protocol):
    """What every search needs of a problem: residuals over the unit cube."""

    @property
    def residuals(self) -> Callable[[Array], Array]:
        """The map from points (P, F) of the cube to weighted residuals (P, M)."""

    @property
    def coordinates(self) -> Coordinates | None:
        """The parameters in physical units, for optimizers that ask for them; None where the cube is all there is."""


@dataclass(frozen=True)
class ResidualProblem:
    """Any residuals over the unit cube, for searches that need nothing else of a problem."""

    residuals: Callable[[Array], Array]
    coordinates: Coordinates | None = None


@dataclass(frozen=True)
class LeastSquaresProblem:
    """A least-squares problem at hand: what is compared, with which weights, by which model over which cube.

    Attributes
    ----------
    blocks
        What is compared.
    weights
        Factor on the error of each block, shape (len(blocks),).
    assembly
        The model.
    cube
        Its free parameters.
    """

    blocks: list[SegmentBlock]
    weights: Array
    assembly: Assembly
    cube: Cube

    @cached_property
    def residuals(self) -> Callable[[Array], Array]:
        """The map from points (P, F) to weighted residuals (P, M), see ``residual_function``."""
        return residual_function(self.blocks, self.assembly, self.cube.to_theta, self.weights)

    @property
    def coordinates(self) -> FreeParameters:
        """The free parameters in physical units."""
        return FreeParameters(self.cube)

    @cached_property
    def of_theta(self) -> Callable[[Array], Array]:
        """The map from parameter vectors (P, K) to weighted residuals (P, M)."""
        return residual_function(self.blocks, self.assembly, lambda theta: theta, self.weights)

    @cached_property
    def _scales(self) -> ResidualScales:
        return _scales(self.blocks, self.weights)

    @cached_property
    def silent(self) -> Array:
        """The weighted residuals (M,) of a response that is zero."""
        nothing = (np.zeros((1, b.drive.shape[1])) for b in self.blocks)
        silent: Array = _weighted(self.blocks, self.assembly, self._scales, nothing, 1)[0]
        return silent

    def sensitivities(self, theta: Array, columns: Index) -> Array:
        """Return weighted residuals at theta (P, K) and their derivatives along some columns (Q,), (P, 1 + Q, M)."""
        exact, every = self.assembly.sensitivities, 1 + len(columns)
        assert exact is not None
        count = len(theta) * every
        simulated = (exact(b.drive, theta, b.dt, columns).reshape(count, -1) for b in self.blocks)
        rows = _weighted(self.blocks, self.assembly, self._scales, simulated, count, every)
        return rows.reshape(len(theta), every, -1)

    @property
    def rows(self) -> int:
        """Number of residuals M."""
        return sum(len(b.target) for b in self.blocks) + 1

    @property
    def simulated(self) -> int:
        """Number of samples that one simulation has."""
        return sum(b.drive.shape[1] for b in self.blocks)

    @property
    def samples(self) -> int:
        """Number of measured samples."""
        return sum(b.samples for b in self.blocks)


def measured(problem: Problem) -> LeastSquaresProblem:
    """Return a problem as one of measured blocks, which some strategies look into.

    Raises
    ------
    TypeError
        If it is not such a one.
    """
    if not isinstance(problem, LeastSquaresProblem):
        raise TypeError(
            f"this strategy searches problems of measured blocks (LeastSquaresProblem), not {type(problem).__name__}"
        )
    return problem
