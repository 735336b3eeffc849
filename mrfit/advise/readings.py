"""Distance between the readings of a formula on a test, beside any law.

One reading is the force. The coefficients of another are refitted to the data there are and to the test, and a law to
either:

    d^2 = min over b, c of |s_1 theta_1 - s_2 c - Phi b|^2,    in squares of standard errors

Phi is the nuisance of any law, s_1 and s_2 are the terms of the readings, constants as they are. A law that is fitted
to the test alone takes more than one that holds for all: mirror images of a one-sided form are told apart by no test.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, permutations

import numpy as np

from mrfit.advise.criterion import DifferenceInformation, triangle
from mrfit.advise.drives import Test
from mrfit.advise.specimen import Specimen
from mrfit.core.specs import Array
from mrfit.discover.formula.factors import Factor, Term
from mrfit.discover.formula.rows import FormulaRows, Scale, samples_of
from mrfit.discover.invariance.base import none
from mrfit.discover.invariance.nuisance import scales_of
from mrfit.discover.invariance.records import Record, thinned, with_steady_currents
from mrfit.discover.invariance.setting import setting_of
from mrfit.discover.policy import STANDARD
from mrfit.io.schemas.discovery import FormulaReading, ProposedFormula


@dataclass(frozen=True)
class FormulaForm:
    """A reading of a formula: its text in SI, its terms, and their coefficients (K,) over the output's range."""

    text: str
    terms: tuple[Term, ...]
    theta: Array

    @classmethod
    def of(cls, said: FormulaReading) -> "FormulaForm":
        """Return a reading as a discovery stores it."""
        terms = tuple(Term(tuple(Factor(f.variable, f.kind, f.constants) for f in t.factors)) for t in said.terms)
        return cls(said.text, terms, np.array([t.coefficient for t in said.terms]))


@dataclass(frozen=True)
class ReadingSet:
    """Readings of a formula on the data there are.

    Attributes
    ----------
    readings
        The readings.
    rows
        The data there are.
    law
        Coefficients (p,) of the best law beside the first reading, of its columns as they are.
    scatter
        RMS of what law and formula leave, over the output's range.
    known
        Triangle (K, K) of the terms of all readings beside the law in the data there are, in standard errors.
    specimen
        The specimen.
    """

    readings: tuple[FormulaForm, ...]
    rows: FormulaRows
    law: Array
    scatter: float
    known: Array
    specimen: Specimen

    @classmethod
    def of(cls, records: Sequence[Record], proposed: ProposedFormula, specimen: Specimen) -> "ReadingSet":
        """Return the readings of a proposed formula on the records there are."""
        records = with_steady_currents(records)
        setting = setting_of(records, none(records).terms, [], STANDARD)
        readings = tuple(map(FormulaForm.of, proposed.readings))
        scales = {s.symbol: Scale(s.origin, s.size) for s in proposed.scales}
        rows = FormulaRows(setting, scales, samples_of(setting, scales), np.ones(setting.rows))
        rows = rows.with_law_force(np.zeros(setting.rows))
        force = rows.columns(readings[0].terms) @ readings[0].theta
        rows = rows.with_law_force(force)
        scatter = max(float(np.sqrt(np.mean(rows.project(rows.target - force) ** 2))), setting.noise)
        columns = np.hstack([rows.columns(r.terms) for r in readings])
        known = triangle(rows.project(columns) / scatter)
        return cls(readings, rows, rows.law_beside(force) / rows.unit, scatter, known, specimen)

    @property
    def names(self) -> tuple[str, ...]:
        """Texts of the readings."""
        return tuple(r.text for r in self.readings)

    @property
    def noise(self) -> float:
        """Standard error of a row, in the output's unit."""
        return self.scatter * self.rows.scales["L"].size

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """Every two readings, by their places."""
        return list(combinations(range(len(self.readings)), 2))

    def apart(self, test: Test, most: float) -> Array | None:
        """Return the distances (pairs,) that a test adds; None where it takes more than a force in N."""
        setting = self.rows.setting
        channels, made = self.specimen.driven(test), setting.records[0].made
        record = thinned("", test.dt, channels, np.zeros(len(test.time)), made)
        terms, span = none([record]).terms, setting.scales.span
        law = setting_of([record], terms, [], STANDARD, scales=setting.scales).law(0, {}).values @ self.law
        # at speeds and strokes of its own a law is known by the test alone
        own = setting_of([record], terms, [], STANDARD, scales=replace(scales_of([record]), span=span))
        sample = samples_of(own, self.rows.scales)[0] | {"L": law}
        columns = np.column_stack(
            [t.of(sample, self.rows.gauge(t)) + np.zeros(len(law)) for r in self.readings for t in r.terms]
        )
        forces = law + columns[:, : len(self.readings[0].terms)] @ self.readings[0].theta
        if float(np.abs(forces).max()) * span > most:
            return None
        rows = FormulaRows(own, self.rows.scales, (sample,), np.ones(own.rows))
        whole = own.row_means(0, columns) / self.scatter
        after = self._squares(triangle(np.vstack([self.known, rows.project(whole)])))
        gained = after - self._squares(self.known)
        # of so small a share of a difference the law is not known
        return np.sqrt(np.where(gained > STANDARD.formula_left * self._squares(triangle(whole)), gained, 0.0))

    def left(self) -> Array:
        """Return the distances (pairs,) in the data there are."""
        return np.sqrt(self._squares(self.known))

    def _squares(self, root: Array) -> Array:
        """Return the squared distance of each pair (pairs,): the less, one or the other being the force."""
        ends = np.cumsum([len(r.terms) for r in self.readings])[:-1]
        own: Sequence[Array] = np.split(root, ends, axis=1)
        forces = [c @ r.theta for c, r in zip(own, self.readings, strict=True)]
        found = {
            (a, b): float(DifferenceInformation.of(own[b], forces[a][:, None]).left()[0])
            for a, b in permutations(range(len(own)), 2)
        }
        return np.array([min(found[a, b], found[b, a]) for a, b in self.pairs])
