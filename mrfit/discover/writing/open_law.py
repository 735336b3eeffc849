"""A decision beside a law that may be off, as discovery.json has it. Nothing is decided, fitted or measured here."""

from collections.abc import Mapping

from mrfit.core.channels import CONTROL, MOTION, unit_of
from mrfit.discover.invariance.findings import LawFindings, significance
from mrfit.discover.policy import Policy
from mrfit.discover.selection.combine import CombinedResult, Shadow
from mrfit.io.schemas.discovery import (
    Candidate,
    DiscoveryFile,
    Examination,
    FoundEffect,
    Gap,
    InvariantEffect,
    LawGap,
    LawPlace,
    OtherBase,
    OtherLaw,
    Suspect,
    Way,
    Ways,
)


def with_examination(
    exact: DiscoveryFile,
    combined: CombinedResult,
    examined: LawFindings,
    output: str,
    policy: Policy,
) -> DiscoveryFile:
    """Return a discovery of a base taken as exact with what was found whatever the law is.

    Parameters
    ----------
    exact
        What the base taken as exact tells.
    combined
        The result of both ways.
    examined
        The examination.
    output
        Channel that the base predicts.
    policy
        How much is told.
    """
    told: dict[str, object] = {
        "law_gap": None if examined.not_applicable else law_gap(exact, examined, policy),
        "confounded": examined.confounded,
        "invariance": examination(combined, examined, output),
        "ways": ways(exact, combined, examined),
        "verdict": combined.verdict,
    }
    if not combined.law_is_open:
        return (_taken_back(exact) if combined.taken_back else exact).model_copy(update=told)
    named = tuple(n for n in combined.standing if n.name in combined.named)
    suspected = [n for n in combined.standing if n.name not in combined.named]
    told |= {
        "effects": tuple(_found(n) for n in named),
        "ambiguous_set": combined.ambiguous_set,
        "suspects": (),
        "advice": tuple(_tests(examined, combined)),
        "candidates": _candidates(exact.candidates, combined),
        "augmented_model": "+".join([exact.base_model, *(n.name for n in (*named, *suspected))]),
        "held": tuple((f"{n.name}.{p.name}", p.value) for n in (*named, *suspected) for p in n.parameters),
    }
    return exact.model_copy(update=told)


def _taken_back(exact: DiscoveryFile) -> DiscoveryFile:
    """Return a discovery where nothing confirms what the base taken as exact names."""
    gap, known = exact.gap, exact.gap.noise_floor is not None
    back = tuple(
        Suspect(name=e.name, parameters=e.parameters, holdout_nrmse_after=e.holdout_nrmse_after, closed=gap.closed)
        for e in exact.effects
    )
    reason = "beside a law that is off it has no proof"
    rest = {"share_of_gap": 1.0 if known else None, "where": exact.where, "text": exact.where_text}
    changes = {
        "effects": (),
        "ambiguous_set": (),
        "suspects": (*back, *exact.suspects),
        "augmented_model": exact.base_model,
        "gap": gap.model_copy(update={"after": gap.before, "closed": 0.0 if known else None}),
        "candidates": tuple(
            c.model_copy(update={"accepted": False, "reason": reason}) if c.accepted else c for c in exact.candidates
        ),
        "unexplained": exact.unexplained.model_copy(update=rest),
    }
    return exact.model_copy(update=changes)


def with_gap(found: DiscoveryFile, gap: Gap, without: Mapping[str, float | None]) -> DiscoveryFile:
    """Return a discovery whose augmented model leaves another gap than that of the base taken as exact.

    ``without`` is the error on held-out conditions (NRMSE) without each effect that is named, the others held.
    """
    effects = tuple(
        e.model_copy(update={"holdout_nrmse_before": without[e.name], "holdout_nrmse_after": gap.after})
        for e in found.effects
    )
    rest = found.law_gap.rest if found.law_gap else None
    unexplained = found.unexplained.model_copy(
        update={"share_of_gap": rest, "where": (), "text": (), "looks": (), "looks_text": ""}
    )
    return found.model_copy(update={"gap": gap, "effects": effects, "unexplained": unexplained})


def with_laws(found: DiscoveryFile, laws: tuple[OtherLaw, ...], left_out: tuple[str, ...] = ()) -> DiscoveryFile:
    """Return a discovery that tells of other laws, and of those that were not fitted."""
    told: dict[str, object] = {"other_laws": laws}
    if left_out:
        told["left_out"] = (*found.left_out, f"fits of other laws that are slow to simulate ({', '.join(left_out)})")
    return found.model_copy(update=told)


def with_another_base(found: DiscoveryFile, again: DiscoveryFile) -> DiscoveryFile:
    """Return a discovery with what another base lacks that was taken as exact."""
    other = OtherBase(
        model=again.base_model,
        verdict=again.verdict,
        effects=again.effects,
        ambiguous_set=again.ambiguous_set,
        gap=again.gap,
    )
    return found.model_copy(update={"other_base": other})


def _found(effect: InvariantEffect) -> FoundEffect:
    return FoundEffect(
        name=effect.name,
        parameters=effect.parameters,
        aliases=(),
        holdout_nrmse_before=None,
        holdout_nrmse_after=None,
    )


def _tests(examined: LawFindings, combined: CombinedResult) -> list[str]:
    """Return the tests that tell the effects of a set apart."""
    if not combined.ambiguous:
        return []
    names = dict.fromkeys(n for group in combined.ambiguous for n in group)
    tests = {c.name: c.test for c in examined.confounded}
    return [f"{n}: {tests[n]}" for n in names if tests.get(n)]


def _candidates(rows: tuple[Candidate, ...], combined: CombinedResult) -> tuple[Candidate, ...]:
    """Return the fate of every effect, where some are named beside an open law."""
    shadows = {s.name: s.reason for s in combined.shadows}
    standing = {n.name: n for n in combined.standing}
    changed = []
    for row in rows:
        told: dict[str, object] = {"accepted": row.name in standing}
        if row.name in standing:
            own = significance(standing[row.name])
            told["reason"] = f"it takes {own.share:.0%} of what no law makes, {own.z:.0f} standard errors from neutral"
        elif row.name in shadows:
            told["reason"] = shadows[row.name]
        changed.append(row.model_copy(update=told))
    return tuple(sorted(changed, key=lambda r: not r.accepted))


def law_gap(exact: DiscoveryFile, examined: LawFindings, policy: Policy) -> LawGap | None:
    """Return the error of the base's law, and the shares of its gap that the law, effects and neither of them take."""
    found, errors = examined.law_gap, examined.errors
    if found is None or errors.base is None:
        return None
    noise = errors.noise**2
    whole = max(errors.base**2 - noise, 1e-300)
    taken = max(errors.law**2 - errors.after**2, 0.0)
    return LawGap(
        error=found.error,
        share=found.share,
        effects=min(taken / whole, 1.0),
        rest=min(max(errors.after**2 - noise, 0.0) / whole, 1.0),
        left=errors.law,
        taken=min(taken / max(errors.law**2 - noise, 1e-300), 1.0),
        where=found.where,
        text=tuple(_where(found.where, policy)),
        looks=exact.unexplained.looks_text,
    )


def _where(places: tuple[LawPlace, ...], policy: Policy) -> list[str]:
    """Return the places of a law's error in words: of each kind the bin that holds most beyond its samples."""
    said = []
    for over in dict.fromkeys(p.over for p in places):
        most = max((p for p in places if p.over == over), key=lambda p: p.share_of_error - p.share_of_samples)
        if most.share_of_error - most.share_of_samples > policy.region_told:
            shares = (
                f"{100.0 * most.share_of_error:.0f} % of it in {100.0 * most.share_of_samples:.0f} % of the samples"
            )
            said.append(f"{_bin(most)} ({shares})")
    return said


def _bin(p: LawPlace) -> str:
    factor, unit = (1e3, f"m{p.unit}") if p.unit in ("m", "m/s") else (1.0, p.unit)
    low, high = (f"{float(f'{factor * end:.2g}'):g}" for end in (p.low, p.high))
    high = f"{high} {unit}"
    if p.over == "travel":
        return f"within {high} of a reversal" if p.low == 0.0 else f"{low} to {high} after a reversal"
    what = CONTROL if p.over == "control" else p.over
    return f"with a {what} below {high}" if p.low == 0.0 else f"with a {what} of {low} to {high}"


def examination(combined: CombinedResult, examined: LawFindings, output: str) -> Examination:
    """Return the entry of an examination."""
    if examined.not_applicable:
        return Examination(not_applicable=examined.not_applicable)
    shadows = {s.name: s for s in combined.shadows}
    errors = examined.errors
    return Examination(
        named=tuple(n for n in examined.named if n.name not in shadows),
        turned_down=(
            *(_shadow(n, shadows[n.name]) for n in examined.named if n.name in shadows),
            *examined.turned_down,
        ),
        broken=examined.broken,
        travel=examined.travel,
        travel_unit=unit_of(MOTION[output][0]),
        time=examined.time,
        base=errors.base,
        law=errors.law,
        after=errors.after,
        noise=errors.noise,
    )


def _shadow(n: InvariantEffect, shadow: Shadow) -> InvariantEffect:
    return InvariantEffect(name=n.name, breaks=n.breaks, standing=n.standing, reason=shadow.reason)


def ways(exact: DiscoveryFile, combined: CombinedResult, examined: LawFindings) -> Ways:
    """Return the results of both ways, and whether they agree."""
    own = Way(verdict=exact.verdict, effects=tuple(e.name for e in exact.effects), ambiguous_set=exact.ambiguous_set)
    sets = combined.ambiguous_set if combined.law_is_open else ()
    names = tuple(n.name for n in combined.standing if n.name not in sets)
    word = "ambiguous" if sets else "named" if names else "unexplained"
    if examined.not_applicable:
        word = "insufficient-data"
    other = Way(verdict=word, effects=names, ambiguous_set=sets)
    return Ways(exact_base=own, invariances=other, agree=not combined.difference, difference=combined.difference)
