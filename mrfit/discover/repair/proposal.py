"""The terms that a base's law lacks: chosen on whole conditions left out, against terms that chance makes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array
from mrfit.discover.policy import STANDARD, Policy
from mrfit.discover.repair.choice import Choice, ConditionGrams, chosen, jackknife
from mrfit.discover.repair.rows import FittedBase, RepairRows, rows_of, shifted
from mrfit.discover.repair.terms import LawTerm, candidates


@dataclass(frozen=True)
class Repair:
    """Result of a search.

    Attributes
    ----------
    terms
        Terms of a repair; empty for nothing.
    why
        Why nothing is proposed; empty if something is.
    rows, choice
        Rows and way of the choice.
    theta, spread
        Strengths (k,) over the range of the output, and their standard errors over conditions.
    chance
        Most that terms shifted in time take of conditions left out.
    errors
        RMS errors over the range on held-out records: of the base, and with the terms; None without any.
    """

    terms: tuple[LawTerm, ...]
    why: str
    rows: RepairRows | None = None
    choice: Choice | None = None
    theta: Array | None = None
    spread: Array | None = None
    chance: float = 0.0
    errors: tuple[float, float] | None = None


def repaired(learnt: FittedBase, held_out: FittedBase | None, policy: Policy = STANDARD) -> Repair:
    """Return the terms that a base lacks.

    Parameters
    ----------
    learnt, held_out
        The base on records to choose on, and on those of other conditions to prove it on.
    policy
        Thresholds.
    """
    control = np.concatenate([r.control for r in learnt.records])
    varies = bool(np.ptp(control) > STANDARD.moving_control * max(float(np.abs(control).max()), 1e-9))
    rows = rows_of(learnt, candidates(varies))
    grams = ConditionGrams(rows.grams(), rows.base.shape[1])
    if len(grams.grams) < policy.repair_fewest:
        return Repair((), "there are too few records to leave some out")
    found = chosen(grams, policy)
    drawn = of_chance(rows, np.random.default_rng(0), policy.repair_draws, policy)
    chance, takes, least = max(0.0, *(c.first.takes for c in drawn)), found.first.takes, found.first.least
    if not found.places or takes <= chance:
        why = (
            f"the best of {len(rows.terms)} terms takes {max(takes, 0.0):.0%} of the squared error on conditions left "
            f"out, {max(least, 0.0):.0%} without one of them, terms shifted in time up to {chance:.0%}"
        )
        return Repair((), why, rows, found, chance=chance)
    theta, spread = (
        u[grams.own :] / rows.units[grams.own + np.array(found.places)] for u in jackknife(grams, found.places)
    )
    errors = on_held_out(rows, grams, found.places, held_out) if held_out else None
    why = "it does not lower the error on held-out conditions" if errors and errors[1] >= errors[0] else ""
    return Repair(tuple(rows.terms[p] for p in found.places), why, rows, found, theta, spread, chance, errors)


def of_chance(rows: RepairRows, rng: np.random.Generator, count: int, policy: Policy) -> list[Choice]:
    """Return the choices among the terms shifted in time, drawn so many times."""
    own = rows.base.shape[1]
    return [chosen(ConditionGrams(rows.grams(shifted(rows, rng)), own), policy, most=1) for _ in range(count)]


def on_held_out(
    rows: RepairRows, grams: ConditionGrams, places: Sequence[int], held_out: FittedBase
) -> tuple[float, float]:
    """Return the RMS errors of the base and of it with some terms on records that they were not fitted to."""
    others = rows_of(held_out, rows.terms, rows)

    def error(some: Sequence[int]) -> float:
        whole = np.column_stack([others.base, others.columns[:, list(some)]])
        return float(np.sqrt(np.mean((others.target - whole @ grams.fitted(some)) ** 2)))

    return error(()), error(places)
