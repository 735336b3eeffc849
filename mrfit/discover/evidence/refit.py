"""Fit a base with some effects jointly, all parameters free, and say how far it is off on data it has not seen."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from mrfit.core import registry
from mrfit.core.executors.order import spread
from mrfit.core.progress import Progress, silent
from mrfit.core.specs import Array, EffectSpec, Param
from mrfit.discover.evidence.bench import Bench
from mrfit.discover.evidence.clusters import clustered, score
from mrfit.discover.evidence.work import Effort, limits_of_base
from mrfit.discover.policy import STANDARD
from mrfit.errors import DataError
from mrfit.fit.diagnostics.uncertainty import Uncertainty, analyse, long_run_covariance, sensitivities
from mrfit.search import run as search
from mrfit.search.auto import Auto
from mrfit.search.cube import Cube, cube_of
from mrfit.search.descent import Descent
from mrfit.search.limits import Limits
from mrfit.search.problem import LeastSquaresProblem, differences
from mrfit.search.starts import at_scales, start_values_of
from mrfit.simulate.assembly import Assembly, assemble
from mrfit.simulate.current_dependence import CurrentDependence

# How refits are searched, next to their optimum and from many starts; effects are added to the base's own parameters
NEARBY, THOROUGH = (
    Descent(STANDARD.refit_budget, STANDARD.rough_tolerance, STANDARD.polish_above_noise),
    Auto(own_parameters=True),
)
# Bounds of a shape parameter that is a share
SHARE_BOUNDS = (0.0, 1.0)


@dataclass(frozen=True)
class Refit:
    """A fitted assembly.

    Attributes
    ----------
    effects
        Names of the effects beside the base, sorted.
    assembly, cube
        The model and its search space.
    point
        Optimum in the cube (F,).
    train, holdout
        Errors in multiples of the noise floor, one (N_s,) for each segment of the role.
    measure
        Gives ``uncertainty``; a fit that does not help is never asked for it.
    """

    effects: tuple[str, ...]
    assembly: Assembly
    cube: Cube
    point: Array
    train: list[Array]
    holdout: list[Array]
    measure: Callable[[], Uncertainty]

    @cached_property
    def uncertainty(self) -> Uncertainty:
        """Uncertainty of the free parameters in the cube, with the scatter between conditions."""
        return self.measure()

    @property
    def theta(self) -> Array:
        """Parameters (K,)."""
        return self.cube.to_theta(self.point[None, :])[0]

    @property
    def values(self) -> dict[str, float]:
        """Parameters by name."""
        return dict(zip((p.name for p in self.cube.params), self.theta.tolist(), strict=True))

    def chi(self, role: str) -> float:
        """Return the RMS error of a role in multiples of the noise floor, 1 where only noise is left; see ``usual``."""
        return usual(self.train if role == "train" else self.holdout)

    def strength(self, effect: str) -> float:
        """Return the distance of an effect from neutral, in standard errors, by the clearest of its parameters."""
        distances = self.distances(effect)
        return max(score(self.uncertainty, at, distance, len(distances)) for at, distance in distances.items())

    def distances(self, effect: str) -> dict[int, float]:
        """Return the distance from neutral in the cube of an effect's strengths, by their places in the point."""
        neutral = self.cube.to_points(self.neutral_theta(effect))[0]
        return {at: float(self.point[at] - neutral[at]) for at in self._moving(effect)}

    def _moving(self, effect: str) -> list[int]:
        """Return the places among the free parameters of those that are the effect, not its shape."""
        return [self._place(effect, p) for p in _params(effect) if p.role != "shape"]

    def _place(self, effect: str, param: Param) -> int:
        names = [p.name for p in self.cube.params]
        return int(np.flatnonzero(self.cube.free == names.index(f"{effect}.{param.name}"))[0])

    def shapes(self, effect: str) -> dict[str, float]:
        """Return the places in their ranges, 0 to 1, at which an effect's shape parameters ended, without shares.

        A rate that may be zero, which only another effect's channel makes a form, is none.
        """
        shapes = [p for p in _params(effect) if p.role == "shape" and (p.low, p.high) != SHARE_BOUNDS and not p.needs]
        return {p.name: float(self.point[self._place(effect, p)]) for p in shapes}

    def neutral_theta(self, effect: str) -> Array:
        """Return the parameters with an effect of them at neutral, shape (1, K)."""
        theta = self.theta[None, :].copy()
        for k, p in enumerate(self.cube.params):
            if p.name.startswith(effect + "."):
                theta[0, k] = p.start
        return theta


@dataclass(frozen=True)
class RefitRequest:
    """Effects that are to be fitted together, and from where.

    Attributes
    ----------
    effects
        Names; their order does not matter.
    starts
        Start values by parameter name, of which the best are taken; parameters that are not named start at the SPEC's
        value, neutral for an effect.
    """

    effects: tuple[str, ...]
    starts: tuple[Mapping[str, float], ...]


@dataclass(frozen=True)
class _Problem:
    """Effects to fit, the problem, and the points (P, F) to start from, as they are sent to a process."""

    effects: tuple[str, ...]
    posed: LeastSquaresProblem
    points: Array


@dataclass(frozen=True)
class _Optimum:
    """A point (F,) and its cost."""

    point: Array
    cost: float


@dataclass(frozen=True)
class Fitter:
    """Fits assemblies to a bench's training segments.

    Attributes
    ----------
    bench
        The data.
    base
        Written name of the base model.
    dependence
        How its parameters depend on current, or None.
    start
        The user's start values, by parameter name.
    known
        Optima found before, by effects: a discovery that was stopped goes on from them.
    keep
        Called with effects and optimum after each fit.
    jobs
        Worker processes.
    judged
        The last fit judged of each set of effects: the same optimum is asked for again and again.
    fixed
        Parameters that are held, by name.
    effort
        Of the discovery, to which every set of effects adds its samples once.
    """

    bench: Bench
    base: str
    dependence: CurrentDependence | None
    start: Mapping[str, float]
    known: dict[tuple[str, ...], Array]
    keep: Callable[[tuple[str, ...], Array], None]
    jobs: int = 1
    judged: dict[tuple[str, ...], Refit] = field(default_factory=dict)
    fixed: Mapping[str, float] = field(default_factory=dict)
    effort: Effort = field(default_factory=Effort)

    def assembly(self, effects: Sequence[str]) -> Assembly:
        """Return the base with these effects."""
        return assemble("+".join([self.base, *effects]), self.dependence)

    def cube(self, effects: Sequence[str]) -> Cube:
        """Return the search space; start values are the SPEC's, neutral for effects."""
        cube, plain = cube_of(self.assembly(effects).spec, {}, self.start, self.fixed), self.assembly(())
        return at_scales(cube, (s.block_for(plain) for s in self.bench.of_role("train")), plain)

    def first(self, seed: int) -> Refit:
        """Return the base alone, fitted by ``auto`` from many starts."""
        assembly, cube = self.assembly(()), self.cube(())
        if () not in self.known:
            posed = self._posed(assembly, cube)
            starts = np.vstack([cube.start[None, :], self._data_driven(assembly, cube)])
            limits = limits_of_base(assembly, self.bench.samples("train"), len(cube.free), STANDARD)
            found = search.run(posed, starts, limits, np.random.default_rng(seed), THOROUGH)
            if limits.budget is not None and any(link.ending == "budget" for link in found.links):
                self.effort.leave_out("further starts of the base's fit")
            self._remember((), found.point, found.cost)
        return self._judged((), assembly, cube, self.known[()])

    def rough(self, error: float) -> Refit:
        """Return the base alone where a short descent ends from characteristic points: enough to judge it by.

        ``error`` is the RMS of errors over the floor of what it is compared with: far above it, it is not fitted.
        """
        assembly, cube = self.assembly(()), self.cube(())
        starts = np.vstack([cube.start[None, :], self._data_driven(assembly, cube)])
        how = replace(NEARBY, evaluations=STANDARD.law_budget, far_above=STANDARD.law_is_far * error)
        found = _descent(_Problem((), self._posed(assembly, cube), starts), silent, how)
        self._remember((), found.point, found.cost)
        return self._judged((), assembly, cube, found.point)

    def refits(self, wanted: Sequence[RefitRequest]) -> Iterator[Refit]:
        """Yield refits one after the other, while processes make the descents of those to come."""
        problems = [self._started(one) for one in wanted]
        new = [p.effects not in self.known for p in problems]
        unknown = [p for p, is_new in zip(problems, new, strict=True) if is_new]
        with closing(spread(_descent, unknown, self.jobs, silent)) as descents:
            for problem, is_new in zip(problems, new, strict=True):
                yield self._refitted(problem, next(descents) if is_new else None)

    def _refitted(self, problem: _Problem, found: _Optimum | None) -> Refit:
        key, posed = problem.effects, problem.posed
        if found is not None:
            self._remember(key, found.point, found.cost)
        elif _starts_lower(posed, problem.points, self.known[key]):
            # not kept for a later run: that one comes by here again
            self.known[key] = _descent(problem, silent).point
        return self._judged(key, posed.assembly, posed.cube, self.known[key])

    def _started(self, wanted: RefitRequest) -> _Problem:
        """Return the problem of effects in their order, and where it starts from."""
        key = tuple(sorted(wanted.effects))
        assembly, cube = self.assembly(key), self.cube(key)
        names = [p.name for p in cube.params]
        theta = np.array([[s.get(n, p.start) for n, p in zip(names, cube.params, strict=True)] for s in wanted.starts])
        return _Problem(key, self._posed(assembly, cube), cube.to_points(theta))

    def thorough(self, found: Refit) -> Refit:
        """Return a fit searched again from many starts: a base that imitated the effect may be far off its own."""
        if found.chi("train") < STANDARD.only_noise:
            return found
        starts = np.vstack([found.point[None, :], self._data_driven(found.assembly, found.cube)])
        limits = Limits(STANDARD.multistart_budget * (len(found.point) + 1))
        posed = self._posed(found.assembly, found.cube)
        outcome = search.run(posed, starts, limits, np.random.default_rng(0), THOROUGH)
        again = self._judged(found.effects, found.assembly, found.cube, outcome.point)
        if not again.chi("train") < found.chi("train"):
            return found
        self._remember(found.effects, outcome.point, outcome.cost)
        return again

    def _posed(self, assembly: Assembly, cube: Cube) -> LeastSquaresProblem:
        stretches = self.bench.of_role("train")
        weights = np.array([1.0 / s.floor for s in stretches])
        return LeastSquaresProblem([s.block_for(assembly) for s in stretches], weights, assembly, cube)

    def _remember(self, key: tuple[str, ...], point: Array, cost: float) -> None:
        if not np.isfinite(cost):
            name = "+".join([self.base, *key])
            raise DataError(f"every simulation of '{name}' diverged; choose another base model")
        self.known[key] = point
        self.keep(key, point)

    def _data_driven(self, assembly: Assembly, cube: Cube) -> Array:
        rows = []
        for stretch in self.bench.of_role("train"):
            found = start_values_of(stretch.block_for(assembly), assembly)
            rows.append([found.get(p.name, p.start) for p in cube.params])
        return cube.to_points(np.unique(np.array(rows), axis=0))

    def thinned(self, assembly: Assembly, cube: Cube) -> Callable[[Array], Array]:
        """Return ``residuals`` of every n-th sample: what screening needs of long records."""
        evaluate, stride = self.residuals(assembly, cube), self.stride
        return lambda points: evaluate(points)[:, ::stride]

    @property
    def stride(self) -> int:
        """Samples of training data for each one that screening looks at."""
        return max(1, -(-self.bench.samples("train") // STANDARD.screened_samples))

    def residuals(self, assembly: Assembly, cube: Cube) -> Callable[[Array], Array]:
        """Return the map from points (P, F) to training errors in multiples of the noise floor (P, N)."""
        blocks = [(s.block_for(assembly), s.floor) for s in self.bench.of_role("train")]

        def evaluate(points: Array) -> Array:
            theta = cube.to_theta(points)
            return np.hstack([differences(b, assembly, theta) / floor for b, floor in blocks])

        return evaluate

    def _judged(self, key: tuple[str, ...], assembly: Assembly, cube: Cube, point: Array) -> Refit:
        if key not in self.judged:
            self.effort.spent += self.bench.samples("train")
        if key not in self.judged or not np.array_equal(self.judged[key].point, point):
            self.judged[key] = self._judge(key, assembly, cube, point)
        return self.judged[key]

    def _judge(self, key: tuple[str, ...], assembly: Assembly, cube: Cube, point: Array) -> Refit:
        theta = cube.to_theta(point[None, :])
        train = [e[0] for e in self.bench.errors(assembly, theta, "train")]
        holdout = [e[0] for e in self.bench.errors(assembly, theta, "holdout")]
        residuals = self.residuals(assembly, cube)
        return Refit(key, assembly, cube, point, train, holdout, lambda: self._uncertainty(residuals, point, train))

    def _uncertainty(self, residuals: Callable[[Array], Array], point: Array, train: list[Array]) -> Uncertainty:
        parts = np.split(sensitivities(residuals, point), np.cumsum([len(e) for e in train])[:-1])
        stretches = self.bench.of_role("train")
        within = analyse(parts, train, [s.block.period if s.repeats else 0.0 for s in stretches])
        return clustered(within, parts, train, [s.segment.condition for s in stretches])


def usual(errors: Sequence[Array]) -> float:
    """Return the RMS of errors, (N_s,) each, without the largest few of them.

    A force that jumps where the velocity turns errs by twice its yield force in a sample whose side the motion's own
    error decides. One such sample may outweigh a record, and any effect that moves it seems to take all of that.
    """
    squares = np.concatenate(errors) ** 2
    # an error is 0 where a sample is not compared
    squares = squares[squares > 0.0] if np.any(squares) else squares
    kept = len(squares) - int(STANDARD.odd_samples * len(squares))
    return float(np.sqrt(np.mean(np.partition(squares, kept - 1)[:kept])))


def _params(effect: str) -> tuple[Param, ...]:
    spec: EffectSpec = registry.load("effect", effect).SPEC
    return spec.params


def _descent(problem: _Problem, progress: Progress, how: Descent = NEARBY) -> _Optimum:
    """Return the end of a descent from the best start."""
    found = search.run(problem.posed, problem.points, Limits(), np.random.default_rng(0), how)
    return _Optimum(found.point, found.cost)


def _starts_lower(posed: LeastSquaresProblem, starts: Array, known: Array) -> bool:
    """Return whether one of several starts (S, F) already costs less than an optimum known (F,), a local one then."""
    costs = np.mean(posed.residuals(np.vstack([known[None, :], starts])) ** 2, axis=1)
    return bool(np.any(costs[1:] < costs[0] * (1.0 - STANDARD.lower_start)))


def paired_z(before: Sequence[Array], after: Sequence[Array]) -> float:
    """Return the standard score of the fall in squared error, from the long-run variance of the paired differences."""
    total, variance = 0.0, 0.0
    for b, a in zip(before, after, strict=True):
        fall = b**2 - a**2
        total += float(fall.sum())
        variance += float(long_run_covariance((fall - fall.mean())[:, None])[0, 0])
    return total / np.sqrt(variance) if variance > 0 else 0.0
