"""The examination: which effects are there whatever the law is, and how far the base's law is off.

    F = shape(m*Phi(v, memory, i_e) beta + sum_e theta_e S_e) + noise

Phi is a dictionary of forces that keep the invariances of every law (``nuisance``). Effects are added one by one, the
one that leaves least first, each against its rivals, and all are judged again beside the others.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mrfit.core.protocols import Effect
from mrfit.core.specs import Array, Invariance
from mrfit.discover.invariance.base import Base, none
from mrfit.discover.invariance.estimate import Fitted, refine, table
from mrfit.discover.invariance.findings import (
    Confounded,
    Errors,
    Findings,
    NamedEffect,
    Parameter,
    Tier,
    TurnedDown,
)
from mrfit.discover.invariance.generic import broken
from mrfit.discover.invariance.law_gap import law_gap
from mrfit.discover.invariance.owned import lawful, owns
from mrfit.discover.invariance.policy import STANDARD, Policy
from mrfit.discover.invariance.records import Record
from mrfit.discover.invariance.screening import level_of, of_place, screened
from mrfit.discover.invariance.selection import (
    Candidate,
    Refined,
    Screening,
    both,
    decide,
    screened_out,
    weakest,
    worth_a_swap,
    worth_pairing,
    worth_refining,
)
from mrfit.discover.invariance.sensitivity import Examined, examined, missing
from mrfit.discover.invariance.setting import Setting, setting_of
from mrfit.discover.invariance.standing import Described, described
from mrfit.discover.invariance.weights import residuals, rms, weights_of

TIERS: dict[Invariance, Tier] = {
    Invariance.ODDNESS: "any-law",
    Invariance.TIME: "any-law",
    Invariance.TEMPERATURE: "any-law",
    Invariance.POSITION: "short-memory",
    Invariance.MEMORY: "causal",
    Invariance.CURRENT: "current-at-once",
}
# Factor on the horizon of memory under which a name has to hold as well
FURTHER = 2.0


def examine(
    records: Sequence[Record], base: Base | None, effects: Sequence[Effect], policy: Policy = STANDARD
) -> Findings:
    """Return which effects are there whatever the law is, and how far the law of a base is off.

    Parameters
    ----------
    records
        Records of one specimen, under several conditions.
    base
        What the base model gives, see ``base_of``; None for no base.
    effects
        Effects that may be missing, all that act on the output.
    policy
        Thresholds.
    """
    if not records:
        return Findings(not_applicable="no records")
    base = base or none(records)
    able, confounded = _able(records, base, effects, policy)
    base = _without_unlawful(records, base, able)
    setting = setting_of(records, base.terms, able, policy)
    columns = setting.law(0, {}).ends[-1]
    if setting.rows < policy.rows_for_a_column * columns:
        return Findings(not_applicable=f"{setting.rows} means over samples are too few to tell {columns} forces apart")
    chosen = _chosen(setting, policy)
    chosen = _held_further(setting_of(records, base.terms, able, policy, FURTHER), chosen, policy)
    weights = weights_of(setting, chosen.state)
    plain = table(setting, weights_of(setting, {}), {})
    alone = rms(residuals(setting, {}, plain))
    made = table(setting, weights, chosen.state)
    after = rms(residuals(setting, chosen.state, made))
    gap = law_gap(setting, base.response, chosen.state, made, (alone, after))
    return Findings(
        named=tuple(_named(setting, d, chosen.rivals.get(d.row.name, ())) for d in chosen.found),
        turned_down=tuple(_turned_down(setting, chosen)),
        confounded=(*confounded, *_no_sensitivity(setting, chosen, policy)),
        broken=tuple(broken(setting, weights, chosen.state, policy)),
        errors=Errors(_base_error(setting, base.response), alone, after, setting.noise),
        law_gap=gap,
        travel=setting.scales.lengths[-1] * setting.scales.travel,
        time=setting.scales.longest,
    )


def _able(
    records: Sequence[Record], base: Base, effects: Sequence[Effect], policy: Policy
) -> tuple[list[Examined], list[Confounded]]:
    """Return the effects that can be tested, and why others cannot."""
    channels = frozenset.intersection(*(frozenset(r.channels) for r in records))
    spans = {
        n: max(float(r.measured(r.channels[n]).max()) for r in records)
        - min(float(r.measured(r.channels[n]).min()) for r in records)
        for n in channels
    }
    able, confounded = [], []
    for module in effects:
        effect, spec = examined(module), module.SPEC
        if effect is None:
            confounded.append(Confounded(spec.name, "it breaks no invariance: any law may have it", spec.experiment))
            continue
        why = missing(effect, channels, spans)
        if not why and effect.moves and not any(r.moves for r in records):
            why = "no record in which its input moves"
        if not why and owns(base, records, effect, policy):
            why = "the base has it itself"
        if why:
            confounded.append(Confounded(spec.name, why, spec.experiment))
        else:
            able.append(effect)
    return able, confounded


def _without_unlawful(records: Sequence[Record], base: Base, able: Sequence[Examined]) -> Base:
    """Return a base without terms that an effect would be lost in."""
    if not base.terms[0].shape[1]:
        return base
    bare = setting_of(records, none(records).terms, able, STANDARD)
    return lawful(base, records, able, [bare.law(k, {}).values for k in range(len(records))])


@dataclass(frozen=True)
class _Chosen:
    """Effects that are there, with what was said of all that were refined."""

    state: dict[str, Array] = field(default_factory=dict)
    found: tuple[Described, ...] = ()
    rivals: dict[str, tuple[str, ...]] = field(default_factory=dict)
    reasons: dict[str, str] = field(default_factory=dict)
    rows: dict[str, Refined] = field(default_factory=dict)
    screened: dict[str, Candidate] = field(default_factory=dict)


def _chosen(setting: Setting, policy: Policy) -> _Chosen:
    """Add effects one by one, or two at once where none alone is there, then judge all again."""
    chosen = _Chosen()
    while len(chosen.state) < policy.most_named:
        weights = weights_of(setting, chosen.state)
        screening = screened(setting, weights, chosen.state)
        if not chosen.state:
            chosen = replace(chosen, screened={c.name: c for c in screening.candidates})
        further = _one_more(setting, weights, chosen, screening, policy)
        if further.state is chosen.state:
            further = _two_more(setting, weights, further, screening, policy)
        found, chosen = further.state is not chosen.state, further
        if not found:
            break
    return _beside_each_other(setting, chosen, policy)


def _one_more(
    setting: Setting, weights: Sequence[Array], chosen: _Chosen, screening: Screening, policy: Policy
) -> _Chosen:
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


def _two_more(
    setting: Setting, weights: Sequence[Array], chosen: _Chosen, screening: Screening, policy: Policy
) -> _Chosen:
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


def _beside_each_other(setting: Setting, chosen: _Chosen, policy: Policy) -> _Chosen:
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
    """A state with one effect in the place of another, ``out``, none if all stand; and the rivals of each."""

    state: dict[str, Array]
    out: str
    rivals: dict[str, tuple[str, ...]]


def _swap(
    setting: Setting, weights: Sequence[Array], state: dict[str, Array], rows: Sequence[Refined], policy: Policy
) -> _Swap:
    """Try other effects in the place of each, beside all the others."""
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


def _held_further(setting: Setting, chosen: _Chosen, policy: Policy) -> _Chosen:
    """Return what stands where a law may remember for longer as well."""
    state, reasons = dict(chosen.state), dict(chosen.reasons)
    while state:
        weights = weights_of(setting, state)
        fitted = refine(setting, weights, state)
        rows = [described(setting, weights, fitted, name).row for name in state]
        name, why = weakest(rows, policy)
        if not name:
            break
        del state[name]
        reasons[name] = f"a law that remembers for longer may have it: {why}"
    if len(state) == len(chosen.state):
        return chosen
    kept = {n: chosen.state[n] for n in state}
    found = tuple(d for d in chosen.found if d.row.name in state)
    return replace(chosen, state=kept, found=found, reasons=reasons)


def _named(setting: Setting, found: Described, rivals: tuple[str, ...]) -> NamedEffect:
    effect = setting.known[found.row.name]
    parameters: tuple[Parameter, ...] = found.parameters
    return NamedEffect(
        name=effect.name,
        breaks=effect.breaks.invariance,
        tier=TIERS[effect.breaks.invariance],
        parameters=parameters,
        force=found.force,
        common=effect.common,
        standing=found.row.standing,
        rivals=rivals,
        alike=effect.breaks.alike,
    )


def _turned_down(setting: Setting, chosen: _Chosen) -> list[TurnedDown]:
    return [
        TurnedDown(
            name, setting.known[name].breaks.invariance, why, chosen.screened[name].share,
            chosen.rows[name].standing if name in chosen.rows else None,
        )
        for name, why in chosen.reasons.items()
        if name not in chosen.state and why
    ]  # fmt: skip


def _no_sensitivity(setting: Setting, chosen: _Chosen, policy: Policy) -> list[Confounded]:
    return [
        Confounded(name, f"the law takes all but {c.left:.2g} of its square", setting.known[name].spec.experiment)
        for name, c in chosen.screened.items()
        if c.left < policy.left
    ]


def _base_error(setting: Setting, response: Sequence[Array]) -> float | None:
    if not response:
        return None
    parts = []
    for at, own in enumerate(response):
        record = setting.records[at]
        whole = np.concatenate([np.zeros(record.lead), own])
        parts.append(setting.targets[at] - setting.row_means(at, whole) / setting.scales.span)
    return rms(parts)
