"""Stop (elastic-perfectly-plastic) operators in parallel: the Prandtl-Ishlinskii and the Maxwell-slip law.

E_k follows its input's increments and is held within +-r_k; the law is sum_k w_k E_k. With weights >= 0 and the input
taken as displacement, the output as force, every closed loop dissipates: it encloses area >= 0 (Visintin,
Differential Models of Hysteresis, 1994, ch. III).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class StopLaw:
    """Thresholds r_k (unit of the input) and weights w_k (output unit per input unit), both shape (K,)."""

    thresholds: Array
    weights: Array

    def rest(self, runs: int) -> Array:
        """Return the demagnetised (all zero) state, shape (runs, K)."""
        return np.zeros((runs, len(self.thresholds)))

    def advance(self, state: Array, increment: Array) -> Array:
        """Return the state (..., K) after the input has moved by increment (...,)."""
        moved: Array = np.clip(state + increment[..., None], -self.thresholds, self.thresholds)
        return moved

    def output(self, state: Array) -> Array:
        """Return sum_k w_k E_k, shape (...,)."""
        total: Array = state @ self.weights
        return total

    def slope(self, state: Array) -> Array:
        """Return the derivative of the output with respect to the input off the corners, shape (...,)."""
        free: Array = (np.abs(state) < self.thresholds) @ self.weights
        return free

    def path(self, inputs: Array) -> Array:
        """Return the output along a whole input history (N,), from rest and with the first input counted from 0."""
        state = self.rest(1)
        out = np.empty_like(inputs)
        last = 0.0
        for k, value in enumerate(inputs):
            state = self.advance(state, np.array([value - last]))
            out[k] = self.output(state)[0]
            last = value
        return out
