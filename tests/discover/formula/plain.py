"""Rows of a search on a law of a few columns, with nothing of a record but its scaled variables."""

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import cast

import numpy as np

from mrfit.core.specs import Array
from mrfit.discover.formula.factors import Factor, Term
from mrfit.discover.formula.rows import FormulaRows, Scale
from mrfit.discover.formula.standing import Formula
from mrfit.discover.invariance.setting import RegressionData

SCALES = {
    "x": Scale(0.006, 0.02),
    "v": Scale(0.0, 0.4),
    "a": Scale(0.0, 8.0),
    "i": Scale(0.0, 2.0),
    "T": Scale(30.0, 25.0),
    "t": Scale(0.0, 60.0),
    "L": Scale(0.0, 500.0),
}


def term(*factors: tuple[str, str, *tuple[float, ...]]) -> Term:
    """Return a product of factors, each of a variable, a kind and constants."""
    return Term(tuple(Factor(variable, kind, tuple(constants)) for variable, kind, *constants in factors))


def formula(terms: Sequence[Term], theta: Sequence[float], errors: Sequence[float] = (1.0,), **more: float) -> Formula:
    """Return a formula of which only what is given matters."""
    found = {"kept": 0.9, "size": 0.1, "left": 0.5, "cancelled": 1.0} | more
    return Formula(tuple(terms), np.array(theta), np.array(errors), **found)


def rows_of(
    samples: Sequence[Mapping[str, Array]],
    targets: Sequence[Array] | None = None,
    law: Sequence[Array] | None = None,
    weights: Sequence[Array] | None = None,
    made: str = "force",
) -> FormulaRows:
    """Return the rows of records, each a group of its own, of which every sample is a row."""
    counts = [len(next(iter(s.values()))) for s in samples]
    columns = law or [np.ones((n, 1)) for n in counts]
    setting = SimpleNamespace(
        records=[SimpleNamespace(made=made, measured=lambda values: values) for _ in counts],
        targets=targets or [np.zeros(n) for n in counts],
        groups=[np.full(n, k) for k, n in enumerate(counts)],
        count=len(counts),
        law=lambda k, state: SimpleNamespace(values=columns[k]),
        row_means=lambda k, values: values,
    )
    own = np.concatenate(list(weights)) if weights else np.ones(sum(counts))
    return FormulaRows(cast(RegressionData, setting), SCALES, tuple(dict(s) for s in samples), own)
