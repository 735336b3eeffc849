"""From an optimum to what is written: parameters with intervals, errors, passivity, and reasons for distrust."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from mrfit.core.channels import WORK_AGAINST
from mrfit.core.specs import Array, DerivedQuantity, Param, PassiveRange
from mrfit.fit.diagnostics.bootstrap import BootstrapInterval
from mrfit.fit.diagnostics.residual_tests import ALL
from mrfit.fit.diagnostics.uncertainty import Uncertainty, sensitivities
from mrfit.io.schemas.determined import State
from mrfit.io.schemas.fit import Caution, Conditioning, Covariance, MetricRow, Passivity, Quantity, ResidualTest, Result
from mrfit.search.cube import Cube
from mrfit.search.parts import Blocks
from mrfit.search.problem import SegmentBlock, differences_of
from mrfit.signal.metrics import ErrorSums, absorbed_energy, error_sums, together
from mrfit.signal.noise_floor import NoiseFloor
from mrfit.signal.runs import runs
from mrfit.simulate.assembly import Assembly
from mrfit.simulate.current_dependence import base_name, parameter_of

NO_LIMITS: Mapping[str, float] = MappingProxyType({})
AT_BOUND = 1e-4
WORSE_ON_HOLDOUT = 1.5
# Fit in percent up to which a model explains nothing: an error of 95 % of a constant's, a tenth of the variance
FIT_PERCENT_NOTHING = 5.0
# Share of the bounds beyond which an interval that leaves the sign open says nothing either
SIGNLESS = 0.25
# Work per cycle below this share of the rectangle round the loop is none
POWER_ROUNDING = 1e-9


def parameter_rows(
    cube: Cube, point: Array, uncertainty: Uncertainty, ranges: Mapping[str, float] = NO_LIMITS
) -> list[Quantity]:
    """Return one row per parameter: value, unit, 95 % interval, bounds, whether at one, whether the data determine it.

    Parameters
    ----------
    cube
        Bounds and scales.
    point
        Optimum in the cube, shape (F,).
    uncertainty
        Covariance in the cube.
    ranges
        Range of the data by unit, of which offsets are judged.
    """
    theta = cube.to_theta(point[None, :])[0]
    rows = []
    for k, param in enumerate(cube.params):
        row = Quantity(
            name=param.name,
            value=theta[k],
            unit=param.unit,
            text=param.text,
            low=theta[k],
            high=theta[k],
            bound_low=param.low,
            bound_high=param.high,
            fixed=True,
            added_to=_added_to(param, ranges),
        )
        place = np.flatnonzero(cube.free == k)
        if len(place):
            at = int(place[0])
            width = uncertainty.half_width(np.eye(len(point))[at])
            # an interval as wide as the bounds says nothing
            known = bool(2 * width <= 1.0)
            ends = point[at] + width * np.array([-1.0, 1.0])
            low, high = (_unclipped(cube, k, end) for end in ends) if known else (None, None)
            ended = bool(min(point[at], 1 - point[at]) < AT_BOUND)
            row = replace(row, low=low, high=high, identifiable=known, at_bound=ended, fixed=False)
        rows.append(row)
    return rows


def _unclipped(cube: Cube, k: int, position: float) -> float:
    """Map one cube coordinate to its parameter without clipping, so that an interval may reach past a bound."""
    param = cube.params[k]
    if param.scale == "log":
        return float(np.exp(np.log(param.low) + position * np.log(param.high / param.low)))
    return float(param.low + position * (param.high - param.low))


def _added_to(one: Param | DerivedQuantity, ranges: Mapping[str, float]) -> float | None:
    """Return the range of what an offset adds to, None of what is none."""
    return ranges.get(one.unit) if one.role == "offset" else None


def derived_rows(
    assembly: Assembly, cube: Cube, point: Array, uncertainty: Uncertainty, ranges: Mapping[str, float] = NO_LIMITS
) -> list[Quantity]:
    """Return one row per derived quantity with its 95 % interval by the delta method, where the data determine it.

    They do not by the rule that holds for parameters: along the quantity's gradient g in the cube the interval,
    2·width/‖g‖, is as wide as the bounds. Nor do they where not even the sign is known of an interval that takes more
    than a quarter of them; of parameters searched over decades the sign is never open.
    """

    def derived(points: Array) -> Array:
        return assembly.derived(cube.to_theta(points))

    values, gradients = derived(point[None, :])[0], sensitivities(derived, point)
    rows = []
    for d, quantity in enumerate(assembly.spec.derived):
        value, width = float(values[d]), uncertainty.half_width(gradients[d])
        share = 2 * width / max(float(np.linalg.norm(gradients[d])), 1e-300)
        known = bool(share <= (1.0 if abs(value) > width else SIGNLESS))
        row = Quantity(
            name=quantity.name,
            value=value,
            unit=quantity.unit,
            text=quantity.text,
            identifiable=known,
            added_to=_added_to(quantity, ranges),
            logarithm=quantity.role == "logarithm",
        )
        rows.append(replace(row, low=value - width, high=value + width) if known else row)
    return rows


def covariance_of(
    assembly: Assembly, cube: Cube, point: Array, uncertainty: Uncertainty, known: set[str]
) -> Covariance:
    """Return the covariance of the parameters and derived quantities in ``known``, by the delta method.

    A parameter is on the scale of its search, a derived quantity in its unit.
    """
    spec, (_, _, (low, high, *_), log) = assembly.spec, cube.map
    params = [spec.params[k] for k in cube.free]

    def derived(points: Array) -> Array:
        return assembly.derived(cube.to_theta(points))

    gradients = np.vstack([np.diag(high - low), sensitivities(derived, point)])
    rows = [*params, *spec.derived]
    kept = [k for k, row in enumerate(rows) if row.name in known]
    matrix = gradients[kept] @ uncertainty.covariance @ gradients[kept].T
    return Covariance(
        names=[rows[k].name for k in kept],
        roles=[rows[k].role for k in kept],
        log=[k < len(params) and bool(log[k]) for k in kept],
        rows=matrix.tolist(),
        degrees=uncertainty.degrees,
    )


def with_intervals(rows: Sequence[Quantity], found: Mapping[str, BootstrapInterval]) -> list[Quantity]:
    """Return rows with the ends of other intervals, where there are any."""
    changed = []
    for row in rows:
        interval = found.get(row.name)
        if interval is None or row.fixed:
            changed.append(row)
        else:
            # an end beyond the bounds is none: the other one says something nevertheless
            known = interval.low is not None or interval.high is not None
            changed.append(replace(row, low=interval.low, high=interval.high, identifiable=known))
    return changed


def conditioning(cube: Cube, uncertainty: Uncertainty) -> Conditioning:
    """Return rank, singular values and the directions the data leave open, as weights by parameter name."""
    names = [cube.params[int(k)].name for k in cube.free]
    directions = [
        {n: round(float(w), 3) for n, w in zip(names, column, strict=True) if abs(w) > 0.05}
        for column in uncertainty.null.T
    ]
    return Conditioning(
        rank=uncertainty.rank,
        parameters=len(names),
        singular_values=uncertainty.singular_values.tolist(),
        null_directions=directions,
    )


def work_drive(block: SegmentBlock, assembly: Assembly) -> Array | None:
    """Return the channel whose change does work against the output, at the targets of a full block (N,), or None.

    A stroke or angle that does not drive the model is integrated from its rate.
    """
    inputs = assembly.spec.inputs
    name, rate = WORK_AGAINST.get(assembly.spec.output, ("", ""))
    if name in inputs:
        return block.inputs(inputs.index(name))
    if rate in inputs:
        values = block.inputs(inputs.index(rate))
        return np.cumsum(values - values.mean()) * block.dt
    return None


def simulate_block(block: SegmentBlock, assembly: Assembly, theta: Array) -> tuple[Array, float]:
    """Return the output at the targets (N,), the record's unknown constant included, and that constant."""
    with np.errstate(all="ignore"):
        outputs = assembly.simulate(block.drive, theta[None, :], block.dt)
        simulated: Array = block.target + differences_of(block, assembly, outputs)[0]
        return simulated, float(np.mean(simulated - block.at_targets(outputs)[0]))


def metric_rows(
    blocks: Blocks, floors: Sequence[NoiseFloor], simulated: Sequence[Array], assembly: Assembly
) -> list[MetricRow]:
    """Return one row of errors per condition and role, and one ``all`` row per role."""
    segments = blocks.segments
    sums = [_errors_of(b, y, assembly) for b, y in zip(blocks, simulated, strict=True)]
    rows = []
    for role in (r for r in ("train", "holdout", "predict") if any(s.role == r for s in segments)):
        chosen = [k for k, s in enumerate(segments) if s.role == role]
        conditions = list(dict.fromkeys(segments[k].condition for k in chosen))
        sets = [(c, [k for k in chosen if segments[k].condition == c]) for c in conditions]
        for condition, members in [*sets, ("all", chosen)]:
            whole = together([sums[k] for k in members])
            power = sum(sums[k].samples * floors[k].value ** 2 for k in members) / whole.samples
            row = MetricRow(condition=condition, role=role, samples=whole.samples, **whole.measures())
            rows.append(replace(row, noise_floor=float(np.sqrt(power))))
    return rows


def _errors_of(block: SegmentBlock, simulated: Array, assembly: Assembly) -> ErrorSums:
    """Return the sums of the error measures over the samples that are compared; others do no work."""
    drive = work_drive(block, assembly)
    if block.counts.all():
        return error_sums(block.target, simulated, drive)
    own = block.counts > 0.0
    lengths = np.diff(runs(own))[:, 0]
    starts = np.cumsum([0, *lengths[:-1]]).tolist()
    return error_sums(block.target[own], simulated[own], None if drive is None else drive[own], starts)


def passivity_rows(blocks: Sequence[SegmentBlock], simulated: Sequence[Array], assembly: Assembly) -> list[Passivity]:
    """Return the work per cycle of every periodic segment, and whether the model takes it in as a passive part does."""
    rows = []
    for block, output in zip(blocks, simulated, strict=True):
        drive = work_drive(block, assembly)
        if block.segment.cycles and drive is not None:
            # of the co-energy the loop is traversed in the opposite sense
            sign = -1.0 if assembly.spec.co_energy else 1.0
            area = sign * absorbed_energy(output, drive) / block.segment.cycles
            passive = area >= -POWER_ROUNDING * float(np.ptp(output) * np.ptp(drive))
            place = block.segment
            rows.append(Passivity(condition=place.condition, role=place.role, loop_area=area, passive=passive))
    return rows


def _ratio(held_out: MetricRow, training: MetricRow, of_tests: bool) -> float:
    """Return the error on held-out data over that in training, in shares of the range or of the noise: the less.

    Of parts of the same tests (``of_tests``) the errors can be compared as they are, too.
    """
    plain = _number(held_out.rmse) / _number(training.rmse)
    ratios = [_number(held_out.nrmse) / _number(training.nrmse), *([plain] if of_tests else [])]
    floors = _number(held_out.noise_floor), _number(training.noise_floor)
    if floors[0] * floors[1] > 0.0:
        ratios.append(plain / floors[0] * floors[1])
    return min(ratios)


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _tied(row: ResidualTest) -> str:
    """Return the text on an input with which the residual is correlated, and on the condition where it is so most."""
    where = ""
    if row.condition == ALL:
        where = f", over all {row.conditions} conditions together"
    elif row.conditions > 1:
        where = f" in {row.dependent} of {row.conditions} conditions, most on {row.condition}"
    return (
        f"the residual is correlated with {row.channel}{where} (correlation {row.correlation:.2f} at {row.lag} "
        f"samples, by chance {row.limit:.2f}): the model lacks an effect of this input"
    )


def readable(derived: Sequence[Quantity], parameters: Sequence[Quantity]) -> list[str]:
    """Return the derived quantities that the data determine, but coefficients of parameters that they determine too."""
    open_ones = {base_name(p.name) for p in parameters if not p.identifiable}
    told = [d.name for d in derived if d.determined is State.WELL]
    return [name for name in told if not (of := parameter_of(name)) or of in open_ones]


def warnings_of(result: Result, metrics: Sequence[MetricRow], passive: PassiveRange | None = None) -> list[Caution]:
    """Return every reason to distrust a result, each with a name and one sentence; ``passive`` is the SPEC's."""
    found = []

    def warn(kind: str, text: str) -> None:
        found.append(Caution(kind=kind, text=text))

    bound = [p.name for p in result.parameters if p.at_bound and p.identifiable]
    if bound:
        warn("at-bound", f"{', '.join(bound)} ended at a bound: widen --bounds or fix the parameter")
    unknown = [p.name for p in result.parameters if not p.identifiable]
    if unknown:
        determined = readable(result.derived, result.parameters)
        instead = f"; read {', '.join(determined)} instead" if determined else ""
        warn("not-identifiable", f"the data do not determine {', '.join(unknown)} one by one{instead}")
    if result.nonfinite:
        warn("non-finite", "some simulations diverged and were passed over: first_nonfinite in fit.json is one")
    if result.budget_spent:
        spent, limit = ("time", "--seconds") if result.out_of_time else ("evaluations", "--budget")
        warn("budget-spent", f"the search used all its {spent} before it settled: raise {limit}")
    if len(result.starts or ()) > 1 and result.agreeing < 2:
        remedy = "raise --budget" if result.budget_spent else "compare with another --seed or --opt pso-fmin"
        warn("starts-disagree", f"no two starts ended at the least error: there may be a better one; {remedy}")
    tied = [r for r in result.residual_tests if not r.independent]
    if tied:
        warn("input-residual", _tied(max(tied, key=lambda r: abs(r.correlation))))
    active = [p for p in result.passivity if not p.passive]
    if active:
        worst = min(active, key=lambda p: _number(p.loop_area))
        place = f"{worst.condition} (loop area {_number(worst.loop_area):.3g} J)"
        remedy = "; it cannot with --bounds {}={:g}:{:g}".format(*passive) if passive else ""
        warn("not-passive", f"the model releases energy on {place}: no coil or damper can{remedy}")
    apart = [r for r in result.repeats if not r.agree]
    if apart:
        odd = max(apart, key=lambda r: r.difference / r.moved)
        warn(
            "repeats-disagree",
            f"the {odd.segments} segments of {odd.condition} differ by {odd.difference:.3g} RMS, their "
            f"cycles by {odd.noise_floor:.3g}: no set of parameters follows all; name in the channel map "
            "([condition]) what changed between them, as current or temperature, or do not ingest the one that differs",
        )
    by_role: dict[str, MetricRow] = {m.role: m for m in metrics if m.condition == "all"}
    if _number(by_role["train"].fit_percent) <= FIT_PERCENT_NOTHING:
        warn(
            "explains-nothing",
            "the error in training is hardly less than that of a constant: check sign, unit and column of every "
            "channel (`mrfit ingest --preview`), widen --bounds, or try other models (`mrfit compare --models all`)",
        )
    seen, held = ({m.condition for m in metrics if m.role == role} for role in ("train", "holdout"))
    ratio = _ratio(by_role["holdout"], by_role["train"], held <= seen) if held else 0.0
    if ratio > WORSE_ON_HOLDOUT:
        warn("holdout-worse", f"the error on held-out data is {ratio:.1f} times that in training")
    return found
