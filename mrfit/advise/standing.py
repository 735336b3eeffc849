"""The rivals on the data there are: each fitted with the base, its sensitivities, and draws from its intervals."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mrfit.advise.rivals import NO_MORE_RIVALS, Rival, spec_of
from mrfit.core.progress import Progress
from mrfit.core.specs import Array
from mrfit.discover.evidence.bench import Bench
from mrfit.errors import DataError
from mrfit.fit.diagnostics.uncertainty import sensitivities
from mrfit.search import run as search
from mrfit.search.auto import Auto
from mrfit.search.cube import Cube, cube_of
from mrfit.search.descent import Descent
from mrfit.search.limits import Limits
from mrfit.search.problem import LeastSquaresProblem, differences
from mrfit.search.starts import at_scales, start_values_of
from mrfit.simulate.assembly import Assembly, assemble
from mrfit.simulate.current_dependence import CurrentDependence

# Standard deviation of a free parameter before any data, as a share of its bounds
PRIOR = 0.5
# An effect of which the data show nothing is taken to make this share of the output's range, at most this of its own
HIDDEN_SHARE, HIDDEN_MOST = 0.05, 0.1
DRAWS = 6
# Training samples that are looked at; of more every n-th, each standing for several
RIVAL_SAMPLES = 100_000
# Step of the differences in the cube
RIVAL_STEP = 1e-4
# Evaluations of a descent for each free parameter, its tolerance, and floors above which it need not be exact
NEARBY_DESCENT = Descent(60, 3e-4, 2.0)


class Stencil(NamedTuple):
    """Points (F + 1, F) and the steps (F,) between the first and the others."""

    points: Array
    steps: Array


@dataclass(frozen=True)
class RivalModel:
    """What is fitted: the base's written name, how it depends on current, and start values."""

    base: str
    dependence: CurrentDependence | None
    start: Mapping[str, float]
    seed: int


@dataclass(frozen=True)
class FittedRival:
    """A rival, fitted.

    Attributes
    ----------
    rival
        Which.
    assembly, cube
        The model and its search space.
    point
        Its optimum (F,) in the cube.
    errors
        Simulated − measured in multiples of the noise floor, samples of all training segments (N,), see ``errors_of``.
    jacobian
        Sensitivities of these in the cube (N, F).
    prior
        Standard deviations of the parameters before any data (F,), in the cube.
    stride
        Samples that each one stands for.
    """

    rival: Rival
    assembly: Assembly
    cube: Cube
    point: Array
    errors: Array
    jacobian: Array
    prior: Array
    stride: int

    @property
    def values(self) -> dict[str, float]:
        """Parameters by name."""
        theta = self.cube.to_theta(self.point[None, :])[0]
        return dict(zip((p.name for p in self.cube.params), theta.tolist(), strict=True))

    @property
    def chi(self) -> float:
        """RMS error in multiples of the noise floor."""
        return float(np.sqrt(np.mean(self.errors**2) / self.stride))

    def draws(self, count: int, rng: np.random.Generator) -> Array:
        """Return parameters (D, F) from the intervals that the data and the bounds leave; the optimum is the first.

        They are normal about the optimum with the covariance (JᵀJ + P)⁻¹, reflected at the bounds.
        """
        root = np.linalg.qr(np.vstack([self.jacobian / max(self.chi, 1.0), np.diag(1.0 / self.prior)]), mode="r")
        away = np.linalg.solve(root, rng.standard_normal((len(self.point), count))).T
        inside = np.abs(self.point + away)
        drawn = np.clip(1.0 - np.abs(1.0 - inside), 0.0, 1.0)
        # of an effect that the data do not show the optimum is its absence
        return drawn if self.rival.hidden else np.vstack([self.point, drawn])


def fitted(bench: Bench, model: RivalModel, rivals: Sequence[Rival], progress: Progress) -> list[FittedRival]:
    """Return the rivals fitted to a bench's training segments, each from the base's optimum.

    Raises
    ------
    DataError
        If every simulation of one diverges.
    """
    progress("rivals", 0, len(rivals) + 1)
    values = _fit_of_base(bench, model)
    found: list[FittedRival] = []
    for k, rival in enumerate(rivals, start=1):
        progress("rivals", k, len(rivals) + 1)
        found.append(_standing(bench, model, rival, values))
        if rival.name == NO_MORE_RIVALS:
            values = found[-1].values
    progress("rivals", len(rivals) + 1, len(rivals) + 1)
    return found


def _posed(bench: Bench, assembly: Assembly, cube: Cube) -> LeastSquaresProblem:
    stretches = bench.of_role("train")
    weights = np.array([1.0 / s.floor for s in stretches])
    return LeastSquaresProblem([s.block_for(assembly) for s in stretches], weights, assembly, cube)


def _cube(bench: Bench, model: RivalModel, assembly: Assembly, start: Mapping[str, float]) -> Cube:
    plain = assemble(model.base, model.dependence)
    known = {n: v for n, v in start.items() if n in assembly.spec.names}
    cube = cube_of(assembly.spec, {}, known, {})
    return at_scales(cube, (s.block_for(plain) for s in bench.of_role("train")), plain)


def _fit_of_base(bench: Bench, model: RivalModel) -> dict[str, float]:
    """Return the base's parameters where a search from many starts ends."""
    assembly = assemble(model.base, model.dependence)
    cube = _cube(bench, model, assembly, model.start)
    blocks = [s.block_for(assembly) for s in bench.of_role("train")]
    found = [start_values_of(b, assembly) for b in blocks]
    rows = np.array([[f.get(p.name, p.start) for p in cube.params] for f in found])
    starts = np.vstack([cube.start[None, :], cube.to_points(np.unique(rows, axis=0))])
    rng = np.random.default_rng(model.seed)
    outcome = search.run(_posed(bench, assembly, cube), starts, Limits(), rng, Auto(own_parameters=True))
    _check(outcome.cost, assembly)
    theta = cube.to_theta(outcome.point[None, :])[0]
    return dict(zip((p.name for p in cube.params), theta.tolist(), strict=True))


def _check(cost: float, assembly: Assembly) -> None:
    if not np.isfinite(cost):
        raise DataError(f"every simulation of '{assembly.name}' diverged; choose another base model")


def _standing(bench: Bench, model: RivalModel, rival: Rival, base: Mapping[str, float]) -> FittedRival:
    assembly = assemble("+".join([model.base, *rival.effects]), model.dependence)
    cube = _cube(bench, model, assembly, model.start)
    start = {**base, **rival.start}
    theta = np.array([[start.get(p.name, p.start) for p in cube.params]])
    point = cube.to_points(theta)[0]
    if rival.effects and not rival.hidden:
        # an effect without a value begins a little off its neutral one, where its sensitivity does not vanish
        starts = np.vstack([point, cube.to_points(_nudged(theta, cube, rival))])
        outcome = search.run(_posed(bench, assembly, cube), starts, Limits(), np.random.default_rng(0), NEARBY_DESCENT)
        _check(outcome.cost, assembly)
        point = outcome.point
    evaluate = errors_of(bench, assembly, cube)
    jacobian = sensitivities(evaluate, point)
    errors = evaluate(point[None, :])[0]
    stride = stride_of(bench)
    prior = _prior(bench, rival, cube, jacobian / np.sqrt(stride))
    return FittedRival(rival, assembly, cube, point, errors, jacobian, prior, stride)


def _nudged(theta: Array, cube: Cube, rival: Rival) -> Array:
    moved = theta.copy()
    for k, param in enumerate(cube.params):
        if param.name.startswith(f"{rival.name}.") and param.name not in rival.start:
            moved[0, k] += 1e-2 * (param.high - param.low)
    return moved


def stencil(point: Array) -> Stencil:
    """Return a point (F,) of the cube with its neighbours, one step into it along each axis."""
    steps = np.where(point > 0.5, -RIVAL_STEP, RIVAL_STEP)
    return Stencil(np.vstack([point, point + np.diag(steps)]), steps)


def stride_of(bench: Bench) -> int:
    """Return the training samples for each one that is looked at."""
    return -(-bench.samples("train") // RIVAL_SAMPLES)


def errors_of(bench: Bench, assembly: Assembly, cube: Cube) -> Callable[[Array], Array]:
    """Return the map from points (P, F) to errors of training samples in multiples of the noise floor (P, N).

    A sample that stands for several is multiplied by the root of their number, so that sums of squares stay.
    """
    blocks, stride = [(s.block_for(assembly), s.floor) for s in bench.of_role("train")], stride_of(bench)

    def evaluate(points: Array) -> Array:
        theta = cube.to_theta(points)
        weight = np.sqrt(stride)
        return np.hstack([differences(b, assembly, theta)[:, ::stride] * (weight / floor) for b, floor in blocks])

    return evaluate


def _prior(bench: Bench, rival: Rival, cube: Cube, jacobian: Array) -> Array:
    """Return the standard deviations of parameters before any data; those of a hidden effect make a small force."""
    prior = np.full(len(cube.free), PRIOR)
    if not rival.hidden:
        return prior
    strengths = {f"{rival.name}.{p.name}" for p in spec_of(rival.name).params if p.role != "shape"}
    floor = float(np.sqrt(np.mean([s.floor**2 for s in bench.of_role("train")])))
    for at, k in enumerate(cube.free):
        if cube.params[k].name in strengths:
            rms = float(np.sqrt(np.mean(jacobian[:, at] ** 2)))
            prior[at] = min(HIDDEN_SHARE * bench.span / floor / max(rms, 1e-300), HIDDEN_MOST)
    return prior
