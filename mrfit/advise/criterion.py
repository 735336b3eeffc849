"""How far apart two models are on a test, refits of the one projected out; what a test adds to parameters.

A model r is true. Another one, s, is fitted to all data there are and to those of the test, every parameter free, base
and effect alike. To first order about its present fit it leaves

    d^2 = min over p of |e + R p|^2 + rest + |y + J p|^2

in squares of standard errors of the noise. R (F, F) and e (F,) are the triangle and the projected difference of the
data there are, rest is what no refit takes of that, J (N, F) and y (N,) are sensitivities and difference on the test.
What a refit of s could absorb, on both together, counts nothing. It is T-optimality (Atkinson and Fedorov 1975).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array

# Shares of the largest singular value below which a direction is none
RANK = 1e-10


@dataclass(frozen=True)
class DifferenceInformation:
    """What data say of a difference from one model, reduced to as many rows as it has parameters.

    Attributes
    ----------
    root
        Triangle R (F, F) with RᵀR = JᵀJ.
    pull
        Projection of the differences on the space of the columns of J (F, D), one column for each draw.
    rest
        Squared length of what is left of each (D,).
    """

    root: Array
    pull: Array
    rest: Array

    @classmethod
    def of(cls, jacobian: Array, differences: Array) -> "DifferenceInformation":
        """Return what sensitivities (N, F) and differences (N, D), in standard errors of the noise, determine."""
        orthogonal, root = np.linalg.qr(jacobian)
        pull = orthogonal.T @ differences
        return cls(root, pull, np.maximum(np.sum(differences**2, axis=0) - np.sum(pull**2, axis=0), 0.0))

    def and_(self, jacobian: Array, differences: Array) -> "DifferenceInformation":
        """Return the same with more data, sensitivities (N, F) and differences (N, D)."""
        joined = DifferenceInformation.of(np.vstack([self.root, jacobian]), np.vstack([self.pull, differences]))
        return DifferenceInformation(joined.root, joined.pull, joined.rest + self.rest)

    def left(self) -> Array:
        """Return the least squared distance of each draw (D,): no refit takes more."""
        u, singular, _ = np.linalg.svd(self.root)
        blind = singular <= RANK * max(float(singular.max(initial=0.0)), 1e-300)
        unexplained: Array = self.rest + np.sum((u[:, blind].T @ self.pull) ** 2, axis=0)
        return unexplained


def added(known: DifferenceInformation, jacobian: Array, differences: Array) -> Array:
    """Return the distance (D,) in standard errors that a test adds to what the data tell apart already.

    Parameters
    ----------
    known
        The data there are.
    jacobian, differences
        Sensitivities (N, F) of the model that is not true, and how far the true one is from it (N, D), one column for
        each draw of its parameters; both in standard errors of the noise.
    """
    after = known.and_(jacobian, differences).left()
    return np.sqrt(np.maximum(after - known.left(), 0.0))


def without(columns: Array, nuisance: Array) -> Array:
    """Return columns (N, Q) less what a nuisance (N, M) explains of them, such as a constant of every record."""
    if not nuisance.shape[1]:
        return columns
    orthogonal, _ = np.linalg.qr(nuisance)
    return columns - orthogonal @ (orthogonal.T @ columns)


def triangle(jacobian: Array) -> Array:
    """Return R (F, F) with RᵀR = JᵀJ of sensitivities (N, F)."""
    return np.linalg.qr(jacobian)[1]


def half_widths(roots: Sequence[Array], prior: Array) -> Array:
    """Return standard errors (F,) of parameters from triangles (F, F) of several data, within a prior's (F,)."""
    information = np.diag(prior**-2.0) + sum(root.T @ root for root in roots)
    return np.sqrt(np.diag(np.linalg.inv(information)))


def determinant_gain(root: Array, jacobian: Array, prior: Array) -> float:
    """Return by which factor a test shrinks the standard errors, their geometric mean over parameters, as a logarithm.

        g = 1/(2 F) ln( det(P + R'R + J'J) / det(P + R'R) ),    P = diag(prior^-2)

    It is D-optimality (Wald 1943); with the prior of a bounded parameter it is finite where data leave one open.
    """
    scale = 1.0 / prior
    before = np.linalg.slogdet(np.diag(scale**2) + root.T @ root)[1]
    after = np.linalg.slogdet(np.diag(scale**2) + root.T @ root + jacobian.T @ jacobian)[1]
    return 0.5 * float(after - before) / len(prior)
