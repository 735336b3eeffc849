"""Linear mixed model with known measurement variances, by restricted maximum likelihood.

y_i = X_i β + Z_i u_i + w_i + e_i for unit i, with u_ir ~ N(0, γ_r) for each column r of Z and w ~ N(0, γ_0), both
estimated, and e_ij ~ N(0, c_ij), known. Standard errors of β are those of Kenward and Roger (1997) where V is linear
in γ, degrees of freedom Satterthwaite's.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr

from mrfit.core.specs import Array, Index

SCORING_STEPS = 200
# Step of the score in the units of the components at which a search ends, and share of the variance that counts as none
SCORING_SETTLED, NO_VARIANCE = 1e-12, 1e-10


@dataclass(frozen=True)
class MixedFit:
    """Result of a mixed model.

    Attributes
    ----------
    beta, errors, degrees
        Coefficients (P,), their standard errors and degrees of freedom.
    components
        Variances γ: of w, then of each column of Z (1 + R,).
    component_errors
        Their standard errors, by the expected information (1 + R,).
    covariance
        Of the coefficients, without the small-sample part (P, P).
    """

    beta: Array
    errors: Array
    degrees: Array
    components: Array
    component_errors: Array
    covariance: Array

    @property
    def probabilities(self) -> Array:
        """Two-sided probability of each coefficient's size without an effect (P,)."""
        return 2.0 * stdtr(self.degrees, -np.abs(self.beta) / np.maximum(self.errors, 1e-300))


@dataclass(frozen=True)
class _Batch:
    """Units of M rows each: y (U, M), X (U, M, P), known variances (U, M), derivatives (1 + R, U, M, M)."""

    y: Array
    x: Array
    known: Array
    parts: Array


def fit_mixed(y: Array, x: Array, known: Array, units: Index, z: Array) -> MixedFit:
    """Fit the model.

    Parameters
    ----------
    y
        Values (N,).
    x
        Covariates of the mean (N, P), of full rank.
    known
        Known variances c (N,).
    units
        Unit of each row (N,).
    z
        Columns whose coefficients differ from unit to unit (N, R); R may be 0.
    """
    scale = float(np.std(y - x @ np.linalg.lstsq(x, y, rcond=None)[0])) or 1.0
    batches = list(_batches(y / scale, x, known / scale**2, units, z))
    gamma = np.full(1 + z.shape[1], 0.5) / np.concatenate([[1.0], np.maximum(np.mean(z**2, axis=0), 1e-300)])
    value, score, information, _ = _likelihood(batches, gamma)
    for _ in range(SCORING_STEPS):
        # a component at zero whose likelihood falls stays there
        free = (gamma > 0.0) | (score > 0.0)
        step = np.zeros_like(gamma)
        step[free] = np.linalg.lstsq(information[np.ix_(free, free)], score[free], rcond=None)[0]
        if float(np.abs(np.where(gamma + step < 0.0, gamma, step)) @ np.sqrt(np.diag(information))) < SCORING_SETTLED:
            break
        for _ in range(30):
            trial = np.maximum(gamma + step, 0.0)
            better, *rest = _likelihood(batches, trial)
            if better >= value - 1e-13 * abs(value):
                break
            step /= 2.0
        else:
            break
        gamma, value, (score, information, _) = trial, better, rest
    _, _, information, beta = _likelihood(batches, gamma)
    return _small_sample(batches, gamma, information, beta, scale)


def _batches(y: Array, x: Array, known: Array, units: Index, z: Array) -> Iterator[_Batch]:
    order = np.argsort(units, kind="stable")
    _, starts, counts = np.unique(units[order], return_index=True, return_counts=True)
    for size in np.unique(counts):
        rows = order[starts[counts == size][:, None] + np.arange(size)]
        pairs = [np.broadcast_to(np.eye(size), (len(rows), size, size))]
        pairs += [column[rows][:, :, None] * column[rows][:, None, :] for column in z.T]
        yield _Batch(y[rows], x[rows], known[rows], np.array(pairs))


def _weights(batch: _Batch, gamma: Array) -> tuple[Array, float]:
    """Return the inverse covariances of a batch (U, M, M) and the sum of their log-determinants' halves, negative."""
    covariance = np.tensordot(gamma, batch.parts, 1)
    place = np.arange(batch.y.shape[1])
    covariance[:, place, place] += np.maximum(batch.known, NO_VARIANCE)
    inverse = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
    return inverse, -0.5 * float(np.linalg.slogdet(covariance)[1].sum())


def _likelihood(batches: list[_Batch], gamma: Array) -> tuple[float, Array, Array, Array]:
    """Return the restricted log-likelihood, its gradient, the expected information of γ, and the coefficients."""
    weights = [_weights(b, gamma) for b in batches]
    precision = sum(np.einsum("uma,umn,unb->ab", b.x, w, b.x) for b, (w, _) in zip(batches, weights, strict=True))
    right = sum(np.einsum("uma,umn,un->a", b.x, w, b.y) for b, (w, _) in zip(batches, weights, strict=True))
    phi = np.linalg.inv(precision)
    beta: Array = phi @ right
    value = float(sum(v for _, v in weights)) - 0.5 * float(np.linalg.slogdet(precision)[1])
    count, first = len(gamma), np.zeros(len(gamma))
    p, q, trace = _moments(batches, [w for w, _ in weights], count)
    for b, (w, _) in zip(batches, weights, strict=True):
        rest = np.einsum("umn,un->um", w, b.y - b.x @ beta)
        value -= 0.5 * float(np.sum(rest * (b.y - b.x @ beta)))
        first += 0.5 * (np.einsum("um,rumn,un->r", rest, b.parts, rest) - np.einsum("umn,runm->r", w, b.parts))
    first -= 0.5 * np.einsum("ab,rba->r", phi, p)
    cross = np.einsum("ab,rbc,cd,sda->rs", phi, p, phi, p)
    information: Array = 0.5 * (trace - 2.0 * np.einsum("ab,rsba->rs", phi, q) + cross)
    return value, first, information, beta


def _moments(batches: list[_Batch], weights: list[Array], count: int) -> tuple[Array, Array, Array]:
    """Return −P_r = Σ −X'WV_rWX (R, P, P) with its sign, Q_rs = Σ X'WV_rWV_sWX, and Σ tr(WV_rWV_s)."""
    size = batches[0].x.shape[2]
    p, q, trace = np.zeros((count, size, size)), np.zeros((count, count, size, size)), np.zeros((count, count))
    for b, w in zip(batches, weights, strict=True):
        turned = w @ b.parts
        wx = w @ b.x
        px = b.parts @ wx
        p -= np.einsum("uma,rumb->rab", wx, px)
        q += np.einsum("ruma,umn,sunb->rsab", px, w, px, optimize=True)
        trace += np.einsum("rumn,sunm->rs", turned, turned, optimize=True)
    return p, q, trace


def _small_sample(batches: list[_Batch], gamma: Array, information: Array, beta: Array, scale: float) -> MixedFit:
    """Return the fit with Kenward and Roger's standard errors and Satterthwaite's degrees of freedom."""
    weights = [_weights(b, gamma)[0] for b in batches]
    phi = np.linalg.inv(sum(np.einsum("uma,umn,unb->ab", b.x, w, b.x) for b, w in zip(batches, weights, strict=True)))
    p, q, _ = _moments(batches, weights, len(gamma))
    # of a component at zero nothing is estimated
    free = gamma > 0.0
    spread = np.zeros_like(information)
    if free.any():
        spread[np.ix_(free, free)] = np.linalg.pinv(information[np.ix_(free, free)])
    inner = q - np.einsum("rab,bc,scd->rsad", p, phi, p)
    adjusted = phi + 2.0 * phi @ np.einsum("rs,rsab->ab", spread, inner) @ phi
    slopes = -np.einsum("ka,rab,bk->kr", phi, p, phi)
    variances = np.einsum("kr,rs,ks->k", slopes, spread, slopes)
    rows = sum(b.y.size for b in batches)
    most = float(rows - len(beta))
    degrees = np.full(len(beta), np.inf)
    if free.any():
        degrees = np.minimum(2.0 * np.diag(phi) ** 2 / np.maximum(variances, 1e-12 * np.diag(phi) ** 2), most)
    errors = np.sqrt(np.maximum(np.diag(adjusted), np.diag(phi)))
    return MixedFit(
        beta * scale,
        errors * scale,
        np.maximum(degrees, 1.0),
        gamma * scale**2,
        np.sqrt(np.maximum(np.diag(spread), 0.0)) * scale**2,
        phi * scale**2,
    )
