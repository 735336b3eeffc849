"""How clearly an effect shows beside the best law: scatter over conditions and nuisances, and what it predicts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from mrfit.core.specs import Array
from mrfit.discover.invariance.estimate import Fitted, Table, table
from mrfit.discover.invariance.findings import Parameter, Standing
from mrfit.discover.invariance.nuisance import FULL, TIME, TRAVEL
from mrfit.discover.invariance.screening import contribution, early, level_of
from mrfit.discover.invariance.selection import Refined
from mrfit.discover.invariance.setting import Setting

TINY = 1e-300
# Two-sided 95 %
QUANTILE = 0.975


@dataclass(frozen=True)
class Described:
    """An effect of a state: the row that is decided on, and its parameters with intervals."""

    row: Refined
    parameters: tuple[Parameter, ...]


def described(setting: Setting, weights: Sequence[Array], fitted: Fitted, name: str) -> Described:
    """Return how clearly one effect of a state shows beside the others."""
    effect, made = setting.known[name], fitted.table
    level = level_of(effect)
    own = [k for k, (n, _) in enumerate(made.free) if n == name]
    columns = contribution(setting, fitted.state, name, made.law)
    offset = not _constant(columns)
    best = made.steps(level, offset)
    without, held = made.jackknife(level, offset)
    count = len(without)
    deviations = without - without.mean(axis=0)
    errors = np.sqrt((count - 1) / count * np.sum(deviations**2, axis=0))
    ladder = np.array([made.steps(k, offset) for k in (TRAVEL, TIME, FULL) if k != level]) - best
    wide = student.ppf(QUANTILE, count - 1)
    parameters, lead = [], own[0]
    halves = {made.free[k][1]: wide * float(np.hypot(errors[k], np.max(np.abs(ladder[:, k])))) for k in own}
    for number in range(len(effect.numbers)):
        parameters += _parameters(setting, fitted, name, number, halves.get(number))
    value = effect.value(fitted.state[name]) + float(best[lead])
    spread = float(np.min(np.abs(ladder[:, lead])))
    z = abs(value - effect.spec.neutral[effect.numbers[0][0]]) / max(float(np.hypot(errors[lead], spread)), TINY)
    rest = {n: t for n, t in fitted.state.items() if n != name}
    beside = table(setting, weights, rest, [[c] for c in columns])
    standing = _standing(beside, level, offset, columns, z, held)
    sign = effect.breaks.sign == 0 or value * effect.breaks.sign > 0.0
    ahead = _early(setting, weights, rest, name, level) if effect.breaks.early else 0.0
    return Described(Refined(name, standing, fitted.left, sign, ahead), tuple(parameters))


def _constant(columns: Sequence[Array]) -> bool:
    values = np.concatenate(list(columns))
    return bool(np.ptp(values) < 1e-6 * np.max(np.abs(values)))


def _parameters(setting: Setting, fitted: Fitted, name: str, number: int, half: float | None) -> list[Parameter]:
    effect = setting.known[name]
    rows = []
    for place in effect.numbers[number]:
        param, value = effect.spec.params[place], float(fitted.state[name][place])
        low, high = (None, None) if half is None else (value - half, value + half)
        rows.append(Parameter(param.name, param.unit, value, low, high))
    return rows


def _standing(beside: Table, level: int, offset: bool, columns: Sequence[Array], z: float, held: Array) -> Standing:
    """Return the standing of an effect whose columns stand behind a table without it."""
    at = np.array([beside.size + len(beside.free)])
    weights = beside.beside(at, level, offset)
    own, cross, target = (
        np.einsum("i,gij,j->g", weights[:, a], beside.grams, weights[:, b], optimize=True)
        for a, b in ((0, 0), (0, 1), (1, 1))
    )
    # the effect's factor from the other groups
    others = (cross.sum() - cross) / np.maximum(own.sum() - own, TINY)
    kept = 1.0 - float(np.sum(target - 2.0 * others * cross + others**2 * own) / max(target.sum(), TINY))
    before = beside.jackknife(level, offset)[1]
    return Standing(
        share=float(cross.sum() ** 2 / max(own.sum() * target.sum(), TINY)),
        kept=kept,
        held=float(1.0 - held.sum() / max(before.sum(), TINY)),
        size=max(float(np.max(np.abs(c))) for c in columns),
        z=z,
        left=float(own.sum() / max(beside.total[at[0], at[0]], TINY)),
        improved=float(np.mean(held < before)),
    )


def _early(setting: Setting, weights: Sequence[Array], rest: dict[str, Array], name: str, level: int) -> float:
    """Return the share that a record which is early takes beside the best law, over that of an effect."""
    plain = table(setting, weights, rest)
    ahead = early(setting, rest, plain.law)
    effect = setting.known[name]
    unit = effect.at(np.array(effect.spec.neutral), 0, 1.0)
    own = contribution(setting, {**rest, name: unit}, name, plain.law)
    made = table(setting, weights, rest, [[a, b] for a, b in zip(own, ahead, strict=True)])
    found = made.beside(made.size + len(made.free) + np.arange(2), FULL)
    gram = made.total
    squares = np.einsum("ik,ij,jk->k", found, gram, found, optimize=True)
    cross = found[:, :2].T @ gram @ found[:, 2]
    shares = cross**2 / np.maximum(squares[:2], TINY)
    return float(shares[1] / max(shares[0], TINY)) if cross[1] > 0.0 else 0.0
