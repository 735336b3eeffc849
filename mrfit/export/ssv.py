"""SSP parameter sets (.ssv): the fit's values, and draws from the distribution that its intervals stand for.

A parameter is normal about its value, on a logarithmic scale where it has one, with the width of its 95 % interval.
Parameters that the output moves alike are drawn together: their correlation is that of a least-squares fit of the
model to its logs. Beyond its bounds a draw is held there.

Where the data do not determine parameters one by one, draws go along the directions that they do determine, as far as
the intervals of parameters and derived quantities say; what cannot be seen in the output stays as it is.
"""

import math
from collections.abc import Sequence

import numpy as np

from mrfit.core.specs import Array, Param
from mrfit.export.c_parts import prefix_of
from mrfit.export.head import head_lines
from mrfit.export.source import ExportSource
from mrfit.export.stage import Files
from mrfit.export.text import ascii_line, number
from mrfit.export.units import base_units
from mrfit.export.xml import XmlElement, xml
from mrfit.io.schemas.fit import Quantity, Result
from mrfit.settings.export import Settings

# Of a normal distribution: half the 95 % interval over the standard deviation
_WIDTH = 1.959963984540054
# Samples by which correlations are computed, share of a standard deviation that is one step
_SAMPLES, _STEP = 4000, 0.1
# Least eigenvalue of the correlation, relative to the largest: parameters that no data tell apart
_LEAST = 1e-12
# Step in shares of the bounds, singular value below which nothing moves, and the width beyond which a direction is open
CUBE_STEP, _UNSEEN, _OPEN = 1e-4, 3e-5, 0.5
AS_FITTED = "Values are those of the fit, to the last digit: no difference from the simulation in Python."
NO_DRAWS = "No draws: of no parameter and no derived quantity of this fit an interval is known."
NAMESPACE = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"


def files(source: ExportSource, settings: Settings) -> Files:
    """Return the fit's own set and ``settings.draws`` drawn ones."""
    sets = drawn(source, settings)
    moved = int(np.count_nonzero(np.ptp(np.vstack([source.theta, sets]), axis=0)))
    prefix = prefix_of(source.prefix or source.name)
    if not moved:
        told = [AS_FITTED, NO_DRAWS]
        return Files({f"{prefix}.ssv": _set(source, source.theta, told, prefix)}, (NO_DRAWS,), 0.0)
    told = _told(source, sets, settings)
    digits = max(3, len(str(settings.draws)))
    contents = {f"{prefix}.ssv": _set(source, source.theta, told, prefix)}
    for k, theta in enumerate(sets, 1):
        name = f"{prefix}_{k:0{digits}d}"
        contents[f"ssv/{name}.ssv"] = _set(source, theta, [f"Draw {k} of {settings.draws}.", *told[1:]], name)
    said = f"{settings.draws} draws of {moved} parameters, seed {settings.seed}; {len(source.theta) - moved} held"
    return Files(contents, (said, *told[1:2], _band(source, sets)), 0.0, f"ssv/{prefix}_[0-9]*.ssv")


def _told(source: ExportSource, sets: Array, settings: Settings) -> list[str]:
    held = [n for n, column in zip(source.spec.names, sets.T, strict=True) if not np.ptp(column)]
    how = "within 95 % intervals, correlated as in the fit"
    if not one_by_one(source):
        how = "along what the data determine, as wide as the intervals of parameters and derived quantities"
    return [AS_FITTED, f"Draws: normal {how}, seed {settings.seed}.", *([f"Held: {', '.join(held)}"] if held else [])]


def _band(source: ExportSource, sets: Array) -> str:
    """Return the spread of the draws' outputs over a segment of the logs."""
    if not source.stretches:
        return "The band of the output is not known: the fit's logs are not at hand."
    stretch = source.stretches[0]
    drive = np.ascontiguousarray(source.drive(stretch)[:, :_SAMPLES])
    with np.errstate(all="ignore"):
        outputs = source.assembly.simulate(drive, sets, stretch.dt)
    spread = float(np.sqrt(np.mean(np.var(outputs, axis=0)))) / source.output_range
    return f"Standard deviation of the output over the draws: {100.0 * spread:.2g} % of its range."


def _result(source: ExportSource) -> Result:
    return next(r for r in source.content.results if r.condition == source.condition)


def _rows(source: ExportSource) -> list[Quantity]:
    rows = {p.name: p for p in _result(source).parameters}
    return [rows[p.name] for p in source.spec.params]


def intervals(source: ExportSource) -> list[tuple[float, bool] | None]:
    """Return for every parameter its standard deviation and whether that is of its logarithm; None if it is held."""
    return [_spread(p, row) for p, row in zip(source.spec.params, _rows(source), strict=True)]


def one_by_one(source: ExportSource) -> bool:
    """Return whether every parameter that was fitted has an interval, or there are no logs to tell more by."""
    known = zip(_rows(source), intervals(source), strict=True)
    return not source.stretches or all(row.fixed or width is not None for row, width in known)


def _spread(param: Param, row: Quantity) -> tuple[float, bool] | None:
    low, high = row.low, row.high
    if row.fixed or low is None or high is None or not high > low:
        return None
    log = param.scale == "log" and low > 0.0
    width = math.log(high / low) if log else high - low
    return width / (2.0 * _WIDTH), log


def drawn(source: ExportSource, settings: Settings) -> Array:
    """Return parameter sets (draws, K)."""
    if not one_by_one(source):
        return _along(source, settings)
    rows = intervals(source)
    free = [k for k, row in enumerate(rows) if row is not None]
    sets = np.tile(source.theta, (settings.draws, 1))
    if not free:
        return sets
    widths = np.array([row[0] for row in rows if row is not None])
    logs = np.array([row[1] for row in rows if row is not None])
    values, vectors = np.linalg.eigh(correlation(source, free, widths, logs))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    normal = np.random.default_rng(settings.seed).standard_normal((settings.draws, len(free)))
    moves = normal @ root.T * widths
    moved = _moved(source.theta[free], moves, logs)
    low, high = (np.array([getattr(source.spec.params[k], end) for k in free]) for end in ("low", "high"))
    sets[:, free] = np.clip(moved, np.minimum(low, source.theta[free]), np.maximum(high, source.theta[free]))
    return sets


def _moved(values: Array, moves: Array, logs: Array) -> Array:
    return np.where(logs, values * np.exp(np.where(logs, moves, 0.0)), values + moves)


def correlation(source: ExportSource, free: list[int], widths: Array, logs: Array) -> Array:
    """Return the correlation (F, F) of the free parameters of a least-squares fit to the logs, 1 without logs."""
    if not source.stretches:
        return np.eye(len(free))
    points, steps = np.tile(source.theta, (2 * len(free), 1)), np.diag(_STEP * widths)
    points[:, free] = _moved(source.theta[free], np.vstack([steps, -steps]), logs)
    jacobian = np.hstack([_slopes(outputs, _STEP) for outputs in _outputs(source, points)])
    gram = jacobian @ jacobian.T
    scale = np.sqrt(np.where(np.diag(gram) > 0.0, np.diag(gram), 1.0))
    values, vectors = np.linalg.eigh(gram / np.outer(scale, scale))
    inverse = (vectors / np.maximum(values, _LEAST * values[-1])) @ vectors.T
    deviations = np.sqrt(np.diag(inverse))
    found: Array = inverse / np.outer(deviations, deviations)
    return found


def _along(source: ExportSource, settings: Settings) -> Array:
    """Return parameter sets (draws, K), drawn along the directions of the parameter space that the data determine."""
    free = [k for k, row in enumerate(_rows(source)) if not row.fixed]
    sets = np.tile(source.theta, (settings.draws, 1))
    steps = CUBE_STEP * np.vstack([np.eye(len(free)), -np.eye(len(free))])
    jacobian = np.hstack([_slopes(o) for o in _outputs(source, _in_cube(source, free, steps))])
    values, vectors = np.linalg.eigh(jacobian @ jacobian.T)
    seen = values > _UNSEEN**2 * values[-1]
    values, vectors = values[seen], vectors[:, seen]
    scale = _scale(source, free, steps, values, vectors)
    widths = scale / np.sqrt(values)
    kept = widths < _OPEN
    normal = np.random.default_rng(settings.seed).standard_normal((settings.draws, len(values)))
    moves = normal[:, kept] * widths[kept] @ vectors[:, kept].T
    sets[:, free] = _in_cube(source, free, moves)[:, free]
    return sets


def _slopes(values: Array, step: float = CUBE_STEP) -> Array:
    """Return central differences (F, M) of values (2F, M) at steps up and down."""
    half = len(values) // 2
    return np.nan_to_num((values[:half] - values[half:]) / (2.0 * step))


def _in_cube(source: ExportSource, free: list[int], moves: Array) -> Array:
    """Return parameters (M, K) moved by shares (M, F) of the range between their bounds, on their scales."""
    points = np.tile(source.theta, (len(moves), 1))
    for column, k in enumerate(free):
        p, value = source.spec.params[k], float(source.theta[k])
        low, high = min(p.low, value), max(p.high, value)
        if p.scale == "log" and low > 0.0:
            moved = value * np.exp(moves[:, column] * math.log(high / low))
        else:
            moved = value + moves[:, column] * (high - low)
        points[:, k] = np.clip(moved, low, high) if np.abs(moves).max(initial=0.0) > CUBE_STEP else moved
    return points


def _outputs(source: ExportSource, points: Array) -> list[Array]:
    """Return the outputs (P, M) of parameter sets (P, K) over pieces of the logs."""
    share = max(_SAMPLES // len(source.stretches), 200)
    found = []
    for s in source.stretches[: _SAMPLES // 200]:
        drive = np.ascontiguousarray(source.drive(s)[:, :share])
        with np.errstate(all="ignore"):
            found.append(source.assembly.simulate(drive, points, s.dt))
    return found


def _scale(source: ExportSource, free: list[int], steps: Array, values: Array, vectors: Array) -> float:
    """Return the size of the noise that gives the intervals there are, of parameters and of derived quantities."""
    covariance = (vectors / values) @ vectors.T
    points = _in_cube(source, free, steps)
    found = []
    derived = _slopes(source.assembly.derived(points))
    for column, row in zip(derived.T, _result(source).derived, strict=False):
        low, high = row.low, row.high
        power = float(column @ covariance @ column)
        if low is not None and high is not None and high > low and power > 0.0:
            found.append((high - low) / (2.0 * _WIDTH) / math.sqrt(power))
    for column_number, k in enumerate(free):
        p, width = source.spec.params[k], intervals(source)[k]
        if width is not None:
            reach = math.log(p.high / p.low) if width[1] else p.high - p.low
            found.append(width[0] / reach / math.sqrt(float(covariance[column_number, column_number])))
    return float(np.median(found)) if found else 0.0


def _set(source: ExportSource, theta: Array, told: list[str], name: str) -> bytes:
    values = [(p.name, p.unit, v) for p, v in zip(source.spec.params, theta.tolist(), strict=True)]
    return parameter_set(name, f"{source.assembly.name} of the fit {source.name}", values, head_lines(source, told))


def parameter_set(name: str, what: str, values: Sequence[tuple[str, str, float]], head: Sequence[str]) -> bytes:
    """Return a parameter set of names, SI units and values, with a description and lines of a head."""
    parameters = [
        XmlElement("ssv:Parameter", {"name": p}, [XmlElement("ssv:Real", {"value": number(v), "unit": unit})])
        for p, unit, v in values
    ]
    units = dict.fromkeys(unit for _, unit, _ in values)
    listed = [XmlElement("ssc:Unit", {"name": u}, [XmlElement("ssc:BaseUnit", dict(base_units(u)))]) for u in units]
    whole = XmlElement(
        "ssv:ParameterSet",
        {
            "xmlns:ssv": NAMESPACE,
            "xmlns:ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
            "version": "1.0",
            "name": name,
            "description": ascii_line(what),
        },
        [XmlElement("ssv:Parameters", {}, parameters), XmlElement("ssv:Units", {}, listed)],
    )
    return xml(whole, head)
