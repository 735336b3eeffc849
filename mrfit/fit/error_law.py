"""How far off a model is on tests that it has not seen, learnt from tests that were left out of its fit.

The logarithm of a test's error, of the magnitude that 95 of 100 samples do not exceed, is regressed on the logarithm
of the output's range, since noise does not grow with it and the error of a model does, and on how far the test lies
beyond the others. A new test is one more draw from this law, with Student's t for its scatter.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, stdtrit

from mrfit.core.specs import Array
from mrfit.io.schemas.band import Remainder

COVERED_SHARE, NORMAL = 0.95, 1.96
ERRORS_ENOUGH = 39
"""Tests from which their ranks alone say what 95 of 100 samples of another one do not exceed, whatever the law.

One more test of which nothing is known then takes no more than half of the other five.
"""
# What is believed before any test: scatter of the logarithm and the tests that this is worth; slopes over the range
# and the way beyond, and their scatter. Settled on 300 tests of planted dampers of other laws than the models, by fits
# to 3 to 10 tests: with a slope of 0.8 over the range, a test on which the model falls short of the force had a band as
# short, and of fits to three tests 79 % of samples lay within, not 86 %
SCATTER, WORTH = 0.6, 3.0
SLOPES, LOOSENESS = np.array([0.2, 0.5]), np.array([0.3, 0.5])
ERROR_QUANTILES = (np.arange(400) + 0.5) / 400.0


@dataclass(frozen=True)
class ErrorLaw:
    """Law of the error on unseen tests.

    Attributes
    ----------
    middle
        Mean logarithm of the output's range.
    coefficients
        Logarithm of the error at the middle, and its slopes over the logarithm of the range and the way beyond (3,).
    inverse
        Covariance of the coefficients over the square of the scatter (3, 3).
    scatter, degrees
        Of the logarithm about the law, and its degrees of freedom.
    off
        What each test is off the law (T,).
    """

    middle: float
    coefficients: Array
    inverse: Array
    scatter: float
    degrees: float
    off: Array

    @classmethod
    def of(cls, rows: Sequence[Remainder]) -> "ErrorLaw":
        """Return the law of what is left of tests, at least one."""
        errors, ranges = (np.log(np.maximum(v, 1e-300)) for v in ([r.quantile for r in rows], [r.reach for r in rows]))
        # stretches of one motion are together one test
        shares = np.array([r.share for r in rows])
        middle = float(np.average(ranges, weights=shares))
        design = np.column_stack([np.ones(len(rows)), ranges - middle, [r.beyond for r in rows]])
        believed = np.concatenate([[0.0], (SCATTER / LOOSENESS) ** 2])
        weighted = shares * design.T
        inverse = np.linalg.inv(weighted @ design + np.diag(believed))
        found = inverse @ (weighted @ errors + believed * np.array([0.0, *SLOPES]))
        # an error grows with the output, no more than in proportion, and with the way beyond
        slopes = np.clip(found[1:], 0.0, [1.0, math.inf])
        level = float(np.average(errors - design[:, 1:] @ slopes, weights=shares))
        coefficients = np.array([level, *slopes])
        off = errors - design @ coefficients
        degrees = WORTH + float(shares.sum()) - 1.0
        scatter = math.sqrt((WORTH * SCATTER**2 + float(shares @ off**2)) / degrees)
        return cls(middle, coefficients, inverse, scatter, degrees, off)

    def half_width(self, reach: float, beyond: float) -> float:
        """Return the half-width that holds 95 of 100 samples, of an output of a range in a test so far beyond."""
        place = np.array([1.0, math.log(max(reach, 1e-300)) - self.middle, beyond])
        centre = float(place @ self.coefficients)
        spread = self.scatter * math.sqrt(1.0 + float(place @ self.inverse @ place))
        half = _holding(spread * np.asarray(stdtrit(self.degrees, ERROR_QUANTILES), dtype=np.float64))
        if len(self.off) >= ERRORS_ENOUGH:
            # one more test, of which nothing is known, and which no width holds
            half = max(half, _holding(np.append(self.off, math.inf)))
        return math.exp(centre) * half


def _holding(errors: Array) -> float:
    """Return the half-width that holds 95 of 100 samples of tests together, by the logarithms of their errors.

    Within a test samples are taken as normal.
    """
    from scipy.optimize import brentq

    def lacking(width: float) -> float:
        return COVERED_SHARE - float(np.mean(2.0 * ndtr(NORMAL * np.exp(width - errors)) - 1.0))

    known = errors[np.isfinite(errors)]
    return math.exp(brentq(lacking, known.min() - 1.0, known.max() + 5.0, xtol=1e-4))
