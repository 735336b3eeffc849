"""Simulated minus measured at the targets of a block, in one pass over the batch."""

import math

from mrfit.core.specs import Array, Index
from mrfit.kernels.jit import kernel


@kernel
def compare(
    simulated: Array, nodes: Index, weights: Array, targets: tuple[Array, Array, Array], every: int, out: Array
) -> None:
    """Set out[p, b] = scale[b]*(Σ_k weights[b, k]*simulated[p, nodes[b, k]] − target[b] − mean_p).

    Parameters
    ----------
    simulated
        Outputs, shape (P, N).
    nodes, weights
        Samples that make up the value beside each target, shape (B, S).
    targets
        Measured values (B,); shares (B,) with which the mean difference of each row is taken and removed, or an empty
        array to remove none; scale (B,).
    every
        The target is subtracted from so many-th rows, the first among them; the others are derivatives of those before.
    out
        Result, shape (P, B). A row that is not finite at its targets is NaN where a mean is removed.
    """
    target, shares, scale = targets
    for p in range(len(simulated)):
        mean, share = 0.0, -1.0 if p % every == 0 else 0.0
        for b in range(len(target)):
            value = share * target[b]
            for k in range(nodes.shape[1]):
                value += weights[b, k] * simulated[p, nodes[b, k]]
            out[p, b] = value
        if len(shares):
            for b in range(len(target)):
                mean += shares[b] * out[p, b]
            if not math.isfinite(mean):
                mean = math.nan
        for b in range(len(target)):
            out[p, b] = scale[b] * (out[p, b] - mean)
