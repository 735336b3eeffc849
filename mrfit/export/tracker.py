"""Plan of a tracker of parameters: what a fit and its logs say of their prior, of the noise and of standing still."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations_with_replacement

import numpy as np

from mrfit.core import registry
from mrfit.core.channels import unit_of
from mrfit.core.specs import Array, Index
from mrfit.errors import ConfigError, DataError
from mrfit.export.source import ExportSource
from mrfit.kernels.tracking import EstimatorPlan
from mrfit.signal.convolution import correlation_time
from mrfit.simulate.chain import advanced
from mrfit.simulate.current_dependence import base_name
from mrfit.simulate.program import DEFAULTS, DamperProgram

WALK_RATES = (0.02, 0.1, 0.5)
"""Changes of a parameter in a minute, as shares of its value, which the filters of random walks expect."""
CHANGE_RATES = (0.0015, 0.012, 0.012)
"""Changes a second, to all filters of each of ``WALK_RATES``, for which bands have room."""
NEARLY = 1e-300
"""Less than any value of a parameter that counts, but not 0: an effect at its neutral values is left out."""
# Share of a parameter's unit by which sensitivities are forward differences: of 1e-3, rounding is ten times as large;
# standard deviation of one that is open
_DIFFERENCE, _OPEN = 1e-2, 0.1
# Seconds in which models follow the estimate of a parameter of which they remember something; samples that show whether
_FOLLOWED, _SHOWN = 0.2, 2000
# Share of what a parameter changes in the output that is rounding
_NOTHING = 1e-6
# Share of the greatest rate of the slowest test below which a damper stands
_STANDING = 0.05


@dataclass(frozen=True)
class TrackedParameter:
    """A parameter that is tracked.

    Attributes
    ----------
    name, unit
        Its name and its unit; those of a factor on values at several currents are the parameter's name and 1.
    value, deviation
        Mean and standard deviation of the prior, all other parameters known.
    span
        Size to which changes are compared.
    low, high
        Bounds.
    places
        Places in the vector of all parameters; ``factor``: whether these are multiplied.
    remembered
        Whether the output is of what the parameter was before, too.
    """

    name: str
    unit: str
    value: float
    deviation: float
    span: float
    low: float
    high: float
    places: tuple[int, ...]
    factor: bool
    remembered: bool = False

    @property
    def difference(self) -> float:
        """Difference of the parameter, in standard deviations, by which sensitivities are told."""
        return _DIFFERENCE * self.span / self.deviation


@dataclass(frozen=True)
class TrackerPlan:
    """All that a tracker is made of beside the model.

    Attributes
    ----------
    parameters
        Those that are tracked, T.
    prior
        Correlations of their prior (T, T).
    held
        Covariance (T, T), SI, that the errors of parameters which are not tracked bring, on motions like the fit's.
    deviation, correlated
        Standard deviation of the fit's residual and its integrated correlation time in s.
    standing
        (input, rate) below all of which the damper stands; empty where no input is a rate.
    """

    parameters: tuple[TrackedParameter, ...]
    prior: Array
    held: Array
    deviation: float
    correlated: float
    standing: tuple[tuple[str, float], ...]

    @property
    def filters(self) -> int:
        """Number of filters: two of constant parameters; at each rate, of each that moves and of all that do."""
        return len(self.constants.walk)

    def column(self, name: str) -> Array:
        """Return an attribute of all parameters (T,)."""
        return np.array([getattr(p, name) for p in self.parameters])

    @property
    def bases(self) -> set[str]:
        """Names of the parameters, whatever the current."""
        return {base_name(p.name) for p in self.parameters}

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """Pairs of parameters whose covariance is told, each once."""
        return list(combinations_with_replacement([p.name for p in self.parameters], 2))

    @cached_property
    def constants(self) -> EstimatorPlan:
        """Constants of the estimator."""
        spans, values, low, high, deviations = map(self.column, ("span", "value", "low", "high", "deviation"))
        moving = np.unique([*np.eye(len(deviations)), np.ones(len(deviations))], axis=0)
        each = moving * (spans / deviations) ** 2 / 60.0
        walk = np.vstack([0.0 * deviations, *(rate**2 * each for rate in WALK_RATES), 0.0 * deviations])
        # to rest is as likely as the quickest change
        changes = np.array([CHANGE_RATES[-1], *np.repeat(CHANGE_RATES, len(moving)), 0.0]) / len(moving)
        noise = np.array([self.deviation**2, self.correlated])
        bounds = (low - values) / deviations, (high - values) / deviations
        followed = _FOLLOWED * self.column("remembered")
        return EstimatorPlan(noise, walk, changes, np.maximum((spans / deviations) ** 2, 1.0), followed, *bounds)

    def moves(self, names: Sequence[str], drive: Array) -> Index:
        """Return whether the damper moves (N,) under channels (C, N), 1 or 0."""
        own = [np.abs(drive[list(names).index(n)]) > rate for n, rate in self.standing]
        return np.any(own, axis=0).astype(np.int64) if own else np.ones(drive.shape[1], dtype=np.int64)


def plan_of(source: ExportSource, names: Sequence[str]) -> TrackerPlan:
    """Return the plan of a tracker of parameters of a fit.

    Raises
    ------
    ConfigError
        If the model has no such parameter, or it cannot be tracked.
    DataError
        If the fit's residual is not known.
    """
    if not names:
        raise ConfigError(f"--track: name parameters of {', '.join(_names(source))}")
    places = [_places(source, name) for name in dict.fromkeys(names)]
    flat = [k for own in places for k in own]
    spans = np.abs(source.theta[flat])
    covariance, alone = _covariances(source, flat, spans)
    spans = np.maximum(spans, 3.0 * np.sqrt(np.diag(covariance)))
    found, columns = list[TrackedParameter](), np.zeros((len(flat), len(places)))
    for k, (name, own) in enumerate(zip(dict.fromkeys(names), places, strict=True)):
        rows = [flat.index(j) for j in own]
        factor, params = len(own) > 1, [source.spec.params[j] for j in own]
        values = source.theta[list(own)]
        columns[rows, k] = values if factor else 1.0
        ends = [sorted((p.low / v, p.high / v)) for p, v in zip(params, values, strict=True)] if factor else []
        low, high = (max(e[0] for e in ends), min(e[1] for e in ends)) if ends else (params[0].low, params[0].high)
        unit, value, span = ("1", 1.0, 1.0) if factor else (params[0].unit, float(values[0]), float(spans[rows[0]]))
        found.append(TrackedParameter(name, unit, value, 0.0, span, low, high, own, factor))
    # a factor common to several values is what their covariance says of it when all have it
    common, narrow = (np.linalg.inv(columns.T @ np.linalg.solve(c, columns)) for c in (covariance, alone))
    deviations = np.sqrt(np.diag(narrow))
    sizes, axes = np.linalg.eigh(common - narrow)
    held = (axes * np.maximum(sizes, 0.0)) @ axes.T
    tracked = tuple(
        replace(p, deviation=float(d), remembered=_is_remembered(source, p))
        for p, d in zip(found, deviations, strict=True)
    )
    deviation, correlated = _noise(source)
    prior = narrow / np.outer(deviations, deviations)
    return TrackerPlan(tracked, prior, held, deviation, correlated, _standing(source))


def _names(source: ExportSource) -> list[str]:
    return list(dict.fromkeys(map(base_name, source.spec.names)))


def _places(source: ExportSource, name: str) -> tuple[int, ...]:
    """Return the places of a parameter, at all of its currents."""
    own = tuple(k for k, n in enumerate(source.spec.names) if name in (n, base_name(n)))
    if not own:
        raise ConfigError(f"--track {name}: the model {source.assembly.name} has {', '.join(_names(source))}")
    effect = name.partition(".")[0]
    if "." in name and hasattr(registry.load("effect", effect), "longest"):
        raise ConfigError(f"--track {name}: a time by which {effect} is late cannot be tracked")
    if len(own) > 1 and not np.all(source.theta[list(own)]):
        raise ConfigError(f"--track {name}: it is 0 at a current, and has no factor there")
    return own


def _is_remembered(source: ExportSource, p: TrackedParameter) -> bool:
    """Return whether the output along a log differs where the parameter was another one until the sample before."""
    if not source.stretches:
        return True
    log, places, programs = source.stretches[0], list(p.places), list[DamperProgram]()
    for share in (0.0, _DIFFERENCE):
        theta = source.theta.copy()
        theta[places] += share * (theta[places] if p.factor else p.span) + NEARLY
        moving = {base_name(p.name)}
        programs.append(DamperProgram(source.law_name, theta, source.dependence, False, log.dt, moving))
    rows = dict(zip(source.spec.inputs, source.drive(log)[:, :_SHOWN], strict=True))
    given = np.stack(np.broadcast_arrays(*(rows.get(n, DEFAULTS.get(n, 0.0)) for n in programs[0].channels)), axis=1)
    nowhere, still = np.full(2, np.nan), np.zeros((2, programs[0].chain.places.whole))
    one, other = (advanced(q.chain, still, given[[0, 0]], -1.0, nowhere)[1] for q in programs)
    apart = shown = 0.0
    for k in range(1, len(given)):
        states, now = np.array([one[0], other[1]]), given[[k, k]]
        (plain, one), (changed, other) = (advanced(q.chain, states, now, log.dt, nowhere) for q in programs)
        apart, shown = max(apart, abs(plain[1, 0] - plain[0, 0])), max(shown, abs(changed[1, 0] - plain[0, 0]))
    return bool(apart > _NOTHING * shown)


def _covariances(source: ExportSource, places: Sequence[int], spans: Array) -> tuple[Array, Array]:
    """Return the covariance of the fit (K, K) at places of the parameters, and that where all others are known.

    Of a parameter that the fit leaves open it is that of the derived quantity that moves with it; else a tenth of its
    size.
    """
    result = next(r for r in source.content.results if r.condition == source.condition)
    stored, names = result.covariance, [source.spec.names[k] for k in places]
    wide = [_OPEN * s or _OPEN * source.spec.params[k].high for k, s in zip(places, spans.tolist(), strict=True)]
    found = np.diag(np.square(wide))
    if stored is None:
        return found, found
    at = [stored.names.index(n) if n in stored.names else -1 for n in names]
    scale = [source.theta[k] if j >= 0 and stored.log[j] else 1.0 for k, j in zip(places, at, strict=True)]
    for a, k in enumerate(places):
        for name, slope in _moved_with(source, k) if at[a] < 0 else ():
            if name in stored.names and (j := stored.names.index(name)) not in at:
                at[a], scale[a] = j, 1.0 / slope
                break
    known, rows = [a for a, j in enumerate(at) if j >= 0], np.array(stored.rows).reshape(2 * [len(stored.names)])
    mine = [at[a] for a in known]
    rest = [j for j, n in enumerate(stored.names) if n in source.spec.names and j not in mine]
    size = np.sqrt(np.maximum(np.diag(rows), 1e-300))[rest]
    shared, others = rows[np.ix_(mine, rest)] / size, rows[np.ix_(rest, rest)] / np.outer(size, size)
    by_others = shared @ np.linalg.pinv(others, hermitian=True) @ shared.T
    alone, sizes = found.copy(), np.outer([scale[a] for a in known], [scale[a] for a in known])
    found[np.ix_(known, known)] = rows[np.ix_(mine, mine)] * sizes
    alone[np.ix_(known, known)] = (rows[np.ix_(mine, mine)] - by_others) * sizes
    least = np.diag(np.square(1e-6 * np.maximum(spans, 1e-300)))
    return found + least, alone + least


def _moved_with(source: ExportSource, place: int) -> list[tuple[str, float]]:
    """Return derived quantities in proportion to a parameter, or nearly so, and their slopes; the nearest first."""
    theta = np.stack([source.theta, source.theta])
    step = _DIFFERENCE * (theta[0, place] or source.spec.params[place].high)
    theta[1, place] += step
    before, moved = source.assembly.derived(theta)
    slopes = (moved - before) / step
    with np.errstate(all="ignore"):
        shares = np.abs(slopes * theta[0, place] / before)
    off = np.where((shares > 0.5) & (shares < 2.0), np.abs(np.log(np.maximum(shares, 1e-300))), np.inf)
    return [(source.spec.derived[d].name, float(slopes[d])) for d in np.argsort(off) if np.isfinite(off[d])]


def _noise(source: ExportSource) -> tuple[float, float]:
    """Return the standard deviation of the fit's residual, and its integrated correlation time in s.

    Raises
    ------
    DataError
        If neither the logs nor an error of the fit are at hand.
    """
    if not source.stretches:
        errors = [row.rmse for row in source.content.metrics if row.rmse]
        if not errors:
            raise DataError(f"{source.name}: the size of its residual is not known: fit again")
        return errors[0], 0.0
    residuals = [s.measured - s.simulated for s in source.stretches]
    samples = sum(map(len, residuals))
    variance = sum(float(e @ e) for e in residuals) / samples
    times = [correlation_time(e, 0.0) * s.dt * len(e) for e, s in zip(residuals, source.stretches, strict=True)]
    # a fit without an error: rounding is noise too
    return max(float(np.sqrt(variance)), 1e-9 * source.output_range), sum(times) / samples


def _standing(source: ExportSource) -> tuple[tuple[str, float], ...]:
    """Return the rates below which a damper stands."""
    rates = [n for n in source.channels if unit_of(n).endswith("/s")]
    tests = {n: [float(np.abs(s.inputs[n]).max()) for s in source.stretches] for n in rates}
    return tuple(
        (n, _STANDING * min(v for v in values if v > 0.0))
        for n, values in tests.items()
        if max(values, default=0.0) > 0.0
    )
