"""A network of two hidden layers of three tanh units and its derivatives, in one pass over the samples.

    h1 = tanh(W1*u + b1),  h2 = tanh(W2*h1 + b2),  F = w3*h2 + b3

u holds two channels and the same two delayed. Every derivative is a product of two rows over the samples:

    dF/dw3_j = h2_j,    dF/dW2_jk = d2_j*h1_k,  dF/db2_j = d2_j,    d2_j = w3_j*(1 - h2_j^2)
    dF/db3 = 1,         dF/dW1_jk = d1_j*u_k,   dF/db1_j = d1_j,    d1_j = sum_a d2_a*W2_aj*(1 - h1_j^2)

A vector's 31 values are W1 by rows, b1, W2 by rows, b2, w3, b3.
"""

import math

import numpy as np

from mrfit.core.specs import Array, Index
from mrfit.kernels.jit import kernel
from mrfit.kernels.lti import delayed
from mrfit.kernels.powers import tanh

# Where a vector's values start
_W1, _B1, _W2, _B2, _W3, _B3 = 0, 12, 15, 24, 27, 30
# Where the rows of the scratch start: inputs, units and d of both layers, and ones
_U, _H1, _H2, _D2, _D1, _ONE = 0, 4, 7, 10, 13, 16
# Samples at a time: the scratch stays in a core's level 1 cache
_CHUNK = 128


@kernel
def _layer(rows: Array, places: tuple[int, int, int], weights: Array, biases: Array, samples: int) -> None:
    """Set the three rows from places[2] on to a layer's units, of places[1] inputs in the rows from places[0] on."""
    first, inputs, unit = places
    for a in range(3):
        for j in range(samples):
            total = biases[a]
            for k in range(inputs):
                total += weights[inputs * a + k] * rows[first + k, j]
            rows[unit + a, j] = tanh(total)


@kernel
def _backward(rows: Array, theta: Array, first_layer: bool, samples: int) -> None:
    """Set the rows of d2 and, where the first layer's derivatives are asked for, of d1."""
    for a in range(3):
        weight = theta[_W3 + a]
        for j in range(samples):
            rows[_D2 + a, j] = weight * (1.0 - rows[_H2 + a, j] * rows[_H2 + a, j])
    if not first_layer:
        return
    for b in range(3):
        from_1, from_2, from_3 = theta[_W2 + b], theta[_W2 + 3 + b], theta[_W2 + 6 + b]
        for j in range(samples):
            total = from_1 * rows[_D2, j] + from_2 * rows[_D2 + 1, j] + from_3 * rows[_D2 + 2, j]
            rows[_D1 + b, j] = total * (1.0 - rows[_H1 + b, j] * rows[_H1 + b, j])


@kernel
def _factors(column: int) -> tuple[int, int]:
    """Return the two rows of the scratch whose product is the derivative with respect to a parameter."""
    if column < _B1:
        return _D1 + column // 4, _U + column % 4
    if column < _W2:
        return _D1 + column - _B1, _ONE
    if column < _B2:
        return _D2 + (column - _W2) // 3, _H1 + (column - _W2) % 3
    if column < _W3:
        return _D2 + column - _B2, _ONE
    return (_H2 + column - _W3 if column < _B3 else _ONE), _ONE


@kernel
def _evaluate(rows: Array, theta: Array, columns: Index, span: tuple[int, int], out: Array) -> None:
    """Set one vector's out, (1 + C, N), over a span of samples from its inputs in the scratch."""
    first, samples = span
    _layer(rows, (_U, 4, _H1), theta[_W1:_B1], theta[_B1:_W2], samples)
    _layer(rows, (_H1, 3, _H2), theta[_W2:_B2], theta[_B2:_W3], samples)
    lowest = int(columns.min()) if len(columns) else _B3
    if lowest < _W3:
        _backward(rows, theta, lowest < _W2, samples)
    w1, w2, w3, bias = theta[_W3], theta[_W3 + 1], theta[_W3 + 2], theta[_B3]
    for j in range(samples):
        out[0, first + j] = w1 * rows[_H2, j] + w2 * rows[_H2 + 1, j] + w3 * rows[_H2 + 2, j] + bias
    for c in range(len(columns)):
        left, right = _factors(columns[c])
        for j in range(samples):
            out[1 + c, first + j] = rows[left, j] * rows[right, j]


@kernel
def network(drive: Array, lag: Array, theta: Array, columns: Index) -> Array:
    """Return the network's output and its derivatives with respect to some parameters.

    Parameters
    ----------
    drive
        Two channels, shape (2, N).
    lag
        By how many samples the inputs' second pair is delayed, linear between samples, shape (1,).
    theta
        Parameter vectors, shape (P, 31).
    columns
        Parameters asked for, 0 ... 30, in any order, shape (C,). Nothing is propagated back for the last four alone.

    Returns
    -------
    Array
        Shape (P, 1 + C, N): F, then dF/dtheta of each column. A vector with NaN gives NaN.
    """
    rows = np.ones((_ONE + 1, _CHUNK))
    first_ago, second_ago = delayed(drive[0], lag)[0], delayed(drive[1], lag)[0]
    total = drive.shape[1]
    out = np.empty((len(theta), 1 + len(columns), total))
    for first in range(0, total, _CHUNK):
        samples = min(_CHUNK, total - first)
        for j in range(samples):
            rows[_U, j], rows[_U + 1, j] = drive[0, first + j], drive[1, first + j]
            rows[_U + 2, j], rows[_U + 3, j] = first_ago[first + j], second_ago[first + j]
        for p in range(len(theta)):
            _evaluate(rows, theta[p], columns, (first, samples), out[p])
    for p in range(len(theta)):
        if math.isnan(theta[p].sum()):
            out[p] = math.nan
    return out
