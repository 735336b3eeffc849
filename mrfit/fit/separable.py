"""Variable projection: the search goes over the parameters that enter non-linearly, each point with its best others.

Where the response is affine in some parameters, the others held, their optimum within the bounds is a small linear
problem. A search over the rest is shorter and meets fewer local minima. The Jacobian of the projected residuals is
that of Kaufman (1975): derivatives at fixed linear parameters, projected on what these cannot explain. In Gram matrices
that is a Schur complement.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from mrfit.fit.cube import Cube
from mrfit.fit.problem import Posed
from mrfit.kernels.linear import Mask, bounded_weights, eliminate
from mrfit.objective import BLOCK_NUMBERS, Objective, stencils
from mrfit.specs import Array, Index

# A response is taken as affine where it agrees with its linear prediction within this share
AFFINE = 1e-7


@dataclass(frozen=True)
class Solved:
    """Points with their best linear parameters: theta (P, K), residuals (P, M), basis (P, L, M), free ones (P, L)."""

    theta: Array
    residuals: Array
    basis: Array
    free: Mask


@dataclass(frozen=True)
class Projection:
    """A least-squares problem and the parameters that are eliminated from it.

    Attributes
    ----------
    posed
        The problem over all free parameters.
    linear
        Columns of theta that are eliminated, shape (L,).
    cube
        The free parameters that remain, shape (F,).
    moving
        Places among the linear parameters of those whose share of the response depends on the remaining ones, (V,); the
        shares of the others, like that of an offset, are simulated once.
    """

    posed: Posed
    linear: Index
    cube: Cube
    moving: Index

    def solve(self, points: Array) -> Solved:
        """Return points (P, F) of the remaining cube with their best linear parameters, by P·(V + 1) simulations."""
        start, steps, low, high = self._ranges
        theta = self.cube.to_theta(points)
        with np.errstate(all="ignore"):
            rows = np.empty((len(points), len(self.linear) + 1, self.posed.rows))
            if len(self.moving) < len(self.linear):
                rows[:, 1:] = self._still
            moved = self._simulated(theta, self.moving)
            rows[:, 0] = moved[:, 0]
            rows[:, 1 + self.moving] = moved[:, 1:] - moved[:, :1]
            gram = np.matmul(rows, rows[:, 1:].transpose(0, 2, 1))
            weights, free = bounded_weights(gram[:, 1:].copy(), gram[:, 0].copy(), low, high)
            theta[:, self.linear] = np.clip(start + steps * weights, *self._bounds)
            residuals = rows[:, 0] + np.matmul(weights[:, None, :], rows[:, 1:])[:, 0]
        return Solved(theta, residuals, rows[:, 1:], free)

    def _simulated(self, theta: Array, places: Index) -> Array:
        """Return residuals (P, 1 + V, M) at the linear parameters' start, and one step along each of some of them."""
        start, steps = self._ranges[:2]
        varied = np.repeat(theta, len(places) + 1, axis=0)
        columns = self.linear[places]
        of_point = varied.reshape(len(theta), len(places) + 1, -1)
        of_point[:, np.arange(1, len(places) + 1), columns] = (start + steps)[places]
        return self.posed.of_theta(varied).reshape(len(theta), len(places) + 1, -1)

    @cached_property
    def _still(self) -> Array:
        """Shares (L, M) of the response one step along each linear parameter, the remaining ones at their start."""
        rows = self._simulated(self.cube.to_theta(self.cube.start[None, :]), np.arange(len(self.linear)))[0]
        shares: Array = rows[1:] - rows[0]
        return shares

    @cached_property
    def _bounds(self) -> tuple[Array, Array]:
        low, high = np.array([(self.cube.params[k].low, self.cube.params[k].high) for k in self.linear]).T
        return low, high

    @cached_property
    def _ranges(self) -> tuple[Array, Array, Array, Array]:
        """Return start values (L,), steps to the other values simulated, and the bounds in steps from the start."""
        params = [self.cube.params[k] for k in self.linear]
        start, (low, high) = np.array([p.start for p in params]), self._bounds
        steps = np.where(high - start >= start - low, high - start, low - start)
        near = np.array([p.start if p.scale == "log" else np.inf for p in params])
        steps = np.clip(steps, -0.5 * near, near)
        ends = np.stack([(low - start) / steps, (high - start) / steps])
        return start, steps, ends.min(axis=0), ends.max(axis=0)

    def residuals(self, points: Array) -> Array:
        """Return the projected residuals of points (P, F), shape (P, M)."""
        block = max(1, BLOCK_NUMBERS // ((len(self.linear) + 1) * self.posed.rows))
        parts = [self.solve(points[k : k + block]).residuals for k in range(0, len(points), block)]
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def model(self, points: Array, solved: Solved) -> tuple[Array, Array]:
        """Return Jᵀr (P, F) and JᵀJ (P, F, F) per residual of the projected residuals, by P·F simulations."""
        count, dimension = points.shape
        around, steps = stencils(points)
        theta = self.cube.to_theta(around[:, 1:].reshape(-1, dimension))
        theta[:, self.linear] = np.repeat(solved.theta[:, self.linear], dimension, axis=0)
        with np.errstate(all="ignore"):
            rows = self.posed.of_theta(theta).reshape(count, dimension, -1)
            rows -= solved.residuals[:, None, :]
            rows /= steps[:, :, None]
            rows[~np.isfinite(rows.sum(axis=2))] = 0.0
        size, samples = len(self.linear), rows.shape[2]
        whole = np.concatenate([solved.basis, rows], axis=1)
        whole[:, :size][~solved.free] = 0.0
        gradients = np.matmul(rows, solved.residuals[:, :, None])[:, :, 0]
        gram = np.matmul(whole, whole.transpose(0, 2, 1))
        eliminate(gram, np.broadcast_to(np.arange(size + dimension) < size, gram.shape[:2]).copy())
        return gradients / samples, gram[:, size:, size:] / samples

    def completed(self, points: Array) -> Array:
        """Return points (P, F) with their best linear parameters as points of the whole cube."""
        return self.posed.cube.to_points(self.solve(points).theta)

    def reduced(self, points: Array) -> Array:
        """Return points of the whole cube without their linear parameters, (P, F)."""
        kept = ~np.isin(self.posed.cube.free, self.linear)
        return np.ascontiguousarray(points[:, kept])

    def settled(self) -> "Projection":
        """Return the projection with those linear parameters as moving whose shares differ between two points."""
        with np.errstate(all="ignore"):
            shares = self.solve(self.cube.probes()).basis
            apart = np.abs(shares[1] - shares[0]).max(axis=1) > AFFINE * np.abs(shares).max(axis=(0, 2))
        return replace(self, moving=np.flatnonzero(apart))

    def is_affine(self) -> bool:
        """Return whether the response is affine in the linear parameters, at the start and somewhere in the cube."""
        start, steps = self._ranges[:2]
        solved = self.solve(self.cube.probes())
        shares = np.linspace(0.3, 0.7, len(steps))
        with np.errstate(all="ignore"):
            weights = shares - (solved.theta[:, self.linear] - start) / steps
            predicted = solved.residuals + np.matmul(weights[:, None, :], solved.basis)[:, 0]
            solved.theta[:, self.linear] = start + shares * steps
            error = np.abs(self.posed.of_theta(solved.theta) - predicted).max(axis=1)
            size = np.abs(predicted).max(axis=1) + np.abs(solved.basis).max(axis=(1, 2))
        return bool(np.all(error <= AFFINE * size))


@dataclass
class SeparableObjective(Objective):
    """The cost over the remaining cube, each point with its best linear parameters.

    Attributes
    ----------
    projection
        Which they are. Each of the simulations that a point takes counts as an evaluation.
    """

    projection: Projection = field(kw_only=True)

    @property
    def simulations(self) -> int:
        """Simulations that one point takes."""
        return len(self.projection.moving) + 1

    @property
    def model_simulations(self) -> int:
        """Simulations that the Gauss–Newton model of one point takes."""
        return self.simulations + self.dimension

    def _models(self, points: Array) -> tuple[Array, Array, Array]:
        self._watch()
        inside = np.clip(points, 0.0, 1.0)
        solved = self.projection.solve(inside)
        gradients, curvatures = self.projection.model(inside, solved)
        costs = self._noted(inside, solved.residuals, len(points) * self.model_simulations)
        lost = ~np.isfinite(costs)
        gradients[lost], curvatures[lost] = 0.0, 0.0
        return costs, gradients, curvatures


def projection_of(posed: Posed) -> Projection | None:
    """Return the problem with its linear parameters eliminated; None where it has none, or is not affine in them."""
    names = [p.name for p in posed.cube.params]
    linear = np.array([k for k in posed.cube.free if names[k] in posed.assembly.spec.linear], dtype=np.int64)
    rest = replace(posed.cube, free=np.setdiff1d(posed.cube.free, linear))
    projection = Projection(posed, linear, rest, np.arange(len(linear)))
    return projection.settled() if len(linear) and projection.is_affine() else None
