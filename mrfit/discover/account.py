"""A decision as discovery.json has it. Nothing is decided, fitted or measured here."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from mrfit.discover import looks
from mrfit.discover.evidence import Screening
from mrfit.discover.findings import Findings, Interval, Named, Suspect
from mrfit.discover.policy import Policy
from mrfit.discover.regions import Region, in_words
from mrfit.discover.select import Selection


def account(base: str, chosen: Selection, found: Findings, policy: Policy) -> dict[str, Any]:
    """Return everything discovery.json says of a decision.

    Parameters
    ----------
    base
        Written name of the base model.
    chosen
        What was decided.
    found
        What is said of it.
    policy
        How much of it is told.
    """
    pairs = confusable(chosen.screening, policy)
    told = found.tells_of_the_rest(policy)
    return {
        "verdict": chosen.verdict,
        "effects": [_effect_row(named, pairs) for named in found.named],
        "ambiguous_set": sorted({e for group in chosen.ambiguous for e in group}),
        "suspects": [_suspect_row(s) for s in found.suspects],
        "advice": list(found.advice),
        "where": _region_rows(found.where, policy),
        "where_text": in_words(found.where, policy),
        "beyond_training": list(found.beyond),
        "gap": asdict(found.gap),
        "drift": [*map(asdict, found.drifts), *map(asdict, found.followed)],
        "candidates": candidate_rows(chosen),
        "confusable": pairs,
        "cosines": cosine_table(chosen.screening, policy),
        "unexplained": {
            "share_of_gap": found.share_left,
            "predictable": chosen.structure,
            "where": _region_rows(found.rest, policy) if told else [],
            "text": in_words(found.rest, policy) if told else [],
            "looks": list(found.looks),
            "looks_text": looks.in_words(found.looks, policy),
        },
        "augmented_model": "+".join([base, *chosen.final.effects]),
        "segments": [
            {
                "id": s.segment.id,
                "condition": s.segment.condition,
                "role": s.segment.role,
                **s.noise.as_json(1.0 / found.span),
                "noise_floor": s.floor / found.span if s.noise.known else None,
            }
            for s in found.stretches
        ],
    }


def _region_rows(regions: Sequence[Region], policy: Policy) -> list[dict[str, Any]]:
    return [
        {"region": r.name, "share_of_error": r.share_of_error, "share_of_samples": r.share_of_samples}
        for r in regions[: policy.most_regions]
    ]


def _effect_row(named: Named, pairs: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return an accepted effect; its aliases are taken from the confusable ``pairs``."""
    alike = {e for row in pairs if named.name in row["pair"] for e in row["pair"]}
    return {
        "name": named.name,
        "parameters": _parameter_rows(named.parameters),
        "aliases": sorted(alike - {named.name}),
        "holdout_nrmse_before": named.gap.before,
        "holdout_nrmse_after": named.gap.after,
    }


def _suspect_row(suspect: Suspect) -> dict[str, Any]:
    row = {
        "name": suspect.name,
        "parameters": _parameter_rows(suspect.parameters),
        "holdout_nrmse_after": suspect.gap.after,
        "closed": suspect.gap.closed,
    }
    return {**row, "instead_of": suspect.instead_of} if suspect.instead_of else row


def _parameter_rows(parameters: Sequence[Interval]) -> list[dict[str, Any]]:
    return [asdict(p) for p in parameters]


def candidate_rows(chosen: Selection) -> list[dict[str, Any]]:
    """Return every effect of the library with its screening, its gain and what became of it."""
    screened = {c.name: c for c in chosen.screening.candidates}
    rows = [
        {
            "name": name,
            "screen": screened[name].gain if name in screened else 0.0,
            "strength": screened[name].strength if name in screened else 0.0,
            "holdout_gain": chosen.gains.get(name),
            "accepted": name in chosen.final.effects,
            "reason": reason,
        }
        for name, reason in chosen.reasons.items()
    ]
    return sorted(rows, key=lambda r: (not r["accepted"], -float(str(r["screen"]))))


def confusable(screening: Screening, policy: Policy) -> list[dict[str, Any]]:
    """Return the pairs of effects whose projected sensitivities are nearly parallel in these data."""
    names = screening.shown
    return [
        {"pair": sorted([names[a], names[b]]), "cosine": screening.cosines[a][b]}
        for a in range(len(names))
        for b in range(a)
        if abs(screening.cosines[a][b]) > policy.alike
    ]


def cosine_table(screening: Screening, policy: Policy) -> dict[str, Any]:
    """Return the cosines between the projected sensitivities of all effects the data can show, and which are alike."""
    order = sorted(range(len(screening.shown)), key=lambda k: screening.shown[k])
    return {
        "names": [screening.shown[k] for k in order],
        "matrix": [[screening.cosines[a][b] for b in order] for a in order],
        "alike": policy.alike,
    }
