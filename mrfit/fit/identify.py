"""Fit one group of segments: search over the folded data, then judge on every sample."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.channels import CHANNELS, MISSING_CHANNEL_ADVICE, unit_of
from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.fit.diagnostics.uncertainty import Linearisation, condensed, sensitivities
from mrfit.io.columns import part_of
from mrfit.io.schemas.fit import FoundPoint
from mrfit.search import run as search
from mrfit.search import strategies
from mrfit.search.chain import Given
from mrfit.search.cube import Cube
from mrfit.search.limits import Limits, ProgressCallback
from mrfit.search.parts import Blocks, SegmentPart, parts_of, split_cycles
from mrfit.search.problem import AHEAD_CYCLES, LeastSquaresProblem, SegmentBlock, differences
from mrfit.search.result import SearchResult
from mrfit.settings.fit import PATIENCE
from mrfit.signal.long_segments import FOLDED_PIECES, OTHER_PIECES, spread_over
from mrfit.signal.noise_floor import NoiseFloor
from mrfit.signal.output_floor import output_floors, residual_floor
from mrfit.simulate.assembly import Assembly

UNCERTAINTY_SAMPLES = 100_000
# Sums over neighbours of a long log that a cycle is left with at least
SUMS_PER_CYCLE = 50


@dataclass(frozen=True)
class FitGroup:
    """What is fitted with one set of parameters.

    Attributes
    ----------
    name
        Condition, or ``all``.
    search
        Folded blocks of the training segments.
    full
        Full blocks of all segments, training and hold-out.
    floors
        Noise floor of each full block.
    chosen
        Places of the full blocks that stand for all: all of them, but pieces spread over segments that are very long.
    ahead
        Cycles that a folded block is simulated beyond the one compared.
    """

    name: str
    search: list[SegmentBlock]
    full: Blocks
    floors: list[NoiseFloor]
    chosen: list[int]
    ahead: int = 0

    @property
    def training(self) -> Blocks:
        """Full blocks that are searched: those that are fitted, but pieces spread over segments that are very long."""
        return self.judged.of_role("train")

    @property
    def training_floors(self) -> list[float]:
        """Noise floors of the blocks that are searched, in the output's unit; the least each can be where not known."""
        return [self.floors[k].scale for k in self.chosen if self._is_fitted(k)]

    @property
    def judged(self) -> Blocks:
        """Full blocks that stand for all."""
        return Blocks(self.full.parts[k] for k in self.chosen)

    @property
    def fitted(self) -> list[int]:
        """Places of all full blocks that are fitted."""
        return [k for k in range(len(self.full)) if self._is_fitted(k)]

    @property
    def share(self) -> float:
        """Share of the samples that are fitted in the blocks that are searched; 1 where all are."""
        if len(self.chosen) == len(self.full):
            return 1.0
        samples = [self.full.parts[k].segment.samples for k in self.fitted]
        return sum(p.segment.samples for p in self.training.parts) / sum(samples)

    def _is_fitted(self, place: int) -> bool:
        return self.full.parts[place].segment.role == "train"

    def with_residual_floors(
        self, recordings: Mapping[str, Recording], simulated: Sequence[Array], output: str
    ) -> "FitGroup":
        """Return the group with floors that were not known as the residual of the simulated outputs tells them."""
        members: dict[tuple[str, str], list[int]] = {}
        for place, segment in enumerate(self.full.segments):
            members.setdefault((segment.id, segment.role), []).append(place)
        known = list(self.floors)
        for places in members.values():
            # the pieces of a long segment have one floor, told by the one in its middle
            middle = places[len(places) // 2]
            part = self.full.parts[middle]
            recording, left = recordings[part.segment.recording], part.output - simulated[middle]
            found = residual_floor(self.floors[middle], recording, part.segment, left, output)
            for place in places:
                known[place] = found
        return replace(self, floors=known)


def build_group(
    name: str, segments: list[Segment], recordings: dict[str, Recording], assembly: Assembly, split: bool
) -> FitGroup:
    """Return the blocks of a group of segments; a long segment is several, see ``pieces``.

    Parameters
    ----------
    name
        Condition, or ``all``.
    segments
        Segments of the group.
    recordings
        Recordings by id.
    assembly
        The model: names the inputs and the output.
    split
        Hold out the last third of each segment's cycles, instead of the segments whose role says so.

    Raises
    ------
    DataError
        If a recording lacks the model's output or an input, or no training segment is left.
    """
    full: list[SegmentPart] = []
    floors: list[NoiseFloor] = []
    outputs = [measured_output(recordings[s.recording], assembly) for s in segments]
    over = [part_of(y, s.start, s.stop) for s, y in zip(segments, outputs, strict=True)]
    found = output_floors(segments, recordings, over, assembly.spec.output)
    for segment, output, floor in zip(segments, outputs, found, strict=True):
        recording = recordings[segment.recording]
        parts = split_parts(segment, recording, assembly, output, split)
        full += parts
        floors += [floor] * len(parts)
    if not any(p.segment.role == "train" for p in full):
        raise DataError(f"{name}: no training segment; run `mrfit segment --holdout none` or ingest more conditions")
    most = [FOLDED_PIECES if p.folds else OTHER_PIECES for p in full]
    ahead = AHEAD_CYCLES if "+" in assembly.name else 0
    group = FitGroup(name, [], Blocks(full), floors, spread_over([p.segment for p in full], most), ahead)
    return replace(group, search=[p.folded(ahead) for p in group.training.parts])


def split_parts(
    segment: Segment, recording: Recording, assembly: Assembly, output: Array, split: bool
) -> list[SegmentPart]:
    """Return the parts of a segment, the last third of its cycles held out if ``split``; output is the recording's."""
    own = split_cycles(segment, recording.dt) if split else [segment]
    return [part for one in own for part in parts_of(one, recording, assembly, output)]


def measured_output(recording: Recording, assembly: Assembly) -> Array:
    """Return the channel a model predicts.

    Raises
    ------
    DataError
        If the recording does not hold it.
    """
    name = assembly.spec.output
    if name not in recording.channels:
        column = f"name its column in the channel map: [channels] {name} = {{column = …, unit = …}}"
        remedy = MISSING_CHANNEL_ADVICE.get(name, column)
        raise DataError(f"{recording.source}: no {name} in this log, which the model predicts; {remedy}")
    return recording.channels[name]


def weights_of(blocks: Sequence[SegmentBlock], floors: list[float], weight: str) -> Array:
    """Return the factor on each block's error, mean 1: equal, or the inverse of noise floor or output range."""
    if weight == "none":
        return np.ones(len(blocks))
    scales = floors if weight == "floor" else [float(np.ptp(b.target)) for b in blocks]
    factors: Array = 1.0 / np.maximum(scales, 1e-3 * max(scales) + 1e-300)
    return factors / np.mean(factors)


def search_optimum(
    group: FitGroup,
    assembly: Assembly,
    cube: Cube,
    starts: Array,
    settings: "SearchSettings",
    on_progress: ProgressCallback,
) -> SearchResult:
    """Search the cube for the least cost over the training blocks, and return where it ended.

    Parameters
    ----------
    group
        What is fitted.
    assembly, cube
        The model and its free parameters.
    starts
        Start points (S, F); the best of them is where a local search begins, all are tried by one of several starts.
    settings
        How to search.
    on_progress
        Called as ``on_progress(evaluations, best_cost)``.

    Raises
    ------
    DataError
        If every simulation is non-finite; the message shows one of the parameter vectors.
    """
    weights = weights_of(group.search, group.training_floors, settings.weight)
    posed = LeastSquaresProblem(group.search, weights, assembly, cube)
    limits = Limits(settings.budget, settings.seconds, settings.stall)
    found = search.run(posed, starts, limits, settings.rng(group.name), settings.strategy, on_progress)
    if not np.isfinite(found.cost):
        point = starts[0] if found.first_nonfinite is None else found.first_nonfinite
        theta = cube.to_theta(point[None, :])[0]
        shown = ", ".join(f"{p.name}={v:.4g}" for p, v in zip(cube.params, theta, strict=True))
        raise DataError(
            f"{group.name}: every simulation of '{assembly.name}' diverged, as with {shown}"
            f"{_first_wrong(group.search, assembly, theta)}; narrow --bounds, or mend the model"
        )
    return found


def _first_wrong(blocks: Sequence[SegmentBlock], assembly: Assembly, theta: Array) -> str:
    """Return the first sample without a number in words, with its inputs; empty where all are numbers."""
    for block in blocks:
        with np.errstate(all="ignore"):
            output = assembly.simulate(block.drive, theta[None, :], block.dt)[0]
        if len(wrong := np.flatnonzero(~np.isfinite(output))):
            inputs = dict(zip(assembly.spec.inputs, block.drive[:, wrong[0]], strict=True))
            at = ", ".join(f"{n} {v:.3g} {unit_of(n)}" for n, v in inputs.items() if n in CHANNELS)
            return f" ({len(wrong)} of {len(output)} samples are no numbers, the first at {at})"
    return ""


def found_point(
    found: SearchResult, cube: Cube, per_current: list[dict[str, float | None]] | None = None
) -> FoundPoint:
    """Return where a search ended as it is kept, with what a first phase found at each current."""
    first = None
    if found.first_nonfinite is not None:
        values = cube.to_theta(found.first_nonfinite[None, :])[0]
        first = dict(zip((p.name for p in cube.params), values.tolist(), strict=True))
    return FoundPoint(
        point=found.point.tolist(),
        cost=found.cost,
        evaluations=found.nfev,
        budget=found.allowed,
        budget_spent=found.cut_short,
        out_of_time=found.out_of_time,
        stopped=found.message,
        nonfinite=found.nonfinite,
        first_nonfinite=first,
        history=list(found.history),
        preliminary=found.preliminary,
        starts=list(found.starts) or None,
        agreeing=found.agreeing,
        stages=list(found.stages),
        per_current=per_current,
    )


@dataclass(frozen=True)
class SearchSettings:
    """How to search: chain, seed, evaluations, seconds, weighting, patience, options; ``own`` stands for a chain."""

    optimizer: str
    seed: int
    budget: int | None
    seconds: float | None
    weight: str
    stall: float = PATIENCE
    options: Given = ()
    own: strategies.Strategy | None = None

    @property
    def strategy(self) -> strategies.Strategy:
        """The strategy that the optimizer's name and options mean."""
        return self.own or strategies.find(self.optimizer, self.options)

    def rng(self, group: str) -> np.random.Generator:
        """Return the generator of one group."""
        return group_rng(self.seed, group)


def group_rng(seed: int, group: str) -> np.random.Generator:
    """Return the generator of one group: the same whatever else is fitted, and by however many workers."""
    return np.random.default_rng([seed, *group.encode()])


def linearise(group: FitGroup, assembly: Assembly, cube: Cube, point: Array, weight: str) -> Linearisation:
    """Return sensitivities and residuals of the training samples at an optimum, neighbours summed in long logs.

    Of a log so long that sums would blur its cycles, some pieces stand for all.
    """
    training = group.training
    factors = weights_of(training, group.training_floors, weight)
    total = sum(s.samples for s in training.segments)
    length = max(1, -(-total // UNCERTAINTY_SAMPLES))
    finest = _finest(training.parts)
    places = list(range(len(training)))
    if length > finest:
        most = max(1, len(training) * finest // length)
        places, length = spread_over(training.segments, [most] * len(training)), finest
    share = group.share * sum(training.segments[k].samples for k in places) / total
    jacobians, residuals, periods = [], [], []
    for place in places:
        block, factor = training.parts[place].compared, factors[place]

        def simulate(points: Array, block: SegmentBlock = block, factor: float = factor) -> Array:
            return condensed(factor * differences(block, assembly, cube.to_theta(points)), length)

        jacobians.append(sensitivities(simulate, point))
        residuals.append(simulate(point[None, :])[0])
        periods.append(block.period / length)
    return Linearisation(jacobians, residuals, periods, share if share < 1.0 else 1.0)


def _finest(parts: Sequence[SegmentPart]) -> int:
    """Return over how many neighbours samples of pieces of long logs may be summed."""
    periods = [p.period for p in parts if not p.kept and p.period]
    return max(1, int(min(periods) / SUMS_PER_CYCLE)) if periods else UNCERTAINTY_SAMPLES
