"""Choice of the terms that a law lacks, on whole conditions left out.

    y - F_base = J d + sum_k theta_k s_k + noise,    J the sensitivities of the base to its parameters

A term is taken if the error of conditions left out falls by enough without any one of them, clearly over conditions,
and by more than chance makes of terms that are shifted in time. All errors are made of one Gram matrix a condition.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.specs import Array
from mrfit.discover.policy import STANDARD, Policy


@dataclass(frozen=True)
class TriedTerm:
    """A term that was tried.

    Attributes
    ----------
    place
        Of the term.
    errors
        Squared errors of conditions left out (G,) with it.
    alike
        Terms that do as well.
    takes, least
        Share of the squared error of conditions left out that it takes, conditions weighed alike; the least share with
        one more of them left out, whichever it is.
    """

    place: int
    errors: Array
    alike: tuple[int, ...]
    takes: float
    least: float


@dataclass(frozen=True)
class Choice:
    """Terms that conditions left out chose.

    Attributes
    ----------
    base
        Squared errors of conditions left out (G,), the base fitted to the others.
    steps
        Terms that were taken, one after the other.
    refused
        The next best, None where all were taken.
    """

    base: Array
    steps: tuple[TriedTerm, ...]
    refused: TriedTerm | None

    @property
    def first(self) -> TriedTerm:
        """Return the best first term, taken or not."""
        tried = (*self.steps, *([self.refused] if self.refused else []))
        return tried[0]

    @property
    def places(self) -> list[int]:
        """Places of the terms that were taken."""
        return [s.place for s in self.steps]


@dataclass(frozen=True)
class ConditionGrams:
    """Gram matrices (G, M, M) of [base | terms | target], with K columns of the base, and the penalty of fits."""

    grams: Array
    own: int
    ridge: float = STANDARD.repair_ridge

    @property
    def terms(self) -> int:
        """Number of terms."""
        return self.grams.shape[1] - 1 - self.own

    def columns(self, places: Sequence[int]) -> list[int]:
        """Return the columns of the base and of some terms."""
        return [*range(self.own), *(self.own + p for p in places)]

    def without(self, condition: int) -> "ConditionGrams":
        """Return the same without a condition."""
        return replace(self, grams=np.delete(self.grams, condition, axis=0))

    def fitted(self, places: Sequence[int], left_out: int | None = None) -> Array:
        """Return coefficients (K + k,) of base and terms, fitted to all conditions but one."""
        gram = self.grams.sum(axis=0) - (0.0 if left_out is None else self.grams[left_out])
        at = self.columns(places)
        return np.asarray(np.linalg.solve(self._damped(gram, at), gram[at, -1]))

    def error(self, places: Sequence[int], left_out: int) -> float:
        """Return the squared error of a condition, base and terms fitted to the others."""
        at = [*self.columns(places), self.grams.shape[1] - 1]
        both = np.append(-self.fitted(places, left_out), 1.0)
        return float(both @ self.grams[left_out][np.ix_(at, at)] @ both)

    def errors(self, places: Sequence[int]) -> Array:
        """Return the squared error (G,) of each condition left out."""
        return np.array([self.error(places, k) for k in range(len(self.grams))])

    def errors_with_each(self, places: Sequence[int]) -> Array:
        """Return the squared errors (G, C) of conditions left out with each further term, by Frisch and Waugh."""
        at, total = self.columns(places), self.grams.sum(axis=0)
        terms = np.arange(self.terms)
        rest, found = self.own + terms, []
        for own in self.grams:
            gram: Array = total - own
            # terms and target less what the base makes of them
            beside = np.eye(len(gram))[:, self.own :]
            beside[at] -= np.linalg.solve(self._damped(gram, at), gram[at, self.own :])
            fitted, left = gram @ beside, own @ beside
            square = fitted[rest, terms]
            alone = square > STANDARD.repair_alone * gram[rest, rest]
            theta = np.where(alone, fitted[rest, -1] / np.where(alone, square + self._damping(gram), 1.0), 0.0)
            squares, mixed = (beside * left).sum(axis=0), beside.T @ left[:, -1]
            found.append(squares[-1] - 2.0 * theta * mixed[:-1] + theta**2 * squares[:-1])
        return np.array(found)

    def _damped(self, gram: Array, at: Sequence[int]) -> Array:
        damped = gram[np.ix_(at, at)].copy()
        damped[np.diag_indices_from(damped)] += self._damping(gram)
        return damped

    def _damping(self, gram: Array) -> float:
        return float(self.ridge * np.trace(gram[:-1, :-1]) / (len(gram) - 1))


def chosen(grams: ConditionGrams, policy: Policy, most: int | None = None) -> Choice:
    """Return the terms that conditions left out choose, so many at most."""
    errors = base = grams.errors(())
    # one condition that the base cannot reach from the others would decide alone
    weights = 1.0 / (base + np.median(base))
    steps: list[TriedTerm] = []
    while len(steps) < (most or policy.repair_most):
        tried = grams.errors_with_each([s.place for s in steps])
        sums, now = weights @ tried, float(weights @ errors)
        good = np.flatnonzero(sums <= sums.min() + policy.repair_same * max(now - sums.min(), 0.0))
        left, best = weights * errors, weights * tried[:, good[0]]
        # one condition alone is not to decide
        least = 1.0 - float(np.max((best.sum() - best) / (left.sum() - left)))
        alike = tuple(int(p) for p in good[1:])
        step = TriedTerm(int(good[0]), tried[:, good[0]], alike, 1.0 - float(sums[good[0]]) / now, least)
        if step.least < policy.repair_takes or not clear(weights * (errors - step.errors), policy):
            return Choice(base, tuple(steps), step)
        steps.append(step)
        errors = step.errors
    return Choice(base, tuple(steps), None)


def clear(falls: Array, policy: Policy) -> bool:
    """Return whether falls of the errors of conditions (G,) are clearly above zero."""
    return bool(falls.mean() > policy.repair_clear * falls.std(ddof=1) / np.sqrt(len(falls)))


def jackknife(grams: ConditionGrams, places: Sequence[int]) -> tuple[Array, Array]:
    """Return coefficients (K + k,) of base and terms, and their standard errors with each condition left out."""
    grams = replace(grams, ridge=STANDARD.repair_ridge_told)
    left = np.array([grams.fitted(places, k) for k in range(len(grams.grams))])
    spread = np.sqrt((len(left) - 1) / len(left) * np.sum((left - left.mean(axis=0)) ** 2, axis=0))
    return grams.fitted(places), spread
