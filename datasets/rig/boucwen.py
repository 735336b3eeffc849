"""The flux model of Tang et al. 2025 (eq. 5), written for the bench: adaptive steps in i along each monotone branch.

lambda = A Lc i + (1 - A) Lc z / D,  dz/di = kappa - beta |z|^n - gamma z |z|^(n-1) sign(di).
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from datasets.rig.stop import Array


@dataclass(frozen=True, slots=True)
class FluxBoucWen:
    """Parameters of eq. 5; Lc in H, kappa in 1/A, the others so that z is a pure number."""

    A: float
    Lc: float
    kappa: float
    beta: float
    gamma: float
    n: float
    D: float

    def slope(self, z: Array, direction: Array) -> Array:
        """Return dz/di on a rising (+1) or falling (-1) branch; 0 is taken as rising."""
        side = np.where(direction < 0, -1.0, 1.0)
        rate: Array = self.kappa - np.abs(z) ** self.n * (self.beta + self.gamma * side * np.sign(z))
        return rate

    def hysteretic(self, current: Array) -> Array:
        """Return z (N,) along a sampled current (N,) from z = 0, each monotone branch solved to 1e-11."""
        z = np.zeros_like(current)
        step = np.sign(np.diff(current))
        turns = [0, *(k for k in range(1, len(step)) if step[k] * step[k - 1] < 0 or step[k - 1] == 0 != step[k])]
        for first, last in zip(turns, [*turns[1:], len(current) - 1], strict=True):
            z[first : last + 1] = self._branch(current[first : last + 1], z[first])
        return z

    def flux(self, current: Array, z: Array) -> Array:
        """Return lambda in Wb-turns."""
        linked: Array = self.A * self.Lc * current + (1.0 - self.A) * self.Lc / self.D * z
        return linked

    def inductance(self, z: Array, direction: Array) -> Array:
        """Return d lambda / di in H."""
        total: Array = self.A * self.Lc + (1.0 - self.A) * self.Lc / self.D * self.slope(z, direction)
        return total

    def _branch(self, current: Array, start: float) -> Array:
        travel, place = np.unique(np.abs(current - current[0]), return_inverse=True)
        side = 1.0 if current[-1] >= current[0] else -1.0
        if travel[-1] == 0.0:
            return np.full_like(current, start)

        def rate(_: float, z: Array) -> Array:
            return side * self.slope(z, np.array(side))

        way = solve_ivp(rate, (0.0, travel[-1]), [start], "DOP853", travel, rtol=1e-11, atol=1e-13, max_step=0.2)
        path: Array = way.y[0][place]
        return path
