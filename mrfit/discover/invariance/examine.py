"""The examination: which effects are there whatever the law is, and how far the base's law is off.

    F = shape(m*Phi(v, memory, i_e) beta + sum_e theta_e S_e) + noise

Phi is a dictionary of forces that keep the invariances of every law (``nuisance``). Effects are added one by one, the
one that leaves least first, each against its rivals, and all are judged again beside the others.
"""

from collections.abc import Sequence

import numpy as np

from mrfit.core.protocols import Effect
from mrfit.core.specs import Array, Invariance
from mrfit.discover.invariance.base import Base, none
from mrfit.discover.invariance.estimate import table
from mrfit.discover.invariance.explained_by_base import lawful, owns, strength_in
from mrfit.discover.invariance.findings import (
    LawErrors,
    LawFindings,
    Tier,
    closed,
    finite,
)
from mrfit.discover.invariance.law_gap import law_gap
from mrfit.discover.invariance.records import Record, with_steady_currents
from mrfit.discover.invariance.regression import Regression, arrays
from mrfit.discover.invariance.sensitivity import ExaminedEffect, examined, missing
from mrfit.discover.invariance.setting import RegressionData, setting_of
from mrfit.discover.invariance.weights import residuals, rms, weights_of
from mrfit.discover.policy import STANDARD, Policy
from mrfit.discover.selection.any_law import LawSelection, choose
from mrfit.discover.selection.law_rules import EffectDescription, LawSource, State
from mrfit.io.schemas.discovery import BrokenInvariance, Confounded, EffectParameter, InvariantEffect

TIER_OF: dict[Invariance, Tier] = {
    Invariance.ODDNESS: "any-law",
    Invariance.TIME: "any-law",
    Invariance.TEMPERATURE: "any-law",
    Invariance.POSITION: "short-memory",
    Invariance.MEMORY: "causal",
    Invariance.CURRENT: "current-at-once",
}


def examine(
    records: Sequence[Record],
    base: Base | None,
    effects: Sequence[Effect],
    policy: Policy = STANDARD,
    exact: Sequence[Array] = (),
) -> LawFindings:
    """Return the effects that are there whatever the law is, and the error of a base's law.

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
    exact
        What a model taken as exact leaves, per record (N,); empty for no such model.
    """
    if not records:
        return LawFindings(not_applicable="no records")
    records = with_steady_currents(records)
    base = base or none(records)
    able, confounded = _able(records, base, effects, policy)
    base = _without_unlawful(records, base, able)
    setting = setting_of(records, base.terms, able, policy)
    columns = setting.law(0, {}).ends[-1]
    if setting.rows < policy.rows_for_a_column * columns:
        return LawFindings(
            not_applicable=f"{setting.rows} means over samples are too few to tell {columns} forces apart"
        )
    further = setting_of(records, base.terms, able, policy, policy.longer_memory)
    regression = Regression(setting, further, policy)
    chosen, unnamed = choose(regression, policy)
    state = arrays(chosen.state)
    weights = weights_of(setting, state)
    plain = table(setting, weights_of(setting, {}), {})
    alone = rms(residuals(setting, {}, plain))
    made = table(setting, weights, state)
    after = rms(residuals(setting, state, made))
    gap = law_gap(setting, base.response, state, made, (alone, after))
    return LawFindings(
        named=tuple(_named(setting, d, chosen.rivals.get(d.row.name, ())) for d in chosen.found),
        turned_down=tuple(_turned_down(setting, chosen)),
        confounded=(*confounded, *_no_sensitivity(setting, chosen, policy)),
        broken=_broken(regression, unnamed, chosen.state),
        errors=LawErrors(
            _base_error(setting, base.response),
            alone,
            after,
            setting.noise,
            _exact_error(setting, exact),
            after * float(np.sqrt(setting.rows / max(setting.rows - columns, 1))),
        ),  # fmt: skip
        law_gap=gap,
        in_the_model=_in_the_model(setting, weights, chosen, exact),
        travel=setting.scales.lengths[-1] * setting.scales.travel,
        time=setting.scales.longest,
    )


def _able(
    records: Sequence[Record], base: Base, effects: Sequence[Effect], policy: Policy
) -> tuple[list[ExaminedEffect], list[Confounded]]:
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
            confounded.append(
                Confounded(name=spec.name, reason="it breaks no invariance: any law may have it", test=spec.experiment)
            )
            continue
        why = missing(effect, channels, spans)
        if not why and effect.moves and not any(r.moves for r in records):
            why = "no record in which its input moves"
        if not why and owns(base, records, effect, policy):
            why = "the base has it itself"
        if why:
            confounded.append(Confounded(name=spec.name, reason=why, test=spec.experiment))
        else:
            able.append(effect)
    return able, confounded


def lawful_base(records: Sequence[Record], base: Base, effects: Sequence[Effect], policy: Policy) -> Base:
    """Return a base without terms that one of some effects would be lost in."""
    return _without_unlawful(records, base, _able(records, base, effects, policy)[0])


def _without_unlawful(records: Sequence[Record], base: Base, able: Sequence[ExaminedEffect]) -> Base:
    """Return a base without terms that an effect would be lost in."""
    if not base.terms[0].shape[1]:
        return base
    bare = setting_of(records, none(records).terms, able, STANDARD)
    return lawful(base, records, able, [bare.law(k, {}).values for k in range(len(records))])


def _broken(source: LawSource, found: tuple[BrokenInvariance, ...], state: State) -> tuple[BrokenInvariance, ...]:
    """Return the invariances that something without a name breaks, also where a law may remember for longer."""
    still = {b.invariance for b in source.broken(state, True)} if found else ()
    return tuple(b for b in found if b.invariance in still)


def _named(setting: RegressionData, found: EffectDescription, rivals: tuple[str, ...]) -> InvariantEffect:
    breaks = setting.known[found.row.name].breaks
    return InvariantEffect(
        name=found.row.name,
        breaks=breaks.invariance,
        tier=TIER_OF[breaks.invariance],
        parameters=tuple(map(closed, found.parameters)),
        force=closed(found.force),
        standing=finite(found.row.standing),
        one_of=tuple(dict.fromkeys((*rivals, *breaks.alike))),
    )


def _turned_down(setting: RegressionData, chosen: LawSelection) -> list[InvariantEffect]:
    return [
        InvariantEffect(
            name=name,
            breaks=setting.known[name].breaks.invariance,
            parameters=(_strength(setting.known[name], chosen.screened[name].theta),),
            standing=finite(chosen.rows[name].standing) if name in chosen.rows else None,
            reason=why,
        )
        for name, why in chosen.reasons.items()
        if name not in chosen.state and why
    ]


def _strength(effect: ExaminedEffect, theta: Sequence[float]) -> EffectParameter:
    param, value = effect.of(0), effect.value(np.array(theta))
    return EffectParameter(name=param.name, unit=param.unit, value=value, low=None, high=None)


def _no_sensitivity(setting: RegressionData, chosen: LawSelection, policy: Policy) -> list[Confounded]:
    return [
        Confounded(
            name=name,
            reason=f"the law takes all but {c.left:.2g} of its square",
            test=setting.known[name].spec.experiment,
        )
        for name, c in chosen.screened.items()
        if c.left < policy.sensitivity_left
    ]


def _in_the_model(
    setting: RegressionData, weights: Sequence[Array], chosen: LawSelection, left: Sequence[Array]
) -> tuple[str, ...]:
    """Return the effects whose force a model has itself, as strong as it was found: v + Omega*x has a spring."""
    if not left:
        return ()
    output = [t + own / setting.scales.span for t, own in zip(setting.targets, _rows_of(setting, left), strict=True)]
    adding = {d: setting.known[d.row.name] for d in chosen.found if setting.known[d.row.name].adds}
    return tuple(d.row.name for d, e in adding.items() if _holds(d, strength_in(setting, weights, e, output)))


def _holds(found: EffectDescription, strength: float) -> bool:
    """Return whether the interval of an effect's strength holds a value."""
    own = found.parameters[0]
    return (own.low is None or own.low <= strength) and (own.high is None or strength <= own.high)


def _exact_error(setting: RegressionData, left: Sequence[Array]) -> float | None:
    """Return the RMS over the range of what a model leaves, on the rows of the regression."""
    if not left:
        return None
    return rms(_rows_of(setting, left)) / setting.scales.span


def _rows_of(setting: RegressionData, values: Sequence[Array]) -> list[Array]:
    """Return the means over each row of values per record (N,)."""
    whole = [np.concatenate([np.zeros(r.lead), own]) for r, own in zip(setting.records, values, strict=True)]
    return [setting.row_means(at, own) for at, own in enumerate(whole)]


def _base_error(setting: RegressionData, response: Sequence[Array]) -> float | None:
    if not response:
        return None
    parts = []
    for at, own in enumerate(response):
        record = setting.records[at]
        whole = np.concatenate([np.zeros(record.lead), own])
        parts.append(setting.targets[at] - setting.row_means(at, whole) / setting.scales.span)
    return rms(parts)
