"""SSP parameter sets (.ssv): the fit's values, and draws from the distribution that its intervals stand for.

A parameter is normal about its value, on a logarithmic scale where it has one, with the width of its 95 % interval.
Parameters that the output moves alike are drawn together: their correlation is that of a least-squares fit of the
model to its logs. Beyond its bounds a draw is held there.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mrfit.core.specs import Array, Param
from mrfit.export.c_parts import prefix_of
from mrfit.export.head import head_lines
from mrfit.export.source import Source
from mrfit.export.stage import Files, Options
from mrfit.export.text import ascii_line, number
from mrfit.export.units import base_units
from mrfit.export.xml import Node, xml

# Of a normal distribution: half the 95 % interval over the standard deviation
WIDTH = 1.959963984540054
# Samples by which correlations are computed, share of a standard deviation that is one step
SAMPLES, STEP = 4000, 0.1
# Least eigenvalue of the correlation, relative to the largest: parameters that no data tell apart
LEAST = 1e-12
NAMESPACE = "http://ssp-standard.org/SSP1/SystemStructureParameterValues"


def files(source: Source, options: Options) -> Files:
    """Return the fit's own set and ``options.draws`` drawn ones."""
    rows = intervals(source)
    free = [k for k, row in enumerate(rows) if row is not None]
    told = _told(source, rows, options)
    sets = drawn(source, options)
    prefix = prefix_of(source.name)
    digits = max(3, len(str(options.draws)))
    contents = {f"{prefix}.ssv": _set(source, source.theta, told, prefix)}
    for k, theta in enumerate(sets, 1):
        name = f"{prefix}_{k:0{digits}d}"
        contents[f"ssv/{name}.ssv"] = _set(source, theta, [f"Draw {k} of {options.draws}", *told], name)
    said = f"{options.draws} draws of {len(free)} parameters, seed {options.seed}; {len(rows) - len(free)} held"
    return Files(contents, (said, _band(source, sets)), 0.0)


def _told(source: Source, rows: list[Any], options: Options) -> list[str]:
    held = [n for n, row in zip(source.spec.names, rows, strict=True) if row is None]
    lines = [
        "Values are those of the fit, to the last digit: no difference from the simulation in Python.",
        f"Draws: normal within 95 % intervals, correlated as in the fit, seed {options.seed}.",
    ]
    return [*lines, *([f"Held, since no interval is known: {', '.join(held)}"] if held else [])]


def _band(source: Source, sets: Array) -> str:
    """Return how far apart the outputs of the draws are over a segment of the logs."""
    if not source.stretches:
        return "The band of the output is not known: the fit's logs are not at hand."
    stretch = source.stretches[0]
    drive = np.ascontiguousarray(source.drive(stretch)[:, :SAMPLES])
    with np.errstate(all="ignore"):
        outputs = source.assembly.simulate(drive, sets, stretch.dt)
    spread = float(np.sqrt(np.mean(np.var(outputs, axis=0)))) / source.output_range
    return f"Standard deviation of the output over the draws: {100.0 * spread:.2g} % of its range."


def intervals(source: Source) -> list[tuple[float, bool] | None]:
    """Return for every parameter its standard deviation and whether that is of its logarithm; None if it is held."""
    result = next(r for r in source.content["results"] if str(r["condition"]) == source.condition)
    rows: dict[str, Mapping[str, Any]] = {p["name"]: p for p in result["parameters"]}
    return [_spread(p, rows[p.name]) for p in source.spec.params]


def _spread(param: Param, row: Mapping[str, Any]) -> tuple[float, bool] | None:
    low, high = row.get("low"), row.get("high")
    if row.get("fixed") or low is None or high is None or not high > low:
        return None
    log = param.scale == "log" and low > 0.0
    width = math.log(high / low) if log else high - low
    return width / (2.0 * WIDTH), log


def drawn(source: Source, options: Options) -> Array:
    """Return parameter sets (draws, K)."""
    rows = intervals(source)
    free = [k for k, row in enumerate(rows) if row is not None]
    sets = np.tile(source.theta, (options.draws, 1))
    if not free:
        return sets
    widths = np.array([row[0] for row in rows if row is not None])
    logs = np.array([row[1] for row in rows if row is not None])
    values, vectors = np.linalg.eigh(correlation(source, free, widths, logs))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    normal = np.random.default_rng(options.seed).standard_normal((options.draws, len(free)))
    moves = normal @ root.T * widths
    moved = _moved(source.theta[free], moves, logs)
    low, high = (np.array([getattr(source.spec.params[k], end) for k in free]) for end in ("low", "high"))
    sets[:, free] = np.clip(moved, np.minimum(low, source.theta[free]), np.maximum(high, source.theta[free]))
    return sets


def _moved(values: Array, moves: Array, logs: Array) -> Array:
    return np.where(logs, values * np.exp(np.where(logs, moves, 0.0)), values + moves)


def correlation(source: Source, free: list[int], widths: Array, logs: Array) -> Array:
    """Return the correlation (F, F) of the free parameters of a least-squares fit to the logs, 1 without logs."""
    if not source.stretches:
        return np.eye(len(free))
    share = max(SAMPLES // len(source.stretches), 200)
    columns = []
    for s in source.stretches[: SAMPLES // 200]:
        drive = source.drive(s)[:, :share]
        points = np.tile(source.theta, (2 * len(free), 1))
        steps = np.diag(STEP * widths)
        points[:, free] = _moved(source.theta[free], np.vstack([steps, -steps]), logs)
        with np.errstate(all="ignore"):
            outputs = source.assembly.simulate(np.ascontiguousarray(drive), points, s.dt)
        columns.append((outputs[: len(free)] - outputs[len(free) :]) / (2.0 * STEP))
    jacobian = np.nan_to_num(np.hstack(columns))
    gram = jacobian @ jacobian.T
    scale = np.sqrt(np.where(np.diag(gram) > 0.0, np.diag(gram), 1.0))
    values, vectors = np.linalg.eigh(gram / np.outer(scale, scale))
    inverse = (vectors / np.maximum(values, LEAST * values[-1])) @ vectors.T
    deviations = np.sqrt(np.diag(inverse))
    found: Array = inverse / np.outer(deviations, deviations)
    return found


def _set(source: Source, theta: Array, told: list[str], name: str) -> bytes:
    parameters = [
        Node("ssv:Parameter", {"name": p.name}, [Node("ssv:Real", {"value": number(v), "unit": p.unit})])
        for p, v in zip(source.spec.params, theta.tolist(), strict=True)
    ]
    units = dict.fromkeys(p.unit for p in source.spec.params)
    listed = [Node("ssc:Unit", {"name": u}, [Node("ssc:BaseUnit", dict(base_units(u)))]) for u in units]
    whole = Node(
        "ssv:ParameterSet",
        {
            "xmlns:ssv": NAMESPACE,
            "xmlns:ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon",
            "version": "1.0",
            "name": name,
            "description": ascii_line(f"{source.assembly.name} of the fit {source.name}"),
        },
        [Node("ssv:Parameters", {}, parameters), Node("ssv:Units", {}, listed)],
    )
    return xml(whole, head_lines(source, told))
