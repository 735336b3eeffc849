"""Search for the laws of current that predict what is left out best.

Each level of current between the ends is left out in turn and predicted from the others' fits, see ``by_level``. So are
conditions of all levels, where one has three or more. A law costs its deviance there plus ln n + ln p for each order by
which it differs from the reference, n independent samples and p single changes to choose from (Chen and Chen 2008); a
form that is not the parameter's own counts as one more.
The reference are the laws of the parameters' roles where the model errs, and constants where it leaves only noise.

The laws of all parameters together are changed, one at a time, as long as that lowers the cost, from the reference,
from the roles' laws and from constants. Of laws whose error is within one standard error of the best one's, or greater
by no more than counts, the nearest to the reference is taken (Breiman and others 1984).

Laws are taken only if the tests determine them: the stroke of every condition, at the current of every level, has to be
predicted with a standard error below half the deviation of the output. A level at which one slow stroke was tested
gives a yield force and a knee only together, so that laws of both through this level are open at any other speed.
A law of a role that is not determined gives way to a constant, that of the parameter whose constancy the data oppose
least.

Where three levels or fewer leave no level to hold out, each order has twice the cost. A law of as many coefficients as
there are levels goes through all, whatever its form. It has the form whose law of one coefficient fewer comes clearly
nearest to the optima, else the parameter's own.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product

import numpy as np

from mrfit.core.specs import Array, Index
from mrfit.fit.laws.by_level import CurrentLaw, Laws, Tests
from mrfit.simulate.current_dependence import FORMS, HIGHEST_ORDER, LOG, PLAIN
from mrfit.simulate.current_levels import CURRENT_GRID, POLYNOMIAL_ROLES

# Fewest levels at which those between the ends are held out
FEWEST_LEVELS = 4
# Cost of a coefficient in ln n, where held-out levels judge and where the fitted ones do
HELD_OUT_COST, FITTED_COST = 1.0, 2.0
# Cost of one that no force, stiffness or damping has: a change of scale of the state of a loop can stand for theirs
UNUSUAL = 2.0
# Fewest conditions at a current of which one is left out: of two, the other says too little of it. Most such folds
FEWEST_STROKES = 3
FOLD_ROUNDS_MAX = 4
# Error at a level, as a multiple of what its own fit leaves, up to which a simpler law may be worse than the best
MOST_WORSE = 1.1
# Rise of the logarithm of the mean error that is none, however many samples tell it from chance
NEGLIGIBLE_RISE = 0.005
# Distance of a form's law from the optima, as a share of that of the parameter's own form, below which it is nearer. On
# dampers of 3 currents 1/3 left 5 % beyond 1.5 times the best law's error, 1/2 left 7 %, the own form alone 14 %
NEARER = 1.0 / 3.0
# Standard error of a predicted output as a share of its deviation, above which the tests do not determine it: twice
# the error, an interval of 95 %, then spans the output itself
MOST_OPEN = 0.5
# Changes after which the search ends
MOST_CHANGES = 60
State = tuple[CurrentLaw, ...]
"""The law of each group of parameters."""


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
        One fold for each of these levels. Where a level has three conditions or more, also folds in each of which one
        condition of every level that has several is left out, at one level the first while it is the second at the
        next.
    """
    every = np.arange(len(places))
    inner = range(1, levels - 1) if levels >= FEWEST_LEVELS else range(0)
    by_level = [Fold(every[places != k], every[places == k]) for k in inner]
    members = [every[places == k] for k in range(levels)]
    rounds = min(max(len(m) for m in members), FOLD_ROUNDS_MAX)
    by_test = []
    for turn in range(rounds if rounds >= FEWEST_STROKES else 0):
        left = [m[(np.arange(len(m)) + k) % max(min(len(m), rounds), 1) == turn] for k, m in enumerate(members)]
        left = [part for part, m in zip(left, members, strict=True) if len(part) < len(m)]
        judged = np.concatenate(left)
        if len(judged):
            by_test.append(Fold(np.setdiff1d(every, judged), judged))
    return by_level, by_test


@dataclass
class LawSearch:
    """Laws of groups of parameters and their scores under conditions left out, or under all where none can be.

    Attributes
    ----------
    tests
        What is known under each condition.
    groups
        Places among the free parameters of those that vary alike, for all that are chosen.
    reference
        Law of each group that it keeps where no other is better: its form is the group's own.
    kept
        Laws of the other parameters, by place.
    deviances
        Deviance (J,) under each condition judged, of what was judged so far.
    """

    tests: Tests
    groups: list[list[int]]
    reference: State
    kept: dict[int, CurrentLaw]
    deviances: dict[State, Array] = field(default_factory=dict)

    @cached_property
    def folds(self) -> list[Fold]:
        """What is left out, levels first."""
        by_level, by_test = folds_of(self.tests.places, len(self.tests.currents))
        whole = np.arange(len(self.tests.places))
        return [*by_level, *by_test] or [Fold(whole, whole)]

    @property
    def held_out(self) -> bool:
        """Whether levels are left out that the laws of the others have to reach."""
        return len(self.tests.currents) >= FEWEST_LEVELS

    @property
    def highest(self) -> int:
        """Highest order that the levels support."""
        count = len(self.tests.currents)
        return min(HIGHEST_ORDER, count - 2 if self.held_out else count - 1)

    @property
    def price(self) -> float:
        """What a coefficient costs: more where samples are many, and changes to choose from."""
        worth, changes = float(self.tests.worth.sum()), len(self.groups) * len(FORMS) * self.highest
        return (HELD_OUT_COST if self.held_out else FITTED_COST) * float(np.log(worth)) + float(np.log(changes))

    def laws(self, state: State) -> list[CurrentLaw]:
        """Return the law of each free parameter."""
        laws = [self.kept.get(k, CurrentLaw(PLAIN, 0)) for k in range(len(self.tests.free))]
        for members, law in zip(self.groups, state, strict=True):
            for member in members:
                laws[member] = law
        return laws

    def score(self, states: Iterable[State]) -> None:
        """Judge states that were not judged before, those of one level simulated together."""
        new = [s for s in dict.fromkeys(states) if s not in self.deviances]
        if not new:
            return
        found_in: list[list[Array]] = [[] for _ in new]
        for fold in self.folds:
            fitted = Laws(self.tests, [self.laws(s) for s in new], fold.known)
            theta = fitted.parameters(self.tests.currents)
            for test in fold.judged:
                found_at = np.ascontiguousarray(theta[:, self.tests.places[test]])
                for row, found in zip(found_in, self.tests.deviance(int(test), found_at), strict=True):
                    row.append(found)
        for state, row in zip(new, found_in, strict=True):
            self.deviances[state] = np.array(row)

    def total(self, state: State) -> float:
        """Return what the choice makes least: a state's deviance and the cost of its coefficients."""
        return float(self.deviances[state].sum()) + self._price(state)

    def _price(self, state: State) -> float:
        changes = 0.0
        for group, (members, law, usual) in enumerate(zip(self.groups, state, self.reference, strict=True)):
            own = abs(law.order - usual.order) + int(law.order > 0 and law.form != self.own_form(group, law.order))
            role = self.tests.cube.params[self.tests.free[members[0]]].role
            changes += len(members) * own * (1.0 if role in POLYNOMIAL_ROLES or not role else UNUSUAL)
        return self.price * changes

    def _first_allowed(self, states: Iterable[State]) -> State | None:
        """Return the first state that the tests determine and that stays inside the parameters' bounds."""
        return next((s for s in states if not self._leaves_bounds(s) and self.is_determined(s)), None)

    def _leaves_bounds(self, state: State) -> bool:
        """Return whether a positive parameter falls below its bound within the range tested."""
        grid = np.linspace(self.tests.currents[0], self.tests.currents[-1], CURRENT_GRID)
        return bool(self.fitted(state).leaves_bounds(grid)[0])

    def is_determined(self, state: State) -> bool:
        """Return whether the tests determine a state's prediction of every stroke at every current.

        Where constants leave it open, no law of current is to blame.
        """
        return self._openness(state) <= MOST_OPEN

    def _openness(self, state: State) -> float:
        """Return the greatest standard error of a stroke at a current, of those determined with constants."""
        found: Array = self.fitted(state).standard_errors()[0]
        return float(np.max(found, where=self._constant_errors <= MOST_OPEN, initial=0.0))

    @cached_property
    def _constant_errors(self) -> Array:
        """Standard error (U, L) of the prediction by constants, of every stroke at every current."""
        constant = tuple(self._constant(group) for group in range(len(self.groups)))
        found: Array = self.fitted(constant).standard_errors()[0]
        return found

    def determined(self, state: State) -> State:
        """Return a state with constants in place of undetermined laws: the fewest, of least misfit."""
        while not self.is_determined(state):
            varying = [g for g, law in enumerate(state) if law.order]
            fewer = [(*state[:g], self._constant(g), *state[g + 1 :]) for g in varying]
            enough = [s for s in fewer if self.is_determined(s)]
            self.score(enough)
            found = min(enough, key=lambda s: float(self.deviances[s].sum()), default=None)
            state = found or min(fewer, key=self._openness)
        return state

    def fitted(self, state: State) -> Laws:
        """Return the laws that fit all conditions best."""
        return Laws(self.tests, [self.laws(state)], np.arange(len(self.tests.places)))

    def neighbours(self, state: State, group: int) -> list[State]:
        """Return the states in which the law of one group is of another form, or of another order by two at most."""
        law, found = state[group], []
        for order, form in product(range(self.highest + 1), self.forms(group)):
            if self._through_all(order) and form != self.own_form(group, order):
                continue
            other = CurrentLaw(form, order) if order else self._constant(group)
            turned = other.form != law.form and law.order > 0 and order > 0
            if other != law and abs(order - law.order) <= (0 if turned else 2):
                found.append((*state[:group], other, *state[group + 1 :]))
        return list(dict.fromkeys(found))

    def _constant(self, group: int) -> CurrentLaw:
        return CurrentLaw(self.reference[group].form, 0)

    def forms(self, group: int) -> tuple[str, ...]:
        """Return the forms a group may have; two points do not tell them apart."""
        params = [self.tests.cube.params[self.tests.free[m]] for m in self.groups[group]]
        several = all(p.low > 0.0 for p in params) and len(self.tests.currents) > 2
        own = self.reference[group].form
        return (own, *(form for form in FORMS if form != own)) if several else (own,)

    def own_form(self, group: int, order: int) -> str:
        """Return the form that costs a group nothing at an order."""
        usual = self.reference[group].form
        return self._nearest_forms[group] if self._through_all(order) else usual

    def _through_all(self, order: int) -> bool:
        """Return whether a law has as many coefficients as there are levels, so that nothing tells its form."""
        return order == len(self.tests.currents) - 1

    @cached_property
    def _nearest_forms(self) -> list[str]:
        """The form of each group that comes nearest with one coefficient fewer than there are levels."""
        found = []
        for group, usual in enumerate(self.reference):
            away = {form: self._distance(group, form) for form in self.forms(group)}
            nearest = min(away, key=lambda form: away[form])
            found.append(nearest if away[nearest] < NEARER * away[usual.form] else usual.form)
        return found

    def _distance(self, group: int, form: str) -> float:
        """Return the distance from the optima, in their deviations, of a form's laws of one coefficient fewer."""
        values = self.tests.theta[:, self.tests.free[self.groups[group]]]
        law, currents = CurrentLaw(form, len(values) - 2), self.tests.currents.tobytes()
        targets = np.log(values) if form == LOG else values
        found = self.tests.basis(law, currents) @ self.tests.through(law, currents) @ targets
        away = (np.exp(found) if form == LOG else found) - values
        return float(np.linalg.norm(away / np.maximum(np.std(values, axis=0), 1e-300)))

    def best(self, starts: Iterable[State]) -> State:
        """Return the state of least cost that single changes lead to from any of some states, and do not improve."""
        return min((self._improved(s) for s in starts), key=lambda s: self.total(s))

    def _improved(self, state: State) -> State:
        self.score([state])
        for _ in range(MOST_CHANGES):
            others = [s for g in range(len(state)) for s in self.neighbours(state, g)]
            self.score(others)
            lower = [s for s in others if self.total(s) < self.total(state)]
            least = self._first_allowed(sorted(lower, key=lambda s: self.total(s)))
            if least is None:
                break
            state = least
        return state

    def nearest(self, best: State) -> State:
        """Return the state nearest to the reference whose error is within a standard error of the best."""
        state = best
        while True:
            nearer = [
                s for g in range(len(state)) for s in self.neighbours(state, g) if self._price(s) < self._price(state)
            ]
            self.score(nearer)
            alike = [s for s in nearer if self._alike(s, best)]
            found = self._first_allowed(sorted(alike, key=lambda s: (self._price(s), self.total(s))))
            if found is None:
                return state
            state = found

    def _alike(self, state: State, best: State) -> bool:
        more = self.deviances[state] - self.deviances[best]
        if len(more) < 3 or not np.isfinite(self.total(state)):
            return False
        limit = np.sqrt(len(more)) * float(np.std(more, ddof=1))
        errors = np.exp(0.5 * more / self._worth)
        negligible = float(np.mean(np.log(errors))) <= NEGLIGIBLE_RISE
        return bool((more.sum() <= limit or negligible) and errors.max() <= MOST_WORSE)

    @cached_property
    def _judged(self) -> Index:
        """The condition that each deviance is of."""
        return np.concatenate([f.judged for f in self.folds])

    @cached_property
    def _worth(self) -> Array:
        return self.tests.worth[self._judged]

    def objection(self, state: State, chosen: State) -> str:
        """Return why a state was not taken though the error at the levels left out is smaller than the chosen one's."""
        if self._leaves_bounds(state):
            return "it falls below the parameter's bound between the currents"
        if not self.is_determined(state):
            return "the tests do not determine it"
        if self.deviances[state].sum() >= self.deviances[chosen].sum():
            return "it is worse where single conditions are left out"
        if self.total(state) >= self.total(chosen):
            return "the gain does not pay for the change"
        return "the gain is within one standard error over conditions"

    def errors(self, state: State) -> Array:
        """Return the RMS error at each level judged, as a multiple of what the level's own fit leaves, nan elsewhere.

        It is that of the fold in which the whole level is left out, where there is one.
        """
        whole = sum(len(f.judged) for f in self.folds[: len(self.tests.currents) - 2]) if self.held_out else None
        deviances, judged = self.deviances[state][:whole], self._judged[:whole]
        levels = self.tests.places[judged]
        squares = self.tests.squares[judged] + self.tests.unseen[judged]
        with np.errstate(over="ignore", invalid="ignore"):
            left = squares * np.exp(deviances / self.tests.worth[judged])
            count = len(self.tests.currents)
            ratios = np.bincount(levels, left, count) / np.bincount(levels, squares, count)
        return np.sqrt(ratios)
