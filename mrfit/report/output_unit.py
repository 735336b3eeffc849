"""The one unit in which a page, its figures and its sentences give a fit's output and every error of it."""

import math
from typing import NamedTuple

from mrfit.io.schemas.fit import Fit
from mrfit.report.curves import prefixed
from mrfit.report.numbers import in_html, significant


class OutputUnit(NamedTuple):
    """A unit with a prefix.

    Attributes
    ----------
    factor
        By which SI values are multiplied.
    unit
        As print has it, empty for a pure number.
    """

    factor: float
    unit: str

    @property
    def squared(self) -> str:
        """The unit of a square of the output."""
        if not self.unit:
            return ""
        return f"({self.unit})²" if set(self.unit) & set("·/") else f"{self.unit}²"

    def words(self, value: float | None, digits: int = 3) -> str:
        """Return an SI value in this unit."""
        return f"{in_html(significant(None if value is None else self.factor * value, digits))} {self.unit}".strip()


def output_unit(fit: Fit) -> OutputUnit:
    """Return the unit that suits both the range of a fit's output and its error: the geometric mean of both decides."""
    for role in ("train", "holdout", "predict"):
        row = fit.pooled(role)
        if row and row.rmse and row.nrmse and math.isfinite(row.rmse * row.nrmse):
            return OutputUnit(*prefixed(row.rmse / math.sqrt(row.nrmse), fit.unit))
    return OutputUnit(*prefixed(1.0, fit.unit))
