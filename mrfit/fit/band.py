"""95 % band of a prediction: what the parameters leave open, and what the fit left of the data.

The parameters' part is the spread of simulations at parameters drawn by their covariance. The rest is the magnitude
that 95 of 100 residuals of a fit did not exceed, noise and error of the model together. Of a condition that was not
fitted it is that of a power of the output's range, q = q₀·rᵇ with 0 ≤ b ≤ 1: noise does not grow with the output, the
error of a model does. Their squares are added.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from mrfit.core.specs import Array
from mrfit.core.width import Width
from mrfit.fit.diagnostics.bootstrap import Interval
from mrfit.fit.diagnostics.uncertainty import effective_samples, quantile_95
from mrfit.fit.predict import Prediction, closest_result, theta_of
from mrfit.fit.result import simulate_block
from mrfit.io.schemas.fit import Covariance, Fit, Remainder, Result
from mrfit.search.cube import Cube
from mrfit.search.parts import Part
from mrfit.simulate.assembly import Assembly

DRAWS = 50
"""Parameter vectors drawn; their standard deviation is off by a tenth."""
NORMAL = 1.96
FEWEST = 4.0
"""Independent samples below which the quantile of a residual is not made wider."""


def covariance_of(cube: Cube, rows: Array, degrees: float) -> Covariance:
    """Return the table of a covariance (F, F) in the coordinates of a cube."""
    free = [cube.params[k] for k in cube.free]
    return Covariance(
        names=[p.name for p in free],
        low=[p.low for p in free],
        high=[p.high for p in free],
        logarithmic=[p.scale == "log" for p in free],
        rows=rows.tolist(),
        degrees=degrees,
    )


def widened(covariance: Array, cube: Cube, quantile: float, found: Mapping[str, Interval]) -> Array:
    """Return a covariance (F, F) with the widths of other 95 % intervals where these have two ends."""
    scale = np.ones(len(covariance))
    theta = cube.to_theta(np.zeros((2, len(covariance))))
    for at, k in enumerate(cube.free):
        low, high = found.get(cube.params[k].name, Interval(None, None))
        if low is None or high is None or covariance[at, at] <= 0.0:
            continue
        theta[:, k] = low, high
        width = float(np.ptp(cube.to_points(theta)[:, at]))
        scale[at] = width / (2.0 * quantile * math.sqrt(covariance[at, at]))
    made: Array = covariance * np.outer(scale, scale)
    return made


def remainders(parts: Sequence[Part], simulated: Sequence[Array]) -> list[Remainder]:
    """Return what a fit leaves of every condition and role."""
    members: dict[tuple[str, str], list[int]] = {}
    for k, part in enumerate(parts):
        members.setdefault((part.segment.condition, part.segment.role), []).append(k)
    rows = []
    for (condition, role), places in members.items():
        errors = [parts[k].output - simulated[k] for k in places]
        if not all(np.isfinite(e).all() for e in errors):
            continue
        rows.append(
            Remainder(
                condition=condition,
                role=role,
                quantile=float(np.quantile(np.abs(np.concatenate(errors)), 0.95)),
                reach=max(float(np.ptp(simulated[k])) for k in places),
                independent=sum(effective_samples(e) for e in errors),
            )
        )
    return rows


def remainder_width(rows: Sequence[Remainder], condition: str, reach: float) -> float:
    """Return the half-width for noise and model error of a condition whose simulated output has a range."""
    own = [r for r in rows if r.condition == condition]
    if own:
        return max(_safe(r) for r in own)
    known = [r for r in rows if r.quantile > 0.0 and r.reach > 0.0]
    if not known:
        return 0.0
    across, up = (np.log([value(r) for r in known]) for value in (lambda r: r.reach, _safe))
    centred = across - across.mean()
    power = float(centred @ centred)
    # ranges that are alike tell no slope: an output that is larger may then err more, a smaller one no less
    here = math.log(max(reach, 1e-300))
    flat = power < 0.1
    slope = float(here > across.mean()) if flat else float(np.clip(centred @ up / power, 0.0, 1.0))
    law = up.mean() + slope * (across - across.mean())
    off = up - law
    # conditions differ; and held-out ones, where there are some, say how much more is left of what was not fitted
    held = [o for o, r in zip(off, known, strict=True) if r.role == "holdout"]
    scatter = math.sqrt(float(np.mean(off**2)) * (1.0 + 1.0 / len(known)))
    more = max(float(np.mean(held)), 0.0) if held else 0.0
    return math.exp(float(up.mean()) + slope * (here - float(across.mean())) + scatter + more)


def _safe(row: Remainder) -> float:
    """Return the quantile of a remainder, wider where few independent samples tell it."""
    return row.quantile * quantile_95(max(row.independent, FEWEST)) / NORMAL


def widths(fit: Fit, found: Prediction, assembly: Assembly, seed: int = 0) -> dict[str, Width]:
    """Return the half-widths of the bands of a prediction by segment, from the start of a record without cycles.

    There are none of a fit whose file has no covariance.
    """
    rng = np.random.default_rng(seed)
    pieces: dict[str, list[tuple[Array, Array, Result]]] = {}
    for part, output in zip(found.blocks.parts, found.simulated, strict=True):
        result = closest_result(fit.results, part.segment)
        if result.covariance is None:
            continue
        drawn = np.array([_simulated(part, assembly, t, found) for t in _drawn(assembly, result, rng)])
        drawn = drawn[np.isfinite(drawn).all(axis=1)]
        spread = drawn.std(axis=0) if len(drawn) > 1 else np.zeros(drawn.shape[1])
        half = quantile_95(result.covariance.degrees) * spread
        pieces.setdefault(part.segment.id, []).append((half, output, result))
    made = {}
    conditions = {p.segment.id: p.segment.condition for p in found.blocks.parts}
    for segment, some in pieces.items():
        half = np.concatenate([p[0] for p in some])
        reach = float(np.ptp(np.concatenate([p[1] for p in some])))
        rest = remainder_width(some[0][2].remainders, conditions[segment], reach)
        made[segment] = Width(half, np.hypot(half, rest))
    return made


def _drawn(assembly: Assembly, result: Result, rng: np.random.Generator) -> Array:
    """Return parameter vectors (DRAWS, K) drawn about a result by its covariance, within their bounds."""
    about = result.covariance
    assert about is not None
    theta = np.tile(theta_of(assembly, result), (DRAWS, 1))
    at = [assembly.spec.names.index(n) for n in about.names]
    logarithmic = np.array(about.logarithmic, dtype=np.bool_)

    def scaled(values: Array) -> Array:
        return np.where(logarithmic, np.log(np.where(logarithmic, values, 1.0)), values)

    low, high = (scaled(np.array(ends)) for ends in (about.low, about.high))
    values, vectors = np.linalg.eigh(np.array(about.rows))
    steps = rng.standard_normal((DRAWS, len(at))) @ (vectors * np.sqrt(np.maximum(values, 0.0))).T
    points = np.clip((scaled(theta[:, at]) - low) / (high - low) + steps, 0.0, 1.0)
    moved = low + points * (high - low)
    theta[:, at] = np.where(logarithmic, np.exp(np.where(logarithmic, moved, 0.0)), moved)
    return theta


def _simulated(part: Part, assembly: Assembly, theta: Array, found: Prediction) -> Array:
    """Return the output of a part, after what is simulated before it while the model settles."""
    output, constant = simulate_block(part.block, assembly, theta)
    lead = len(found.leads.get(part.segment.id, {}).get("simulated", ()))
    if not lead:
        return output
    with np.errstate(all="ignore"):
        before = assembly.simulate(part.block.drive, theta[None, :], part.block.dt)[0, :lead]
    return np.concatenate([before + constant, output])
