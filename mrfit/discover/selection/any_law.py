"""Effects that no law makes: added one by one, or in twos, each then judged beside the others.

What stands has to stand as well where a law may remember for longer than assumed, since the horizon of memory is a
guess, and beside something without a name: where cavitation bends one direction of motion, an end stop far from the
middle takes a quarter of what no law makes, though forces that are not odd take nearly all of it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import stdtrit

from mrfit.core.specs import Invariance
from mrfit.discover.policy import STANDARD, Policy
from mrfit.discover.selection.law_rules import (
    FULL,
    EffectDescription,
    LawCandidate,
    LawFit,
    LawScreening,
    LawSource,
    RefinedEffect,
    State,
    best_of,
    both,
    lost,
    screened_out,
    stands_further,
    stands_weighed,
    swap_candidates,
    weakest,
    worth_pairing,
    worth_refining,
    worth_weighing,
)
from mrfit.discover.selection.stepwise import grow, prune
from mrfit.io.schemas.discovery import BrokenInvariance, EffectParameter


@dataclass(frozen=True)
class LawSelection:
    """Effects that are there, with what was said of all that were refined, and of all by the last screening."""

    state: State = field(default_factory=dict)
    found: tuple[EffectDescription, ...] = ()
    rivals: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    reasons: Mapping[str, str] = field(default_factory=dict)
    rows: Mapping[str, RefinedEffect] = field(default_factory=dict)
    screened: Mapping[str, LawCandidate] = field(default_factory=dict)

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(self.state)

    def because(self, name: str, reason: str) -> "LawSelection":
        """Return the same with what became of an effect."""
        return replace(self, reasons={**self.reasons, name: reason})

    def without(self, name: str, reason: str) -> "LawSelection":
        """Return the same with an effect taken out."""
        found = tuple(d for d in self.found if d.row.name != name)
        return replace(self.because(name, reason), state=_without(self.state, name), found=found)

    def with_rows(self, described: Sequence[EffectDescription]) -> "LawSelection":
        """Return the same with what was said of effects that were refined."""
        return replace(self, rows={**self.rows, **{d.row.name: d.row for d in described}})


def _without(state: State, name: str) -> State:
    return {n: t for n, t in state.items() if n != name}


def choose(source: LawSource, policy: Policy) -> tuple[LawSelection, tuple[BrokenInvariance, ...]]:
    """Return the effects that are there, and the invariances that something without a name breaks beside them."""
    comparison = AnyLaw(source, policy)
    return comparison.beside_unnamed(comparison.beside_longer_memory(comparison.selected()))


@dataclass(frozen=True)
class AnyLaw:
    """Comparison of effects by what they take of the error that no law makes."""

    source: LawSource
    policy: Policy

    def selected(self) -> LawSelection:
        """Return the selection after effects were added, and all judged again."""
        return self.judged_together(grow(self, LawSelection()))

    def is_open(self, chosen: LawSelection, number: int) -> bool:
        """Return whether another effect may be named."""
        return len(chosen.state) < self.policy.most_named

    def trials(self, chosen: LawSelection, number: int) -> tuple[LawSelection, LawScreening]:
        """Screen every effect beside what is in."""
        screening = self.source.screen(chosen.state, chosen.state)
        screened = {**chosen.screened, **{c.name: c for c in screening.candidates}}
        return replace(chosen, screened=screened), screening

    def additions(self, chosen: LawSelection, found: LawScreening) -> Iterator[LawSelection]:
        """Yield the selection with the effect that leaves least, with one by weights of its own, or with two."""
        for add in (self._add_effect, self._add_effect_by_own_weights, self._add_pair):
            chosen = add(chosen, found)
            yield chosen

    def reassessed(self, chosen: LawSelection) -> LawSelection:
        """Return the same: a refinement moves all effects, and they are judged together when all are in."""
        return chosen

    def _refit(self, start: State, weighed: State, *names: str) -> LawFit:
        """Return effects at their best numbers, beside as much of a law as each of some can be told from."""
        return self.source.refit(start, weighed, names, min(self.source.library[n].level for n in names))

    def _add_effect(self, chosen: LawSelection, screening: LawScreening) -> LawSelection:
        """Return the selection with the effect that leaves least, the same state where none has proof."""
        good, rest = worth_refining(screening.candidates, self.policy)
        state = chosen.state
        fits = {c.name: self._refit({**state, c.name: c.theta}, state, c.name) for c in good}
        tried = [fit.described[0] for fit in fits.values()]
        outcome = best_of([d.row for d in tried], self.policy)
        reasons = {c.name: screened_out(c, self.policy) for c in rest} | {**chosen.reasons, **dict(outcome.reasons)}
        chosen = replace(chosen.with_rows(tried), reasons=reasons)
        if not outcome.winner:
            return chosen
        rivals = {**chosen.rivals, outcome.winner: outcome.rivals}
        return replace(chosen, state=fits[outcome.winner].state, rivals=rivals)

    def _add_effect_by_own_weights(self, chosen: LawSelection, screening: LawScreening) -> LawSelection:
        """Return the selection with the effect that takes most by weights of its own.

        By the residual of the law alone, the conditions weigh least in which the effect is largest.
        """
        starts = {c.name: c.theta for c in screening.candidates if c.name not in chosen.state}
        rows = [r for n in starts if (r := chosen.rows.get(n)) and worth_weighing(r, self.policy)]
        if not rows:
            return chosen
        name = max(rows, key=lambda r: r.standing.share).name
        state: State = {**chosen.state, name: starts[name]}
        for _ in range(self.policy.most_weighings):
            fit = self._refit(state, state, name)
            state = fit.state
            if stands_weighed(fit.described[0].row, self.policy):
                return replace(chosen.with_rows(fit.described), state=state)
        return chosen

    def _add_pair(self, chosen: LawSelection, screening: LawScreening) -> LawSelection:
        """Return the selection with two effects at once, the same state where no two have proof."""
        for pair in worth_pairing(screening, self.policy):
            start = {**chosen.state, **dict(zip(pair.names, pair.thetas, strict=True))}
            if len(start) > self.policy.most_named:
                continue
            fit = self._refit(start, chosen.state, *pair.names)
            if both([d.row for d in fit.described], self.policy):
                return replace(chosen, state=fit.state)
        return chosen

    def judged_together(self, chosen: LawSelection) -> LawSelection:
        """Judge every effect beside all others, take out the weakest without proof in turn, and exchange others."""
        library = self.source.library
        if any(library[n].invariance is Invariance.POSITION for n in chosen.effects):
            for name in [n for n in chosen.effects if library[n].constant]:
                chosen = chosen.without(name, "the origin of a force of the place may be anywhere")
        swaps = 0
        while chosen.effects:
            weighed = chosen.state
            fit = self.source.refit(weighed, weighed, chosen.effects, FULL)
            rows = [d.row for d in fit.described]
            chosen = replace(chosen.with_rows(fit.described), state=fit.state, found=fit.described)
            name, why = weakest(rows, self.policy)
            if name:
                chosen = chosen.without(name, f"beside the others {why}")
                continue
            swapped = self._swapped(chosen, weighed, rows)
            chosen = replace(chosen, rivals=swapped.rivals)
            if swapped.state is chosen.state or swaps == self.policy.most_swaps:
                break
            chosen, swaps = swapped, swaps + 1
        found = chosen.found if chosen.state else ()
        rivals = {n: tuple(r for r in chosen.rivals.get(n, ()) if r not in chosen.state) for n in chosen.state}
        return replace(chosen, found=found, rivals=rivals)

    def _swapped(self, chosen: LawSelection, weighed: State, rows: Sequence[RefinedEffect]) -> LawSelection:
        """Try other effects instead of each, beside all the others, until one leaves less in its place."""
        rivals: dict[str, tuple[str, ...]] = {}
        for row in rows:
            rest = _without(chosen.state, row.name)
            others = swap_candidates(self.source.screen(rest, weighed).candidates, row, self.policy)
            fits = {c.name: self.source.refit({**rest, c.name: c.theta}, weighed, (c.name,), FULL) for c in others}
            outcome = best_of([row, *(fit.described[0].row for fit in fits.values())], self.policy)
            rivals[row.name] = outcome.rivals
            if outcome.winner != row.name:
                chosen = chosen.without(row.name, "another leaves less in its place")
                chosen = replace(chosen, state=fits[outcome.winner].state)
                break
        return replace(chosen, rivals=rivals)

    def beside_longer_memory(self, chosen: LawSelection) -> LawSelection:
        """Return the effects that stand beside a law of longer memory as well."""
        first, sizes = chosen.state, {d.row.name: d.row.standing.size for d in chosen.found}
        again: dict[str, EffectDescription] = {}

        def without_lost(chosen: LawSelection) -> LawSelection | None:
            fit = self.source.refit(chosen.state, chosen.state, chosen.effects, FULL, True)
            again.update(zip(chosen.effects, fit.described, strict=True))
            name, why = lost([d.row for d in fit.described], sizes, self.policy)
            if not name or self._no_rival(first, again[name].row, sizes[name]):
                return None
            return chosen.without(name, f"a law that remembers for longer may have it: {why}")

        chosen = prune(chosen, without_lost)
        return replace(chosen, found=tuple(_widened(d, again[d.row.name], self.source.groups) for d in chosen.found))

    def _no_rival(self, state: State, again: RefinedEffect, size: float) -> bool:
        """Return whether a law of longer memory leaves more than the shorter with an effect, whose force it keeps.

        It has far more numbers than the effect: one that leaves more is not what makes the effect's force.
        """
        longer = self.source.left(_without(state, again.name), True)
        return longer > self.policy.no_rival * self.source.left(state) and stands_further(again, size, self.policy)

    def beside_unnamed(self, chosen: LawSelection) -> tuple[LawSelection, tuple[BrokenInvariance, ...]]:
        """Return the effects that stand beside flexible terms of the other invariances that are broken, and these."""
        found = self.source.broken(chosen.state)
        while taken := self._first_taken(chosen, found):
            chosen = chosen.without(*taken)
            found = self.source.broken(chosen.state)
        return chosen, found

    def _first_taken(self, chosen: LawSelection, found: Sequence[BrokenInvariance]) -> tuple[str, str] | None:
        """Return the first effect that something without a name may have instead, and why."""
        for row in found:
            for effect in chosen.found:
                name, share = effect.row.name, effect.row.standing.share
                if self.source.library[name].invariance is row.invariance or not overshadowed(share, row.share):
                    continue
                left, errors = self.source.beside(chosen.state, name, row.invariance)
                if left < self.policy.share or errors < self.policy.law_clear:
                    return name, f"something without a name that breaks the {row.invariance} may have it"
        return None


def _widened(found: EffectDescription, again: EffectDescription, groups: int) -> EffectDescription:
    """Return an effect with intervals that know how much its numbers differ beside a law of longer memory."""
    quantile = float(stdtrit(groups - 1, STANDARD.quantile))

    def wider(own: EffectParameter, other: EffectParameter) -> EffectParameter:
        if own.low is None or own.high is None:
            return own
        half = float(np.hypot(0.5 * (own.high - own.low), quantile * (other.value - own.value)))
        return replace(own, low=own.value - half, high=own.value + half)

    parameters = tuple(wider(p, q) for p, q in zip(found.parameters, again.parameters, strict=True))
    return replace(found, parameters=parameters, force=wider(found.force, again.force))


def overshadowed(share: float, unnamed: float) -> bool:
    """Return whether something without a name takes more than an effect that takes a share of what no law makes.

    ``unnamed`` is the share that it takes of what is left beside the effect. Terms that are more flexible than any law
    may imitate a true effect as well: they speak against one only where they take more than it.
    """
    return unnamed * (1.0 - share) > share
