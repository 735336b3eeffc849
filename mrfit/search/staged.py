"""Staged identification: each part of a model on the kind of test in which it acts alone, the others held.

The stages are the model's (``STAGES``): for Hammerstein-Wiener the static map on strokes at constant speed, the
hysteresis on sines at constant current, the magnetisation under steps of current, the temperature's factor while a
sine warms the damper (Savaia et al. sec. 3). Where they end the joint refinement of all parameters begins.
"""

import fnmatch
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core import registry
from mrfit.core.protocols import HasStages
from mrfit.core.specs import Array, Index, OptimizerSpec, Stage
from mrfit.errors import ConfigError
from mrfit.io.schemas.fit import Caution, SearchStage
from mrfit.optimizers import lsq
from mrfit.search.chain import Given, OptimizerChain
from mrfit.search.coarse_to_fine import thinned
from mrfit.search.cube import Cube
from mrfit.search.limits import Limits, SearchContext, no_progress, own_generator, seconds_left
from mrfit.search.problem import LeastSquaresProblem, Problem, SegmentBlock, measured
from mrfit.search.result import SearchResult
from mrfit.search.strategy import Strategy
from mrfit.signal.cycles import last_event
from mrfit.simulate.current_dependence import base_name

STAGED_NAME = "staged"
# Waveforms of a stroke whose speed is constant between reversals
CONSTANT_SPEED = ("triangle", "quasi-static")
# Rise of the temperature in K, within one segment, that shows what it does to the force
WARMED = 3.0
# Evaluations of a stage for each of its parameters and one more
STAGE_EVALUATIONS = 200
# At constant speed counts what the force settles to: samples within this share of the speed, in the last part of each
STEADY_SPEED_SHARE, SETTLED_PART = 0.1, 0.5
STAGE_TESTS: Mapping[str, str] = {
    "constant-speed": "strokes at constant speed and current (triangles)",
    "sine": "sines at constant current",
    "current-step": "tests under a current that moves",
    "heating": f"tests at constant current in which the temperature moves by {WARMED:g} K or more",
}


SPEC = OptimizerSpec(
    name=STAGED_NAME,
    title="Stage by stage on the tests made for each part of the model, then least squares on all",
    reference="Savaia et al. sec. 3",
    kind="local",
    budget=lsq.SPEC.budget,
)


@dataclass(frozen=True)
class StagedIdentification(Strategy):
    """Strategy: the model's stages one after another, then a chain of optimizers that begins where they end, too.

    Attributes
    ----------
    name
        The chain as written (``staged``, ``staged-lsq``).
    given
        What the user gives for options of its optimizers.
    """

    name: str = STAGED_NAME
    given: Given = ()

    @property
    def many_starts(self) -> bool:
        """The stages begin at the last start alone."""
        return False

    @property
    def from_points(self) -> bool:
        """Whether the chain is written to begin there."""
        return OptimizerChain(self.name, self.given).from_points

    @property
    def begins_with(self) -> str:
        """The stages."""
        return "stages"

    def check(self, model: str, per: str) -> None:
        """Refuse a model without stages, and conditions that are fitted one by one.

        Raises
        ------
        ConfigError
            If it is one, or they are.
        """
        if not stages_of(model):
            known = ", ".join(n for n in registry.names("model") if stages_of(n))
            raise ConfigError(f"--opt {self.name}: '{model}' has no stages of identification; {known} have them")
        if per != "all":
            raise ConfigError(f"--opt {self.name} fits one set of parameters to several kinds of tests: add --per all")

    def budget(self, dimension: int) -> int:
        """Return the evaluations that the chain asks for; the stages have their own."""
        return OptimizerChain(self.name, self.given).budget(dimension)

    def search(self, problem: Problem, starts: Array, how: SearchContext) -> SearchResult:
        """Return where the chain ends from the best of start points (S, F) and of the stages' end."""
        posed, model = measured(problem), measured(problem).assembly.name
        theta, rng = posed.cube.to_theta(starts[-1:])[0], own_generator(how.rng, "stages")
        theta, stages = identify(posed, model, theta, rng, how.deadline)
        starts = np.vstack([starts, posed.cube.to_points(theta[None, :])])
        left = how._replace(limits=how.limits._replace(seconds=seconds_left(how.deadline)))
        result = OptimizerChain(self.name, self.given).search(posed, starts, left)
        return replace(result, stages=stages)


def stages_of(model: str) -> tuple[Stage, ...]:
    """Return the stages of a written model's base, none if it has no such identification."""
    module = registry.load("model", model.partition("+")[0])
    return module.STAGES if isinstance(module, HasStages) else ()


def kind_of(block: SegmentBlock, inputs: Sequence[str]) -> str:
    """Return the kind of test that a block is, as a ``Stage`` names it; ``inputs`` are the rows of its drive."""
    if not np.isfinite(block.segment.current):
        return "current-step"
    if "temperature" in inputs and float(np.ptp(block.drive[inputs.index("temperature")])) >= WARMED:
        return "heating"
    return "constant-speed" if block.segment.waveform in CONSTANT_SPEED else "sine"


def identify(
    posed: LeastSquaresProblem, model: str, theta: Array, rng: np.random.Generator, deadline: float | None = None
) -> tuple[Array, tuple[SearchStage, ...]]:
    """Return parameters (K,) fitted stage after stage, each from where those before it ended, and what each stage did.

    The parameters of a stage whose tests are missing go to the next stage that has some.

    Parameters
    ----------
    posed
        The joint problem: search blocks, their weights, the model and its cube.
    model
        As written; its base has the stages.
    theta
        Parameters (K,) to start from.
    rng
        Source of further starts.
    deadline
        Of ``time.monotonic``, after which a stage is taken as it stands; None for none.
    """
    cube = posed.cube
    tests = [kind_of(b, posed.assembly.spec.inputs) for b in posed.blocks]
    done: list[SearchStage] = []
    left: list[int] = []
    for stage in stages_of(model):
        own = [int(k) for k in cube.free if _belongs(cube.params[int(k)].name, stage)]
        if not own:
            continue
        left += own
        members = [k for k, test in enumerate(tests) if test == stage.test]
        segments, names = [posed.blocks[k].segment.id for k in members], [cube.params[k].name for k in left]
        done.append(SearchStage(stage=stage.name, test=stage.test, segments=segments, parameters=names))
        if members:
            free = np.array(sorted(left), dtype=np.int64)
            theta, ended = _fitted(posed, members, free, theta, rng, deadline)
            done[-1] = replace(done[-1], cost=ended.cost, evaluations=ended.nfev)
            left = []
    return theta, tuple(done)


def warnings(stages: Sequence[SearchStage]) -> list[Caution]:
    """Return a warning on every stage that had no test to be fitted to, with what its parameters were fitted to."""
    found = []
    for place, stage in enumerate(stages):
        if not stage.segments:
            later = next((s.stage for s in stages[place + 1 :] if s.segments), None)
            where = f"with those of the {later}, then" if later else "only"
            text = (
                f"no stage of the {stage.stage}: among the training segments there are no {STAGE_TESTS[stage.test]}; "
                f"its parameters were fitted {where} in the joint refinement"
            )
            found.append(Caution(kind="stage-skipped", text=text))
    return found


def _belongs(name: str, stage: Stage) -> bool:
    return any(fnmatch.fnmatchcase(base_name(name), pattern) for pattern in stage.parameters)


def settled(block: SegmentBlock, inputs: Sequence[str]) -> SegmentBlock:
    """Return a block of strokes at constant speed in which samples near reversals, where filters still act, count 0.

    A block without velocity, or whose speed is nowhere constant, comes back as it was.
    """
    if "velocity" not in inputs:
        return block
    v = block.drive[inputs.index("velocity")]
    usual = np.median(np.abs(v))
    steady = np.abs(np.abs(v) - usual) <= STEADY_SPEED_SHARE * usual
    # samples since the stroke last reversed or left its speed
    ends = np.flatnonzero(~steady | (np.sign(v) != np.sign(np.roll(v, 1))))
    since = np.arange(len(v)) - last_event(ends, len(v))
    late = since >= SETTLED_PART * since.max()
    counts = np.where(late[block.nodes].all(axis=1), block.counts, 0.0)
    return replace(block, counts=counts) if since.max() and counts.any() else block


def _fitted(
    posed: LeastSquaresProblem,
    members: Sequence[int],
    free: Index,
    theta: Array,
    rng: np.random.Generator,
    deadline: float | None,
) -> tuple[Array, SearchResult]:
    """Return theta (K,) with some parameters fitted to some blocks, and where the search for them ended."""
    params = tuple(
        replace(p, start=float(np.clip(value, p.low, p.high)))
        for p, value in zip(posed.cube.params, theta, strict=True)
    )
    inputs, blocks = posed.assembly.spec.inputs, [posed.blocks[k] for k in members]
    blocks = [settled(b, inputs) if kind_of(b, inputs) == "constant-speed" else b for b in blocks]
    part = LeastSquaresProblem(blocks, posed.weights[list(members)], posed.assembly, Cube(params, free))
    budget = STAGE_EVALUATIONS * (len(free) + 1)
    how = SearchContext(rng, Limits(budget, seconds_left(deadline)), time.monotonic(), no_progress)
    # many descents on fewer samples, the last one on all
    near = OptimizerChain("multistart").search(replace(part, blocks=thinned(blocks)), part.cube.start[None, :], how)
    ended = OptimizerChain("lsq").search(part, near.point[None, :], how)
    found: Array = part.cube.to_theta(ended.point[None, :])[0]
    return found, ended
