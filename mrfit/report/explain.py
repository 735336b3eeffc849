"""A discovery in words, for the terminal and the page: verdict, where the error sits, effects, what would settle it."""

from dataclasses import dataclass

from mrfit.core import registry
from mrfit.core.grouping import grouped
from mrfit.io.schemas.discovery import Candidate, DiscoveryFile, FoundEffect, Suspect
from mrfit.io.schemas.fit import DriftRow
from mrfit.report.curves import prefixed
from mrfit.report.formula_words import formula_sentences
from mrfit.report.law_repair_words import law_repair_sentences
from mrfit.report.law_words import LAW_ALONE, broken_words, law_sentences, left_besides, listed
from mrfit.report.numbers import MISSING_NUMBER, WITHIN_NOISE, in_html, percent, significant, with_interval
from mrfit.signal.drift import drift_words

UNJUDGED = "cannot be judged"
"""How the reason begins of an effect that the data cannot show."""


def headline(found: DiscoveryFile) -> str:
    """Return the verdict in one sentence."""
    base, verdict = found.base_model, found.verdict
    named = listed([effect_words(e.name) for e in found.effects])
    suspects = listed(found.ambiguous_set, "or")
    if verdict == "named":
        return f"{base} lacks {named}" + (", and its law itself is off." if found.held else ".")
    if verdict == "ambiguous":
        known = f"{base} lacks {named}, and something else besides" if named else f"Something is missing from {base}"
        off = f" The law of {base} itself is off." if found.held else ""
        return f"{known}: these data cannot tell whether it is {suspects}.{off}"
    if verdict == "unexplained":
        broken = [broken_words(row.invariance) for row in found.invariance.broken] if found.invariance else []
        if broken and not found.suspects:
            return f"Something is missing from {base} that no effect of the library is: it {listed(broken)}."
        if found.law_gap is not None and found.law_gap.share > LAW_ALONE:
            besides = "something else is missing besides" if left_besides(found) else "no effect has proof beside it"
            return f"The law of {base} is off, and {besides}."
        much = "all of it" if found.suspects else "it"
        return f"Something is missing from {base}, and no effect of the library explains {much}."
    if verdict == "none":
        return f"Nothing that rises above the noise of these data is missing from {base}."
    return f"These data are too few to say whether something is missing from {base}."


def effect_words(name: str) -> str:
    """Return an effect's title with its name in brackets."""
    title = registry.load("effect", name).SPEC.title
    return f"{title[:1].lower()}{title[1:]} ({name})"


def sentences(found: DiscoveryFile, law: bool = True) -> list[str]:
    """Return the explanation: where the error sat, what the gap was and is, and what remains unexplained.

    What is said of the law, of its repair and of a formula comes with it, unless it is said elsewhere.
    """
    beside = [*law_sentences(found), *law_repair_sentences(found), *formula_sentences(found)] if law else []
    rows = [DriftRow(**d.model_dump()) for d in found.drift]
    drift = [_sentence(drift_words(rows))] if rows else []
    if found.verdict == "insufficient-data":
        return [_sentence(text) for text in found.advice] + drift + left_out(found)
    said = list(beside) if found.held else [_sentence(text) for text in found.where_text[:1]]
    said += [_gap(found), *_plain(found)]
    rest = found.unexplained
    if found.effects and not found.held and _left_open(found):
        place = "; ".join(rest.text[:2])
        said.append(f"{percent(rest.share_of_gap)} of the gap stay unexplained" + (f": {place}." if place else "."))
    if rest.looks_text and _left_open(found):
        said.append(_sentence(rest.looks_text))
    if found.verdict == "unexplained":
        said += [_sentence(text) for text in found.beyond_training]
    if found.verdict == "unexplained" and found.suspects:
        said.append(_partial(found))
    if not found.held:
        said += beside
    if found.settings.get("formulas") and found.verdict != "unexplained":
        said.append(f"No formula was looked for: the verdict is {found.verdict}, not unexplained.")
    return said + drift + unjudged(found) + left_out(found)


def takes_of(found: DiscoveryFile, row: Candidate) -> tuple[float | None, str, str]:
    """Return the share that a candidate takes, the same in percent, and how that was found.

    Of the one effect that was taken back it is the share that the verdict names: that of its last refit.
    """
    if row.reason.startswith(UNJUDGED):
        return None, MISSING_NUMBER, "not judged"
    together = [s for s in found.suspects if not s.instead_of and not found.ambiguous_set]
    if [s.name for s in together] == [row.name] and together[0].closed is not None:
        return together[0].closed, closed_share(together[0].closed), "refitted, held-out"
    if row.holdout_gain is None:
        return row.screen, closed_share(row.screen), "screened, training"
    return row.holdout_gain, closed_share(row.holdout_gain), "refitted, held-out"


def unjudged(found: DiscoveryFile) -> list[str]:
    """Return the effects that the data cannot show, with reasons; nothing where named effects explain all."""
    some = [c for c in found.candidates if c.reason.startswith(UNJUDGED)]
    reasons = grouped((c.reason.removeprefix(UNJUDGED).lstrip(": "), c.name) for c in some)
    if found.verdict == "named" or not reasons:
        return []
    return [f"Cannot be judged: {'; '.join(f'{listed(names)} ({why})' for why, names in reasons.items())}."]


def left_out(found: DiscoveryFile) -> list[str]:
    """Return the work that a discovery left out, so as not to take long; nothing where it did all."""
    return [f"Left out, as it takes long: {'; '.join(found.left_out)}."] if found.left_out else []


def _partial(found: DiscoveryFile) -> str:
    """Describe the gap that effects with proof, which leave too much to be named, would take."""
    said: dict[str, str] = {}
    for suspect in found.suspects:
        values = ", ".join(f"{row.name} = {row.value}" for row in parameter_rows(suspect))
        words = f"{effect_words(suspect.name)} with {values}"
        if suspect.instead_of:
            said[suspect.instead_of] += f" (or {words}, which these data cannot tell from it)"
        else:
            said[suspect.name] = words
    closed = found.suspects[0].closed
    share = "part" if closed is None else percent(closed)
    why = "too little to be all that is missing: a cause among others, or an image of another"
    if found.ways is not None and found.ways.exact_base.effects:
        why = f"but only if the law of {found.base_model} were exact: beside a law that is off they have no proof"
    return _sentence(f"{listed(list(said.values()))} would take {share} of the gap, {why}")


def _left_open(found: DiscoveryFile) -> bool:
    gap, share = found.gap, found.unexplained.share_of_gap
    above = gap.noise_floor and gap.after is not None and gap.after > WITHIN_NOISE * gap.noise_floor
    return bool(share is not None and share > 0.02 and above)


def _gap(found: DiscoveryFile) -> str:
    gap = found.gap
    floor = _noise_floor(found)
    if found.held:
        return (
            f"With what was found held and the base fitted again, the error on held-out conditions is "
            f"{percent(gap.after)} of the range, {percent(gap.before)} without; {floor}."
        )
    if gap.before == gap.after:
        ratio = gap.before / gap.noise_floor if gap.before is not None and gap.noise_floor else None
        times = f"{in_html(significant(ratio))} times the noise floor" if ratio else floor
        return f"On held-out conditions the error is {percent(gap.before)} of the range, {times}."
    standing = [e for e in found.augmented_model.split("+") if e in found.ambiguous_set]
    stand_in = f" with {listed(standing)} standing for the set" if standing else ""
    closed = f": {closed_share(gap.closed)} % of the gap is closed" if gap.closed is not None else ""
    return (
        f"On held-out conditions the error falls from {percent(gap.before)} to {percent(gap.after)} of the range"
        f"{stand_in}; {floor}{closed}."
    )


def _noise_floor(found: DiscoveryFile) -> str:
    """Return the noise floor of the held-out conditions; where it was not measured, between what it lies."""
    if found.gap.noise_floor is not None:
        return f"the noise floor is {percent(found.gap.noise_floor)}"
    bounds = [one.noise_floor_bounds for one in found.segments if one.role == "holdout"]
    known = [(low, high) for low, high in bounds if low is not None and high is not None]
    if not known or len(known) < len(bounds):
        return "the noise floor is not known"
    return f"the noise floor lies between about {percent(min(known)[0])} and {percent(max(high for _, high in known))}"


def _plain(found: DiscoveryFile) -> list[str]:
    """Return the plain errors of both models, nothing of a discovery without them."""
    gap = found.gap
    if gap.plain_before is None:
        return []
    changed = found.augmented_model != found.base_model and gap.plain_after is not None
    fits = f"{found.base_model} leaves {percent(gap.plain_before)}"
    fits += f", {found.augmented_model} {percent(gap.plain_after)}" * changed
    return [f"Plain errors, of fits with --per all that weigh every sample alike: held out, {fits}."]


def closed_share(share: float) -> str:
    """Return a share in percent, with more digits close to 100 so that almost all is not called all."""
    return in_html(significant(100.0 * share, 4 if 0.995 <= share < 1.0 else 3))


@dataclass(frozen=True)
class ParameterText:
    """A parameter as text: name, meaning, value with its unit, 95 % interval."""

    name: str
    text: str
    value: str
    interval: str


def parameter_rows(effect: FoundEffect | Suspect) -> list[ParameterText]:
    """Return an effect's parameters as text."""
    meaning = {p.name: p.text for p in registry.load("effect", effect.name).SPEC.params}
    rows = []
    for p in effect.parameters:
        factor, unit = prefixed(abs(p.value), p.unit)
        ends = [None if end is None else factor * end for end in (p.low, p.high)]
        value, low, high = (in_html(t) for t in with_interval(factor * p.value, *ends))
        interval = f"{low} to {high} {unit}".strip() if ends[0] is not None else "not determined"
        rows.append(ParameterText(p.name, meaning.get(p.name, ""), f"{value} {unit}".strip(), interval))
    return rows


def next_step(found: DiscoveryFile) -> str:
    """Return the command that fits the model with what was found, empty where nothing was or it is not certain what."""
    if found.augmented_model == found.base_model or found.verdict == "ambiguous":
        return ""
    orders = found.current_dependence.orders if found.current_dependence else ()
    order = f" --current-order {','.join(f'{name}={order}' for name, order in orders)}" if orders else ""
    held = "".join(f" --fix {name}={value:.6g}" for name, value in found.held)
    driven = "".join(f" --{name.replace('_', '-')} {value}" for name, value in found.driven.items())
    return f"mrfit fit --model {found.augmented_model}{driven}{order}{held} --per all"


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}" + ("" if text.endswith(".") else ".")
