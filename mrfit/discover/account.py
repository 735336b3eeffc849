"""From a decision to discovery.json: verdict, gap, regions, candidates with reasons, the test that would settle it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrfit.core import registry
from mrfit.core.specs import Array, EffectSpec
from mrfit.discover import looks
from mrfit.discover.bench import Bench
from mrfit.discover.decide import Verdict
from mrfit.discover.refit import Fitter, Refit
from mrfit.discover.regions import Region, beyond_training, in_words, locate
from mrfit.discover.remainder import explainable, follows_the_state, repeated_error
from mrfit.discover.screen import ALIKE, cosines
from mrfit.discover.trials import leaves_too_much
from mrfit.fit.result import parameter_rows
from mrfit.signal.drift import drift_row, steady_drift

# Errors that repeat from cycle to cycle, this many times the noise, leave no doubt that something is missing …
FAR_ABOVE = 2.0
# … nor do smaller ones, if a model that knows no physics still predicts this share of their square, or if effects that
# had proof left too much; or errors so far above a floor of white noise that no colour of noise excuses them
CLEARLY_ABOVE = 1.25
STRUCTURE = 0.15
BEYOND_ANY_COLOUR = 8.0
REGIONS = 8


@dataclass(frozen=True)
class Outcome:
    """The verdict's word and what it rests on.

    Attributes
    ----------
    word
        ``none``, ``named``, ``ambiguous`` or ``unexplained``.
    structure
        Share of the remaining squared hold-out error that a nonparametric model predicts.
    """

    word: str
    structure: float


def verdict_of(bench: Bench, verdict: Verdict, seed: int) -> Outcome:
    """Return the verdict's word."""
    noise = bench.most_noise("holdout")
    drop_shadows(verdict, noise)
    final = verdict.final
    structure = explainable(bench, final.train, final.holdout, seed)
    if verdict.ambiguous:
        return Outcome("ambiguous", structure)
    if final.effects:
        return Outcome("named", structure)
    if noise > 1.0:
        return Outcome(_word(final.chi("holdout"), noise, verdict.taken_back or structure > STRUCTURE), structure)
    told = structure > STRUCTURE or verdict.taken_back or final.chi("holdout") > BEYOND_ANY_COLOUR
    left = final.chi("holdout") > CLEARLY_ABOVE and told
    left = left or repeated_error(bench, final) > FAR_ABOVE or follows_the_state(bench, final)
    return Outcome("unexplained" if left else "none", structure)


def _word(chi: float, noise: float, told: bool) -> str:
    """Return the verdict's word where the noise floor is not known: it lies between 1 and ``noise``, as the error does.

    What is within the least noise is noise. What is above the most, or follows the inputs, is not. Of what is between,
    nothing can be said.
    """
    if chi <= CLEARLY_ABOVE:
        return "none"
    return "unexplained" if told or chi > CLEARLY_ABOVE * noise else "insufficient-data"


def drop_shadows(verdict: Verdict, noise: float = 1.0) -> None:
    """Take back all effects if together they leave much of the gap: what is missing then is something else.

    ``noise`` is the most that the noise can be, in multiples of the floor.
    """
    proven = verdict.proven
    if not verdict.final.effects or not leaves_too_much(verdict.base, verdict.final, noise):
        return
    before, after = (fit.chi("holdout") ** 2 for fit in (verdict.base, proven))
    closed = (before - after) / (before - 1.0)
    together = f"{' and '.join(proven.effects)} would take {closed:.0%} of the gap"
    left = f"leave {np.sqrt(after):.3g} times the noise: too little to be all that is missing"
    verdict.reasons |= dict.fromkeys(proven.effects, f"{together} and {left}")
    verdict.final, verdict.ambiguous, verdict.taken_back = verdict.base, [], True


def account(fitter: Fitter, verdict: Verdict, outcome: Outcome) -> dict[str, Any]:
    """Return everything discovery.json says of a decision."""
    bench, before, after = fitter.bench, verdict.base, verdict.final
    named = [e for e in after.effects if not any(e in group for group in verdict.ambiguous)]
    specs = {e: registry.load("effect", e).SPEC for e in registry.names("effect")}
    gap = gap_of(bench, before, after)
    where = regions_of(bench, before)
    rest = regions_of(bench, after)
    share = None if gap["noise_floor"] is None else 1.0 - (gap["closed"] or 0.0)
    spoken_of = share is None or share > 0.1
    shapes = looks.looks(bench, after) if spoken_of else []
    pairs = confusable(verdict)
    standing = {e: group[0] for group in verdict.ambiguous for e in group}
    undecided = sorted(standing)
    partial, others = _partial_rows(fitter, verdict)
    return {
        "verdict": outcome.word,
        "effects": [effect_row(verdict, specs[e], fitter, pairs) for e in named],
        "ambiguous_set": undecided,
        "suspects": [_swapped(fitter, verdict, after, (standing[e], e)) for e in undecided] + partial + others,
        "advice": [f"{e}: {specs[e].experiment}" for e in undecided or [row["name"] for row in partial + others]]
        + _unknown_noise(bench, outcome),
        "where": [region_row(r) for r in where[:REGIONS]],
        "where_text": in_words(where),
        "beyond_training": beyond_training(bench),
        "gap": gap,
        "drift": drift_rows(bench, after) + verdict.drifting,
        "candidates": candidate_rows(verdict),
        "confusable": pairs,
        "cosines": cosine_table(verdict),
        "unexplained": {
            "share_of_gap": share,
            "predictable": outcome.structure,
            "where": [region_row(r) for r in rest[:REGIONS]] if spoken_of else [],
            "text": in_words(rest) if spoken_of else [],
            "looks": shapes,
            "looks_text": looks.in_words(shapes),
        },
        "augmented_model": "+".join([fitter.base, *after.effects]),
        "segments": [
            {
                "id": s.segment.id,
                "condition": s.segment.condition,
                "role": s.segment.role,
                **s.noise.as_json(1.0 / bench.span),
                "noise_floor": s.floor / bench.span if s.noise.known else None,
            }
            for s in bench.stretches
        ],
    }


def drift_rows(bench: Bench, fit: Refit) -> list[dict[str, Any]]:
    """Return one row per record in which the output drifts steadily, where a fit does not explain it."""
    rows = []
    for role, errors in (("train", fit.train), ("holdout", fit.holdout)):
        for stretch, error in zip(bench.of_role(role), errors, strict=True):
            residual, segment = -error * stretch.floor, stretch.segment
            found = steady_drift(residual, stretch.measured + error * stretch.floor, stretch.block.dt, segment.cycles)
            row = {"level_rate": stretch.level_rate, "gain_rate": 0.0}
            if found is not None:
                own = drift_row(segment.condition, segment.id, found)
                row = {"level_rate": stretch.level_rate or own["level_rate"], "gain_rate": own["gain_rate"]}
            if any(row.values()):
                rows.append({"condition": segment.condition, "segment": segment.id, **row})
    return rows


def gap_of(bench: Bench, before: Refit, after: Refit) -> dict[str, float | None]:
    """Return noise floor and errors as NRMSE on held-out conditions, and the share of the gap closed."""
    floors = [s.floor for s in bench.of_role("holdout")]
    counts = [s.segment.samples for s in bench.of_role("holdout")]
    floor = float(np.sqrt(np.average(np.square(floors), weights=counts)))
    errors = [_rms(fit.holdout, floors) for fit in (before, after)]
    span = bench.span
    above = errors[0] ** 2 - floor**2
    # an error below the floor by chance closes all of the gap, not more
    closed = min((errors[0] ** 2 - errors[1] ** 2) / above, 1.0) if above > 0 else None
    known = all(s.noise.known for s in bench.of_role("holdout"))
    return {
        "noise_floor": floor / span if known else None,
        "before": errors[0] / span,
        "after": errors[1] / span,
        "closed": closed if known else None,
    }


def _unknown_noise(bench: Bench, outcome: Outcome) -> list[str]:
    if outcome.word != "insufficient-data":
        return []
    conditions = sorted({s.segment.condition for s in bench.of_role("holdout") if not s.noise.known})
    return [
        f"the noise floor of {', '.join(conditions)} is not known, and the error is within its bounds: log each "
        "of these tests twice with the same drive, or some tests of ten steady cycles, to tell noise from the rest"
    ]


def _rms(errors: Sequence[Array], floors: Sequence[float]) -> float:
    physical = np.concatenate([e * f for e, f in zip(errors, floors, strict=True)])
    return float(np.sqrt(np.mean(physical**2)))


def regions_of(bench: Bench, fit: Refit) -> list[Region]:
    """Return where a fit errs, over training and held-out segments together."""
    stretches = [*bench.of_role("train"), *bench.of_role("holdout")]
    errors = [e * s.floor for e, s in zip([*fit.train, *fit.holdout], stretches, strict=True)]
    return locate(bench, errors, stretches)


def region_row(region: Region) -> dict[str, Any]:
    """Return a region as JSON has it."""
    return {
        "region": region.name,
        "share_of_error": region.share_of_error,
        "share_of_samples": region.share_of_samples,
    }


def effect_row(verdict: Verdict, spec: EffectSpec, fitter: Fitter, pairs: list[dict[str, Any]]) -> dict[str, Any]:
    """Return an accepted effect: its parameters with intervals, and the hold-out error without and with it.

    Its aliases are taken from the confusable ``pairs``.
    """
    final = verdict.final
    rest = [e for e in final.effects if e != spec.name]
    without = fitter.refit(rest, [final.values]) if rest else verdict.base
    gap = gap_of(fitter.bench, without, final)
    alike = {e for row in pairs if spec.name in row["pair"] for e in row["pair"]}
    return {
        "name": spec.name,
        "parameters": own_parameters(final, spec.name),
        "aliases": sorted(alike - {spec.name}),
        "holdout_nrmse_before": gap["before"],
        "holdout_nrmse_after": gap["after"],
    }


def _partial_rows(fitter: Fitter, verdict: Verdict) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the effects that were taken back, and those that could stand ``instead_of`` one of them."""
    if not verdict.taken_back:
        return [], []
    fit = verdict.proven
    others = [
        _swapped(fitter, verdict, fit, (own, other)) | {"instead_of": own}
        for own, *rivals in verdict.doubtful
        for other in rivals
        if other not in fit.effects
    ]
    return [partial_row(fitter, verdict, fit, e) for e in fit.effects], others


def _swapped(fitter: Fitter, verdict: Verdict, fit: Refit, swap: tuple[str, str]) -> dict[str, Any]:
    """Return what the second of two effects would be in a fit in place of the first, from which it cannot be told."""
    own, other = swap
    effects = [other if e == own else e for e in fit.effects]
    return partial_row(fitter, verdict, fitter.refit(effects, [fit.values]), other)


def partial_row(fitter: Fitter, verdict: Verdict, fit: Refit, name: str) -> dict[str, Any]:
    """Return an effect of a fit that is not the final one: its parameters, and the hold-out error of that fit."""
    gap = gap_of(fitter.bench, verdict.base, fit)
    own = {"name": name, "parameters": own_parameters(fit, name)}
    return {**own, "holdout_nrmse_after": gap["after"], "closed": gap["closed"]}


def own_parameters(fit: Refit, effect: str) -> list[dict[str, Any]]:
    """Return an effect's parameters with intervals."""
    return [
        {"name": row["name"].partition(".")[2], **{k: row[k] for k in ("unit", "value", "low", "high")}}
        for row in parameter_rows(fit.cube, fit.point, fit.uncertainty)
        if row["name"].startswith(effect + ".")
    ]


def candidate_rows(verdict: Verdict) -> list[dict[str, Any]]:
    """Return every effect of the library with its screening, its gain and what became of it."""
    screened = {s.name: s for s in verdict.screened}
    rows = [
        {
            "name": name,
            "screen": screened[name].gain if name in screened else 0.0,
            "strength": screened[name].strength if name in screened else 0.0,
            "holdout_gain": verdict.gains.get(name),
            "accepted": name in verdict.final.effects,
            "reason": reason,
        }
        for name, reason in verdict.reasons.items()
    ]
    return sorted(rows, key=lambda r: (not r["accepted"], -float(str(r["screen"]))))


def confusable(verdict: Verdict) -> list[dict[str, Any]]:
    """Return the pairs of effects whose projected sensitivities are nearly parallel in these data."""
    seen = [s for s in verdict.screened if len(s.direction)]
    matrix = cosines(seen)
    return [
        {"pair": sorted([seen[a].name, seen[b].name]), "cosine": float(matrix[a, b])}
        for a in range(len(seen))
        for b in range(a)
        if abs(matrix[a, b]) > ALIKE
    ]


def cosine_table(verdict: Verdict) -> dict[str, Any]:
    """Return the cosines between the projected sensitivities of all effects the data can show, and which are alike."""
    seen = sorted((s for s in verdict.screened if len(s.direction)), key=lambda s: s.name)
    return {"names": [s.name for s in seen], "matrix": cosines(seen).tolist(), "alike": ALIKE}
