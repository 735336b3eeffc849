"""Sentences of a discovery beside a law that may be off: effects whatever the law is, the law, other laws."""

from collections.abc import Sequence

from mrfit.core import registry
from mrfit.io.schemas.discovery import DiscoveryFile, EffectParameter, InvariantEffect, OtherLaw
from mrfit.report.curves import prefixed
from mrfit.report.determined import measured
from mrfit.report.numbers import percent

# What a law has to keep for a name, by the tier of the effect
TIER_WORDS = {
    "any-law": "whatever the law is",
    "short-memory": "whatever the law is, as long as it forgets within {travel} of travel",
    "causal": "whatever the law is, as long as it is made by the motion so far",
    "current-at-once": "whatever the law is, as long as it follows the current at once",
}
# What something without a name depends on, by the invariance that it breaks
BROKEN = {
    "oddness": "is not reversed with the motion",
    "position": "depends on the place in the stroke",
    "time": "changes with time",
    "temperature": "changes with temperature",
    "current-at-once": "does not follow the current at once",
    "memory": "is not made by the motion so far",
}
# Share of the gap that is the law's from which the law is spoken of where nothing is named
LAW_TOLD = 0.2
# … and from which the law alone is the reason
LAW_ALONE = 0.9
# Multiples of the noise floor above which what no law makes is more than noise
LEFT_BESIDES = 2.0
# Names that are listed of what the law may have
ANY_LAW = "any law may have it"


def law_sentences(found: DiscoveryFile) -> list[str]:
    """Return sentences on effects that hold whatever the law is, and on the law."""
    if found.verdict == "none":
        return []
    said = [_effect(found, e) for e in found.invariance.named] if found.invariance else []
    # a law that was taken as exact, and takes the gap with what was named, is not spoken of
    exact = found.effects and not found.held
    said += _broken(found) if exact else [*_law(found), *_broken(found)]
    if said and not exact and (names := [c.name for c in found.confounded if ANY_LAW in c.reason]):
        said.append(f"{_first_up(listed(names))} cannot be told from the law here.")
    if found.ways and found.ways.difference and not found.suspects:
        said.append(f"{_first_up(found.ways.difference)}.")
    return said


def nearer_law(found: DiscoveryFile) -> OtherLaw | None:
    """Return the other law to go on from: where nothing is named with certainty, that which takes most of the gap."""
    return found.other_laws[0] if found.other_laws and found.verdict in ("unexplained", "ambiguous") else None


def other_law_sentences(found: DiscoveryFile) -> list[str]:
    """Return sentences on other bases: their share of the gap, and the command that goes on from each."""
    said = []
    for law in found.other_laws:
        beside = (
            ""
            if law.takes_beside is None
            else f", {100.0 * law.takes_beside:.0f} % with the effects held at their values"
        )
        near = f" and leaves {law.floors:.2g} times the noise" if law.near_the_floor and law.floors else ""
        taken = f"{law.model} takes {100.0 * law.takes:.0f} % of the gap on held-out conditions{beside}{near}"
        said.append(f"{taken}: {law.command}")
    return [*said, *other_base_sentences(found)]


def other_base_sentences(found: DiscoveryFile) -> list[str]:
    """Return sentences on effects that another base lacks, which was taken as exact; nothing where none was."""
    other = found.other_base
    if other is None:
        return []
    gap = f"the error on held-out conditions is {percent(other.gap.after)} of the range"
    if other.effects or other.ambiguous_set:
        names = [e.name for e in other.effects] + [listed(other.ambiguous_set, "or")] * bool(other.ambiguous_set)
        return [f"With {other.model} taken as exact, {listed(names)} is missing, and {gap} with it"]
    what = {"none": "nothing is missing"}.get(other.verdict, f"the verdict is {other.verdict.replace('-', ' ')}")
    return [f"With {other.model} taken as exact, {what}, and {gap}"]


def _effect(found: DiscoveryFile, effect: InvariantEffect) -> str:
    title = registry.load("effect", effect.name).SPEC.title
    words = f"{title} ({effect.name})"
    if effect.one_of:
        words += f", or {listed(effect.one_of, 'or')}, which these data cannot tell from it without a law"
    values = [_value(p) for p in effect.parameters if p.low is not None and p.high is not None][:2]
    if effect.force is not None:
        values.append(f"at most {measured(effect.force)}")
    examined = found.invariance
    assert examined is not None  # it names the effect
    factor, unit = prefixed(examined.travel, examined.travel_unit)
    travel = f"{factor * examined.travel:.2g} {unit}"
    condition = TIER_WORDS.get(effect.tier, "whatever the law is").format(travel=travel)
    return f"{words}, {', '.join(values)}: {condition}."


def _value(p: EffectParameter) -> str:
    return f"{p.name} = {measured(p)}"


def _law(found: DiscoveryFile) -> list[str]:
    gap = found.law_gap
    if gap is None or (gap.share < LAW_TOLD and not found.held):
        return []
    place = f", most of all {listed(gap.text)}" if gap.text else ""
    said = [
        f"{found.base_model} itself errs by {percent(gap.error)} of the range, {100.0 * gap.share:.0f} % of its gap"
        f"{place}."
    ]
    names = [e.name for e in found.invariance.named] if found.invariance else []
    if names:
        take = "takes" if len(names) == 1 else "take"
        said.append(
            f"No law of this kind makes the rest ({percent(gap.left)} of the range), of which {listed(names)} {take} "
            f"{100.0 * gap.taken:.0f} %."
        )
    else:
        more = ": something else is missing, too" if left_besides(found) else ""
        said.append(f"What no law of this kind makes is {percent(gap.left)} of the range{more}.")
    return said


def left_besides(found: DiscoveryFile) -> bool:
    """Return whether clearly more than noise is left that no law makes."""
    gap, floor = found.law_gap, found.gap.noise_floor
    return gap is not None and floor is not None and gap.left > LEFT_BESIDES * floor


def _broken(found: DiscoveryFile) -> list[str]:
    rows = found.invariance.broken if found.invariance else ()
    left = "of what the effects named leave" if found.invariance and found.invariance.named else "of what no law makes"
    return [
        f"Something {broken_words(row.invariance)}, which no effect of the library describes: {100.0 * row.kept:.0f} % "
        f"{left} on conditions left out, at most {percent(row.size)} of the range."
        for row in rows
    ]


def broken_words(invariance: str) -> str:
    """Return the words for a broken invariance."""
    return BROKEN.get(invariance, f"breaks {invariance}")


def listed(names: Sequence[str], joint: str = "and") -> str:
    """Return names as a list in words."""
    return "".join(names) if len(names) < 2 else f"{', '.join(names[:-1])} {joint} {names[-1]}"


def _first_up(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"
