"""Screening: the share of the present error that each effect could take, before any is fitted.

An effect's sensitivity at neutral is projected off those of all parameters the model has already, so that what a refit
of these could absorb does not count. The cosine between two projected sensitivities says whether the data can tell two
effects apart.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mrfit.core.channels import CONTROL, unit_of
from mrfit.core.specs import Array, EffectSpec, Invariance, Param
from mrfit.discover.evidence.bench import Bench
from mrfit.discover.evidence.refit import Fitter, Refit
from mrfit.discover.policy import STANDARD, Policy
from mrfit.discover.selection.questions import Candidate
from mrfit.discover.selection.rules import absorbed
from mrfit.fit.diagnostics.uncertainty import long_run_covariance, sensitivities


@dataclass(frozen=True)
class ScreenedEffect:
    """One effect with what only its screening needs.

    Attributes
    ----------
    candidate
        What screening says of it; the standard score is from the long-run variance of residual times sensitivity.
    direction
        Its unit projected sensitivity over all training samples (N,); empty where the data do not show it.
    columns
        Projected sensitivities to each of its strengths (N, M).
    """

    candidate: Candidate
    direction: Array = field(default_factory=lambda: np.empty(0))
    columns: Array = field(default_factory=lambda: np.empty((0, 0)))


def screen(fitter: Fitter, present: Refit, effects: Sequence[EffectSpec], policy: Policy) -> list[ScreenedEffect]:
    """Return the screening of every effect beside a fitted model, best first."""
    stride = fitter.stride
    errors = np.concatenate(present.train)[::stride]
    ends = np.cumsum([len(e) for e in present.train])
    data = _Data(errors, np.diff(-(-ends // stride), prepend=0).tolist(), present_basis(fitter, present), policy)
    found = [_screened(fitter, present, e, data) for e in effects if e.name not in present.effects]
    return sorted(found, key=lambda s: -s.candidate.gain)


def reach(candidates: Sequence[ScreenedEffect], fit: Refit, stride: int) -> float:
    """Return the share of a fit's squared training error that the sensitivities of candidates could take away together.

    They are those at the fit they were screened with: a first order that holds the better, the nearer the two fits are.
    """
    columns = [c.columns for c in candidates if len(c.columns)]
    if not columns:
        return 0.0
    errors = np.concatenate(fit.train)[::stride]
    taken = np.linalg.qr(np.hstack(columns))[0].T @ errors
    return float(taken @ taken) / max(float(errors @ errors), 1e-300)


def unjudgeable(bench: Bench, effect: EffectSpec) -> str:
    """Return the reason for which the data cannot show an effect, or an empty string."""
    for name in effect.inputs:
        if name not in bench.channels:
            return f"cannot be judged: no {name}"
    for name, least in effect.moves:
        values = [s.channel(name) for s in bench.stretches]
        if float(np.ptp(np.concatenate([v for v in values if v is not None]))) < least:
            return f"cannot be judged: the {name} does not move"
    return _held(bench, effect)


def _held(bench: Bench, effect: EffectSpec) -> str:
    """Return that no test can show an effect of a control that does not act at once, where every test holds it."""
    if effect.breaks is None or effect.breaks.invariance is not Invariance.CURRENT:
        return ""
    values = [v for s in bench.stretches if (v := s.channel(CONTROL)) is not None]
    largest = max((float(np.max(np.abs(v))) for v in values), default=0.0)
    still = all(float(np.ptp(v)) <= STANDARD.still_control * largest for v in values)
    return f"cannot be judged: every test holds the {CONTROL}" if values and still else ""


def is_law_of_current(effect: EffectSpec) -> bool:
    """Return whether an effect changes the control at once, as a law of the base's parameters could."""
    return effect.slot == "input" and effect.inputs == (CONTROL,) and effect.breaks is None


@dataclass(frozen=True)
class _Data:
    """Errors (N,) of every segment one after the other, the segments' lengths, and a basis (N, R) of what is fitted."""

    errors: Array
    lengths: list[int]
    basis: Array
    policy: Policy


def _screened(fitter: Fitter, present: Refit, effect: EffectSpec, data: _Data) -> ScreenedEffect:
    reason = unjudgeable(fitter.bench, effect)
    if reason:
        return ScreenedEffect(Candidate(effect.name, reason, shown=False))
    best = ScreenedEffect(Candidate(effect.name, "absorbed by what the model has", shown=False))
    for trial in _sensitivities(fitter, present, effect):
        free = trial.columns - data.basis @ (data.basis.T @ trial.columns)
        left = np.linalg.norm(free, axis=0) / np.maximum(np.linalg.norm(trial.columns, axis=0), 1e-300)
        if not np.all(np.isfinite(free)) or absorbed(float(np.max(left)), data.policy):
            continue
        coefficients = np.asarray(
            -np.linalg.lstsq(free, data.errors, rcond=STANDARD.screening_rank)[0], dtype=np.float64
        )
        fitted = _within(effect, coefficients)
        explained = free @ fitted
        gain = _gain(data.errors, explained)
        if gain > best.candidate.gain or best.candidate.reason:
            best = replace(_screening(effect, trial.shapes, fitted, explained, data), columns=free)
    return best


def _within(effect: EffectSpec, coefficients: Array) -> Array:
    """Return steps from neutral that stay inside the bounds; a step the bounds forbid is none."""
    steps = coefficients.copy()
    for k, (p, neutral) in enumerate(_strengths(effect)):
        steps[k] = float(np.clip(neutral + steps[k], p.low, p.high)) - neutral
    return steps


def _gain(errors: Array, explained: Array) -> float:
    power = float(explained @ explained)
    if power == 0.0:
        return 0.0
    share = -float(errors @ explained)
    return max(share, 0.0) ** 2 / power / float(errors @ errors)


def _screening(
    effect: EffectSpec,
    start: dict[str, float],
    steps: Array,
    explained: Array,
    data: _Data,
) -> ScreenedEffect:
    direction = explained / max(float(np.linalg.norm(explained)), 1e-300)
    scores = np.split(data.errors * direction, np.cumsum(data.lengths)[:-1])
    variance = sum(float(long_run_covariance((s - s.mean())[:, None])[0, 0]) for s in scores)
    strength = abs(float(data.errors @ direction)) / np.sqrt(variance) if variance > 0 else 0.0
    values = dict(start)
    for (p, neutral), step in zip(_strengths(effect), steps, strict=True):
        smallest = STANDARD.screening_step * (p.high - p.low)
        away = step if abs(step) > smallest else np.copysign(smallest, step)
        values[f"{effect.name}.{p.name}"] = float(np.clip(neutral + away, p.low, p.high))
    return ScreenedEffect(Candidate(effect.name, "", _gain(data.errors, explained), strength, start=values), direction)


@dataclass(frozen=True)
class _ShapeTrial:
    """An effect's columns (N, M) per unit of its parameters, at values of its shape parameters by name."""

    columns: Array
    shapes: dict[str, float]


def _sensitivities(fitter: Fitter, present: Refit, effect: EffectSpec) -> list[_ShapeTrial]:
    """Return the effect's columns for each trial shape."""
    assembly, cube = fitter.assembly([*present.effects, effect.name]), fitter.cube([*present.effects, effect.name])
    names = [p.name for p in cube.params]
    here = present.values
    centre = np.array([here.get(n, p.start) for n, p in zip(names, cube.params, strict=True)])
    residuals = fitter.thinned(assembly, cube)
    trials = []
    strengths = _strengths(effect)
    moves = [
        [share * (p.high - p.low) * (1.0 if n < p.high else -1.0) for p, n in strengths] for share in _steps(effect)
    ]
    for shapes in _shape_grid(effect, fitter):
        theta = centre.copy()
        for n, value in shapes.items():
            theta[names.index(n)] = value
        rows = [theta]
        for (p, neutral), step in (pair for steps in moves for pair in zip(strengths, steps, strict=True)):
            row = theta.copy()
            row[names.index(f"{effect.name}.{p.name}")] = neutral + step
            rows.append(row)
        simulated = residuals(cube.to_points(np.array(rows)))
        changes = (simulated[1:] - simulated[0]).reshape(len(moves), len(strengths), -1)
        trials += [
            _ShapeTrial((change / np.array(steps)[:, None]).T, shapes)
            for change, steps in zip(changes, moves, strict=True)
        ]
    return trials


def _strengths(effect: EffectSpec) -> list[tuple[Param, float]]:
    """Return the parameters of an effect that are no shape, each with its value at neutral."""
    return [(p, n) for p, n in zip(effect.params, effect.neutral, strict=True) if p.role != "shape"]


def _steps(effect: EffectSpec) -> list[float]:
    """Return the steps from neutral, as shares of a parameter's range, over which a sensitivity is taken.

    What changes an input is not linear in its strength: a play narrower than an input's ripple leaves it as it is.
    """
    return [STANDARD.screening_step, *(STANDARD.screened_signed_shapes if effect.slot == "input" else ())]


def _shape_grid(effect: EffectSpec, fitter: Fitter) -> list[dict[str, float]]:
    shapes = [p for p in effect.params if p.role == "shape"]
    starts = {f"{effect.name}.{q.name}": q.start for q in shapes}
    for p in sorted(shapes, key=lambda q: q.scale != "log"):
        tried = _trial_values(p, fitter)
        if tried:
            return [{**starts, f"{effect.name}.{p.name}": value} for value in tried]
    return [starts]


def is_level(param: Param, output: str) -> bool:
    """Return whether a parameter is a level of the output at which something sets in."""
    return param.role == "shape" and param.scale == "log" and param.unit == unit_of(output)


def _trial_values(shape: Param, fitter: Fitter) -> list[float]:
    """Return values at which a shape is tried.

    A level of the output is tried over what was measured, another shape over its decades, or on both sides where it may
    have either sign.
    """
    if is_level(shape, fitter.assembly(()).spec.output):
        levels = np.linspace(0.0, fitter.bench.largest, STANDARD.screened_shapes + 2)[1:-1]
        return [float(v) for v in np.clip(levels, shape.low, shape.high)]
    if shape.scale == "log":
        return [float(v) for v in np.geomspace(shape.low, shape.high, STANDARD.screened_shapes + 2)[1:-1]]
    if shape.low == -shape.high:
        return [
            shape.start,
            *(sign * share * shape.high for share in STANDARD.screened_signed_shapes for sign in (1.0, -1.0)),
        ]
    return []


def present_basis(fitter: Fitter, present: Refit) -> Array:
    """Return an orthonormal basis (N, R) of the sensitivities of all parameters a model has."""
    jacobian = sensitivities(fitter.thinned(present.assembly, present.cube), present.point)
    jacobian = jacobian / np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    u, singular, _ = np.linalg.svd(jacobian, full_matrices=False)
    return u[:, singular > STANDARD.basis_rank * singular[0]]


def cosines(screened: Sequence[ScreenedEffect]) -> Array:
    """Return the matrix of cosines between projected sensitivities; 0 where an effect cannot be judged."""
    size = len(screened)
    matrix = np.eye(size)
    for a in range(size):
        for b in range(a):
            if len(screened[a].direction) and len(screened[b].direction):
                matrix[a, b] = matrix[b, a] = float(screened[a].direction @ screened[b].direction)
    return matrix
