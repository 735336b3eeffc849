"""Standing of a formula beside the best law: what it takes of conditions left out, and how sure it is."""

from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array
from mrfit.discover.formula.factors import Term
from mrfit.discover.formula.rows import FormulaRows
from mrfit.discover.invariance.estimate import squares
from mrfit.discover.policy import STANDARD, Policy

TINY = 1e-300


@dataclass(frozen=True)
class Formula:
    """Terms with their coefficients beside the best law.

    Attributes
    ----------
    terms
        The terms.
    theta
        Their coefficients (K,): force over the range of the output, of scaled variables.
    errors
        Squared error of each group left out (G,), coefficients from the others, the law from all.
    kept
        Share of the squared error that no law makes, taken on groups left out.
    size
        Largest force over the range.
    left
        Least share of a term's square that no law takes.
    cancelled
        Size of the force over the size of its part that no law makes.
    """

    terms: tuple[Term, ...]
    theta: Array
    errors: Array
    kept: float
    size: float
    left: float
    cancelled: float

    @property
    def price(self) -> float:
        """Price of its terms, and of what cancels against the law."""
        dear = max(self.cancelled / STANDARD.formula_cancelled, 1.0)
        return sum(t.price for t in self.terms) + STANDARD.formula_cancelling * float(np.log2(dear))

    @property
    def structure(self) -> tuple[tuple[str, ...], ...]:
        """Its terms without constants, in order."""
        return tuple(sorted(t.structure for t in self.terms))

    @property
    def error(self) -> float:
        """Squared error of all groups left out."""
        return float(self.errors.sum())


def measured(rows: FormulaRows, terms: tuple[Term, ...]) -> Formula:
    """Return a formula at the constants of its terms."""
    columns = rows.columns(terms)
    free = rows.project(columns)
    whole = np.column_stack([free, rows.projected_target])
    grams = np.array([whole[g].T @ whole[g] for g in rows.groups])
    total: Array = grams.sum(axis=0)

    def fitted(gram: Array) -> Array:
        own = gram[:-1, :-1]
        return np.asarray(np.linalg.solve(own + STANDARD.law_jitter * np.diag(total.diagonal()[:-1]), gram[:-1, -1]))

    theta = fitted(total)
    errors = np.array([squares(g, fitted(total - g)) for g in grams])
    centred = (columns - columns.mean(axis=0)) * rows.weights[:, None]
    force, outside = centred @ theta, free @ theta
    return Formula(
        terms=terms,
        theta=theta,
        errors=errors,
        kept=1.0 - float(errors.sum()) / max(float(total[-1, -1]), TINY),
        size=float(np.max(np.abs(columns @ theta))),
        left=float(np.min((free**2).sum(axis=0) / np.maximum((centred**2).sum(axis=0), TINY))),
        cancelled=float(np.linalg.norm(force) / max(float(np.linalg.norm(outside)), TINY)),
    )


@dataclass(frozen=True)
class Certainty:
    """Certainty of a formula.

    Attributes
    ----------
    errors
        Standard errors of the coefficients (K,): jackknife over groups, the law refitted, constants as they are.
    held
        Share of the squared error of a typical group left out, coefficients and law from the others.
    """

    errors: Array
    held: float

    def clear(self, theta: Array) -> float:
        """Return the standard errors that the least clear coefficient lies from zero."""
        return float(np.min(np.abs(theta) / np.maximum(self.errors, TINY)))


def certainty(rows: FormulaRows, formula: Formula) -> Certainty:
    """Return the certainty of a formula."""
    own = np.column_stack([rows.columns(formula.terms), rows.target]) * rows.weights[:, None]
    cross = np.array([rows.weighed[g].T @ own[g] for g in rows.groups])
    squared = np.array([own[g].T @ own[g] for g in rows.groups])
    p = rows.weighed.shape[1]
    law, beside, whole = rows.grams.sum(axis=0), cross.sum(axis=0), squared.sum(axis=0)
    law += STANDARD.law_ridge * len(own) * np.eye(p)
    found, ratios = [], []
    for k, g in enumerate(rows.groups):
        solved = np.linalg.solve(law - rows.grams[k], beside - cross[k])
        gram = whole - squared[k] - (beside - cross[k]).T @ solved
        theta = np.linalg.lstsq(gram[:-1, :-1], gram[:-1, -1], rcond=None)[0]
        without = own[g, -1] - rows.weighed[g] @ solved[:, -1]
        both = np.append(-theta, 1.0)
        with_it = own[g] @ both - rows.weighed[g] @ (solved @ both)
        ratio = (float(with_it @ with_it) + TINY) / (float(without @ without) + TINY)
        ratios.append(np.clip(ratio, 1.0 / STANDARD.group_ratio, STANDARD.group_ratio))
        found.append(theta)
    spread = np.array(found) - np.mean(found, axis=0)
    count = len(found)
    errors = np.sqrt((count - 1) / count * np.sum(spread**2, axis=0))
    return Certainty(errors, 1.0 - float(np.exp(np.mean(np.log(ratios)))))


def objection(formula: Formula, sure: Certainty, policy: Policy) -> str:
    """Return an objection to a formula, or an empty string."""
    clear = sure.clear(formula.theta)
    least = policy.formula_kept_if_plain if clear >= policy.formula_plain else policy.formula_kept
    most = clear >= policy.formula_plain and formula.kept >= policy.formula_most
    tests = (
        (formula.left < policy.formula_left, "the law may have it"),
        (formula.cancelled > policy.formula_most_cancelled, "nearly all of it cancels against the law"),
        (formula.size < policy.size, f"it is at most {formula.size:.1%} of the range"),
        (formula.kept < least, f"it takes only {max(formula.kept, 0.0):.0%} on conditions left out"),
        (
            sure.held < policy.formula_held and not most,
            f"it takes only {max(sure.held, 0.0):.0%}, the law from the others too",
        ),
        (clear < policy.formula_clear, f"a coefficient lies only {clear:.1f} standard errors from zero"),
    )
    return next((why for bad, why in tests if bad), "")
