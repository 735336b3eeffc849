"""Screening: the share of the best law's residual that every effect could take, to first order."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.specs import Array, Index, Invariance
from mrfit.discover.invariance.estimate import (
    GramTable,
    derivative,
    force_added,
    force_of_law,
    plain_table,
    rows_of,
    table,
)
from mrfit.discover.invariance.sensitivity import ExaminedEffect, added, moved, starts
from mrfit.discover.invariance.setting import RegressionData, State
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.law_rules import FULL, TIME, EffectPair, LawCandidate, LawScreening


@dataclass(frozen=True)
class _ScreenedStart:
    effect: ExaminedEffect
    theta: Array
    offset: bool


def screened(setting: RegressionData, weights: Sequence[Array], state: State) -> LawScreening:
    """Return the best start of every effect that is not there yet, and pairs of them; what could take most first."""
    rows = rows_of(setting, state)
    plain = table(setting, weights, state, rows=rows)
    tried, columns = [], []
    slopes = _slopes(setting, state, plain.law)
    for effect in _lacking(setting, state):
        for theta in starts(effect, setting.scales, setting.middle):
            own = _column(setting, state, effect, theta, plain.law, slopes)
            if any(np.any(c) for c in own):
                tried.append(_ScreenedStart(effect, theta, not effect.constant))
                columns.append(own)
    if not tried:
        return LawScreening()
    extra = [[c[at] for c in columns] for at in range(len(setting.records))]
    made = table(setting, weights, state, extra, rows)
    best: dict[str, LawCandidate] = {}
    for level in (FULL, TIME):
        for offset in (True, False):
            chosen = [k for k, t in enumerate(tried) if level_of(t.effect) == level and t.offset is offset]
            for row in _judged(setting, made, [tried[k] for k in chosen], np.array(chosen, dtype=np.int64), level):
                if row.name not in best or row.rank > best[row.name].rank:
                    best[row.name] = row
    best |= {n: _profiled(setting, weights, state, c) for n, c in best.items() if setting.known[n].moves}
    candidates = sorted(best.values(), key=lambda c: -c.rank)
    return LawScreening(tuple(candidates), tuple(_pairs(setting, made, tried, candidates)))


def _profiled(setting: RegressionData, weights: Sequence[Array], state: State, candidate: LawCandidate) -> LawCandidate:
    """Return a candidate that moves the current with the share that it takes with the law refitted at its best start.

    A law that was fitted at another current knows too little of its slope to it.
    """
    effect, before = setting.known[candidate.name], plain_table(setting, weights, state).left()
    found = [
        (1.0 - plain_table(setting, weights, {**state, effect.name: theta}).left() / before, tuple(theta.tolist()))
        for theta in starts(effect, setting.scales, setting.middle)
    ]
    share, start = max(found)
    if candidate.left >= STANDARD.pair_left and share <= candidate.rank:
        return candidate
    # what it takes with the law refitted is nothing that the law has, whatever the slope says
    left = candidate.left if share < STANDARD.shown_share else 1.0
    return replace(candidate, share=share, theta=start, wrong=False, left=left)


def _pairs(
    setting: RegressionData, made: GramTable, tried: Sequence[_ScreenedStart], candidates: Sequence[LawCandidate]
) -> list[EffectPair]:
    """Return the shares that two effects could take together, of those that the law leaves something of."""
    able = [c for c in candidates if c.left >= STANDARD.pair_left and not setting.known[c.name].constant]
    places = np.array([c.tried for c in able], dtype=np.int64)
    if len(able) < 2:
        return []
    weights = made.beside(made.size + len(made.free) + places)
    gram = weights.T @ made.total @ weights
    found = []
    for a in range(len(able)):
        for b in range(a + 1, len(able)):
            effects = [setting.known[able[k].name] for k in (a, b)]
            own, cross = gram[np.ix_([a, b], [a, b])], gram[[a, b], -1]
            if all(e.moves for e in effects) or np.linalg.det(own) <= STANDARD.pair_alike * own[0, 0] * own[1, 1]:
                continue
            steps = np.linalg.solve(own, cross)
            scaled = steps / made.scales[len(made.free) + places[[a, b]]]
            if any(_wrong(e, s) for e, s in zip(effects, scaled, strict=True)):
                continue
            first, second = (
                _start(e, tried[able[k].tried], s) for e, k, s in zip(effects, (a, b), scaled, strict=True)
            )
            share = float(steps @ cross / max(gram[-1, -1], 1e-30))
            found.append(EffectPair((able[a].name, able[b].name), share, (first, second)))
    return sorted(found, key=lambda p: -p.share)


def _wrong(effect: ExaminedEffect, step: float) -> bool:
    """Return whether a strength of this sign is not physical, or not the effect's."""
    sign = effect.breaks.sign
    return (sign != 0 and step * sign < 0.0) or (effect.moves and step < 0.0)


def _start(effect: ExaminedEffect, tried: _ScreenedStart, step: float) -> tuple[float, ...]:
    theta = tried.theta if effect.moves else effect.at(tried.theta, 0, step)
    return tuple(theta.tolist())


def _lacking(setting: RegressionData, state: State) -> list[ExaminedEffect]:
    """Return the effects that may join.

    One current moved by two effects is more than records can tell; beside a force of the place, whose origin is free, a
    constant force is none of its own.
    """
    taken, placed = any(setting.known[n].moves for n in state), any(of_place(setting.known[n]) for n in state)
    return [
        e
        for n, e in setting.known.items()
        if n not in state and not (e.moves and taken) and not (e.constant and placed)
    ]


def of_place(effect: ExaminedEffect) -> bool:
    """Return whether an effect is a force of the place."""
    return effect.breaks.invariance is Invariance.POSITION


def level_of(effect: ExaminedEffect) -> int:
    """Return the highest level of the nuisance beside which an effect can be told."""
    return FULL if effect.breaks.relaxation else TIME


def _judged(
    setting: RegressionData, made: GramTable, tried: Sequence[_ScreenedStart], places: Index, level: int
) -> list[LawCandidate]:
    if not tried:
        return []
    behind = made.size + len(made.free)
    weights = made.beside(behind + places, level, None if tried[0].offset else False)
    gram = made.total
    own = np.einsum("ij,ik,kj->j", weights[:, :-1], gram, weights[:, :-1], optimize=True)
    cross = weights[:, :-1].T @ gram @ weights[:, -1]
    target = float(weights[:, -1] @ gram @ weights[:, -1])
    full = gram.diagonal()[behind + places]
    found = []
    for k, one in enumerate(tried):
        left = float(own[k] / full[k])
        step = float(cross[k] / max(own[k], 1e-30) / made.scales[len(made.free) + places[k]])
        share = (
            float(cross[k] ** 2 / max(own[k], 1e-30) / max(target, 1e-30)) if left > STANDARD.no_sensitivity else 0.0
        )
        start = _start(one.effect, one, step)
        found.append(LawCandidate(one.effect.name, share, left, start, _wrong(one.effect, step), int(places[k])))
    return found


def _slopes(setting: RegressionData, state: State, law: Array) -> list[Array | None]:
    """Return every record's slope of the law to the current (L + N,), None where it does not move."""
    found: list[Array | None] = []
    for at, record in enumerate(setting.records):
        if not record.moves or not any(e.moves for e in setting.known.values()):
            found.append(None)
            continue
        current, step = setting.control(at, state), STANDARD.slope_step * setting.scales.control
        ends = [setting.law_at(at, current + side * step).values @ law for side in (-1.0, 1.0)]
        slope = setting.passed(at, state, ((ends[1] - ends[0]) / (2.0 * step))[:, None])[:, 0]
        found.append(slope)
    return found


def _column(
    setting: RegressionData,
    state: State,
    effect: ExaminedEffect,
    theta: Array,
    law: Array,
    slopes: Sequence[Array | None],
) -> list[Array]:
    """Return the force of an effect at unit strength (one that moves the current: at its own), per record (n,)."""
    found = []
    for at, record in enumerate(setting.records):
        slope = slopes[at]
        if effect.adds:
            unit = effect.at(theta, 0, 1.0 if effect.of(0).high > 0.0 else -1.0)
            force = added(effect, record, unit) / (effect.value(unit) * setting.scales.span)
            found.append(setting.row_means(at, force))
        elif not effect.moves:
            found.append(derivative(setting, at, {**state, effect.name: theta}, (effect.name, 0), law))
        elif slope is None:
            found.append(np.zeros(len(setting.targets[at])))
        else:
            current = setting.control(at, state)
            found.append(setting.row_means(at, (moved(effect, record, current, theta) - current) * slope))
    return found


def contribution(setting: RegressionData, state: State, name: str, law: Array) -> list[Array]:
    """Return the force that one effect of a state adds, law held, per record (n,), over the range.

    Where the effect moves the current, the law without it is taken at currents that the law was fitted at: a field that
    stays behind never reaches the largest.
    """
    effect, rest = setting.known[name], {n: t for n, t in state.items() if n != name}
    found, seen = [], _seen(setting, state) if effect.moves else (0.0, 0.0)
    for at, record in enumerate(setting.records):
        if effect.adds:
            found.append(setting.row_means(at, added(effect, record, state[name])) / setting.scales.span)
        elif effect.moves:
            bare = setting.law_at(at, np.clip(setting.control(at, rest), *seen)).values @ law
            change = force_of_law(setting, at, state, law) - setting.passed(at, rest, bare[:, None])[:, 0]
            found.append(setting.row_means(at, change))
        else:
            change = force_of_law(setting, at, state, law) - force_of_law(setting, at, rest, law)
            found.append(setting.row_means(at, change))
    return found


def _seen(setting: RegressionData, state: State) -> tuple[float, float]:
    """Return the range of the current that the law sees."""
    currents = [setting.records[at].measured(setting.control(at, state)) for at in range(len(setting.records))]
    return min(float(c.min()) for c in currents), max(float(c.max()) for c in currents)


def early(setting: RegressionData, state: State, law: Array) -> list[Array]:
    """Return the force that a record early by one second would add, to first order, per record (n,)."""
    found = []
    for at, record in enumerate(setting.records):
        force = force_of_law(setting, at, state, law) + force_added(setting, at, state) / setting.scales.span
        found.append(setting.row_means(at, np.gradient(force) / record.dt))
    return found
