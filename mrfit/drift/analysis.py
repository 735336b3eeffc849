"""Changes with covariates, differences between units, and units that stand out, parameter by parameter.

Each parameter of each condition is judged by its own variances, which are exact in the margin of a joint law: a joint
covariance of K parameters over n units has K(K + 1)/2 unknowns, too many for the fleets that are tested.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import ndtr, stdtrit

from mrfit.core.counting import number_of
from mrfit.core.grouping import grouped
from mrfit.core.recording import NAMING
from mrfit.core.specs import Array, Index
from mrfit.drift.mixed import MixedFit, fit_mixed
from mrfit.drift.population import PIVOT_DRAWS, UNITS_NEEDED, Population, odd_units, population
from mrfit.drift.source import FORCE_ENDS, FitValue, columns_of
from mrfit.io.schemas.drift import ChangePoint, DriftCause, DriftFile, ParameterOverUnits, Slope, UnitThatStandsOut
from mrfit.settings.drift import Settings

DRIFT_LEVEL = 0.005
"""Probability that parameters which stay are said to drift, all of a comparison together."""
LEFT_LEVEL, FORESEEN_LEVEL = 0.01, 0.05
"""Probabilities of a drift beside the temperature that is none, and that a part moves which an effect moves as well."""
TESTS_FOR_DRIFT = 4
"""Tests from which a drift is looked for."""
TESTS_OF_UNIT = 3
"""Tests of each of three units from which the drift itself may differ between units."""
STEPS_SHOWN = {
    "cycles": (1000.0, "1000 cycles"),
    "energy": (1000.0, "kJ"),
    "temperature": (1.0, "K"),
    "date": (1.0, "day"),
    "frequency": (1.0, "Hz"),
    "amplitude": (1e-3, "mm"),
    "current": (1.0, "A"),
}
COVARIATE_UNITS = {"energy": "J", "temperature": "°C", "frequency": "Hz", "amplitude": "m", "current": "A"}
LEAST_PROBABILITY = 1e-6
"""Probability below which none is told: tails of laws are not known so far out."""
USE_OR_TIME = ("cycles", "energy", "date", "age", "hours", "distance")
"""Covariates that count use or time: only what follows these may be ageing."""
SAME_CONDITION = 0.02
"""Share of the greatest value within which a condition counts as one."""
# Largest exponent of a number
LARGEST_LOGARITHM = 700.0
# Steps that are tried as change points, draws by which the greatest of them is judged, values at either side of one
CHANGES_TRIED, CHANGE_DRAWS, BESIDE_CHANGE = 64, 4000, 3
LIMITS_AT_ONCE = 1000
"""Tests whose covariates are judged at once, for the bounds over all of them."""
STEP_OVER_LINE = 6.0
"""Twice the log-likelihood by which a step has to say more than a steady drift."""


@dataclass(frozen=True)
class Trend:
    """A parameter of one condition with its tests, and what was computed of them.

    Attributes
    ----------
    rows
        The tests (N).
    covariates
        Names of the covariates that move, and their values (N, C).
    units
        Place of the unit of each test among ``names`` (N,).
    names
        The units.
    fitted
        The mixed model: the mean of all covariates is where its first coefficient is; None of too few tests.
    population
        Over the units at the mean of the covariates; None below three units.
    odd
        Units that stand out: place, studentised residual, probability.
    notes
        What could not be judged.
    change
        A step, where it says more than a steady drift.
    """

    rows: tuple[FitValue, ...]
    covariates: tuple[str, ...]
    values: Array
    units: Index
    names: tuple[str, ...]
    fitted: MixedFit | None = None
    population: Population | None = None
    odd: list[tuple[int, float, float]] = field(default_factory=list)
    notes: tuple[str, ...] = ()
    change: ChangePoint | None = None

    @property
    def y(self) -> Array:
        """Values on the scale of the search (N,)."""
        return np.array([r.value for r in self.rows])

    @property
    def known(self) -> Array:
        """Known variances (N,)."""
        return np.array([r.variance for r in self.rows])

    @property
    def centred(self) -> Array:
        """Covariates less their means (N, C)."""
        centred: Array = self.values - self.values.mean(axis=0)
        return centred

    @property
    def repeated(self) -> bool:
        """Whether a unit was tested more than once, beside others."""
        return 1 < len(self.names) < len(self.rows)

    @property
    def random_slope(self) -> bool:
        """Whether enough units have enough tests for a drift of their own each."""
        if not self.covariates or not self.repeated:
            return False
        moving = [len(set(self.values[self.units == k, 0])) >= TESTS_OF_UNIT for k in range(len(self.names))]
        return sum(moving) >= UNITS_NEEDED


def compare(values: Sequence[FitValue], settings: Settings) -> tuple[DriftFile, list[Trend]]:
    """Return the comparison of values, and the trends behind it, parameter by parameter."""
    trends = [_fitted(t) for t in _trends(values, settings.over)]
    tests = sum(len(t.names) for t in trends)
    trends = [_with_population(t, tests) for t in trends]
    probabilities = [p for t in trends if t.fitted for p in t.fitted.probabilities[1:]]
    adjusted = iter(_holm(np.array(probabilities)))
    slopes = [[next(adjusted) for _ in t.covariates] if t.fitted else [] for t in trends]
    trends = [replace(t, change=_change_point(t, len(trends))) for t in trends]
    rows = [_row(t, p) for t, p in zip(trends, slopes, strict=True)]
    doubts = [d for v in values for d in v.doubts]
    # a force that is simulated is of the same test
    fitted = [v for v in values if v.parameter not in FORCE_ENDS]
    found = DriftFile(
        over=list(settings.over),
        unit=settings.unit,
        at=settings.at,
        draws=settings.draws,
        seed=settings.seed,
        units=len({v.specimen for v in values}),
        tests=len({(v.log, v.condition, v.covariates.get("cycles")) for v in fitted or values}),
        parameters=rows,
        causes=list(_causes(rows, trends)),
        notes=list(dict.fromkeys([*doubts, *_mixed(values, settings.over), *(n for t in trends for n in t.notes)])),
    )
    if settings.over and not settings.unit:
        found.notes.append("every log counts as a unit; --unit says which logs are of one")
    found.notes.extend(dict.fromkeys(_where(t) for t in trends if t.population and t.covariates))
    return found, trends


def _where(trend: Trend) -> str:
    """Return the covariates at which the mean and the tolerance interval of a trend hold, in words."""
    means = zip(trend.covariates, trend.values.mean(axis=0), strict=True)
    places = ", ".join(f"{name} {mean:.4g} {COVARIATE_UNITS.get(name, '')}".strip() for name, mean in means)
    return f"{trend.rows[0].condition}: means and tolerances are at the mean of the covariates, {places}"


def probability_text(value: float) -> str:
    """Return a probability with its sign, as ``= 0.0067`` or ``< 1e-6``."""
    return "< 1e-6" if value < LEAST_PROBABILITY else f"= {value:.2g}"


def _mixed(values: Sequence[FitValue], over: Sequence[str]) -> Iterator[str]:
    """Yield the conditions that differ between tests compared as one, and are no covariate, in words."""
    if not set(over) & set(NAMING):
        return
    for name in sorted(set(NAMING) - set(over)):
        step, unit = STEPS_SHOWN[name]
        known = columns_of(values, [name]) / step
        known = known[np.isfinite(known)]
        if len(known) and np.ptp(known) > SAME_CONDITION * np.abs(known).max():
            yield (
                f"{name} differs between these tests, {known.min():.3g} to {known.max():.3g} {unit}, and counts as "
                f"scatter between units: add it by --over {','.join([*over, name])}"
            )


def _trends(values: Sequence[FitValue], over: Sequence[str]) -> Iterator[Trend]:
    """Yield the tests by condition and parameter, with the covariates that move among them."""
    groups = grouped(((one.condition, one.parameter, one.log_scale), one) for one in values)
    for (condition, parameter, _), rows in groups.items():
        columns = columns_of(rows, over)
        whole = np.asarray(np.isfinite(columns).all(axis=1))
        rows, columns = [r for r, kept in zip(rows, whole, strict=True) if kept], columns[whole]
        notes = (
            [f"{condition}, {parameter}: {number_of('test', int(np.sum(~whole)))} without covariates"]
            if not whole.all()
            else []
        )
        used: list[int] = []
        for k, name in enumerate(over):
            design = np.column_stack([np.ones(len(rows)), *(columns[:, j] for j in (*used, k))]) if rows else columns
            spread = np.ptp(design, axis=0)[1:] if rows else np.zeros(1)
            scaled = design / np.maximum(np.abs(design).max(axis=0), 1e-300) if rows else design
            wanted = TESTS_FOR_DRIFT + len(used)
            if len(rows) >= wanted and spread.all() and np.linalg.matrix_rank(scaled, 1e-6) == len(used) + 2:
                used.append(k)
            else:
                notes.append(f"{condition}: {name} does not move by itself in {number_of('test', wanted)} or more")
        names = list(dict.fromkeys(r.specimen for r in rows))
        units = np.array([names.index(r.specimen) for r in rows], dtype=np.int64)
        if rows:
            covariates = tuple(over[k] for k in used)
            yield Trend(tuple(rows), covariates, columns[:, used], units, tuple(names), notes=tuple(notes))


def _fitted(trend: Trend) -> Trend:
    """Return a trend with its mixed model: units differ by a level and, where the data say so, by the drift itself.

    Units that stand out take no part.
    """
    kept = ~np.isin(trend.units, [k for k, _, _ in trend.odd])
    x = np.column_stack([np.ones(len(trend.rows)), trend.centred])
    if len(trend.rows) < max(UNITS_NEEDED, x.shape[1] + 2):
        return trend
    z = x[:, : 1 + trend.random_slope] if trend.repeated else x[:, :0]
    scale = np.maximum(np.abs(x).max(axis=0), 1e-300)
    # coefficients of columns of one size
    z = z / scale[: z.shape[1]]
    found = fit_mixed(trend.y[kept], (x / scale)[kept], trend.known[kept], trend.units[kept], z[kept])
    size = np.concatenate([[1.0], scale[: z.shape[1]]])
    return replace(
        trend,
        fitted=replace(
            found,
            beta=found.beta / scale,
            errors=found.errors / scale,
            components=found.components / size**2,
            component_errors=found.component_errors / size**2,
            covariance=found.covariance / np.outer(scale, scale),
        ),
    )


def _with_population(trend: Trend, tests: int) -> Trend:
    """Return a trend with the distribution over units at the mean of the covariates."""
    if len(trend.names) < UNITS_NEEDED:
        return trend
    values, variances = _levels(trend)
    odd = odd_units(values, variances, tests)
    if odd:
        trend = _fitted(replace(trend, odd=odd))
        values, variances = _levels(trend)
    # one test a unit: the same values give the slopes
    beside = None if trend.repeated or not trend.fitted else trend.centred
    found = population(values, variances, [k for k, _, _ in odd], beside)
    if found.untold:
        note = (
            f"{trend.rows[0].condition}, {trend.rows[0].parameter}: the fits state larger variances than the units "
            "scatter; the deviation between units is not told"
        )
        trend = replace(trend, notes=(*trend.notes, note))
    return replace(trend, population=found)


def _levels(trend: Trend) -> tuple[Array, Array]:
    """Return the value of every unit at the mean of the covariates (U,), and its known variance."""
    level = trend.y - (trend.centred @ trend.fitted.beta[1:] if trend.fitted else 0.0)
    within = trend.fitted.components[0] if trend.fitted and trend.repeated else 0.0
    weights = 1.0 / np.maximum(trend.known + within, 1e-300)
    total = np.bincount(trend.units, weights)
    return np.bincount(trend.units, weights * level) / total, 1.0 / total


def _holm(probabilities: Array) -> Array:
    """Return probabilities multiplied for their number, the least by all, the next by one less (Holm 1979)."""
    order = np.argsort(probabilities)
    steps = probabilities[order] * (len(probabilities) - np.arange(len(probabilities)))
    adjusted = np.empty_like(probabilities)
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1.0) if len(steps) else steps
    return adjusted


def _change_point(trend: Trend, tests: int) -> ChangePoint | None:
    """Return the step along the first covariate that says most, where it says more than a steady drift and chance.

    The greatest of the steps tried is judged by draws of the same without any step.
    """
    if not trend.covariates or trend.fitted is None or len(trend.rows) < 4 * BESIDE_CHANGE:
        return None
    place = trend.values[:, 0]
    edges = np.unique(np.quantile(place, np.linspace(0.0, 1.0, CHANGES_TRIED + 1)[1:-1], method="nearest"))
    steps = np.array([place >= e for e in edges], dtype=np.float64)
    steps = steps[(steps.sum(axis=1) >= BESIDE_CHANGE) & (steps.sum(axis=1) <= len(place) - BESIDE_CHANGE)]
    if not len(steps):
        return None
    flat = replace(trend, covariates=(), values=trend.values[:, :0], fitted=None)
    null = _fitted(flat).fitted
    assert null is not None
    covariance = np.diag(trend.known + null.components[0])
    if len(null.components) > 1:
        covariance += null.components[1] * (trend.units[:, None] == trend.units)
    whitener = np.linalg.inv(np.linalg.cholesky(covariance))
    constant = whitener.sum(axis=1)
    constant /= np.linalg.norm(constant)

    def freed(columns: Array) -> Array:
        """Return whitened columns (N, S) without the constant."""
        turned = whitener @ columns
        left: Array = turned - constant[:, None] * (constant @ turned)
        return left

    contrasts = freed(steps.T)
    sizes = np.linalg.norm(contrasts, axis=0)
    contrasts = contrasts / sizes
    rest = freed(trend.y[:, None])[:, 0]
    found = np.abs(contrasts.T @ rest)
    best = int(np.argmax(found))
    line = freed(trend.centred[:, :1])[:, 0]
    steady = abs(float(line @ rest)) / float(np.linalg.norm(line))
    drawn = np.abs(contrasts.T @ np.random.default_rng(0).standard_normal((len(rest), CHANGE_DRAWS)))
    greatest = drawn.max(axis=0)
    # beyond the draws the tail is that of one normal variable, as often as the draws show steps to be apart
    tail = 2.0 * float(ndtr(-found[best])) * len(contrasts.T)
    probability = min(1.0, tests * min(float(np.mean(greatest >= found[best])) or 1.0, tail))
    whole = float(rest @ rest)
    # twice the log-likelihood that the step has over the line
    gain = len(rest) * math.log((whole - steady**2) / max(whole - found[best] ** 2, 1e-300))
    if probability >= DRIFT_LEVEL or gain <= STEP_OVER_LINE:
        return None
    change = float(contrasts[:, best] @ rest) / float(sizes[best])
    at = float((place[steps[best] > 0].min() + place[steps[best] == 0].max()) / 2.0)
    share = _share(change) if trend.rows[0].log_scale else change
    return ChangePoint(covariate=trend.covariates[0], at=at, change=share, probability=probability)


def _row(trend: Trend, probabilities: Sequence[float]) -> ParameterOverUnits:
    """Return the row of a trend, in SI units."""
    first, fitted, found = trend.rows[0], trend.fitted, trend.population
    back = _exponential if first.log_scale else float
    row = ParameterOverUnits(
        parameter=first.parameter,
        condition=first.condition,
        unit=first.unit,
        role=first.role,
        logarithmic=first.log_scale,
        units=len(trend.names),
        tests=len(trend.rows),
        slopes=[_slope(trend, k, p) for k, p in enumerate(probabilities)],
        change=trend.change,
    )
    if fitted and trend.repeated:
        within, between = fitted.components[0], fitted.components[1]
        row = replace(
            row, repeatability=math.sqrt(within), reproducibility=math.sqrt(within + max(float(between), 0.0))
        )
    if found is None:
        return row
    (low, high), (least, greatest) = found.tolerance, _limits(trend, found)
    return replace(
        row,
        mean=back(found.mean),
        mean_low=back(found.mean_interval[0]),
        mean_high=back(found.mean_interval[1]),
        between=math.sqrt(found.variance),
        between_low=found.sigma_interval[0],
        between_high=found.sigma_interval[1],
        tolerance_low=back(low),
        tolerance_high=back(high),
        least=back(least),
        greatest=back(greatest),
        stands_out=[
            UnitThatStandsOut(specimen=trend.names[k], value=back(float(found.values[k])), z=z, probability=p)
            for k, z, p in trend.odd
        ],
    )


def _limits(trend: Trend, found: Population) -> tuple[float, float]:
    """Return one-sided bounds that hold at the covariates of every test."""
    fitted = trend.fitted
    if fitted is None or not trend.covariates:
        return found.limits()
    rng = np.random.default_rng(0)
    degrees, wider = float(fitted.degrees[1:].min()), fitted.errors[1:] / np.sqrt(np.diag(fitted.covariance)[1:])
    along = rng.multivariate_normal(np.zeros(len(wider)), fitted.covariance[1:, 1:], PIVOT_DRAWS) * wider
    if math.isfinite(degrees):
        along /= np.sqrt(rng.chisquare(degrees, (PIVOT_DRAWS, 1)) / degrees)
    places = np.unique(trend.centred, axis=0)
    lowest, highest = np.full(PIVOT_DRAWS, np.inf), np.full(PIVOT_DRAWS, -np.inf)
    for part in np.array_split(places, -(-len(places) // LIMITS_AT_ONCE)):
        shifts = (fitted.beta[1:] + along) @ part.T
        lowest, highest = np.minimum(lowest, shifts.min(axis=1)), np.maximum(highest, shifts.max(axis=1))
    differ = math.sqrt(fitted.components[2]) if len(fitted.components) > 2 else 0.0
    return found.limits(lowest, highest, differ * float(np.abs(places[:, 0]).max()))


def _exponential(value: float) -> float:
    """Return the exponential, of what no data determine the greatest there is."""
    return math.exp(min(value, LARGEST_LOGARITHM))


def _share(value: float) -> float:
    """Return a change of a logarithm as a share."""
    return math.expm1(min(value, LARGEST_LOGARITHM))


def _slope(trend: Trend, k: int, probability: float) -> Slope:
    fitted, name = trend.fitted, trend.covariates[k]
    assert fitted is not None
    step, per = STEPS_SHOWN.get(name, (1.0, f"unit of {name}"))
    value, error = step * float(fitted.beta[k + 1]), step * float(fitted.errors[k + 1])
    width = float(stdtrit(fitted.degrees[k + 1], 0.975)) * error
    back = _share if trend.rows[0].log_scale else float
    differ = step * math.sqrt(float(fitted.components[2])) if k == 0 and len(fitted.components) > 2 else None
    return Slope(
        covariate=name,
        per=per,
        value=back(value),
        low=back(value - width),
        high=back(value + width),
        probability=probability,
        drifts=probability < DRIFT_LEVEL,
        units_differ=differ,
    )


def _causes(rows: Sequence[ParameterOverUnits], trends: Sequence[Trend]) -> Iterator[DriftCause]:
    """Yield candidates for the effects behind drifts, condition by condition, by the roles of what drifts."""
    for condition in dict.fromkeys(r.condition for r in rows):
        own = [(r, t) for r, t in zip(rows, trends, strict=True) if r.condition == condition]
        for name in dict.fromkeys(s.covariate for r, _ in own for s in r.slopes):
            slopes = [(r, s, t) for r, t in own for s in r.slopes if s.covariate == name]
            moved = {r.parameter: (r, s, t) for r, s, t in slopes if s.drifts or _foreseen(r, s, slopes)}
            if moved:
                yield from _cause(condition, name, moved, len(own))


def _foreseen(row: ParameterOverUnits, slope: Slope, slopes: Sequence[tuple[ParameterOverUnits, Slope, Trend]]) -> bool:
    """Return whether a part moves with the temperature as one that is named does: its test is then one, not of many."""
    parts = {"yield", "viscous"}
    return (
        slope.covariate == "temperature"
        and row.role in parts
        and slope.probability < FORESEEN_LEVEL
        and any(s.drifts and r.role in parts - {row.role} and s.value * slope.value > 0.0 for r, s, _ in slopes)
    )


def _cause(
    condition: str, covariate: str, moved: dict[str, tuple[ParameterOverUnits, Slope, Trend]], of: int
) -> Iterator[DriftCause]:
    """Yield the candidate for what one covariate moves."""
    signs = {role: np.sign(s.value) for r, s, _ in moved.values() for role in [r.role] if role}
    named = ", ".join(f"{n} ({_moves(s)})" for n, (_, s, _) in moved.items())
    only = f"{named} of {of} quantities over {covariate}"
    falling = signs.get("yield") == signs.get("viscous") and "yield" in signs
    if falling and covariate == "temperature":
        yield DriftCause(
            effect="temperature", condition=condition, text=f"yield and viscous parts move together: {only}"
        )
    elif covariate in NAMING:
        text = f"{covariate} is a condition of the test, which says nothing of ageing: {only}"
        yield DriftCause(effect="none named", condition=condition, text=text)
    elif (warm := _with_temperature([t for _, _, t in moved.values()], covariate)) is not None:
        text = f"beside the temperature nothing is left of the drift (least p {probability_text(warm)}): {only}"
        yield DriftCause(effect="temperature", condition=condition, text=text)
    elif covariate not in USE_OR_TIME:
        yield DriftCause(effect="none named", condition=condition, text=f"no rule knows this pattern: {only}")
    elif set(signs) == {"offset"}:
        yield DriftCause(
            effect="pressure loss", condition=condition, text=f"the offset of the force moves alone: {only}"
        )
    elif set(signs) == {"yield"} and signs["yield"] > 0:
        yield DriftCause(effect="seal friction", condition=condition, text=f"friction rises alone: {only}")
    elif set(signs) == {"viscous"} and signs["viscous"] < 0:
        yield DriftCause(effect="thinner fluid", condition=condition, text=f"the viscous part falls alone: {only}")
    else:
        yield DriftCause(effect="none named", condition=condition, text=f"no rule knows this pattern: {only}")


def _moves(slope: Slope) -> str:
    return f"{'rises' if slope.value > 0 else 'falls'}, p {probability_text(slope.probability)}"


def _with_temperature(trends: Sequence[Trend], covariate: str) -> float | None:
    """Return the least probability of drifts beside the temperature, None where one is left or none is known."""
    left, follows = [], []
    for trend in trends:
        warm = columns_of(trend.rows, ["temperature"])
        if "temperature" in trend.covariates or not np.isfinite(warm).all() or not np.ptp(warm) > 0.0:
            return None
        beside = replace(
            trend, covariates=(*trend.covariates, "temperature"), values=np.column_stack([trend.values, warm])
        )
        if len(beside.rows) < beside.values.shape[1] + 3:
            return None
        fitted = _fitted(beside).fitted
        assert fitted is not None
        left.append(float(fitted.probabilities[1 + trend.covariates.index(covariate)]))
        follows.append(float(fitted.probabilities[-1]))
    least = min(1.0, len(left) * min(left))
    known = min(follows) < DRIFT_LEVEL and max(follows) < FORESEEN_LEVEL
    return least if known and least >= LEFT_LEVEL else None
