"""Significance of an effect beside the best law: scatter over conditions and nuisances, and its predictions."""

from collections.abc import Sequence

import numpy as np
from scipy.special import stdtrit

from mrfit.core.channels import unit_of
from mrfit.core.specs import Array
from mrfit.discover.invariance.estimate import GramTable, LawRefinement, squares, table
from mrfit.discover.invariance.screening import contribution, early, level_of
from mrfit.discover.invariance.setting import RegressionData
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.law_rules import FULL, TIME, TRAVEL, EffectDescription, RefinedEffect
from mrfit.io.schemas.discovery import EffectParameter, EffectSignificance

TINY = 1e-300
LARGEST_FORCE = "largest force"
# Levels of the nuisance between which an estimate must not differ
LADDER = (TRAVEL, TIME, FULL)


def described(setting: RegressionData, weights: Sequence[Array], fitted: LawRefinement, name: str) -> EffectDescription:
    """Return the description of one effect of a state, and its significance beside the others."""
    effect = setting.known[name]
    level = level_of(effect)
    columns = contribution(setting, fitted.state, name, fitted.table.law)
    offset = False if effect.constant else None
    rest = {n: t for n, t in fitted.state.items() if n != name}
    beside = table(setting, weights, rest, [[c] for c in columns])
    standing, share = _standing(beside, level, offset, columns, fitted.table.jackknife(level, offset)[1])
    peak, unit = standing.size * setting.scales.span, unit_of(setting.records[0].made)
    force = EffectParameter(
        name=LARGEST_FORCE, unit=unit, value=peak, low=peak * (1.0 - share), high=peak * (1.0 + share)
    )
    value = effect.value(fitted.state[name])
    sign = effect.breaks.sign == 0 or value * effect.breaks.sign > 0.0
    ahead, beyond = _early(setting, weights, rest, name) if effect.breaks.early else (0.0, 0.0)
    parameters = _parameters(setting, fitted, name, level, offset)
    numbers = sum(n == name for n, _ in fitted.table.free)
    groups = len(beside.grams)
    row = RefinedEffect(name, standing, fitted.left, sign, ahead, beyond, numbers, share, groups - 1.0)
    return EffectDescription(row, parameters, force)


def adequate(made: GramTable, level: int, offset: bool | None = None, effects: int | None = None) -> list[int]:
    """Return the other levels of the nuisance that leave hardly more than one does: they could be the law as well."""
    gram = made.total

    def left(at: int) -> float:
        return squares(gram, made.solve(gram, at, effects, offset))

    return [k for k in LADDER if k != level and left(k) <= STANDARD.adequate * left(level)]


def halves(made: GramTable, level: int, offset: bool | None = None) -> Array:
    """Return half the 95 % interval of every number (E,): scatter over groups, and differences between nuisances."""
    best, without = made.steps(level, offset), made.jackknife(level, offset)[0]
    others = adequate(made, level, offset) or [k for k in (TIME, FULL) if k != level][:1]
    spread = np.max(np.abs([made.steps(k, offset) - best for k in others]), axis=0)
    return stdtrit(len(without) - 1, STANDARD.quantile) * np.hypot(scatter(without), spread)


def typical_gain(before: Array, after: Array) -> float:
    """Return the share of the squared error that is taken of a typical group (G,): the geometric mean of the ratios.

    A sum would listen to the few groups alone that no other group says anything of, with the effect or without.
    """
    ratios = np.clip((after + TINY) / (before + TINY), 1.0 / STANDARD.group_ratio, STANDARD.group_ratio)
    return 1.0 - float(np.exp(np.mean(np.log(ratios))))


def scatter(without: Array) -> Array:
    """Return the jackknife's standard error of estimates (G, E), each with one group left out."""
    count = len(without)
    return np.sqrt((count - 1) / count * np.sum((without - without.mean(axis=0)) ** 2, axis=0))


def _parameters(
    setting: RegressionData, fitted: LawRefinement, name: str, level: int, offset: bool | None
) -> tuple[EffectParameter, ...]:
    """Return an effect's parameters with intervals; those that were held have none."""
    effect, half, step = setting.known[name], halves(fitted.table, level, offset), fitted.table.steps(level, offset)
    found = {
        number: (float(d), float(h))
        for (n, number), d, h in zip(fitted.table.free, step, half, strict=True)
        if n == name
    }
    # the state is that beside all levels; an effect that one of them imitates is told beside the others
    lower = level != FULL
    rows = []
    for number, places in enumerate(effect.numbers):
        for place in places:
            param, value = effect.spec.params[place], float(fitted.state[name][place])
            low = high = None
            if number in found:
                difference, scattered = found[number]
                value += difference if lower else 0.0
                wide = float(np.hypot(scattered, STANDARD.accuracy * value))
                low, high = value - wide, value + wide
            rows.append(EffectParameter(name=param.name, unit=param.unit, value=value, low=low, high=high))
    return tuple(rows)


def _standing(
    beside: GramTable, level: int, offset: bool | None, columns: Sequence[Array], held: Array
) -> tuple[EffectSignificance, float]:
    """Return the standing of an effect whose force stands behind a table without it, and half its force's interval.

    The latter is a share of the force.
    """
    count = len(beside.free) + 1
    at = np.array([beside.size + count - 1])
    weights = beside.beside(at, level, offset)
    own, cross, target = (
        np.einsum("i,gij,j->g", weights[:, a], beside.grams, weights[:, b], optimize=True)
        for a, b in ((0, 0), (0, 1), (1, 1))
    )
    # the effect's factor from the other groups
    others = (cross.sum() - cross) / np.maximum(own.sum() - own, TINY)
    kept = 1.0 - float(np.sum(target - 2.0 * others * cross + others**2 * own) / max(target.sum(), TINY))
    before = beside.jackknife(level, offset)[1]

    def factor(gram: Array, at_level: int) -> float:
        return float(beside.solve(gram, at_level, count, offset)[at[0]])

    best = factor(beside.total, level)
    error = float(scatter(np.array([[factor(beside.total - g, level)] for g in beside.grams]))[0])
    differences = {k: abs(factor(beside.total, k) - best) for k in LADDER if k != level}
    spread = min(differences.values())
    most = max((differences[k] for k in adequate(beside, level, offset, count)), default=spread)
    half = stdtrit(len(beside.grams) - 1, STANDARD.quantile) * float(np.hypot(error, most)) / max(abs(best), TINY)
    half = float(np.hypot(half, STANDARD.accuracy))
    standing = EffectSignificance(
        share=float(cross.sum() ** 2 / max(own.sum() * target.sum(), TINY)),
        kept=kept,
        held=typical_gain(before, held),
        size=max(float(np.max(np.abs(c))) for c in columns),
        z=abs(best) / max(float(np.hypot(error, spread)), TINY),
        left=float(own.sum() / max(beside.total[at[0], at[0]], TINY)),
        improved=float(np.mean(held < before)),
    )
    return standing, half


def _early(setting: RegressionData, weights: Sequence[Array], rest: dict[str, Array], name: str) -> tuple[float, float]:
    """Return the shares that an early record takes beside the best law, over an effect's: alone, and beside it.

    The second is what it takes beside the effect, over what the effect takes beside it.
    """
    plain = table(setting, weights, rest)
    ahead = early(setting, rest, plain.law)
    effect = setting.known[name]
    unit = effect.at(np.array(effect.spec.neutral), 0, 1.0)
    own = contribution(setting, {**rest, name: unit}, name, plain.law)
    made = table(setting, weights, rest, [[a, b] for a, b in zip(own, ahead, strict=True)])
    found = made.beside(made.size + len(made.free) + np.arange(2), FULL)
    gram = found.T @ made.total @ found
    cross, squared = gram[:2, 2], gram.diagonal()[:2]
    alone = cross**2 / np.maximum(squared, TINY)
    both = float(cross @ np.linalg.lstsq(gram[:2, :2], cross, rcond=None)[0])
    beyond = np.maximum(both - alone[::-1], TINY)
    return (float(alone[1] / max(alone[0], TINY)) if cross[1] > 0.0 else 0.0), float(beyond[1] / beyond[0])
