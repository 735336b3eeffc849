"""95 % band of a prediction: what the parameters leave open, and what the model leaves of the data.

The parameters' part is the scatter of simulations at refits that leave out a test each. The rest is the magnitude
that 95 of 100 residuals do not exceed, noise and error of the model together: of a condition that was fitted its own,
of another test by the law of tests that were left out of the fit. The wider of the two counts.
"""

import math
from collections.abc import Sequence

import numpy as np

from mrfit.core.recording import Segment
from mrfit.core.specs import Array
from mrfit.core.width import Width
from mrfit.fit.diagnostics.remainders import LEFT_OUT, LEVEL_LEFT_OUT
from mrfit.fit.diagnostics.uncertainty import Uncertainty, quantile_95
from mrfit.fit.error_law import ERRORS_ENOUGH, NORMAL, ErrorLaw
from mrfit.fit.extrapolation import Extents, beyond, is_new_current, together
from mrfit.fit.predict import SegmentPrediction, closest_result, stretch_of, theta_of
from mrfit.fit.result import simulate_block
from mrfit.io.schemas.band import Refits, Remainder
from mrfit.io.schemas.fit import Fit, Result
from mrfit.search.cube import Cube
from mrfit.search.parts import SegmentPart
from mrfit.simulate.assembly import Assembly

BAND_WORTH_MIN = 4.0
"""Independent samples, or degrees of freedom, below which a quantile is not made wider."""
TELLING = 3
"""Refits from which their scatter says what the data leave open."""


def refits_of(cube: Cube, point: Array, uncertainty: Uncertainty, points: Array) -> Refits:
    """Return the refits of a fit by points (G, F) that leave a test out each; by its covariance where these are few.

    Parameters
    ----------
    cube
        Bounds and scales.
    point
        Optimum in the cube, (F,).
    uncertainty
        Covariance in the cube.
    points
        Where refits ended.
    """
    factor, degrees = float(len(points) - 1), float(len(points) - 1)
    if len(points) < TELLING:
        values, vectors = np.linalg.eigh(uncertainty.covariance)
        steps = vectors * np.sqrt(len(point) * np.maximum(values, 0.0))
        points = np.clip(point + np.vstack([steps.T, -steps.T]), 0.0, 1.0)
        factor, degrees = 1.0, uncertainty.degrees
    names = [cube.params[k].name for k in cube.free]
    return Refits(names=names, rows=cube.to_theta(points)[:, cube.free].tolist(), factor=factor, degrees=degrees)


def unseen(results: Sequence[Result]) -> list[Remainder]:
    """Return what is left of tests that had no part in the parameters; of those that had where there are no others."""
    rows = [row for result in results for row in result.remainders]
    fitted = {row.condition for row in rows if row.role == "train"}
    found = [r for r in rows if r.role == LEFT_OUT or (r.role == "holdout" and r.condition not in fitted)]
    return found or [row for row in rows if row.role == "train"]


def own_width(rows: Sequence[Remainder], segment: Segment) -> float | None:
    """Return the half-width of a periodic test whose condition was fitted, None of any other; wider where few tell."""
    out = (LEFT_OUT, LEVEL_LEFT_OUT)
    own = [r for r in rows if r.condition == segment.condition and r.role not in out and segment.cycles]
    widths = [r.quantile * quantile_95(max(r.independent, BAND_WORTH_MIN)) / NORMAL for r in own if r.quantile > 0.0]
    return max(widths, default=None) if any(r.role == "train" for r in own) else None


def widths(fit: Fit, found: SegmentPrediction, assembly: Assembly) -> dict[str, Width]:
    """Return the half-widths of the bands of a prediction by segment, from the start of a record without cycles.

    There are none of a fit whose file says nothing of what it left.
    """
    rows = unseen(fit.results)
    if not rows:
        return {}
    law, made = ErrorLaw.of(rows), dict[str, Width]()
    levels = [r for result in fit.results for r in result.remainders if r.role == LEVEL_LEFT_OUT]
    of_current = ErrorLaw.of(levels) if levels else law
    pieces: dict[str, list[tuple[SegmentPart, Array]]] = {}
    for part, output in zip(found.blocks.parts, found.simulated, strict=True):
        pieces.setdefault(part.segment.id, []).append((part, output))
    for name, some in pieces.items():
        parts, outputs = zip(*some, strict=True)
        result = closest_result(fit.results, parts[0].segment)
        half = np.concatenate([_spread(part, assembly, result, found) for part in parts])
        rest = own_width(result.remainders, parts[0].segment)
        if rest is None:
            chosen = of_current if _is_new_current(result, parts, assembly) else law
            rest = chosen.half_width(float(np.ptp(np.concatenate(outputs))), _beyond(result, parts, assembly))
        made[name] = Width(half, np.maximum(half, rest))
    return made


def promise(fit: Fit, found: SegmentPrediction, assembly: Assembly) -> str:
    """Return what the 95 % bands of a prediction promise, where they are wider and where they fall short."""
    rows = unseen(fit.results)
    if not rows:
        again = f"mrfit fit --model {fit.model} --opt {fit.optimizer} --per {fit.per}"
        return f"none, as the fit was made before bands were kept; `{again}` makes it again, with one"
    closest = [(p, closest_result(fit.results, p.segment)) for p in found.blocks.parts]
    other = {p.segment.condition for p, result in closest if result.condition not in ("all", p.segment.condition)}
    if other:
        return (
            f"falls short for {', '.join(sorted(other))}, of which no parameters were fitted: of real records by the "
            "nearest condition's it held 59 to 70 of 100 samples; a fit with --per all has bands for other conditions"
        )
    text = "low to high holds 95 of 100 samples on average over tests like "
    if rows[0].role == "train":
        return text + f"{rows[0].condition}, if the model errs on others as it does there: no other test was fitted"
    if fit.per == "condition":
        return text + "those that were fitted; other conditions call for a fit with --per all"
    tests = round(sum(r.share for r in rows))
    text += f"the {tests} that were judged by parameters fitted without them"
    if tests < ERRORS_ENOUGH:
        text += f"; fewer than {ERRORS_ENOUGH}: their errors are taken as log-normal"
    levels = [r for _, result in closest for r in result.remainders if r.role == LEVEL_LEFT_OUT]
    new = {p.segment.condition for p, result in closest if _is_new_current(result, [p], assembly)}
    if new and levels:
        told = len({r.condition for r in levels})
        text += f"; at currents that no test had by {told} that were left out in turn: {', '.join(sorted(new))}"
    far = {p.segment.condition for p, result in closest if _beyond(result, [p], assembly) > 0.0}
    return text + (f"; wider beyond what was fitted: {', '.join(sorted(far))}" if far else "")


def _beyond(result: Result, parts: Sequence[SegmentPart], assembly: Assembly) -> float:
    """Return how far a test lies beyond those that a result was fitted to."""
    return beyond(together(_fitted(result)), _reached(parts, assembly))


def _is_new_current(result: Result, parts: Sequence[SegmentPart], assembly: Assembly) -> bool:
    return is_new_current(_fitted(result), _reached(parts, assembly))


def _fitted(result: Result) -> list[Extents]:
    return [r.extents for r in result.remainders if r.role == "train"]


def _reached(parts: Sequence[SegmentPart], assembly: Assembly) -> Extents:
    names = assembly.spec.inputs
    return together(
        stretch_of(p.segment, p.dt, {n: p.inputs(row) for row, n in enumerate(names)}).extents() for p in parts
    )


def _spread(part: SegmentPart, assembly: Assembly, result: Result, found: SegmentPrediction) -> Array:
    """Return the half-width of the band of the parameters over a part, and over what is simulated before it."""
    refits = result.refits
    assert refits is not None
    theta = np.tile(theta_of(assembly, result), (len(refits.rows), 1))
    theta[:, [assembly.spec.names.index(n) for n in refits.names]] = refits.rows
    drawn = np.array([_simulated(part, assembly, t, found) for t in theta])
    finite = np.isfinite(drawn).all(axis=1)
    spread: Array = drawn[finite].std(axis=0) if finite.any() else np.zeros(drawn.shape[1])
    return quantile_95(max(refits.degrees, BAND_WORTH_MIN)) * math.sqrt(refits.factor) * spread


def _simulated(part: SegmentPart, assembly: Assembly, theta: Array, found: SegmentPrediction) -> Array:
    """Return the output of a part, after what is simulated before it while the model settles."""
    output, constant = simulate_block(part.block, assembly, theta)
    lead = len(found.leads.get(part.segment.id, {}).get("simulated", ()))
    if not lead:
        return output
    with np.errstate(all="ignore"):
        before = assembly.simulate(part.block.drive, theta[None, :], part.block.dt)[0, :lead]
    return np.concatenate([before + constant, output])
