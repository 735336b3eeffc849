"""Where a search starts: the model's own start values, characteristic points, a first phase current by current.

Where parameters depend on current, the base model is fitted at each level, and polynomials go through the values. That
is the result in rotary-stiffness paper §5.3, preyield paper §3 and inverse-tanh paper §2.3; here the joint fit of all
currents begins there.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core import registry
from mrfit.core.counting import few
from mrfit.core.grouping import grouped
from mrfit.core.specs import Array, EffectSpec
from mrfit.errors import ConfigError
from mrfit.optimizers import multistart
from mrfit.optimizers.cost.objective import Objective
from mrfit.search import run as search
from mrfit.search.chain import OptimizerChain
from mrfit.search.cube import Cube
from mrfit.search.descent import Descent
from mrfit.search.limits import Limits, seconds_left
from mrfit.search.problem import LeastSquaresProblem, SegmentBlock
from mrfit.simulate.assembly import Assembly
from mrfit.simulate.at_current import through
from mrfit.simulate.current_dependence import CurrentDependence, base_name, expanded
from mrfit.simulate.current_levels import level_of, levels_of

# Evaluations of the first phase: at the first current, and at each of the others, which start from their neighbour
FIRST_LEVEL, OTHER_LEVELS = 200, 60
# Share of the squared cost that the fit at one of the others may leave
LEVEL_TOLERANCE = 1e-6
# Parameters that a message names
OPEN_NAMED = 6


@dataclass(frozen=True)
class LevelFit:
    """What the first phase found at one current: level in A, cost, and the base model's parameters (K,)."""

    current: float
    cost: float
    theta: Array


def data_starts(
    blocks: Sequence[SegmentBlock], base: Assembly, dependence: CurrentDependence | None, given: Iterable[str]
) -> list[dict[str, float]]:
    """Return the sets of start values that the data give by characteristic points, by parameter name; none if none.

    Without dependence on current those of other minima may come first, see ``far_starts`` of the model, from the block
    whose output has the greatest range.

    Parameters
    ----------
    blocks
        Full training blocks; the median over those of one current counts.
    base
        The base model.
    dependence
        How parameters depend on current: a polynomial is laid through the levels' values.
    given
        Parameters whose start the user gave; they are left out.
    """
    taken = {base_name(name) for name in given}
    levels = levels_of(b.segment for b in blocks) if dependence else []
    found = grouped((level_of(b.segment, levels) if dependence else 0.0, start_values_of(b, base)) for b in blocks)
    levels = sorted(level for level in found if np.isfinite(level))
    medians = [{n: float(np.median([v[n] for v in found[i] if n in v])) for n in _named(found[i])} for i in levels]
    names = [n for n in base.spec.names if n not in taken and medians and all(n in m for m in medians)]
    if not names:
        return []
    if dependence is None:
        widest = max(blocks, key=lambda b: float(np.ptp(b.target)))
        far = base.far_starts(*_shown(widest, base)) if base.far_starts else []
        usual = {n: medians[0][n] for n in names}
        return [s for s in (*({n: v for n, v in f.items() if n not in taken} for f in far), usual) if s]
    table = np.array([[m.get(n, base.spec.start[k]) for k, n in enumerate(base.spec.names)] for m in medians])
    nodes = through(base.spec, dependence, np.array(levels), table)
    return [{n: v for n, v in zip(node_names(base, dependence), nodes.tolist(), strict=True) if base_name(n) in names}]


def characteristic_points(
    cube: Cube,
    blocks: Sequence[SegmentBlock],
    base: Assembly,
    dependence: CurrentDependence | None,
    given: Iterable[str],
) -> Array:
    """Return the start point (1, F) that the data give by characteristic points alone, for ``--opt points``.

    Parameters are as in ``data_starts``; those in ``given`` keep the user's start value.

    Raises
    ------
    ConfigError
        If the points leave a free parameter open.
    """
    taken = {base_name(name) for name in given}
    found = data_starts(blocks, base, dependence, taken)[-1:]
    free = [cube.params[int(k)].name for k in cube.free]
    missing = [n for n in free if base_name(n) not in taken and not any(n in values for values in found)]
    if missing:
        raise ConfigError(
            f"--opt points: the characteristic points of '{base.name}' leave {few(missing, OPEN_NAMED)} "
            "open; give them by --start or --fix, or choose another optimizer"
        )
    return to_points(cube, found or [{}])


def beside_effects(starts: Sequence[Mapping[str, float]], model: str, taken: Iterable[str]) -> list[dict[str, float]]:
    """Return starts with effects away from neutral: the last one, with each effect at the starts that its SPEC names.

    All descents from neutral starts agree where neutral lies in a minimum of its own, and their agreement is no
    evidence that there is no lower one.

    Parameters
    ----------
    starts
        Start values by parameter name, the most informed last.
    model
        Written name.
    taken
        Parameters of which the user said something; an effect with one of them is left out.
    """
    given, found = set(taken), []
    for effect in registry.elements(model)[1]:
        spec: EffectSpec = registry.load("effect", effect).SPEC
        names = [f"{spec.name}.{p.name}" for p in spec.params]
        if not given & set(names):
            found += [{**starts[-1], **dict(zip(names, values, strict=True))} for values in spec.starts]
    return found


def at_scales(cube: Cube, blocks: Iterable[SegmentBlock], base: Assembly) -> Cube:
    """Return a cube with the parameters that its SPEC fixes at the greatest values that full training blocks give."""
    fixed = [p.name for p in cube.params if p.fixed]
    if not fixed:
        return cube
    found = [start_values_of(block, base) for block in blocks]
    held = {n: max(values[n] for values in found if n in values) for n in fixed if any(n in v for v in found)}
    return replace(cube, params=tuple(replace(p, start=held[p.name]) if p.name in held else p for p in cube.params))


def start_values_of(block: SegmentBlock, assembly: Assembly) -> dict[str, float]:
    """Return the start values that a full block gives, by parameter name."""
    return assembly.start_values(*_shown(block, assembly))


def _shown(block: SegmentBlock, assembly: Assembly) -> tuple[Array, Array, float]:
    """Return drive (C, N), output (N,) and dt of a full block as models look at them for start values."""
    return np.ascontiguousarray(block.drive[: len(assembly.spec.inputs), block.nodes[:, 0]]), block.target, block.dt


def _named(values: Iterable[Mapping[str, float]]) -> set[str]:
    return {name for one in values for name in one}


def node_names(base: Assembly, dependence: CurrentDependence) -> list[str]:
    """Return the names of a base model's parameters, each of those that vary once for every node of current."""
    return list(expanded(base.spec, dependence).names)


def level_fits(
    blocks: Sequence[SegmentBlock],
    base: Assembly,
    cube: Cube,
    weights: Array,
    rng: np.random.Generator,
    deadline: float | None = None,
) -> list[LevelFit]:
    """Fit the base model current by current, each level but the first from its neighbour's optimum.

    The highest level comes first, since the loop shows most there. Going on from a neighbour keeps parameters that the
    data hardly determine from jumping between levels.

    Parameters
    ----------
    blocks
        Search blocks; those without a held current are passed over.
    base
        The base model.
    cube
        Its cube.
    weights
        Factor on the error of each block.
    rng
        Source of randomness.
    deadline
        Of ``time.monotonic``, after which a level is taken as it stands; None for none.
    """
    levels = levels_of(b.segment for b in blocks)
    inputs = len(base.spec.inputs)
    fits: list[LevelFit] = []
    for level in reversed(levels):
        members = [k for k, b in enumerate(blocks) if level_of(b.segment, levels) == level]
        own = [replace(blocks[k], drive=np.ascontiguousarray(blocks[k].drive[:inputs])) for k in members]
        problem = LeastSquaresProblem(own, weights[members], base, cube)
        points = np.array([cube.start, *([cube.to_points(fits[-1].theta[None, :])[0]] if fits else [])])
        strategy = Descent(OTHER_LEVELS, LEVEL_TOLERANCE, 0.0) if fits else OptimizerChain("multistart", scored=True)
        evaluations = OTHER_LEVELS if fits else FIRST_LEVEL
        limits = Limits(evaluations * (len(cube.free) + 1) + len(points), seconds_left(deadline))
        found = search.run(problem, points, limits, rng, strategy)
        fits.append(LevelFit(level, found.cost, cube.to_theta(found.point[None, :])[0]))
    return fits[::-1]


def condition_means(
    blocks: Sequence[SegmentBlock],
    base: Assembly,
    cube: Cube,
    weights: Array,
    rng: np.random.Generator,
    deadline: float | None = None,
) -> list[LevelFit]:
    """Fit the base model to every condition by itself, and return the mean of its parameters at every current.

    Parameters are as in ``level_fits``; the cost is the mean of the conditions'.
    """
    levels = levels_of(b.segment for b in blocks)
    found: dict[float, list[LevelFit]] = {level: [] for level in levels}
    for condition in dict.fromkeys(b.segment.condition for b in blocks):
        members = [k for k, b in enumerate(blocks) if b.segment.condition == condition]
        level = level_of(blocks[members[0]].segment, levels)
        if level in found:
            found[level] += level_fits([blocks[k] for k in members], base, cube, weights[members], rng, deadline)
    return [
        LevelFit(level, float(np.mean([f.cost for f in fits])), np.mean([f.theta for f in fits], axis=0))
        for level, fits in found.items()
        if fits
    ]


def descended(residuals: Callable[[Array], Array], point: Array, allowed: int) -> Array:
    """Return the best point (F,) of the cube after damped Gauss-Newton steps from a point, in so many simulations."""
    objective = Objective(residuals, point, allowed, starts=point[None, :])
    multistart.refine(objective, point[None, :], LEVEL_TOLERANCE)
    return objective.best_point


def two_phase_start(levels: Sequence[LevelFit], base: Assembly, dependence: CurrentDependence) -> dict[str, float]:
    """Return the parameters at the nodes, by name, of the polynomials through the levels' values."""
    sound = [level for level in levels if np.isfinite(level.cost)]
    if not sound:
        return {}
    currents, theta = np.array([s.current for s in sound]), np.array([s.theta for s in sound])
    nodes = through(base.spec, dependence, currents, theta)
    return dict(zip(node_names(base, dependence), nodes.tolist(), strict=True))


def to_points(cube: Cube, starts: Sequence[Mapping[str, float]]) -> Array:
    """Return start points (S, F) of a cube from values by name, others at the cube's own start; clipped into it."""
    theta = np.array([[s.get(p.name, p.start) for p in cube.params] for s in starts])
    return cube.to_points(theta.reshape(len(starts), len(cube.params)))
