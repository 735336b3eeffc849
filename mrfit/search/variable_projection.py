"""Variable projection: the search goes over the parameters that enter non-linearly, each point with its best others.

Where the response is affine in some parameters, the others held, their optimum within the bounds is a small linear
problem. A search over the rest is shorter and meets fewer local minima. The Jacobian of the projected residuals is
that of Kaufman (1975): derivatives at fixed linear parameters, projected on what these cannot explain. In Gram matrices
that is a Schur complement.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from mrfit.core.specs import Array, Index, Mask
from mrfit.kernels.cube import stencils, varied_stencils
from mrfit.kernels.linear import affine_model, projected, reduced_model, with_last_share
from mrfit.optimizers.cost.objective import BLOCK_NUMBERS, DIFFERENCE_STEP, Objective
from mrfit.search.cube import Cube
from mrfit.search.problem import LeastSquaresProblem

# Samples of a point that are simulated beyond what its model needs, to have all in one call
MORE_SAMPLES = 1280
# Least start value of a linear parameter, in steps, from which its share can be told
LEAST_START = 1e-5
# A response is taken as affine where it agrees with its linear prediction within this share
AFFINE = 1e-7
# Places in the cube, beside the start, at which it has to agree
PROBED = 6


class ProjectedPoints(NamedTuple):
    """Points with their best linear parameters.

    theta (P, K), residuals (P, M) and their root mean square (P,), basis (P, L, M), free ones of the linear (P, L).
    """

    theta: Array
    residuals: Array
    costs: Array
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
    complete
        Whether the response vanishes with the linear parameters: one's share is then what the others leave.
    """

    posed: LeastSquaresProblem
    linear: Index
    cube: Cube
    moving: Index
    complete: bool = False

    def solve(self, points: Array) -> ProjectedPoints:
        """Return points (P, F) of the remaining cube with their best linear parameters, by so many simulations each."""
        theta = self.cube.to_theta(points)
        return self._solved(theta, self._with_last(self._simulated(theta, self._varied)))

    @property
    def exact(self) -> bool:
        """Whether the model has exact derivatives."""
        return self.posed.assembly.sensitivities is not None

    @property
    def simulations(self) -> int:
        """Simulations that the best linear parameters of a point take; one where derivatives are exact."""
        return 1 if self.exact else 1 + len(self._varied)

    @property
    def _varied(self) -> Index:
        """Places of those linear parameters whose shares are simulated at every point."""
        return self.moving[:-1] if self.complete else self.moving

    def _with_last(self, rows: Array) -> Array:
        """Return residuals (Q, 1 + V, M) of the start and all that move, of those of ``_varied``."""
        return with_last_share(rows, *self._last) if self.complete else rows

    @cached_property
    def _last(self) -> tuple[Array, Array]:
        """Residuals (M,) with those that move at zero, the others at their start; starts of those that move (V,)."""
        ratios = self._ranges[0] / self._ranges[1]
        still = np.setdiff1d(np.arange(len(self.linear)), self.moving)
        rest = self.posed.silent if not len(still) else self.posed.silent + ratios[still] @ self._still[still]
        return rest, ratios[self.moving]

    def _solved(self, theta: Array, rows: Array) -> ProjectedPoints:
        """Return points at theta (P, K), simulated as in ``_simulated``, with their best linear parameters."""
        start, steps, low, high = self._ranges
        weights, residuals, costs, basis, free = projected(rows, self._still, self.moving, low, high)
        theta[:, self.linear] = np.minimum(np.maximum(start + steps * weights, self._bounds[0]), self._bounds[1])
        return ProjectedPoints(theta, residuals, costs, basis, free)

    def _simulated(self, theta: Array, places: Index) -> Array:
        """Return residuals (P, 1 + V, M) at the linear parameters' start, and one step along each of some of them."""
        start, steps = self._ranges[:2]
        if self.exact:
            rows = self.posed.sensitivities(theta, self.linear[places])
            rows[:, 1:] *= steps[places, None]
            rows[:, 1:] += rows[:, :1]
            return rows
        varied = np.repeat(theta, len(places) + 1, axis=0)
        columns = self.linear[places]
        of_point = varied.reshape(len(theta), len(places) + 1, -1)
        of_point[:, np.arange(1, len(places) + 1), columns] = (start + steps)[places]
        return self.posed.of_theta(varied).reshape(len(theta), len(places) + 1, -1)

    @cached_property
    def _still(self) -> Array:
        """Shares (L, M) of the response one step along each linear parameter, the remaining ones at their start.

        Empty where all of them move.
        """
        if len(self.moving) == len(self.linear):
            return np.empty((0, 0))
        rows = self._simulated(self.cube.to_theta(self.cube.start[None, :]), np.arange(len(self.linear)))[0]
        return np.ascontiguousarray(rows[1:] - rows[0])

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

    def models(self, points: Array) -> tuple[Array, Array, Array]:
        """Return cost (P,), Jᵀr (P, F) and JᵀJ (P, F, F) per residual of points (P, F).

        Simulated are all neighbours with all moving linear parameters at once, where these are few samples; else P·(V +
        1) of them for the best linear parameters, and P·F at these.
        """
        if self.exact:
            solved = self.solve(points)
            rows = self.posed.sensitivities(solved.theta, self.cube.free)
            parts = np.zeros_like(solved.residuals), solved.residuals, solved.basis, solved.free
            steps = np.ascontiguousarray(1.0 / self.cube.slopes(solved.theta))
            return solved.costs, *reduced_model(rows, steps, parts)
        (count, dimension), around = points.shape, stencils(points, DIFFERENCE_STEP)
        if self.at_once:
            theta = varied_stencils(self.cube.to_theta(around[0].reshape(-1, dimension)), *self._moved)
            rows = self._with_last(self.posed.of_theta(theta).reshape(count * (dimension + 1), self.simulations, -1))
            rows = rows.reshape(count, dimension + 1, len(self.moving) + 1, -1)
            return affine_model(rows, self._still, self.moving, self._ranges[2:], around[1])
        theta, solved = self.cube.to_theta(around[0][:, 1:].reshape(-1, dimension)), self.solve(points)
        theta[:, self.linear] = np.repeat(solved.theta[:, self.linear], dimension, axis=0)
        varied, parts = self.posed.of_theta(theta), (solved.residuals, solved.residuals, solved.basis, solved.free)
        return solved.costs, *reduced_model(varied.reshape(count, dimension, -1), around[1], parts)

    @cached_property
    def at_once(self) -> bool:
        """Whether all that the model of a point takes is simulated at once."""
        more = len(self.cube.free) * len(self._varied) * self.posed.simulated
        return not self.exact and more <= MORE_SAMPLES

    @property
    def model_simulations(self) -> int:
        """Simulations that the model of a point takes; two where derivatives are exact."""
        own, dimension = self.simulations, len(self.cube.free)
        if self.exact:
            return 2
        return own * (1 + dimension) if self.at_once else own + dimension

    @cached_property
    def _moved(self) -> tuple[Index, Array]:
        """Columns of theta of the linear parameters that are varied, and the values one step along them."""
        start, steps, *_ = self._ranges
        return self.linear[self._varied], (start + steps)[self._varied]

    def completed(self, points: Array) -> Array:
        """Return points (P, F) with their best linear parameters as points of the whole cube."""
        return self.posed.cube.to_points(self.solve(points).theta)

    def reduced(self, points: Array) -> Array:
        """Return points of the whole cube without their linear parameters, (P, F)."""
        kept = ~np.isin(self.posed.cube.free, self.linear)
        return np.ascontiguousarray(points[:, kept])

    @cached_property
    def _probed(self) -> ProjectedPoints:
        """Two points of the remaining cube with their best linear parameters."""
        with np.errstate(all="ignore"):
            return self.solve(self.cube.probes())

    def settled(self) -> "Projection":
        """Return the projection with those linear parameters as moving whose shares differ between two points."""
        with np.errstate(all="ignore"):
            shares = self._probed.basis
            apart = np.abs(shares[1] - shares[0]).max(axis=1) > AFFINE * np.abs(shares).max(axis=(0, 2))
        return replace(self, moving=np.flatnonzero(apart))

    def is_affine(self, points: Array) -> bool:
        """Return whether the response is affine in the linear parameters: at the start, in the cube, at points (P, F).

        An effect that sets in somewhere, as a valve does above a force, is affine wherever it has not. That may be at
        most places in the cube, so that it is asked at the points too. A law without effects is asked in
        the cube only; its contract asks the rest.
        """
        error, most = self._departure(self._probed)
        if not np.all(error <= most):
            return False
        further = self.cube.probes(PROBED)[len(error) :]
        if not self.posed.assembly.bare:
            further = np.vstack([further, self.reduced(points)])
        with np.errstate(all="ignore"):
            error, most = self._departure(self.solve(further))
        # what cannot be simulated far inside tells nothing
        return not np.any(np.isfinite(error) & ~(error <= most))

    def _departure(self, solved: ProjectedPoints) -> tuple[Array, Array]:
        """Return the error of the linear prediction at solved points and the most that rounding may make, (P,) each."""
        start, steps = self._ranges[:2]
        shares = np.linspace(0.3, 0.7, len(steps))
        with np.errstate(all="ignore"):
            weights = shares - (solved.theta[:, self.linear] - start) / steps
            predicted = solved.residuals + np.matmul(weights[:, None, :], solved.basis)[:, 0]
            theta = solved.theta.copy()
            theta[:, self.linear] = start + shares * steps
            error = np.abs(self.posed.of_theta(theta) - predicted).max(axis=1)
            size = np.abs(predicted).max(axis=1) + np.abs(solved.basis).max(axis=(1, 2))
            return error, AFFINE * size

    def vanishes(self, last: Index) -> bool:
        """Return whether the response vanishes with the linear parameters; some (V,) have to have starts."""
        start, steps = self._ranges[:2]
        if np.any(np.abs(start[last]) < LEAST_START * np.abs(steps[last])):
            return False
        solved = self._probed
        with np.errstate(all="ignore"):
            values = solved.theta[:, self.linear] / steps
            left = solved.residuals - np.matmul(values[:, None, :], solved.basis)[:, 0] - self.posed.silent
            size = np.abs(solved.residuals).max(axis=1) + np.abs(solved.basis).max(axis=(1, 2))
            return bool(np.all(np.abs(left).max(axis=1) <= AFFINE * size))


@dataclass
class SeparableObjective(Objective):
    """The cost over the remaining cube, each point with its best linear parameters.

    Attributes
    ----------
    projection
        Which they are. Each of the simulations that a point takes counts as an evaluation.
    """

    projection: Projection = field(kw_only=True)

    def repose(self, posed: LeastSquaresProblem) -> None:
        """Go on with another problem over the same cube, see ``Objective.restate``."""
        self.projection = replace(self.projection, posed=posed)
        self.restate(self.projection.residuals)

    @property
    def simulations(self) -> int:
        """Simulations that one point takes."""
        return self.projection.simulations

    @property
    def exact(self) -> bool:
        """Whether the Gauss–Newton models are free of the noise of differences."""
        return self.projection.exact

    @property
    def model_simulations(self) -> int:
        """Simulations that the Gauss–Newton model of one point takes."""
        return self.projection.model_simulations

    def _models(self, points: Array) -> tuple[Array, Array, Array]:
        self._watch()
        inside = np.minimum(np.maximum(points, 0.0), 1.0)
        costs, gradients, curvatures = self.projection.models(inside)
        self._width = self.projection.posed.rows
        costs = self._noted(inside, costs, len(points) * self.model_simulations)
        lost = ~np.isfinite(costs)
        if lost.any():
            gradients[lost], curvatures[lost] = 0.0, 0.0
        return costs, gradients, curvatures


def projection_of(posed: LeastSquaresProblem, points: Array) -> Projection | None:
    """Return the problem with its linear parameters eliminated; None where it has none, or is not affine in them.

    Parameters
    ----------
    posed
        The problem.
    points
        Points (P, F) near which it is searched, at which it has to be affine too.
    """
    names = [p.name for p in posed.cube.params]
    linear = np.array([k for k in posed.cube.free if names[k] in posed.assembly.spec.linear], dtype=np.int64)
    rest = replace(posed.cube, free=np.setdiff1d(posed.cube.free, linear))
    projection = Projection(posed, linear, rest, np.arange(len(linear)))
    # a base model alone is affine in what its SPEC marks; effects may saturate
    if not len(linear) or not (posed.assembly.alone or projection.is_affine(points)):
        return None
    settled = projection.settled()
    last = settled.moving[-1:]
    # a term that an effect adds may be silent wherever one looks for it, as an end stop beyond the stroke is
    complete = bool(len(last)) and not posed.assembly.adds and projection.vanishes(last)
    return replace(settled, complete=complete)
