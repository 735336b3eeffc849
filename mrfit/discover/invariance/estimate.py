"""Partial regression on Gram matrices: what effects add beside the best law, with the scatter over conditions.

By Frisch and Waugh the coefficient of an effect beside a nuisance is that of its sensitivity's residual. All that is
asked for is a solve of sums of one Gram matrix a group of samples, with groups or columns left out.

Numbers that do not enter linearly are found by damped Gauss-Newton steps, the nuisance refitted at each (variable
projection).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array, Index
from mrfit.discover.invariance.sensitivity import added, is_place, step_of
from mrfit.discover.invariance.setting import RegressionData, State
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.law_rules import FULL

TINY_SQUARE = 1e-30

Free = tuple[str, int]
"""An effect and one of its groups of numbers."""


@dataclass(frozen=True)
class GramTable:
    """Gram matrices of [nuisance | effects | further columns | target], one a group.

    Attributes
    ----------
    grams
        (G, M, M).
    ends
        Where each level of the nuisance ends.
    free
        Effects' numbers whose derivatives are the next columns.
    scales
        RMS of the columns behind the nuisance: coefficients divided by it are in the columns' unit.
    law
        Coefficients of the unscaled nuisance at the best fit (p,).
    unit
        RMS of the nuisance's columns (p,).
    rows
        Rows.
    constant
        Whether the nuisance's constant takes part; not beside an effect that is one.
    """

    grams: Array
    ends: tuple[int, ...]
    free: tuple[Free, ...]
    scales: Array
    law: Array
    unit: Array
    rows: int
    constant: bool = True

    @property
    def total(self) -> Array:
        """Sum over the groups."""
        return self.grams.sum(axis=0)

    @property
    def size(self) -> int:
        """Columns of the nuisance."""
        return self.ends[-1]

    def solve(self, gram: Array, level: int = FULL, effects: int | None = None, offset: bool | None = None) -> Array:
        """Return coefficients (M - 1,) from a Gram, zero where a column is left out.

        Parameters
        ----------
        gram
            (M, M).
        level
            Highest level of the nuisance.
        effects
            Columns behind the nuisance that take part; None for those of ``free``.
        offset
            Whether the nuisance's constant takes part; None for as the table says.
        """
        place = self.kept(level, offset)
        behind = self.size + np.arange(len(self.free) if effects is None else effects)
        at = np.concatenate([place, behind])
        found = np.zeros(len(gram) - 1)
        found[at] = np.linalg.solve(self._damped(gram, at, len(place)), gram[at, -1])
        return found

    def kept(self, level: int, offset: bool | None = None) -> Index:
        """Return the nuisance's columns up to a level."""
        constant = self.constant if offset is None else offset
        return np.arange(0 if constant else 1, self.ends[level])

    def _damped(self, gram: Array, at: Index, own: int) -> Array:
        damped = gram[np.ix_(at, at)].copy()
        damped[np.arange(own), np.arange(own)] += STANDARD.law_ridge * self.rows
        damped[np.diag_indices_from(damped)] += STANDARD.law_jitter * self.rows
        return damped

    def beside(
        self, columns: Index, level: int = FULL, offset: bool | None = None, effects: int | None = None
    ) -> Array:
        """Return weights (M, C) that make residuals of some columns, the target last, beside nuisance and effects."""
        gram = self.total
        place = self.kept(level, offset)
        at = np.concatenate([place, self.size + np.arange(len(self.free) if effects is None else effects)])
        wanted = np.append(columns, len(gram) - 1)
        weights = np.zeros((len(gram), len(wanted)))
        weights[wanted, np.arange(len(wanted))] = 1.0
        weights[at] -= np.linalg.solve(self._damped(gram, at, len(place)), gram[np.ix_(at, wanted)])
        return weights

    def jackknife(self, level: int = FULL, offset: bool | None = None) -> tuple[Array, Array]:
        """Return steps (G, E) with each group left out, and that group's squared error then (G,)."""
        total, steps, left = self.total, [], []
        for own in self.grams:
            found = self.solve(total - own, level, offset=offset)
            steps.append(found[self.size : self.size + len(self.free)] / self.scales[: len(self.free)])
            left.append(squares(own, found))
        return np.array(steps), np.array(left)

    def steps(self, level: int = FULL, offset: bool | None = None) -> Array:
        """Return the steps (E,) of the effects' numbers to the best fit."""
        found = self.solve(self.total, level, offset=offset)
        return found[self.size : self.size + len(self.free)] / self.scales[: len(self.free)]

    def left(self, level: int = FULL) -> float:
        """Return the squared error of the best fit."""
        gram = self.total
        return squares(gram, self.solve(gram, level))


def squares(gram: Array, coefficients: Array) -> float:
    """Return the squared error of coefficients (M - 1,) by a Gram (M, M) whose last column is the target."""
    own = gram[:-1, :-1]
    return float(gram[-1, -1] - 2.0 * coefficients @ gram[:-1, -1] + coefficients @ own @ coefficients)


@dataclass(frozen=True)
class RegressionRows:
    """The rows of a regression at a state, per record: nuisance (n, p), and the target less what effects add (n,)."""

    law: list[Array]
    target: list[Array]
    unit: Array
    ends: tuple[int, ...]


def rows_of(setting: RegressionData, state: State) -> RegressionRows:
    """Return the rows at a state of the effects."""
    law, target = [], []
    ends: tuple[int, ...] = ()
    for at in range(len(setting.records)):
        found = setting.law(at, state)
        ends = found.ends
        law.append(setting.row_means(at, setting.passed(at, state, found.values)))
        target.append(
            setting.targets[at] - setting.row_means(at, force_added(setting, at, state)) / setting.scales.span
        )
    unit = np.sqrt(sum(np.sum(p**2, axis=0) for p in law) / setting.rows) + STANDARD.law_jitter
    return RegressionRows([p / unit for p in law], target, unit, ends)


def force_added(setting: RegressionData, at: int, state: State) -> Array:
    """Return the force (L + N,) that the effects of a state add to a record."""
    total = np.zeros(len(setting.records[at].speed))
    for name, theta in state.items():
        if setting.known[name].adds:
            total += added(setting.known[name], setting.records[at], theta)
    return total


Extra = Sequence[Sequence[Array]]
"""Further columns, per record: (n,) each, over the range of the output."""


def plain_table(setting: RegressionData, weights: Sequence[Array], state: State) -> GramTable:
    """Return the Gram matrices of the nuisance alone: what the best law leaves beside effects that stay as they are."""
    rows = rows_of(setting, state)
    grams = _grams(setting, weights, rows, [[] for _ in setting.records])
    constant = not any(setting.known[n].constant for n in state)
    return GramTable(grams, rows.ends, (), np.empty(0), np.empty(0), rows.unit, setting.rows, constant)


def table(
    setting: RegressionData,
    weights: Sequence[Array],
    state: State,
    extra: Extra = (),
    rows: RegressionRows | None = None,
) -> GramTable:
    """Return the Gram matrices at a state, further columns behind those of its effects.

    Parameters
    ----------
    setting
        The data.
    weights
        Of each row, per record (n,).
    state
        Effects that are there.
    extra
        Further columns, per record.
    rows
        ``rows_of`` the state, where it is at hand.
    """
    rows = rows or rows_of(setting, state)
    plain = _grams(setting, weights, rows, [[] for _ in setting.records])
    constant = not any(setting.known[n].constant for n in state)
    first = GramTable(plain, rows.ends, (), np.empty(0), np.empty(0), rows.unit, setting.rows, constant)
    law = first.solve(first.total)[: first.size] / rows.unit
    free = tuple(
        (name, n)
        for name in state
        for n in range(len(setting.known[name].numbers))
        if _free(setting, name, n, state[name])
    )
    behind = [
        [derivative(setting, at, state, f, law) for f in free] + (list(extra[at]) if extra else [])
        for at in range(len(setting.records))
    ]
    count = len(behind[0])
    scales = np.array(
        [np.sqrt(sum(np.sum(b[k] ** 2) for b in behind) / setting.rows) + TINY_SQUARE for k in range(count)]
    )
    behind = [[c / s for c, s in zip(b, scales, strict=True)] for b in behind]
    grams = _grams(setting, weights, rows, behind) if count else plain
    return GramTable(grams, rows.ends, free, scales, law, rows.unit, setting.rows, constant)


def _free(setting: RegressionData, name: str, number: int, theta: Array) -> bool:
    """Return whether a number is fitted: strengths, and shapes that have a start, from screening or from a strength.

    A shape that is neutral at its start bends a force that is there: without strength it does nothing.
    """
    effect = setting.known[name]
    param = effect.of(number)
    started = param.role != "shape" or param.scale == "log" or is_place(param, setting.scales)
    return started or ((effect.adds or effect.moves) and effect.value(theta) != 0.0)


def _grams(
    setting: RegressionData, weights: Sequence[Array], rows: RegressionRows, behind: Sequence[Sequence[Array]]
) -> Array:
    size = rows.law[0].shape[1] + len(behind[0]) + 1
    grams = np.zeros((setting.count, size, size))
    for law, target, own, weight, group in zip(rows.law, rows.target, behind, weights, setting.groups, strict=True):
        block, columns = np.empty((len(target), size)), law.shape[1]
        np.multiply(law, weight[:, None], out=block[:, :columns])
        for k, column in enumerate((*own, target), columns):
            np.multiply(column, weight, out=block[:, k])
        edges = np.flatnonzero(np.diff(group, prepend=-1, append=-1))
        for first, last in zip(edges[:-1], edges[1:], strict=True):
            part = block[first:last]
            grams[group[first]] += part.T @ part
    return grams


def derivative(setting: RegressionData, at: int, state: State, free: Free, law: Array) -> Array:
    """Return the derivative (n,) of a record's force by one of an effect's numbers, over the range of the output."""
    name, number = free
    effect, theta, record = setting.known[name], state[name], setting.records[at]
    value = effect.value(theta, number)
    step = step_of(effect, number, value)
    here, there = effect.at(theta, number, value - step), effect.at(theta, number, value + step)
    width = effect.value(there, number) - effect.value(here, number)
    if effect.adds:
        change = added(effect, record, there) - added(effect, record, here)
        return setting.row_means(at, change) / (width * setting.scales.span)
    if effect.moves and not record.moves:
        return np.zeros(len(setting.targets[at]))
    before, after = ({**state, name: t} for t in (here, there))
    return setting.row_means(at, force_of_law(setting, at, after, law) - force_of_law(setting, at, before, law)) / width


def force_of_law(setting: RegressionData, at: int, state: State, law: Array) -> Array:
    """Return the force (L + N,) of a law with coefficients (p,) behind the effects of a state, over the range."""
    force = setting.law(at, state).values @ law
    return setting.passed(at, state, force[:, None])[:, 0]


@dataclass(frozen=True)
class LawRefinement:
    """A state of the effects at its best numbers, the table there, and its squared error."""

    state: State
    table: GramTable
    left: float


def refine(
    setting: RegressionData, weights: Sequence[Array], state: Mapping[str, Array], level: int = FULL
) -> LawRefinement:
    """Return effects with their best numbers, by Levenberg and Marquardt's steps."""
    best, current, damping = _fitted(setting, weights, state, level), dict(state), STANDARD.damping
    for _ in range(STANDARD.refine_rounds):
        step = _damped_step(best.table, level, damping)
        current, most = _moved(setting, best.state, best.table.free, step)
        if most < STANDARD.refine_settled:
            break
        tried = _fitted(setting, weights, current, level)
        if tried.left < best.left:
            little = tried.left > best.left * (1.0 - STANDARD.refine_little)
            best, damping = tried, damping / STANDARD.damping_less
            if little:
                break
        else:
            damping = max(damping, STANDARD.damping) * STANDARD.damping_more
            if damping > STANDARD.damping_hopeless:
                break
    return best


def _fitted(setting: RegressionData, weights: Sequence[Array], state: State, level: int) -> LawRefinement:
    made = table(setting, weights, state)
    # the law is refitted beside effects that stay where they are
    return LawRefinement(state, made, squares(made.total, made.solve(made.total, level, effects=0)))


def _damped_step(made: GramTable, level: int, damping: float) -> Array:
    """Return the step (E,) of the effects' numbers beside a nuisance that follows."""
    count = len(made.free)
    weights = made.beside(made.size + np.arange(count), level, effects=0)
    own = weights.T @ made.total @ weights
    normal = own[:-1, :-1] + np.diag(damping * own.diagonal()[:-1] + STANDARD.law_jitter * made.rows)
    return np.linalg.solve(normal, own[:-1, -1]) / made.scales[:count]


def _moved(setting: RegressionData, state: State, free: Sequence[Free], steps: Array) -> tuple[dict[str, Array], float]:
    """Return a state after steps of its numbers, and the largest relative change."""
    new, most = dict(state), 0.0
    for (name, number), step in zip(free, steps, strict=True):
        effect = setting.known[name]
        param, old = effect.of(number), effect.value(new[name], number)
        value = old + float(step)
        if param.scale == "log" or (effect.moves and old > 0.0):
            value = min(max(value, old / STANDARD.refine_furthest), old * STANDARD.refine_furthest)
        if param.scale == "log" and is_place(param, setting.scales):
            value = min(
                max(value, STANDARD.force_places[0] * setting.scales.travel),
                STANDARD.force_places[1] * setting.scales.travel,
            )
        new[name] = effect.at(new[name], number, value)
        most = max(most, abs(effect.value(new[name], number) - old) / max(abs(old), TINY_SQUARE))
    return new, most
