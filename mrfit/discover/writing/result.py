"""A decision as discovery.json has it. Nothing is decided, fitted or measured here."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrfit.discover.evidence.bench import Stretch
from mrfit.discover.policy import Policy
from mrfit.discover.selection.exact_base import Selection
from mrfit.discover.selection.questions import EffectScreening
from mrfit.discover.writing.findings import Findings
from mrfit.discover.writing.regions import Region, in_words
from mrfit.discover.writing.residual_shape import shape_in_words
from mrfit.io.schemas.discovery import (
    Candidate,
    Cosines,
    DiscoveryDependence,
    DiscoveryFile,
    FoundEffect,
    Gap,
    Pair,
    SegmentFloor,
    Unexplained,
    Where,
)


@dataclass(frozen=True)
class DiscoveryRequest:
    """Question of a discovery: base model, seed and data.

    Attributes
    ----------
    model
        Written name of the base model.
    seed
        Of every random choice.
    data_sha256
        Of what the segments hold.
    key
        Of all that the result depends on.
    dependence
        How the base's parameters depend on current, as written; None if they do not.
    choice
        How that was chosen, None where it was not.
    """

    model: str
    seed: int
    data_sha256: str
    key: str
    dependence: DiscoveryDependence | None = None
    choice: dict[str, Any] | None = None


def insufficient(asked: DiscoveryRequest, lacking: str) -> DiscoveryFile:
    """Return the discovery of data that are too few."""
    return DiscoveryFile(
        base_model=asked.model,
        verdict="insufficient-data",
        effects=(),
        ambiguous_set=(),
        advice=(lacking,),
        where=(),
        gap=Gap(noise_floor=None, before=None, after=None, closed=None),
        candidates=(),
        unexplained=Unexplained(share_of_gap=None, where=()),
        augmented_model=asked.model,
        seed=asked.seed,
        data_sha256=asked.data_sha256,
        key=asked.key,
    )


def account(asked: DiscoveryRequest, chosen: Selection, found: Findings, policy: Policy) -> DiscoveryFile:
    """Return everything discovery.json says of a decision.

    Parameters
    ----------
    asked
        Base model and data.
    chosen
        What was decided.
    found
        What is said of it.
    policy
        How much of it is told.
    """
    pairs = confusable(chosen.screening, policy)
    told = found.tells_of_the_rest(policy)
    return DiscoveryFile(
        base_model=asked.model,
        verdict=chosen.verdict,
        effects=tuple(_with_aliases(named, pairs) for named in found.named),
        ambiguous_set=chosen.ambiguous_set,
        suspects=found.suspects,
        advice=found.advice,
        where=_regions(found.where, policy),
        where_text=tuple(in_words(found.where, policy)),
        beyond_training=found.beyond,
        gap=found.gap,
        drift=found.drifts,
        candidates=candidates(chosen),
        confusable=pairs,
        cosines=cosine_table(chosen.screening, policy),
        unexplained=Unexplained(
            share_of_gap=found.share_left,
            predictable=chosen.structure,
            where=_regions(found.rest, policy) if told else (),
            text=tuple(in_words(found.rest, policy)) if told else (),
            looks=found.looks,
            looks_text=shape_in_words(found.looks, policy),
        ),
        augmented_model="+".join([asked.model, *chosen.final.effects]),
        segments=tuple(_segment(s, found.span) for s in found.stretches),
        seed=asked.seed,
        data_sha256=asked.data_sha256,
        current_dependence=asked.dependence,
        current_choice=asked.choice,
        key=asked.key,
    )


def _segment(stretch: Stretch, span: float) -> SegmentFloor:
    """Return a segment with its noise floor as a share of the output's range."""
    noise, segment = stretch.noise, stretch.segment
    low, high = (1.0 / span * end if np.isfinite(end) else None for end in (noise.low, noise.high))
    return SegmentFloor(
        id=segment.id,
        condition=segment.condition,
        role=segment.role,
        noise_floor=stretch.floor / span if noise.known else None,
        noise_floor_method=noise.method,
        noise_floor_bounds=(low, high),
    )


def _regions(regions: Sequence[Region], policy: Policy) -> tuple[Where, ...]:
    return tuple(
        Where(region=r.name, share_of_error=r.share_of_error, share_of_samples=r.share_of_samples)
        for r in regions[: policy.most_regions]
    )


def _with_aliases(named: FoundEffect, pairs: Sequence[Pair]) -> FoundEffect:
    """Return an accepted effect with its aliases, which are taken from the confusable ``pairs``."""
    alike = {e for row in pairs if named.name in row.pair for e in row.pair}
    return named.model_copy(update={"aliases": tuple(sorted(alike - {named.name}))})


def candidates(chosen: Selection) -> tuple[Candidate, ...]:
    """Return every effect of the library with its screening, its gain and what became of it."""
    screened = {c.name: c for c in chosen.screening.candidates}
    rows = [
        Candidate(
            name=name,
            screen=screened[name].gain if name in screened else 0.0,
            strength=screened[name].strength if name in screened else 0.0,
            holdout_gain=chosen.gains.get(name),
            accepted=name in chosen.final.effects,
            reason=reason,
        )
        for name, reason in chosen.reasons.items()
    ]
    return tuple(sorted(rows, key=lambda r: (not r.accepted, -r.screen)))


def confusable(screening: EffectScreening, policy: Policy) -> tuple[Pair, ...]:
    """Return the pairs of effects whose projected sensitivities are nearly parallel in these data."""
    names = screening.shown
    return tuple(
        Pair(pair=(min(names[a], names[b]), max(names[a], names[b])), cosine=screening.cosines[a][b])
        for a in range(len(names))
        for b in range(a)
        if abs(screening.cosines[a][b]) > policy.alike
    )


def cosine_table(screening: EffectScreening, policy: Policy) -> Cosines:
    """Return the cosines between the projected sensitivities of all effects the data can show, and which are alike."""
    order = sorted(range(len(screening.shown)), key=lambda k: screening.shown[k])
    return Cosines(
        names=tuple(screening.shown[k] for k in order),
        matrix=tuple(tuple(screening.cosines[a][b] for b in order) for a in order),
        alike=policy.alike,
    )


def model_toml(found: DiscoveryFile) -> str:
    """Return the augmented model as a pipeline file has it; what was found whatever the law is stays held."""
    held = ", ".join(f'"{name}" = {value!r}' for name, value in found.held)
    fixed = f"fixed = {{ {held} }}\n" if held else ""
    driven = "".join(f'{name} = "{value}"\n' for name, value in found.driven.items())
    return f'[[fit]]\nmodel = "{found.augmented_model}"\nper = "all"\n{driven}{fixed}'
