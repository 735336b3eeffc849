"""Choose form and order of every parameter's dependence on current by what predicts currents left out.

Each level of current between the ends is left out in turn and predicted from the others' fits, see ``by_level``. A law
costs its deviance there plus, as in Schwarz's criterion, ln n for each coefficient, n independent samples; a form that
is not the parameter's own counts as one more. Starting from constants, single parameters' orders and forms are changed
as long as that lowers the cost. Of laws whose error is within one standard error of the best one's the simplest is
taken (Breiman and others 1984).

Where the fits at single currents leave much more than noise, samples are no independent evidence: the orders of the
parameters' roles are changed only where the error left out falls by a third, and by three standard errors over
conditions.

Where three levels or fewer leave nothing to hold out, the levels' own fits decide, each coefficient at twice the cost.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from mrfit.assembly import Assembly
from mrfit.dependence import HIGHEST, LOG, PLAIN, CurrentDependence, Order, logarithmic, through
from mrfit.errors import DataError
from mrfit.fit.by_level import Law, Laws, Posing, Tests, drawn_together, tests_about
from mrfit.fit.cube import Cube
from mrfit.fit.current import default_orders, level_of, levels_of
from mrfit.fit.problem import Block, Posed
from mrfit.fit.starts import Level, level_fits, node_names
from mrfit.kernels.cube import Mask
from mrfit.specs import Array, Index, Param

# Fewest levels at which those between the ends are held out
FEWEST_LEVELS = 4
# Cost of a coefficient in ln n, where held-out levels judge and where the fitted ones do
HELD_OUT_COST, FITTED_COST = 1.0, 2.0
# Error that the fits at single currents leave, as a multiple of the noise floor, above which it is the model's own
OWN_ERROR = 1.5
# Standard errors by which another order has to be better there, and the ratio of errors: of many tried one is by chance
CLEAR, MUCH = 3.0, 1.5
# Share of the conditions of the level tested under most that another level has to have to say so
SEEN = 0.5
# Most folds in which conditions are left out
MOST_ROUNDS = 4
# Error at a level, as a multiple of what its own fit leaves, up to which a simpler law may be worse than the best
MOST_WORSE = 1.1
# The same from which on the data ask for more than their currents can tell
NOT_MET = 1.5
# Changes after which the search ends
MOST_CHANGES = 60
# Laws rejected that are told in words, the nearest first
TOLD = 4
# Currents at which a polynomial is looked at
GRID = 65

State = tuple[Law, ...]


@dataclass(frozen=True)
class Score:
    """Deviance at each level judged (J,), and the cost of the laws' coefficients."""

    deviances: Array
    price: float

    @property
    def total(self) -> float:
        """What the choice makes least."""
        return float(self.deviances.sum()) + self.price


@dataclass(frozen=True)
class Limits:
    """Ends in A of the range tested, randomness, and ``time.monotonic`` after which levels are taken as they are."""

    low: float
    high: float
    rng: np.random.Generator
    deadline: float | None = None


@dataclass(frozen=True)
class Data:
    """Search blocks, the factor on the error of each, and the noise floor of each in the output's unit."""

    blocks: list[Block]
    weights: Array
    floors: Array


@dataclass(frozen=True)
class Choice:
    """What was chosen, and why.

    Attributes
    ----------
    dependence
        The choice, None where every parameter is constant.
    about
        For fit.json: ``judged_by``, ``held_out`` levels with errors, ``parameters`` with what was rejected, ``text``.
    warnings
        What the number of currents cannot support.
    fits
        The base model's fit at each level, rising.
    theta
        Parameters of the laws that fit all levels best, (L, K) at the levels' currents.
    by_role
        Whether all orders are those of the parameters' roles.
    """

    dependence: CurrentDependence | None
    about: dict[str, Any]
    warnings: list[dict[str, str]]
    fits: list[Level]
    theta: Array
    by_role: bool

    def start(self, base: Assembly) -> dict[str, float]:
        """Return the parameters at the nodes, by name, of the laws that fit all levels best."""
        assert self.dependence is not None
        currents = np.array([f.current for f in self.fits])
        nodes = through(base.spec, self.dependence, currents, self.theta)
        return dict(zip(node_names(base, self.dependence), nodes.tolist(), strict=True))


@dataclass(frozen=True)
class Fold:
    """Conditions (V,) from which others (W,) are predicted."""

    known: Index
    judged: Index


def folds_of(places: Index, levels: int) -> tuple[list[Fold], list[Fold]]:
    """Return the folds by which laws are judged: whole levels left out, and conditions of every level.

    Parameters
    ----------
    places
        Level of each condition (U,).
    levels
        Number of levels L; those between the ends are left out where they are four or more.

    Returns
    -------
    tuple
        One fold for each of these levels; and folds in each of which one condition of every level that has several is
        left out, at one level the first while it is the second at the next.
    """
    every = np.arange(len(places))
    inner = range(1, levels - 1) if levels >= FEWEST_LEVELS else range(0)
    by_level = [Fold(every[places != k], every[places == k]) for k in inner]
    members = [every[places == k] for k in range(levels)]
    rounds = min(max(len(m) for m in members), MOST_ROUNDS)
    by_test = []
    for turn in range(rounds if rounds > 1 else 0):
        left = [m[(np.arange(len(m)) + k) % max(min(len(m), rounds), 1) == turn] for k, m in enumerate(members)]
        left = [part for part, m in zip(left, members, strict=True) if len(part) < len(m)]
        judged = np.concatenate(left)
        if len(judged):
            by_test.append(Fold(np.setdiff1d(every, judged), judged))
    return by_level, by_test


@dataclass
class _Search:
    """Laws of groups of parameters and their scores under conditions left out, or under all where none can be."""

    tests: Tests
    groups: list[list[int]]
    own: list[str]
    scores: dict[State, Score] = field(default_factory=dict)

    @cached_property
    def folds(self) -> list[Fold]:
        by_level, by_test = folds_of(self.tests.places, len(self.tests.currents))
        whole = np.arange(len(self.tests.places))
        return [*by_level, *by_test] or [Fold(whole, whole)]

    @property
    def held_out(self) -> bool:
        """Whether levels are left out."""
        return len(self.tests.currents) >= FEWEST_LEVELS

    @property
    def highest(self) -> int:
        count = len(self.tests.currents)
        return min(HIGHEST, count - 2 if self.held_out else count - 1)

    @property
    def price(self) -> float:
        worth = float(self.tests.worth.sum())
        return (HELD_OUT_COST if self.held_out else FITTED_COST) * float(np.log(worth))

    def laws(self, state: State) -> list[Law]:
        """Return the law of each free parameter."""
        laws = [Law(PLAIN, 0)] * len(self.tests.free)
        for members, law in zip(self.groups, state, strict=True):
            for member in members:
                laws[member] = law
        return laws

    def score(self, states: Iterable[State]) -> None:
        """Judge states that were not judged before, those of one level simulated together."""
        new = [s for s in dict.fromkeys(states) if s not in self.scores]
        if not new:
            return
        deviances: list[list[Array]] = [[] for _ in new]
        for fold in self.folds:
            fitted = [Laws(self.tests, self.laws(s), fold.known) for s in new]
            for test in fold.judged:
                current = self.tests.currents[self.tests.places[test]]
                theta = np.array([laws.parameters(np.array([current]))[0] for laws in fitted])
                for row, found in zip(deviances, self.tests.deviance(int(test), theta), strict=True):
                    row.append(found)
        for state, row in zip(new, deviances, strict=True):
            self.scores[state] = Score(np.array(row), self._price(state) + self._outside(state))

    def _price(self, state: State) -> float:
        coefficients = 0
        for members, law, own in zip(self.groups, state, self.own, strict=True):
            coefficients += len(members) * (law.order + 1) + int(law.order > 0 and law.form != own)
        return self.price * coefficients

    def _outside(self, state: State) -> float:
        if not any(law.form == PLAIN and law.order for law in state):
            return 0.0
        grid = np.linspace(self.tests.currents[0], self.tests.currents[-1], GRID)
        return np.inf if self.fitted(state).leaves_bounds(grid) else 0.0

    def fitted(self, state: State) -> Laws:
        """Return the laws that fit all conditions best."""
        return Laws(self.tests, self.laws(state), np.arange(len(self.tests.places)))

    def neighbours(self, state: State, group: int) -> list[State]:
        """Return the states in which the law of one group is another one, by no more than two orders."""
        law, found = state[group], []
        for order, form in product(range(self.highest + 1), self.forms(group)):
            other = Law(form, order) if order else Law(self.own[group], 0)
            if other != law and abs(order - law.order) <= 2:
                found.append((*state[:group], other, *state[group + 1 :]))
        return list(dict.fromkeys(found))

    def forms(self, group: int) -> tuple[str, ...]:
        """Return the forms a group may have; two points do not tell them apart."""
        params = [self.tests.cube.params[self.tests.free[m]] for m in self.groups[group]]
        both = all(p.low > 0.0 for p in params) and len(self.tests.currents) > 2
        return (self.own[group], PLAIN if self.own[group] == LOG else LOG) if both else (self.own[group],)

    def best(self) -> State:
        """Return the state that single changes do not improve, from constants on."""
        return self._improved(tuple(Law(own, 0) for own in self.own), clearly=False)

    def near(self, usual: dict[str, int]) -> State:
        """Return the usual orders by name, with those changes that clearly lower the error left out."""
        params = [self.tests.cube.params[k] for k in self.tests.free]
        orders = [min(usual.get(params[g[0]].name, 0), self.highest) for g in self.groups]
        start = tuple(Law(own, order) for own, order in zip(self.own, orders, strict=True))
        return self._improved(start, clearly=True)

    def _improved(self, state: State, *, clearly: bool) -> State:
        self.score([state])
        for _ in range(MOST_CHANGES):
            others = [s for g in range(len(state)) for s in self.neighbours(state, g)]
            self.score(others)
            lower = [s for s in others if self.scores[s].total < self.scores[state].total]
            lower = [s for s in lower if not clearly or self._clearly(s, state)]
            if not lower:
                break
            state = min(lower, key=lambda s: self.scores[s].total)
        return state

    def _clearly(self, state: State, than: State) -> bool:
        """Return whether a state's error is much lower than another's, by several standard errors over conditions."""
        gain = (self.scores[than].deviances - self.scores[state].deviances)[self._speaks]
        if len(gain) < 2 or not np.all(np.isfinite(gain)):
            return False
        spread = np.sqrt(len(gain)) * float(np.std(gain, ddof=1))
        ratio = float(np.mean(0.5 * gain / self._worth[self._speaks]))
        return bool(gain.sum() > CLEAR * spread and ratio > np.log(MUCH))

    @cached_property
    def _speaks(self) -> Mask:
        """Which deviances are of levels tested under no fewer than half as many conditions as any other.

        Of a wrong model a level's one stroke gives parameters that are right for this stroke alone.
        """
        conditions = np.bincount(self.tests.places)
        speaks: Mask = conditions[self.tests.places[self._judged]] >= SEEN * conditions.max()
        return speaks

    def simplest(self, best: State) -> State:
        """Return the simplest state found by lowering orders whose error is within a standard error of the best."""
        state = best
        while True:
            lower = [
                s
                for g in range(len(state))
                for s in self.neighbours(state, g)
                if self._price(s) < self._price(state) and s[g].order <= state[g].order
            ]
            self.score(lower)
            alike = [s for s in lower if self._alike(s, best)]
            if not alike:
                return state
            state = min(alike, key=lambda s: (self._price(s), self.scores[s].total))

    def _alike(self, state: State, best: State) -> bool:
        found, least = self.scores[state], self.scores[best]
        more = found.deviances - least.deviances
        if len(more) < 3 or not np.isfinite(found.total):
            return False
        limit = np.sqrt(len(more)) * float(np.std(more, ddof=1))
        errors = np.exp(0.5 * more / self._worth)
        return bool(more.sum() <= limit and errors.max() <= MOST_WORSE)

    @cached_property
    def _judged(self) -> Index:
        """The condition that each deviance is of."""
        return np.concatenate([f.judged for f in self.folds])

    @cached_property
    def _worth(self) -> Array:
        return self.tests.worth[self._judged]

    def errors(self, state: State) -> Array:
        """Return the RMS error at each level judged, as a multiple of what the level's own fit leaves, nan elsewhere.

        It is that of the fold in which the whole level is left out, where there is one.
        """
        whole = sum(len(f.judged) for f in self.folds[: len(self.tests.currents) - 2]) if self.held_out else None
        deviances, judged = self.scores[state].deviances[:whole], self._judged[:whole]
        levels = self.tests.places[judged]
        squares = self.tests.squares[judged]
        with np.errstate(over="ignore", invalid="ignore"):
            left = squares * np.exp(deviances / self.tests.worth[judged])
            count = len(self.tests.currents)
            ratios = np.bincount(levels, left, count) / np.bincount(levels, squares, count)
        errors: Array = np.sqrt(ratios)
        return errors


def chosen_by_levels(base: Assembly, cube: Cube, data: Data, kept: dict[str, Order], limits: Limits) -> Choice:
    """Return the dependence on current that the base model's fits at single levels call for.

    Parameters
    ----------
    base, cube
        The base model and its free parameters.
    data
        What is fitted, of two levels or more.
    kept
        Orders of parameters that are not chosen, by name.
    limits
        Range of current, randomness and deadline.
    """
    blocks, weights = data.blocks, data.weights
    fits = level_fits(blocks, base, cube, weights, limits.rng, limits.deadline)
    levels, posed = levels_of(b.segment for b in blocks), []
    for fit in (fits := [f for f in fits if np.isfinite(f.cost)]):
        members = [k for k, b in enumerate(blocks) if level_of(b.segment, levels) == fit.current]
        own = Posed([blocks[k] for k in members], weights[members], base, cube)
        posed.append(Posing(own, data.floors[members]))
    if len(fits) < 2:
        raise DataError(
            f"every simulation of '{base.name}' diverged at all currents but one: narrow --bounds, or give "
            "--current-order"
        )
    together = drawn_together(cube, fits, posed, limits.rng)
    return choose(tests_about(base.spec, cube, together, posed), fits, kept, (limits.low, limits.high))


def choose(tests: Tests, fits: list[Level], kept: dict[str, Order], ends: tuple[float, float]) -> Choice:
    """Return the dependence on current that predicts levels left out best, with no more coefficients than that takes.

    Parameters
    ----------
    tests
        The base model about its optimum at two currents or more.
    fits
        The base model's fit at each level, as it ended.
    kept
        Orders of parameters that are not chosen, by name.
    ends
        Ends in A of the range tested.
    """
    params = [tests.cube.params[k] for k in tests.free]
    chosen = [k for k, p in enumerate(params) if p.name not in kept]
    search = _Search(tests, _groups(params, chosen), [])
    search.own = [LOG if logarithmic(tests.spec, params[g[0]]) else PLAIN for g in search.groups]
    usual = {n: int(order) for n, order in default_orders(tests.spec, len(tests.currents))}
    noisy = tests.excess <= OWN_ERROR
    state = search.simplest(search.best()) if noisy else search.near(usual)
    orders: dict[str, Order] = dict(kept)
    for members, law, own in zip(search.groups, state, search.own, strict=True):
        for member in members:
            written: Order = law.order if law.form == own else f"{law.form}{law.order}"
            orders |= {params[member].name: written} if law.order else {}
    named = tuple((p.name, orders[p.name]) for p in tests.spec.params if orders.get(p.name))
    theta = search.fitted(state).parameters(tests.currents)
    about, warnings = _about(search, state, params)
    by_role = dict(named) == {n: min(order, search.highest) for n, order in usual.items()}
    return Choice(CurrentDependence(named, *ends) if named else None, about, warnings, fits, theta, by_role)


def _groups(params: Sequence[Param], chosen: Sequence[int]) -> list[list[int]]:
    """Return the parameters that vary alike: the coefficients of one expansion, which have no role; others alone."""
    together = [k for k in chosen if not params[k].role]
    alone = [[k] for k in chosen if params[k].role]
    return [*alone, together] if together else alone


def _about(search: _Search, state: State, params: Sequence[Param]) -> tuple[dict[str, Any], list[dict[str, str]]]:
    """Return what fit.json and the page say of a choice, and the warnings."""
    search.score([s for g in range(len(state)) for s in search.neighbours(state, g)])
    errors, rows, currents = search.errors(state), [], search.tests.currents
    how = "held out" if search.held_out else "fitted: too few to hold one out"
    usual = (
        ""
        if search.tests.excess <= OWN_ERROR
        else (
            f"; these leave {search.tests.excess:.3g} times the noise, the model's own error: orders are those of the "
            "parameters' roles but where another clearly predicts better"
        )
    )
    text = [
        f"law of current by the error at currents {how}, as a multiple of what a fit to one current alone leaves{usual}"
    ]
    for group, law in enumerate(state):
        others = sorted(search.neighbours(state, group), key=lambda s: search.scores[s].total)
        rejected = [{**_row(s[group]), "error": _mean(search.errors(s))} for s in others]
        names = [params[m].name for m in search.groups[group]]
        rows.append({"names": names, **_row(law), "error": _mean(errors), "rejected": rejected})
        shown = ", ".join(f"{_short(r)} {_shown(r['error'])}" for r in rejected[:TOLD])
        text.append(
            f"{_span(names)}: {_words(law)}, {_shown(_mean(errors))}" + (f"; rejected {shown}" if shown else "")
        )
    about = {
        "judged_by": "held-out currents" if search.held_out else "fitted currents",
        "currents": currents.tolist(),
        "errors": [
            {"current": float(i), "error": float(e)} for i, e in zip(currents, errors, strict=True) if np.isfinite(e)
        ],
        "parameters": rows,
        "text": text,
    }
    return about, _warnings(search, state, errors)


def _row(law: Law) -> dict[str, Any]:
    return {"form": law.form if law.order else "constant", "order": law.order}


def _short(row: dict[str, Any]) -> str:
    """Return a law as it is written after --current-order."""
    return f"{row['form']}{row['order']}" if row["order"] else "constant"


def _warnings(search: _Search, state: State, errors: Array) -> list[dict[str, str]]:
    currents, found = search.tests.currents, []
    at = ", ".join(f"{i:.4g} A" for i in currents)
    if not search.held_out and any(law.order for law in state):
        found.append(
            f"tests at {len(currents)} currents ({at}) leave none to hold out: between them the laws of current are "
            f"not checked; test at {FEWEST_LEVELS} currents or more"
        )
    worst = int(np.nanargmax(errors))
    if search.held_out and errors[worst] > NOT_MET:
        place = currents[worst]
        found.append(
            f"at {place:.4g} A, held out, the error is {errors[worst]:.3g} times what a fit to this current alone "
            f"leaves: a polynomial through {len(currents) - 1} other currents does not reach it; test at currents "
            "near it, or try pieces (--current-order NAME=1:BREAK:2)"
        )
    return [{"kind": "current-levels", "text": text} for text in found]


def _mean(errors: Array) -> float:
    """Return the mean of errors on a logarithmic scale."""
    with np.errstate(over="ignore"):
        return float(np.exp(np.nanmean(np.log(errors))))


def _shown(error: float) -> str:
    return f"{error:.2f}" if error < 9.995 else f"{error:.3g}"


def _words(law: Law) -> str:
    if not law.order:
        return "constant"
    return f"{'exponential of a polynomial' if law.form == LOG else 'polynomial'} of order {law.order}"


def _span(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]} … {names[-1]}"
