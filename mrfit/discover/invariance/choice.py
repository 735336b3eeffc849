"""Which effects no law makes: added one by one, or two where none alone is there, each then judged beside the others.

What stands has to stand as well where a law may remember for longer than assumed, since the horizon of memory is a
guess, and beside something without a name: where cavitation bends one direction of motion, an end stop far from the
middle takes a quarter of what no law makes, though forces that are not odd take nearly all of it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import t as student

from mrfit.core.specs import Invariance
from mrfit.discover.invariance.findings import BrokenInvariance, Parameter
from mrfit.discover.invariance.selection import (
    FULL,
    EffectDescription,
    LawCandidate,
    LawScreening,
    LawSource,
    RefinedEffect,
    State,
    both,
    decide,
    lost,
    screened_out,
    stands_further,
    stands_weighed,
    weakest,
    worth_a_swap,
    worth_pairing,
    worth_refining,
    worth_weighing,
)
from mrfit.discover.policy import STANDARD, Policy


@dataclass(frozen=True)
class LawSelection:
    """Effects that are there, with what was said of all that were refined, and of all by the last screening."""

    state: State = field(default_factory=dict)
    found: tuple[EffectDescription, ...] = ()
    rivals: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    reasons: Mapping[str, str] = field(default_factory=dict)
    rows: Mapping[str, RefinedEffect] = field(default_factory=dict)
    screened: Mapping[str, LawCandidate] = field(default_factory=dict)

    def without(self, name: str, reason: str) -> "LawSelection":
        """Return the same with an effect taken out."""
        return replace(
            self,
            state=_without(self.state, name),
            found=tuple(d for d in self.found if d.row.name != name),
            reasons={**self.reasons, name: reason},
        )


def _without(state: State, name: str) -> State:
    return {n: t for n, t in state.items() if n != name}


def choose(source: LawSource, policy: Policy) -> tuple[LawSelection, tuple[BrokenInvariance, ...]]:
    """Return the effects that are there, and the invariances that something without a name breaks beside them."""
    return beside_unnamed(source, beside_longer_memory(source, chosen_effects(source, policy), policy), policy)


def chosen_effects(source: LawSource, policy: Policy) -> LawSelection:
    """Add effects one by one, or two at once where none alone is there, then judge all again."""
    chosen = LawSelection()
    while len(chosen.state) < policy.most_named:
        screening = source.screen(chosen.state, chosen.state)
        chosen = replace(chosen, screened={**chosen.screened, **{c.name: c for c in screening.candidates}})
        further = chosen
        for add in (add_effect, add_effect_by_own_weights, add_pair):
            further = add(source, further, screening, policy)
            if further.state is not chosen.state:
                break
        else:
            return reassessed(source, further, policy)
        chosen = further
    return reassessed(source, chosen, policy)


def add_effect(source: LawSource, chosen: LawSelection, screening: LawScreening, policy: Policy) -> LawSelection:
    """Return what stands with the effect that leaves least, the same state where none has proof."""
    good, rest = worth_refining(screening.candidates, policy)
    state = chosen.state
    fits = {
        c.name: source.refit({**state, c.name: c.theta}, state, (c.name,), source.library[c.name].level) for c in good
    }
    tried = [fit.described[0].row for fit in fits.values()]
    outcome = decide(tried, policy)
    reasons = {c.name: screened_out(c, policy) for c in rest} | {**chosen.reasons, **dict(outcome.reasons)}
    chosen = replace(chosen, reasons=reasons, rows={**chosen.rows, **{r.name: r for r in tried}})
    if not outcome.winner:
        return chosen
    rivals = {**chosen.rivals, outcome.winner: outcome.rivals}
    return replace(chosen, state=fits[outcome.winner].state, rivals=rivals)


def add_effect_by_own_weights(
    source: LawSource, chosen: LawSelection, screening: LawScreening, policy: Policy
) -> LawSelection:
    """Return what stands with the effect that takes most by weights of its own, the same state where it has no proof.

    By the residual of the law alone, the conditions weigh least in which the effect is largest.
    """
    starts = {c.name: c.theta for c in screening.candidates}
    rows = [r for n in starts if (r := chosen.rows.get(n)) and n not in chosen.state and worth_weighing(r, policy)]
    if not rows:
        return chosen
    name = max(rows, key=lambda r: r.standing.share).name
    state: State = {**chosen.state, name: starts[name]}
    for _ in range(policy.most_weighings):
        fit = source.refit(state, state, (name,), source.library[name].level)
        state, row = fit.state, fit.described[0].row
        if stands_weighed(row, policy):
            return replace(chosen, state=state, rows={**chosen.rows, name: row})
    return chosen


def add_pair(source: LawSource, chosen: LawSelection, screening: LawScreening, policy: Policy) -> LawSelection:
    """Return what stands with two effects at once, the same state where no two have proof."""
    for pair in worth_pairing(screening, policy):
        start = {**chosen.state, **dict(zip(pair.names, pair.thetas, strict=True))}
        if len(start) > policy.most_named:
            continue
        fit = source.refit(start, chosen.state, pair.names, min(source.library[n].level for n in pair.names))
        if both([d.row for d in fit.described], policy):
            return replace(chosen, state=fit.state)
    return chosen


def reassessed(source: LawSource, chosen: LawSelection, policy: Policy) -> LawSelection:
    """Return what stands when every effect is judged beside all others, the weakest without proof taken out in turn."""
    if any(source.library[n].invariance is Invariance.POSITION for n in chosen.state):
        for name in [n for n in chosen.state if source.library[n].constant]:
            chosen = chosen.without(name, "the origin of a force of the place may be anywhere")
    rivals, swaps = dict(chosen.rivals), 0
    while chosen.state:
        weighed = chosen.state
        fit = source.refit(weighed, weighed, tuple(weighed), FULL)
        rows = [d.row for d in fit.described]
        chosen = replace(
            chosen, state=fit.state, found=fit.described, rows={**chosen.rows, **{r.name: r for r in rows}}
        )
        name, why = weakest(rows, policy)
        if name:
            chosen = chosen.without(name, f"beside the others {why}")
            continue
        swap = _swapped(source, weighed, fit.state, rows, policy)
        rivals = swap.rivals
        if not swap.state or swaps == policy.most_swaps:
            break
        chosen, swaps = (
            replace(chosen.without(swap.out, "another leaves less in its place"), state=swap.state),
            swaps + 1,
        )
    found = chosen.found if chosen.state else ()
    rivals = {n: tuple(r for r in rivals.get(n, ()) if r not in chosen.state) for n in chosen.state}
    return replace(chosen, found=found, rivals=rivals)


@dataclass(frozen=True)
class EffectSwap:
    """A state with one effect instead of another, ``out``, none if all stand; and the rivals of each."""

    state: State
    out: str
    rivals: dict[str, tuple[str, ...]]


def _swapped(
    source: LawSource, weighed: State, state: State, rows: Sequence[RefinedEffect], policy: Policy
) -> EffectSwap:
    """Try other effects instead of each, beside all the others."""
    rivals: dict[str, tuple[str, ...]] = {}
    for row in rows:
        rest = _without(state, row.name)
        others = worth_a_swap(source.screen(rest, weighed).candidates, row, policy)
        fits = {c.name: source.refit({**rest, c.name: c.theta}, weighed, (c.name,), FULL) for c in others}
        outcome = decide([row, *(fit.described[0].row for fit in fits.values())], policy)
        rivals[row.name] = outcome.rivals
        if outcome.winner != row.name:
            return EffectSwap(fits[outcome.winner].state, row.name, rivals)
    return EffectSwap({}, "", rivals)


def beside_longer_memory(source: LawSource, chosen: LawSelection, policy: Policy) -> LawSelection:
    """Return what stands where a law may remember for longer as well."""
    first, sizes = chosen, {d.row.name: d.row.standing.size for d in chosen.found}
    again: dict[str, EffectDescription] = {}
    while chosen.state:
        names = tuple(chosen.state)
        fit = source.refit(chosen.state, chosen.state, names, FULL, True)
        again = dict(zip(names, fit.described, strict=True))
        name, why = lost([d.row for d in fit.described], sizes, policy)
        if not name or _no_rival(source, first.state, again[name], sizes[name], policy):
            break
        chosen = chosen.without(name, f"a law that remembers for longer may have it: {why}")
    return replace(chosen, found=tuple(_widened(d, again[d.row.name], source.groups) for d in chosen.found))


def _no_rival(source: LawSource, state: State, again: EffectDescription, size: float, policy: Policy) -> bool:
    """Return whether a law of longer memory leaves more than the shorter with an effect, whose force it hardly bends.

    It has far more numbers than the effect: one that leaves more is not what makes the effect's force.
    """
    longer = source.left(_without(state, again.row.name), True)
    return longer > policy.no_rival * source.left(state) and stands_further(again.row, size, policy)


def _widened(found: EffectDescription, again: EffectDescription, groups: int) -> EffectDescription:
    """Return an effect with intervals that know how much its numbers differ beside a law of longer memory."""
    quantile = float(student.ppf(STANDARD.quantile, groups - 1))

    def wider(own: Parameter, other: Parameter) -> Parameter:
        if own.low is None or own.high is None:
            return own
        half = float(np.hypot(0.5 * (own.high - own.low), quantile * (other.value - own.value)))
        return replace(own, low=own.value - half, high=own.value + half)

    parameters = tuple(wider(p, q) for p, q in zip(found.parameters, again.parameters, strict=True))
    return replace(found, parameters=parameters, force=wider(found.force, again.force))


def beside_unnamed(
    source: LawSource, chosen: LawSelection, policy: Policy
) -> tuple[LawSelection, tuple[BrokenInvariance, ...]]:
    """Return the effects that stand beside flexible terms of the other invariances that are broken, and these."""
    while True:
        found = source.broken(chosen.state)
        taken = _first_taken(source, chosen, found, policy)
        if not taken:
            return chosen, found
        chosen = chosen.without(*taken)


def _first_taken(
    source: LawSource, chosen: LawSelection, found: Sequence[BrokenInvariance], policy: Policy
) -> tuple[str, str] | None:
    """Return the first effect that something without a name may have instead, and why."""
    for row in found:
        for effect in chosen.found:
            name, share = effect.row.name, effect.row.standing.share
            if source.library[name].invariance is row.invariance or not overshadowed(share, row.share):
                continue
            left, errors = source.beside(chosen.state, name, row.invariance)
            if left < policy.share or errors < policy.law_clear:
                return name, f"something without a name that breaks the {row.invariance.value} may have it"
    return None


def overshadowed(share: float, unnamed: float) -> bool:
    """Return whether something without a name takes more than an effect that takes a share of what no law makes.

    ``unnamed`` is the share that it takes of what is left beside the effect. Terms that are more flexible than any law
    may imitate a true effect as well: they speak against one only where they take more than it.
    """
    return unnamed * (1.0 - share) > share
