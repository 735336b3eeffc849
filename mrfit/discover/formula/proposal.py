"""A formula for what no law makes and no effect of the library describes, and the tests it has to stand.

    y = Phi beta + sum_k theta_k s_k(x, v, a, i, T, t; c_k) + noise,    all over the range of the output

Phi is the nuisance of any law. A formula is kept only if it stands beside the law of every form that is tried: Phi
alone, with the terms of a base, and with twice the memory.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.specs import Array
from mrfit.discover.formula.factors import Factor, Term
from mrfit.discover.formula.grammar import grammar, mirrored
from mrfit.discover.formula.rows import FormulaRows, moving, samples_of, scales_of
from mrfit.discover.formula.search import again, candidates, chosen
from mrfit.discover.formula.standing import TINY, Certainty, Formula, certainty, measured, objection
from mrfit.discover.invariance.base import Base, none
from mrfit.discover.invariance.records import Record, with_steady_currents
from mrfit.discover.invariance.setting import RegressionData, setting_of
from mrfit.discover.invariance.weights import weights_of
from mrfit.discover.policy import STANDARD, Policy


@dataclass(frozen=True)
class HeldOutErrors:
    """RMS errors over the range on held-out records: what no law makes, the same with the formula, and noise."""

    law: float
    after: float
    noise: float

    @property
    def closed(self) -> float:
        """Share of the squared error beyond noise that the formula takes."""
        whole = self.law**2 - self.noise**2
        return min((self.law**2 - self.after**2) / whole, 1.0) if whole > 0.0 else 0.0


@dataclass(frozen=True)
class Proposal:
    """Result of a search.

    Attributes
    ----------
    formula
        The best; None where no term is outside every law.
    why
        Why it is not proposed; empty if it is.
    sure
        How sure it is.
    alike
        Formulas that the conditions do not tell from it.
    rows
        What it was found on.
    held_out
        Errors on held-out records; None without any.
    shifts
        What laws of other forms move its coefficients by (K,): what is not known of them beside the standard errors.
    """

    formula: Formula | None
    why: str
    sure: Certainty | None = None
    alike: tuple[Formula, ...] = ()
    rows: FormulaRows | None = None
    held_out: HeldOutErrors | None = None
    shifts: Array | None = None

    @property
    def terms(self) -> tuple[Term, ...]:
        """Terms of the best formula; empty without one."""
        return self.formula.terms if self.formula else ()


def propose(records: Sequence[Record], held_out: Sequence[Record], base: Base | None, policy: Policy) -> Proposal:
    """Return the formula for what neither a law nor the base makes of some records.

    Parameters
    ----------
    records, held_out
        Records to find it on, and of other conditions to prove it on; the latter may be none.
    base
        Terms of a base on ``records`` and then ``held_out``, which a formula is to add to; None for no base.
    policy
        Thresholds.
    """
    records, held_out = with_steady_currents(records), with_steady_currents(held_out)
    terms = (base or none([*records, *held_out])).terms
    setting = setting_of(records, terms[: len(records)], [], policy)
    columns = setting.law(0, {}).ends[-1]
    if setting.rows < policy.rows_for_a_column * columns:
        return Proposal(None, f"{setting.rows} rows are too few to tell {columns} forces of laws apart")
    rows = rows_beside(setting)
    found = candidates(rows, grammar(moving(rows.samples, rows.scales)), policy)
    if not found:
        return Proposal(None, "no term is outside every law")
    first = chosen(rows, found, policy)[0]
    rows = reweighed(rows, first)
    found, proof = again(rows, found, policy), None
    if held_out:
        proof = setting_of(held_out, terms[len(records) :], [], policy, scales=setting.scales)
    tried = [_tried(rows, found, terms[: len(records)], proof, policy)]
    # a term that does not stand takes those with it that stand alone
    while tried[-1].why and (fewer := [f for f in found if len(f.terms) < len(tried[-1].terms)]):
        tried.append(_tried(rows, fewer, terms[: len(records)], proof, policy))
    return next((t for t in tried if not t.why), tried[0])


def _tried(
    rows: FormulaRows, found: Sequence[Formula], terms: Sequence[Array], proof: RegressionData | None, policy: Policy
) -> Proposal:
    """Return the result for the best of some formulas; terms (L + N, K) are a base's, the proof is of other records."""
    best, alike = chosen(rows, found, policy)
    sure = certainty(rows, best)
    errors = on_held_out(rows, best, proof) if proof else None
    why = objection(best, sure, policy)
    others = {} if why else beside_other_laws(rows, best, terms, policy)
    why = why or lost_beside_other_laws(best, sure, others, policy)
    if not why and errors and errors.after > errors.law:
        why = "it does not lower the error on held-out conditions"
    shifts = np.max([np.zeros(len(best.theta)), *(np.abs(o.theta - best.theta) for o in others.values())], axis=0)
    return Proposal(best, why, sure, (*readings(rows, best, policy), *alike), rows, errors, shifts)


def rows_beside(setting: RegressionData) -> FormulaRows:
    """Return the rows of a search beside the best law."""
    scales = scales_of(setting)
    rows = FormulaRows(setting, scales, samples_of(setting, scales), np.concatenate(weights_of(setting, {})))
    return rows.with_law_force(np.zeros(setting.rows))


def reweighed(rows: FormulaRows, formula: Formula) -> FormulaRows:
    """Return rows weighed by what is left beside a formula, with the force of the law beside it."""
    force = rows.columns(formula.terms) @ formula.theta
    setting = rows.setting
    left = replace(setting, targets=tuple(t - f for t, f in zip(setting.targets, rows.parts(force), strict=True)))
    return rows.with_weights(weights_of(left, {})).with_law_force(force)


def readings(rows: FormulaRows, formula: Formula, policy: Policy) -> list[Formula]:
    """Return the formula's mirror images that leave the same."""
    found = []
    for at, term in enumerate(formula.terms):
        for other in mirrored(term):
            image = measured(rows, (*formula.terms[:at], other, *formula.terms[at + 1 :]))
            if image.error <= policy.formula_same * formula.error:
                found.append(image)
    return found


def beside_other_laws(
    rows: FormulaRows, formula: Formula, terms: Sequence[Array], policy: Policy
) -> dict[str, Formula]:
    """Return the formula beside laws of other forms, by what is said of them; terms (L + N, K) are a base's."""
    records = rows.setting.records
    others = {"a law that remembers for longer": setting_of(records, terms, [], policy, policy.longer_memory)}
    if terms[0].shape[1]:
        others["a law without the terms of the base"] = setting_of(records, of_the_place(rows, terms), [], policy)
    return {
        what: measured(FormulaRows(setting, rows.scales, rows.samples, rows.weights), formula.terms)
        for what, setting in others.items()
    }


def lost_beside_other_laws(formula: Formula, sure: Certainty, others: Mapping[str, Formula], policy: Policy) -> str:
    """Return an objection of what is left of a formula beside laws of other forms, or an empty string."""
    clear = sure.clear(formula.theta)
    least = policy.formula_kept_if_plain if clear >= policy.formula_plain else policy.formula_kept
    for what, beside in others.items():
        if beside.kept < policy.formula_further * least:
            return f"{what} may have it: beside it {100.0 * max(beside.kept, 0.0):.0f} % are left to take"
        if abs(1.0 - beside.size / formula.size) > policy.formula_drift:
            return f"{what} changes its force by {100.0 * abs(1.0 - beside.size / formula.size):.0f} %"
    return ""


def of_the_place(rows: FormulaRows, terms: Sequence[Array]) -> list[Array]:
    """Return those of a base's terms (L + N, K) that are springs beside any law: no law can stand in for them."""
    setting = rows.setting
    alone = setting_of(setting.records, none(setting.records).terms, [], STANDARD)
    bare = replace(rows, setting=alone)
    own = np.concatenate([setting.row_means(k, t) for k, t in enumerate(terms)])
    left = bare.project(own)
    place = bare.project(bare.column(Term((Factor("x", "line"),))))
    cosines = place @ left / np.maximum(np.linalg.norm(left, axis=0) * np.linalg.norm(place), TINY)
    return [t[:, np.abs(cosines) > STANDARD.effect_force] for t in terms]


def on_held_out(rows: FormulaRows, formula: Formula, setting: RegressionData) -> HeldOutErrors:
    """Return the errors of the best law, without and with a formula, on records that it was not found on.

    The law is that of these records: it errs more on conditions that it does not know than a formula takes.
    """
    force = rows.columns(formula.terms) @ formula.theta
    law = rows.law_beside(force) / rows.unit
    samples = [{**s, "L": setting.law(k, {}).values @ law} for k, s in enumerate(samples_of(setting, rows.scales))]
    others = FormulaRows(setting, rows.scales, tuple(samples), np.ones(setting.rows))
    own = np.concatenate([setting.row_means(k, force_of(rows, formula, s)) for k, s in enumerate(samples)])
    before, after = (float(np.sqrt(np.mean(others.project(y) ** 2))) for y in (others.target, others.target - own))
    return HeldOutErrors(before, after, setting.noise)


def force_of(rows: FormulaRows, formula: Formula, values: dict[str, Array]) -> Array:
    """Return the force (N,) over the range of a formula found on some rows, at scaled variables (N,)."""
    terms = [theta * t.of(values, rows.gauge(t)) for t, theta in zip(formula.terms, formula.theta, strict=True)]
    return np.asarray(np.sum(np.broadcast_arrays(*terms, values["x"] * 0.0), axis=0))
