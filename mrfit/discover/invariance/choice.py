"""Which effects are there: added one by one, or two where none alone is; then each is tried beside the others."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mrfit.core.specs import Array
from mrfit.discover.invariance.estimate import Fitted, refine
from mrfit.discover.invariance.policy import Policy
from mrfit.discover.invariance.screening import level_of, of_place, screened
from mrfit.discover.invariance.selection import (
    Candidate,
    Refined,
    Screening,
    both,
    decide,
    screened_out,
    stands_weighed,
    weakest,
    worth_a_swap,
    worth_pairing,
    worth_refining,
    worth_weighing,
)
from mrfit.discover.invariance.setting import Setting
from mrfit.discover.invariance.standing import Described, described
from mrfit.discover.invariance.weights import weights_of


@dataclass(frozen=True)
class Chosen:
    """Effects that are there, with what was said of all that were refined, and of all by the last screening."""

    state: dict[str, Array] = field(default_factory=dict)
    found: tuple[Described, ...] = ()
    rivals: dict[str, tuple[str, ...]] = field(default_factory=dict)
    reasons: dict[str, str] = field(default_factory=dict)
    rows: dict[str, Refined] = field(default_factory=dict)
    screened: dict[str, Candidate] = field(default_factory=dict)


def chosen_effects(setting: Setting, policy: Policy) -> Chosen:
    """Add effects one by one, or two at once where none alone is there, then judge all again."""
    chosen = Chosen()
    while len(chosen.state) < policy.most_named:
        weights = weights_of(setting, chosen.state)
        screening = screened(setting, weights, chosen.state)
        chosen = replace(chosen, screened=chosen.screened | {c.name: c for c in screening.candidates})
        further = _one_more(setting, weights, chosen, screening, policy)
        if further.state is chosen.state:
            further = _weighed_again(setting, further, screening, policy)
        if further.state is chosen.state:
            further = _two_more(setting, weights, further, screening, policy)
        found, chosen = further.state is not chosen.state, further
        if not found:
            break
    return _beside_each_other(setting, chosen, policy)


def _one_more(
    setting: Setting, weights: Sequence[Array], chosen: Chosen, screening: Screening, policy: Policy
) -> Chosen:
    """Return what stands with the effect that leaves least, the same state where none has proof."""
    good, rest = worth_refining(screening.candidates, policy)
    reasons = {c.name: screened_out(c, policy) for c in rest} | chosen.reasons
    fits: dict[str, Fitted] = {}
    for c in good:
        start = {**chosen.state, c.name: np.array(c.theta)}
        fits[c.name] = refine(setting, weights, start, level_of(setting.known[c.name]))
    tried = [described(setting, weights, fits[c.name], c.name).row for c in good]
    outcome = decide(tried, policy)
    reasons |= dict(outcome.reasons)
    rows = chosen.rows | {r.name: r for r in tried}
    state, rivals = chosen.state, dict(chosen.rivals)
    if outcome.winner:
        state = dict(fits[outcome.winner].state)
        rivals[outcome.winner] = outcome.rivals
    return replace(chosen, state=state, reasons=reasons, rows=rows, rivals=rivals)


def _weighed_again(setting: Setting, chosen: Chosen, screening: Screening, policy: Policy) -> Chosen:
    """Return what stands with the effect that takes most by weights of its own, the same state where it has no proof.

    By what the law alone leaves, the conditions weigh least in which the effect is largest.
    """
    starts = {c.name: c.theta for c in screening.candidates}
    rows = [r for n in starts if (r := chosen.rows.get(n)) and n not in chosen.state and worth_weighing(r, policy)]
    if not rows:
        return chosen
    name = max(rows, key=lambda r: r.standing.share).name
    state = {**chosen.state, name: np.array(starts[name])}
    for _ in range(policy.most_weighings):
        weights = weights_of(setting, state)
        fitted = refine(setting, weights, state, level_of(setting.known[name]))
        state, row = dict(fitted.state), described(setting, weights, fitted, name).row
        if stands_weighed(row, policy):
            return replace(chosen, state=state, rows={**chosen.rows, name: row})
    return chosen


def _two_more(
    setting: Setting, weights: Sequence[Array], chosen: Chosen, screening: Screening, policy: Policy
) -> Chosen:
    """Return what stands with two effects at once, the same state where no two have proof."""
    for pair in worth_pairing(screening, policy):
        start = {**chosen.state, **{n: np.array(t) for n, t in zip(pair.names, pair.thetas, strict=True)}}
        if len(start) > policy.most_named:
            continue
        level = min(level_of(setting.known[n]) for n in pair.names)
        fitted = refine(setting, weights, start, level)
        if both([described(setting, weights, fitted, n).row for n in pair.names], policy):
            return replace(chosen, state=dict(fitted.state))
    return chosen


def _beside_each_other(setting: Setting, chosen: Chosen, policy: Policy) -> Chosen:
    """Return what stands when every effect is judged beside all others, the weakest without proof taken out in turn."""
    state, reasons, rows = dict(chosen.state), dict(chosen.reasons), dict(chosen.rows)
    if any(of_place(setting.known[n]) for n in state):
        for name in [n for n in state if setting.known[n].constant]:
            del state[name]
            reasons[name] = "the origin of a force of the place may be anywhere"
    found: tuple[Described, ...] = ()
    rivals, swaps = dict(chosen.rivals), 0
    while state:
        weights = weights_of(setting, state)
        fitted = refine(setting, weights, state)
        state = dict(fitted.state)
        found = tuple(described(setting, weights, fitted, name) for name in state)
        rows |= {d.row.name: d.row for d in found}
        name, why = weakest([d.row for d in found], policy)
        if name:
            del state[name]
            reasons[name], found = f"beside the others {why}", ()
            continue
        swap = _swap(setting, weights, state, [d.row for d in found], policy)
        rivals = swap.rivals
        if not swap.state or swaps == policy.most_swaps:
            break
        reasons[swap.out] = "another leaves less in its place"
        state, swaps = swap.state, swaps + 1
    rivals = {n: tuple(r for r in rivals.get(n, ()) if r not in state) for n in state}
    return replace(chosen, state=state, found=found, rivals=rivals, reasons=reasons, rows=rows)


@dataclass(frozen=True)
class _Swap:
    """A state with one effect instead of another, ``out``, none if all stand; and the rivals of each."""

    state: dict[str, Array]
    out: str
    rivals: dict[str, tuple[str, ...]]


def _swap(
    setting: Setting, weights: Sequence[Array], state: dict[str, Array], rows: Sequence[Refined], policy: Policy
) -> _Swap:
    """Try other effects instead of each, beside all the others."""
    rivals: dict[str, tuple[str, ...]] = {}
    for row in rows:
        rest = {n: t for n, t in state.items() if n != row.name}
        others = worth_a_swap(screened(setting, weights, rest).candidates, row, policy)
        fits = {c.name: refine(setting, weights, {**rest, c.name: np.array(c.theta)}) for c in others}
        tried = [described(setting, weights, fit, name).row for name, fit in fits.items()]
        outcome = decide([row, *tried], policy)
        rivals[row.name] = outcome.rivals
        if outcome.winner != row.name:
            return _Swap(dict(fits[outcome.winner].state), row.name, rivals)
    return _Swap({}, "", rivals)
