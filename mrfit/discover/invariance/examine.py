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
    Refined,
    decide,
    screened_out,
    weakest,
    worth_refining,
)
from mrfit.discover.invariance.sensitivity import Tested, missing, tested
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
    base = base or none(records)
    able, confounded = _able(records, base, effects, policy)
    base = _without_unlawful(records, base, able)
    setting = setting_of(records, base.terms, able, policy)
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
) -> tuple[list[Tested], list[Confounded]]:
    """Return the effects that can be tested, and why others cannot."""
    channels = frozenset.intersection(*(frozenset(r.channels) for r in records))
    spans = {
        n: max(float(r.measured(r.channels[n]).max()) for r in records)
        - min(float(r.measured(r.channels[n]).min()) for r in records)
        for n in channels
    }
    able, confounded = [], []
    for module in effects:
        effect, spec = tested(module), module.SPEC
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


def _without_unlawful(records: Sequence[Record], base: Base, able: Sequence[Tested]) -> Base:
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
    shares: dict[str, float] = field(default_factory=dict)
    lefts: dict[str, float] = field(default_factory=dict)


def _chosen(setting: Setting, policy: Policy) -> _Chosen:
    """Add effects one by one, then judge all again."""
    state: dict[str, Array] = {}
    reasons: dict[str, str] = {}
    rivals: dict[str, tuple[str, ...]] = {}
    rows: dict[str, Refined] = {}
    shares: dict[str, float] = {}
    lefts: dict[str, float] = {}
    for turn in range(policy.most_named):
        weights = weights_of(setting, state)
        candidates = screened(setting, weights, state)
        good, rest = worth_refining(candidates, policy)
        if turn == 0:
            shares = {c.name: c.share for c in candidates}
            lefts = {c.name: c.left for c in candidates}
        reasons |= {c.name: screened_out(c, policy) for c in rest if c.name not in reasons}
        fits: dict[str, Fitted] = {}
        for c in good:
            start = {**state, c.name: np.array(c.theta)}
            fits[c.name] = refine(setting, weights, start, level_of(setting.known[c.name]))
        tried = [described(setting, weights, fits[c.name], c.name).row for c in good]
        rows |= {r.name: r for r in tried}
        outcome = decide(tried, policy)
        reasons |= dict(outcome.reasons)
        if not outcome.winner:
            break
        state = dict(fits[outcome.winner].state)
        rivals[outcome.winner] = outcome.rivals
    return _beside_each_other(setting, _Chosen(state, (), rivals, reasons, rows, shares, lefts), policy)


def _beside_each_other(setting: Setting, chosen: _Chosen, policy: Policy) -> _Chosen:
    """Return what stands when every effect is judged beside all others, the weakest without proof taken out in turn."""
    state, reasons, rows = dict(chosen.state), dict(chosen.reasons), dict(chosen.rows)
    if any(of_place(setting.known[n]) for n in state):
        for name in [n for n in state if setting.known[n].constant]:
            del state[name]
            reasons[name] = "the origin of a force of the place may be anywhere"
    found: tuple[Described, ...] = ()
    while state:
        weights = weights_of(setting, state)
        fitted = refine(setting, weights, state)
        state = dict(fitted.state)
        found = tuple(described(setting, weights, fitted, name) for name in state)
        rows |= {d.row.name: d.row for d in found}
        name, why = weakest([d.row for d in found], policy)
        if not name:
            break
        del state[name]
        reasons[name], found = f"beside the others {why}", ()
    rivals = {n: tuple(r for r in chosen.rivals.get(n, ()) if r not in state) for n in state}
    return replace(chosen, state=state, found=found, rivals=rivals, reasons=reasons, rows=rows)


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
            name, setting.known[name].breaks.invariance, why, chosen.shares.get(name, 0.0),
            chosen.rows[name].standing if name in chosen.rows else None,
        )
        for name, why in chosen.reasons.items()
        if name not in chosen.state and why
    ]  # fmt: skip


def _no_sensitivity(setting: Setting, chosen: _Chosen, policy: Policy) -> list[Confounded]:
    return [
        Confounded(name, f"the law takes all but {left:.2g} of its square", setting.known[name].spec.experiment)
        for name, left in chosen.lefts.items()
        if left < policy.left
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
