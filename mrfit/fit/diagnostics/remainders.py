"""What a model leaves of tests that it was not fitted to: each of them left out of the fit in turn.

The error of a model is no noise: it is alike over a test, and the parameters follow it. What a fit leaves of its own
tests is therefore less than its residual in others. A refit without a test begins at the optimum and takes chord
steps, with the Jacobian there, so that all of them cost some tens of simulations.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.channels import CONTROL
from mrfit.core.specs import Array, Index
from mrfit.fit.diagnostics.uncertainty import effective_samples, sensitivities
from mrfit.fit.extrapolation import SLACK, beyond, together
from mrfit.fit.identify import FitGroup, weights_of
from mrfit.fit.predict import closest_result, stretch_of, theta_of
from mrfit.fit.result import AT_BOUND
from mrfit.io.schemas.band import Remainder
from mrfit.io.schemas.fit import Result
from mrfit.search.cube import Cube
from mrfit.search.parts import SegmentPart
from mrfit.search.problem import LeastSquaresProblem, differences
from mrfit.simulate.assembly import Assembly

LEFT_OUT, LEVEL_LEFT_OUT = "left-out", "level-left-out"
"""Roles of a test whose data had no part in the parameters that it is judged by, nor had any of its current."""
UNCUT_TESTS_MIN, PIECES = 3, 10
"""Tests below which those without cycles are cut, into so many: a refit without one of two knows too little."""
REFITS = 24
"""Refits at most; with more tests several are left out together."""
REFIT_STEPS, FAR_STEPS = 3, 10
"""Chord steps of a refit: from the optimum nearby, and to another law of current."""
DAMPINGS = (1e-8, 1e-5, 1e-3, 1e-1)
"""Of a step, in squares of the greatest singular value: what moves the output less is followed less."""
WEAK_BEND = 1e-3
"""Weight of the coefficients of a law of current, in the greatest singular value: data that tell them outweigh it."""


@dataclass(frozen=True)
class Unit:
    """What is left out at a time: a condition, or a stretch of a test without cycles.

    Attributes
    ----------
    condition
        Its name.
    members
        For each part that belongs to it, its place and the samples.
    share
        Of a test.
    """

    condition: str
    members: tuple[tuple[int, slice], ...]
    share: float = 1.0


def _whole(condition: str, places: Iterable[int]) -> Unit:
    return Unit(condition, tuple((k, slice(None)) for k in places))


def units_of(parts: Sequence[SegmentPart]) -> list[Unit]:
    """Return the units of the parts that were fitted: conditions, and tests without cycles, cut where they are few."""
    periodic: dict[str, list[int]] = {}
    single = [k for k, p in enumerate(parts) if not p.segment.cycles]
    for k, part in enumerate(parts):
        if part.segment.cycles:
            periodic.setdefault(part.segment.condition, []).append(k)
    units = [_whole(condition, places) for condition, places in periodic.items()]
    tests = len(units) + len(single)
    each = -(-(PIECES - len(units)) // len(single)) if single and tests < UNCUT_TESTS_MIN else 1
    for k in single:
        ends = np.linspace(0, len(parts[k].output), each + 1).astype(np.int64).tolist()
        cuts = [slice(a, b) for a, b in zip(ends, ends[1:], strict=False) if b - a > 1]
        units += [Unit(parts[k].segment.condition, ((k, cut),), 1.0 / len(cuts)) for cut in cuts]
    return units


def levels_of(parts: Sequence[SegmentPart], assembly: Assembly) -> list[Unit]:
    """Return the currents at which tests were held, each with its tests; none where one moved or there are not three.

    A test left out alone is followed by its neighbours of the same current, and says nothing of the law of current.
    """
    if CONTROL not in assembly.spec.inputs:
        return []
    row = assembly.spec.inputs.index(CONTROL)
    currents = [np.asarray(part.inputs(row)) for part in parts]
    means = np.array([float(np.mean(c)) for c in currents])
    slack = SLACK * max(float(np.ptp(means)), float(np.max(np.abs(means))))
    order = np.argsort(means)
    levels = np.split(order, np.flatnonzero(np.diff(means[order]) > slack) + 1)
    if len(levels) < UNCUT_TESTS_MIN or any(float(np.ptp(c)) > slack for c in currents):
        return []
    return [_whole(f"{means[places].mean():.3g} A", places.tolist()) for places in levels]


def bends_of(assembly: Assembly, cube: Cube) -> Array:
    """Return the derivatives (C, F) of coefficients of laws of current by free parameters, higher orders weighted more.

    Held small, they make a law of the lowest order that the currents which are left can tell.
    """
    rows = np.zeros((0, len(cube.free)))
    _, dependence = assembly.recipe or ("", None)
    names = [cube.params[k].name for k in cube.free]
    for name, order in dependence.orders if dependence else ():
        nodes = [f"{name}@{label}" for label in dependence.labels(order)] if dependence and order else []
        for piece in dependence.pieces(order) if dependence and all(n in names for n in nodes) and nodes else ():
            place = 2.0 * (piece.nodes - piece.low) / (piece.high - piece.low) - 1.0
            powers = np.linalg.inv(np.vander(place, increasing=True))[1:]
            own = np.zeros((piece.order, len(names)))
            own[:, [names.index(nodes[c]) for c in piece.columns]] = powers * 10.0 ** np.arange(len(powers))[:, None]
            rows = np.vstack([rows, own])
    return rows


def refitted(posed: LeastSquaresProblem, point: Array, groups: Index, bends: Array | None = None) -> Array:
    """Return the ends (G, F) of refits that leave out one group of residuals each.

    Parameters
    ----------
    posed
        What was fitted.
    point
        Optimum in the cube, (F,).
    groups
        Group of each residual (M,), -1 for what is in none.
    bends
        What is held small where the data do not tell it (C, F): what has seen a group would else stay in a refit.
    """
    count, every, residuals = int(groups.max()) + 1, range(int(groups.max()) + 1), posed.residuals
    if bends is not None and len(bends):
        weak = WEAK_BEND * float(np.linalg.norm(sensitivities(residuals, point), 2)) * bends
        groups = np.concatenate([groups, np.full(len(bends), -1)])

        def residuals(points: Array) -> Array:
            return np.hstack([posed.residuals(points), points @ weak.T])

    base, slopes = residuals(point[None, :])[0], sensitivities(residuals, point)
    # one that ended at a bound is held there
    slopes[:, np.minimum(point, 1.0 - point) < AT_BOUND] = 0.0
    kept = [groups != g for g in every]
    split = [np.linalg.svd(slopes[k], full_matrices=False) for k in kept]
    points, left = np.tile(point, (count, 1)), np.tile(base, (count, 1))
    best = np.array([float(np.sum(base[k] ** 2)) for k in kept])
    for _ in range(REFIT_STEPS if bends is None else FAR_STEPS):
        seen = [u.T @ left[g][kept[g]] for g, (u, _, _) in enumerate(split)]
        at, rows = points.copy(), left.copy()
        for damping in DAMPINGS:
            steps = [vt.T @ (s / (s**2 + damping * s[0] ** 2) * e) for e, (_, s, vt) in zip(seen, split, strict=True)]
            trial = np.clip(at - np.stack(steps), 0.0, 1.0)
            tried = residuals(trial)
            for g in every:
                square = float(np.sum(tried[g][kept[g]] ** 2))
                if square < best[g]:
                    points[g], rows[g], best[g] = trial[g], tried[g], square
        left = rows
    return points


def fitted_remainders(parts: Sequence[SegmentPart], simulated: Sequence[Array], assembly: Assembly) -> list[Remainder]:
    """Return what a fit leaves of every condition and role, by the simulated output of its parts."""
    members: dict[tuple[str, str], list[int]] = {}
    for k, part in enumerate(parts):
        members.setdefault((part.segment.role, part.segment.condition), []).append(k)
    rows: list[Remainder] = []
    for (role, condition), places in members.items():
        errors = [simulated[k] - parts[k].output for k in places]
        rows += _row(_whole(condition, places), parts, errors, assembly, role)
    fitted = together(r.extents for r in rows if r.role == "train")
    return [r if r.role == "train" else replace(r, beyond=beyond(fitted, r.extents)) for r in rows]


def left_out(
    group: FitGroup, assembly: Assembly, cube: Cube, point: Array, weight: str
) -> tuple[Array, list[Remainder]]:
    """Return refits without each unit, (G, F) in the cube, and what they leave of it; none where there are not two.

    Parameters
    ----------
    group
        What was fitted.
    assembly, cube
        The model and its free parameters.
    point
        Optimum in the cube, (F,).
    weight
        Weighting of conditions.
    """
    parts = group.training.parts
    units = units_of(parts)
    if len(units) < 2 or not len(point):
        return np.empty((0, len(point))), []
    posed = LeastSquaresProblem(group.search, weights_of(group.search, group.training_floors, weight), assembly, cube)
    starts = np.cumsum([0, *(len(b.target) for b in group.search)])

    def without(units: Sequence[Unit], role: str, bends: Array | None = None) -> tuple[Array, list[Remainder]]:
        groups = np.full(int(starts[-1]) + 1, -1)
        for number, unit in enumerate(units):
            for k, samples in unit.members:
                # a condition's folded block goes as a whole; of a test without cycles every sample is a target
                groups[starts[k] : starts[k + 1]][samples] = number % REFITS
        points = refitted(posed, point, groups, bends)
        rows: list[Remainder] = []
        for number, unit in enumerate(units):
            theta = cube.to_theta(points[[number % REFITS]])
            errors = [differences(parts[k].block, assembly, theta)[0][samples] for k, samples in unit.members]
            rows += _row(unit, parts, errors, assembly, role)
        ranges = [together(o.extents for o in rows if o is not r) for r in rows]
        return points, [replace(r, beyond=beyond(others, r.extents)) for r, others in zip(rows, ranges, strict=True)]

    points, rows = without(units, LEFT_OUT)
    levels = levels_of(parts, assembly)
    return points, rows + (without(levels, LEVEL_LEFT_OUT, bends_of(assembly, cube))[1] if levels else [])


def borrowed(parts: Sequence[SegmentPart], assembly: Assembly, results: Sequence[Result]) -> list[Remainder]:
    """Return what the parameters of the nearest other condition leave of parts of one that was fitted by itself."""
    condition = parts[0].segment.condition
    nearest = closest_result([r for r in results if r.condition != condition], parts[0].segment)
    theta = theta_of(assembly, nearest)[None, :]
    errors = [differences(part.block, assembly, theta)[0] for part in parts]
    fitted = together(r.extents for r in nearest.remainders if r.role == "train")
    rows = _row(_whole(condition, range(len(parts))), parts, errors, assembly, LEFT_OUT)
    return [replace(r, beyond=beyond(fitted, r.extents)) for r in rows]


def _row(
    unit: Unit, parts: Sequence[SegmentPart], errors: Sequence[Array], assembly: Assembly, role: str
) -> list[Remainder]:
    """Return what is left of a unit, whose errors are simulated less measured output; nothing where it diverged."""
    if not all(np.isfinite(e).all() for e in errors):
        return []
    names, stretches, reach = assembly.spec.inputs, [], 0.0
    for (k, samples), error in zip(unit.members, errors, strict=True):
        part = parts[k]
        stretches.append(stretch_of(part.segment, part.dt, {n: part.inputs(r)[samples] for r, n in enumerate(names)}))
        reach = max(reach, float(np.ptp(np.asarray(part.output)[samples] + error)))
    return [
        Remainder(
            condition=unit.condition,
            role=role,
            quantile=float(np.quantile(np.abs(np.concatenate(errors)), 0.95)),
            reach=reach,
            independent=sum(effective_samples(e) for e in errors),
            extents=together(s.extents() for s in stretches),
            share=unit.share,
        )
    ]
