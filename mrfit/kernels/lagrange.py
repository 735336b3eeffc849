"""Polynomials through values at nodes, along the samples of a signal."""

import numpy as np

from mrfit.core.specs import Array
from mrfit.kernels.jit import kernel


@kernel
def polynomials(nodes: Array, at: Array) -> Array:
    """Return the Lagrange polynomials of nodes (Q,) at values (N,), shape (Q, N)."""
    rows = np.ones((len(nodes), len(at)))
    for k in range(len(nodes)):
        for j in range(len(nodes)):
            if j != k:
                for i in range(len(at)):
                    rows[k, i] *= (at[i] - nodes[j]) / (nodes[k] - nodes[j])
    return rows


@kernel
def combine(values: Array, basis: Array, out: Array) -> None:
    """Write the sum over nodes of values (P, Q, M), M = 1 or N, each times its polynomial (Q, N), to (P, N)."""
    varying = values.shape[2] > 1
    for p in range(len(values)):
        for k in range(len(basis)):
            for j in range(basis.shape[1]):
                term = values[p, k, j if varying else 0] * basis[k, j]
                out[p, j] = term if k == 0 else out[p, j] + term
