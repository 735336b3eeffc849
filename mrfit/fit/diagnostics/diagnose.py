"""How far to trust a fit: intervals by the method asked for, what the data determine, what the residual still holds."""

from collections.abc import Sequence

import numpy as np

from mrfit.core import registry
from mrfit.core.channels import unit_of
from mrfit.core.protocols import ErrsInRecord, NeedsRise
from mrfit.core.specs import Array
from mrfit.fit.band import refits_of
from mrfit.fit.diagnostics.bands import bands
from mrfit.fit.diagnostics.bootstrap import bootstrap_intervals, replicated
from mrfit.fit.diagnostics.identifiability import judge
from mrfit.fit.diagnostics.posterior import draws_of_fit, posterior_intervals, posterior_rows
from mrfit.fit.diagnostics.profile import ProfiledParameter, profiled
from mrfit.fit.diagnostics.remainders import fitted_remainders, left_out
from mrfit.fit.diagnostics.repeats import repeat_rows
from mrfit.fit.diagnostics.residual_tests import input_dependence, varies
from mrfit.fit.diagnostics.uncertainty import analyse
from mrfit.fit.identify import FitGroup, group_rng, linearise, weights_of
from mrfit.fit.result import (
    conditioning,
    covariance_of,
    derived_rows,
    parameter_rows,
    passivity_rows,
    readable,
    with_intervals,
)
from mrfit.io.schemas.band import Refits
from mrfit.io.schemas.fit import Caution, DriftRow, FitDiagnostics, ResidualTest
from mrfit.search.cube import Cube
from mrfit.search.parts import LazySequence, SegmentPart
from mrfit.search.problem import LeastSquaresProblem
from mrfit.settings.fit import Settings
from mrfit.signal.drift import drift_row, drift_words, steady_drift
from mrfit.simulate.assembly import Assembly

# Slopes, and steps of an input, below this share of the greatest count as none
SLOPE_FLOOR = 1e-6
# Share by which a parameter is moved that is said to be linear, and share of the output's range by which half-way may
# be off
LINEAR_MOVE, NOT_LINEAR = 0.3, 1e-4
# Samples by which that is judged
LINEAR_SAMPLES = 5000


def diagnose(
    group: FitGroup, assembly: Assembly, cube: Cube, point: Array, simulated: Sequence[Array], settings: Settings
) -> FitDiagnostics:
    """Return everything of a result that says how far to trust it.

    Parameters
    ----------
    group
        What was fitted.
    assembly, cube
        The model and its free parameters.
    point
        Optimum in the cube, shape (F,).
    simulated
        Output at this point for each full block.
    settings
        Weighting of conditions, method of the intervals, and the seed of what these draw.
    """
    weight, intervals = settings.weight, settings.intervals
    rng = group_rng(settings.seed, f"{group.name} intervals")
    # of very long segments some pieces stand for all
    judged, responses = group.judged, LazySequence(len(group.chosen), lambda k: simulated[group.chosen[k]])
    fitted = [k for k, s in enumerate(judged.segments) if s.role == "train"]
    residuals = LazySequence(len(fitted), lambda k: judged.parts[fitted[k]].output - responses[fitted[k]])
    linearised = linearise(group, assembly, cube, point, weight)
    uncertainty = analyse(linearised.jacobians, linearised.residuals, linearised.periods, linearised.share)
    ranges = ranges_of(group.training.parts, assembly)
    parameters = parameter_rows(cube, point, uncertainty, ranges)
    derived = derived_rows(assembly, cube, point, uncertainty, ranges)
    known = {r.name for r in (*parameters, *derived) if r.identifiable and not r.fixed}
    covariance = covariance_of(assembly, cube, point, uncertainty, known) if known else None
    folded = LeastSquaresProblem(group.search, weights_of(group.search, group.training_floors, weight), assembly, cube)
    profiles: list[ProfiledParameter] = []
    draws: Refits | None = None
    if intervals == "bootstrap":
        errors = [
            np.where(judged.parts[k].compared.counts > 0.0, e, 0.0) for k, e in zip(fitted, residuals, strict=True)
        ]
        points = replicated(folded, point, uncertainty.directions[:, ~uncertainty.open], errors, rng)
        drawn = bootstrap_intervals(folded, points)
        found = {name: interval for name, interval in drawn.items() if name in known}
        parameters, derived = with_intervals(parameters, found), with_intervals(derived, found)
    elif intervals == "profile":
        profiles = profiled(folded, point, uncertainty, linearised)
        parameters = with_intervals(parameters, {p.profile.name: p.interval for p in profiles})
    elif intervals == "posterior":
        points = draws_of_fit(
            folded,
            point,
            uncertainty,
            linearised,
            lambda model, own, at: linearise(group, model, own, at, weight),
            rng,
        )
        drawn = posterior_intervals(folded, points)
        drawn = {name: interval for name, interval in drawn.items() if name in known}
        parameters, derived = with_intervals(parameters, drawn), with_intervals(derived, drawn)
        draws = posterior_rows(cube, points, known)
    segments = group.training.segments
    error = float(np.sqrt(np.mean(np.concatenate(linearised.residuals) ** 2)))
    refits, unseen = left_out(group, assembly, cube, point, weight)
    return FitDiagnostics(
        intervals=intervals,
        parameters=parameters,
        derived=derived,
        conditioning=conditioning(cube, uncertainty),
        identifiability=list(
            judge(cube, point, uncertainty, segments, readable(derived, parameters), error=error).sentences
        ),
        passivity=passivity_rows(judged, responses, assembly),
        drift=drift_rows(judged.parts, responses),
        repeats=repeat_rows(judged.parts, [group.floors[k].scale for k in group.chosen], responses),
        residual_tests=residual_rows([judged.parts[k] for k in fitted], residuals, assembly),
        profiles=[p.profile for p in profiles],
        bands=bands(assembly, cube, point, uncertainty),
        covariance=covariance,
        draws=draws,
        refits=refits_of(cube, point, uncertainty, refits) if len(point) else None,
        remainders=[*fitted_remainders(judged.parts, responses, assembly), *unseen],
    )


def ranges_of(parts: Sequence[SegmentPart], assembly: Assembly) -> dict[str, float]:
    """Return the range of the output and of every input over parts, by unit; of a voltage by the flux that it adds."""
    spec = assembly.spec
    series = {unit_of(name): [p.inputs(row) for p in parts] for row, name in enumerate(spec.inputs)}
    series[unit_of(spec.output)] = [np.asarray(p.output) for p in parts]
    found = {unit: float(max(map(np.max, some)) - min(map(np.min, some))) for unit, some in series.items()}
    if spec.output == "flux":
        longest = max(len(p.output) * p.dt for p in parts)
        found[unit_of("voltage")] = found[unit_of("flux")] / longest
    return found


def drift_rows(parts: Sequence[SegmentPart], simulated: Sequence[Array]) -> list[DriftRow]:
    """Return one row per part whose residual drifts steadily: what the output's level and gain do with time."""
    rows = []
    for part, output in zip(parts, simulated, strict=True):
        found = steady_drift(part.output - output, output, part.dt, part.segment.cycles)
        if found is not None:
            rows.append(drift_row(part.segment.condition, part.segment.id, found))
    return rows


def law_warnings(parts: Sequence[SegmentPart], assembly: Assembly, theta: Array) -> list[Caution]:
    """Return warnings on what a model is taken for and is not at parameters (K,): linear, or with a rising output."""
    return [*_linear_warnings(parts, assembly, theta), *slope_warnings(parts, assembly, theta)]


def _linear_warnings(parts: Sequence[SegmentPart], assembly: Assembly, theta: Array) -> list[Caution]:
    spec, (first, *_) = assembly.spec, parts
    if registry.elements(assembly.name)[1]:
        # a search looks itself what an effect leaves linear
        return []
    moved = np.where(theta == 0.0, [LINEAR_MOVE * (p.high - p.low) for p in spec.params], (1.0 + LINEAR_MOVE) * theta)
    wrong, drive = [], np.ascontiguousarray(first.block.drive[:, :LINEAR_SAMPLES])
    for name in spec.linear:
        ends, k = np.tile(theta, (3, 1)), spec.names.index(name)
        ends[2, k] = moved[k]
        ends[1] = (ends[0] + ends[2]) / 2.0
        with np.errstate(all="ignore"):
            rows = assembly.simulate(drive, ends, first.dt)
        if np.abs(rows[1] - (rows[0] + rows[2]) / 2.0).max() > NOT_LINEAR * np.ptp(rows[0]):
            wrong.append(name)
    if not wrong:
        return []
    told = f"the output is not linear in {', '.join(wrong)}, which the SPEC of {assembly.name} names `linear`"
    return [Caution(kind="not-linear", text=f"{told}: what was searched is another law; take it out of `linear`")]


def slope_warnings(parts: Sequence[SegmentPart], assembly: Assembly, theta: Array) -> list[Caution]:
    """Return a warning on each effect that needs an output which rises, of one that falls at parameters (K,)."""
    found, spec, inside = [], assembly.spec, theta.copy()
    modules = {name: registry.load("effect", name) for name in registry.elements(assembly.name)[1]}
    places = {name: np.array([n.startswith(f"{name}.") for n in spec.names]) for name in modules}
    for effect, module in modules.items():
        if isinstance(module, ErrsInRecord):
            # what the instruments add is no output of the model inside
            inside[places[effect]] = module.SPEC.neutral
    for effect, module in modules.items():
        own = places[effect]
        if not (isinstance(module, NeedsRise) and module.RISING) or np.all(theta[own] == module.SPEC.neutral):
            continue
        without = inside.copy()
        without[own] = module.SPEC.neutral
        slopes = np.concatenate([_slopes(p, assembly, without) for p in parts])
        least, falling = (
            float(slopes.min(initial=0.0)),
            float(np.mean(slopes < -SLOPE_FLOOR * np.abs(slopes).max(initial=0.0))),
        )
        if falling > 0.0:
            unit = f"{unit_of(spec.output)}/{unit_of(spec.inputs[0])}"
            text = (
                f"{spec.output} falls while {spec.inputs[0]} rises, by up to {-least:.3g} {unit}, in "
                f"{100.0 * falling:.2g} % of the samples: {effect} has no one solution there; narrow --bounds of the "
                f"base model, or leave {effect} out"
            )
            found.append(Caution(kind="falling-output", text=text))
    return found


def _slopes(part: SegmentPart, assembly: Assembly, theta: Array) -> Array:
    """Return the rise of the output over that of the first input from sample to sample, where that one moves."""
    drive = part.block.drive
    output, rise = assembly.simulate(drive, theta[None], part.dt)[0], np.diff(drive[0])
    moves = np.abs(rise) > SLOPE_FLOOR * float(np.ptp(drive[0]))
    slopes: Array = np.diff(output)[moves] / rise[moves]
    return slopes


def drift_warnings(rows: Sequence[DriftRow]) -> list[Caution]:
    """Return the warning on blocks whose residual drifts, if any."""
    return [Caution(kind="drift", text=drift_words(rows))] if rows else []


def residual_rows(parts: Sequence[SegmentPart], residuals: Sequence[Array], assembly: Assembly) -> list[ResidualTest]:
    """Return for each input the correlation of the training residual with it, in the condition where it is largest."""
    periods = [p.period for p in parts]
    conditions = [p.segment.condition for p in parts]

    def values_of(row: int) -> LazySequence[Array]:
        return LazySequence(len(parts), lambda k: parts[k].inputs(row))

    inputs = {name: values_of(row) for row, name in enumerate(assembly.spec.inputs)}
    moving = {name: values for name, values in inputs.items() if any(varies(u) for u in values)}
    rows = []
    for name, values in moving.items():
        found = input_dependence(name, values, residuals, periods, conditions, len(moving))
        if found is not None:
            rows.append(found)
    return rows
