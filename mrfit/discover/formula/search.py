"""Search for the terms of a formula: a beam over a grid of constants, constants by variable projection, and the choice.

Source: variable projection, G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413; matching pursuit with a beam.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from mrfit.core.specs import Array, Index
from mrfit.discover.formula.factors import Term
from mrfit.discover.formula.grammar import from_an_origin
from mrfit.discover.formula.rows import FormulaRows
from mrfit.discover.formula.standing import TINY, Formula, certainty, measured
from mrfit.discover.policy import STANDARD, Policy


@dataclass(frozen=True)
class _Draft:
    """Terms at constants that are not refined, and the share of what no law makes that they take."""

    terms: tuple[Term, ...]
    share: float

    @property
    def structure(self) -> tuple[tuple[str, ...], ...]:
        """Its terms without constants, in order."""
        return tuple(sorted(t.structure for t in self.terms))


@dataclass(frozen=True)
class _Grid:
    """Terms at every constant that they are tried with, of which a law leaves something.

    ``unit`` (n, T) are their rows beside the law, of unit length, ``target`` (n,) is the output's.
    """

    terms: tuple[Term, ...]
    unit: Array
    target: Array

    def extended(self, terms: tuple[Term, ...], free: Array, most: int) -> list[_Draft]:
        """Return terms, of rows (n, K) beside the law, with one more each: the best of each structure, in order."""
        basis = np.linalg.qr(free)[0]
        own = basis.T @ self.unit
        left, alone = 1.0 - np.sum(own**2, axis=0), self.target - basis @ (basis.T @ self.target)
        gains = np.where(left > STANDARD.formula_alike, (alone @ self.unit) ** 2 / np.maximum(left, TINY), 0.0)
        whole = max(float(self.target @ self.target), TINY)
        had = whole - float(alone @ alone)
        seen, found = {t.structure for t in terms}, list[_Draft]()
        for j in np.argsort(-gains):
            if len(found) == most or gains[j] <= 0.0:
                break
            if self.terms[j].structure not in seen:
                seen.add(self.terms[j].structure)
                found.append(_Draft((*terms, self.terms[j]), (had + float(gains[j])) / whole))
        return found


def candidates(rows: FormulaRows, terms: Sequence[Term], policy: Policy) -> list[Formula]:
    """Return formulas of one, two and three terms at their best constants.

    Each gets a further term after its own constants were refined: what they are off by would be taken for one.
    """
    grid = _grid(rows, terms, policy)
    drafts = grid.extended((), np.empty((len(grid.target), 0)), policy.formula_singles)
    found: list[Formula] = []
    for most, steps, extended in zip(
        policy.formula_refined, policy.formula_steps, (*policy.formula_extended, 0), strict=True
    ):
        best = max((d.share for d in drafts), default=0.0)
        worth = [
            d
            for n, d in enumerate(drafts[:most])
            if n < 2 or (1.0 - d.share) / max(1.0 - best, STANDARD.formula_small) < policy.formula_worth
        ]
        level = sorted((measured(rows, refined(rows, d.terms, steps)) for d in worth), key=lambda f: f.error)
        found += level
        grown = (
            d
            for f in level[:extended]
            for d in grid.extended(f.terms, rows.project(rows.columns(f.terms)), policy.formula_grown)
        )
        unique: dict[tuple[tuple[str, ...], ...], _Draft] = {}
        for draft in sorted(grown, key=lambda d: -d.share):
            unique.setdefault(draft.structure, draft)
        drafts = list(unique.values())
    return [*found, *_with_origins(rows, found, policy)]


def _grid(rows: FormulaRows, terms: Sequence[Term], policy: Policy) -> _Grid:
    columns = rows.columns(terms)
    good = np.all(np.isfinite(columns), axis=0)
    columns = np.where(good, columns, 0.0)
    free = rows.project(columns)
    own = np.sum(free**2, axis=0)
    whole = np.sum(((columns - columns.mean(axis=0)) * rows.weights[:, None]) ** 2, axis=0)
    at: Index = np.flatnonzero(good & (own > policy.formula_left * np.maximum(whole, TINY)))
    return _Grid(tuple(terms[j] for j in at), free[:, at] / np.sqrt(own[at]), rows.projected_target)


def _with_origins(rows: FormulaRows, found: Sequence[Formula], policy: Policy) -> list[Formula]:
    """Return single terms of powers of the place with the origin left open: it costs less than a term of its own."""
    opened = [from_an_origin(f.terms[0]) for f in found if len(f.terms) == 1]
    return [measured(rows, refined(rows, (t,), policy.formula_steps[0])) for t in opened if t is not None]


def refined(rows: FormulaRows, terms: tuple[Term, ...], steps: int) -> tuple[Term, ...]:
    """Return terms at the constants that leave least, by so many steps of bounded least squares."""
    start = np.array([c for t in terms for c in t.constants])
    if not len(start):
        return terms
    low, high = np.array([b for t in terms for b in t.bounds]).T
    ends = np.cumsum([len(t.constants) for t in terms])[:-1]

    def at(constants: Array) -> tuple[Term, ...]:
        return tuple(t.at(tuple(map(float, c))) for t, c in zip(terms, np.split(constants, ends), strict=True))

    def left(constants: Array) -> Array:
        free = rows.project(rows.columns(at(constants)))
        best = np.linalg.lstsq(free, rows.projected_target, rcond=None)[0]
        return np.asarray(rows.projected_target - free @ best)

    inside = np.clip(start, low + STANDARD.formula_jitter, high - STANDARD.formula_jitter)
    try:
        found = least_squares(
            left,
            inside,
            bounds=(low, high),
            diff_step=[STANDARD.formula_step],
            x_scale=np.maximum(np.abs(inside), STANDARD.formula_least_scale),
            max_nfev=steps,
        )
    except (ValueError, np.linalg.LinAlgError):
        return terms
    return at(found.x)


def again(rows: FormulaRows, found: Sequence[Formula], policy: Policy) -> list[Formula]:
    """Return candidates measured again on rows of other weights, those near the best at new constants."""
    least = min(f.error for f in found)
    near = [f for f in found if f.error < policy.formula_looked_at * least]
    worth = policy.formula_refined_again * least
    return [
        measured(rows, refined(rows, f.terms, policy.formula_steps_again) if f.error < worth else f.terms) for f in near
    ]


def chosen(rows: FormulaRows, found: Sequence[Formula], policy: Policy) -> tuple[Formula, list[Formula]]:
    """Return the formula of fewest terms that no further term improves clearly, and those as good.

    Of formulas as good the cheapest is chosen.
    """
    best = {}
    for f in sorted(found, key=lambda f: -f.error):
        best[len(f.terms)] = f
    now = best[min(best)]
    for count in sorted(best)[1:]:
        other = best[count]
        if not _earns(rows, other, now, policy):
            break
        now = other
    cheaper = [f for f in as_good(found, now, policy) if f.price < now.price - policy.formula_cheaper]
    if cheaper:
        now = min(cheaper, key=lambda f: (round(f.price, 3), f.error))
    return now, sorted(as_good(found, now, policy), key=lambda f: f.error)


def _earns(rows: FormulaRows, other: Formula, now: Formula, policy: Policy) -> bool:
    """Return whether a formula's further term earns its place: it takes much of what is left, or is plain."""
    if not _falls(now.errors - other.errors):
        return False
    if other.error <= (1.0 - policy.formula_more) * now.error:
        return True
    takes = other.kept - now.kept >= policy.formula_plain_takes
    if not takes or other.error > (1.0 - policy.formula_more_if_plain) * now.error:
        return False
    return certainty(rows, other).clear(other.theta) >= policy.formula_plain


def as_good(found: Sequence[Formula], now: Formula, policy: Policy) -> list[Formula]:
    """Return the formulas of no more terms that the conditions left out do not tell from one."""
    return [
        f
        for f in found
        if f is not now
        and len(f.terms) <= len(now.terms)
        and f.error <= policy.formula_same * now.error
        and f.kept >= policy.formula_gain * now.kept
        and (f.error <= policy.formula_same_if_clear * now.error or not _falls(f.errors - now.errors))
    ]


def _falls(fall: Array) -> bool:
    """Return whether a fall of the squared errors of groups (G,) is clear over these."""
    return bool(fall.mean() > 2.0 * fall.std(ddof=1) / np.sqrt(len(fall)))
