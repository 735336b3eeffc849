"""Intervals by profile likelihood: how far one parameter can go while the others make up for it.

With normal, correlated residuals a parameter c is held and the others refitted; the interval ends where the sum of
squares has risen by t²·σ²·κ, t the 97.5 % quantile, σ² the residual variance, κ the factor by which the residuals'
correlation widens this parameter's variance (1 for white residuals). Ends that lie beyond a bound are open.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from mrfit.core.specs import Array
from mrfit.fit.diagnostics.bootstrap import BootstrapInterval
from mrfit.fit.diagnostics.uncertainty import LEAN, Linearisation, Uncertainty
from mrfit.io.schemas.fit import Profile
from mrfit.search import run as search
from mrfit.search.limits import Limits
from mrfit.search.problem import LeastSquaresProblem, ResidualProblem

FIRST_STEP = 0.05
# An end is found when the rise is within this share of the quantile
PRECISION = 0.01
SEARCHES = 12
# Evaluations for each parameter of a refit that starts near its optimum
REFIT_BUDGET = 15
# Shares of the way to an end at which the profile is computed too: for its figure
PROFILE_RANGE = (0.5, 1.25)


@dataclass(frozen=True)
class ProfiledParameter:
    """A parameter's interval by its profile likelihood, and the profile where it was computed."""

    interval: BootstrapInterval
    profile: Profile


def profiled(
    posed: LeastSquaresProblem, point: Array, uncertainty: Uncertainty, linearised: Linearisation
) -> list[ProfiledParameter]:
    """Return profile likelihoods and their intervals, of the parameters that lean on no redundant direction.

    Parameters
    ----------
    posed
        Folded blocks that were fitted.
    point
        Optimum in the cube, shape (F,).
    uncertainty, linearised
        At this optimum.
    """
    factors = variance_factors(uncertainty, linearised)
    # of all samples: edges fall between the samples of a folded cycle, which then costs more
    power = residual_power(uncertainty, linearised)
    moving = uncertainty.directions[:, ~uncertainty.redundant]
    found = []
    for at, k in enumerate(posed.cube.free):
        if float(np.sum(moving[at] ** 2)) < 1.0 - LEAN:
            continue
        side = _Side(posed, point, (at, moving), uncertainty.quantile, power * factors[at])
        width = uncertainty.half_width(np.eye(len(point))[at])
        step = min(width, 0.5) if 0.0 < width < np.inf else FIRST_STEP
        ends = [side.end(-step), side.end(step)]
        side.fill(ends)

        def value_of(position: float, at: int = at, k: int = int(k)) -> float:
            return float(posed.cube.to_theta(_at(point, at, position)[None, :])[0, k])

        name, steps = posed.cube.params[int(k)].name, sorted(side.seen.items())
        values, rises = [value_of(p) for p, _ in steps], [r for _, r in steps]
        profile = Profile(name=name, values=values, rises=rises, quantile=uncertainty.quantile)
        found.append(ProfiledParameter(BootstrapInterval(*(None if e is None else value_of(e) for e in ends)), profile))
    return found


def variance_factors(uncertainty: Uncertainty, linearised: Linearisation) -> Array:
    """Return by which factor correlated residuals widen each parameter's variance over white ones, shape (F,).

    Parameters that the data leave open get the median over the determined directions.
    """
    samples = sum(len(r) for r in linearised.residuals)
    power = residual_power(uncertainty, linearised)
    kept = uncertainty.directions[:, ~uncertainty.open]
    white = power / (samples * uncertainty.singular_values[~uncertainty.open] ** 2)
    usual = float(np.median(uncertainty.spreads[~uncertainty.open] ** 2 / white)) if uncertainty.rank else 1.0
    if not np.isfinite(usual) or usual == 0.0:
        usual = 1.0
    variances = (kept**2) @ white
    open_share = np.sum(uncertainty.null**2, axis=1)
    known = (variances > 0.0) & (open_share < 1e-3) & (np.diag(uncertainty.covariance) > 0.0)
    return np.where(known, np.diag(uncertainty.covariance) / np.where(variances > 0.0, variances, 1.0), usual)


def residual_power(uncertainty: Uncertainty, linearised: Linearisation) -> float:
    """Return the variance σ² of the residuals."""
    samples = sum(len(r) for r in linearised.residuals)
    return sum(float(r @ r) for r in linearised.residuals) / max(samples - uncertainty.rank, 1)


def _at(point: Array, at: int, value: float) -> Array:
    moved = point.copy()
    moved[at] = value
    return moved


@dataclass
class _Side:
    """The profile of one parameter: rise of the sum of squares as it is moved and the others are refitted.

    ``along`` holds the parameter's place and the directions (F, D) the output moves along; ``variance`` is σ²κ.
    ``seen`` are the rises that were computed, by coordinate.
    """

    posed: LeastSquaresProblem
    point: Array
    along: tuple[int, Array]
    quantile: float
    variance: float
    seen: dict[float, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.at, moving = self.along
        self.base = _mean_square(self.posed.residuals, self.point)
        self.seen[float(self.point[self.at])] = 0.0
        # directions in which the others move while the parameter rests
        self.others = moving @ np.linalg.svd(moving[self.at : self.at + 1])[2][1:].T

    def end(self, step: float) -> float | None:
        """Return the coordinate at which the rise reaches the quantile, beginning with a step; None beyond the cube."""
        limit = 1.0 if step > 0.0 else 0.0
        near, near_rise, far = self.point[self.at], 0.0, self.point[self.at] + step
        warm = self.point
        for _ in range(SEARCHES):
            far = min(max(far, 0.0), 1.0)
            rise, warm = self.rise(far, warm)
            if rise >= self.quantile:
                return self._between((float(near), near_rise), (float(far), rise), warm)
            if far == limit:
                return None
            near, near_rise = far, rise
            reach = self.quantile / max(rise, self.quantile / 4.0)
            far = self.point[self.at] + (far - self.point[self.at]) * max(1.2 * reach, 1.2)
        return None

    def _between(self, near: tuple[float, float], far: tuple[float, float], warm: Array) -> float:
        """Narrow a bracket of the end by regula falsi (Illinois); the rise is nearly linear in the coordinate."""
        low, high = [near[0], near[1] - self.quantile], [far[0], far[1] - self.quantile]
        for _ in range(SEARCHES):
            if abs(high[1]) <= PRECISION * self.quantile:
                break
            middle = low[0] + (high[0] - low[0]) * low[1] / (low[1] - high[1])
            rise, warm = self.rise(middle, warm)
            if (rise - self.quantile) * high[1] < 0.0:
                low = high
            else:
                low[1] /= 2.0
            high = [middle, rise - self.quantile]
        return high[0]

    def rise(self, value: float, warm: Array) -> tuple[float, Array]:
        """Return the square root of the rise over σ²κ with the parameter held, and the point it was reached at."""
        held, residuals, count = _at(warm, self.at, value), self.posed.residuals, self.others.shape[1]

        def reached(moves: Array) -> Array:
            points: Array = np.clip(held + (2.0 * moves - 1.0) @ self.others.T, 0.0, 1.0)
            return points

        if count:
            problem, limits = (
                ResidualProblem(lambda moves: residuals(reached(moves))),
                Limits(REFIT_BUDGET * (count + 1)),
            )
            best = search.run(problem, np.full((1, count), 0.5), limits, np.random.default_rng(0), "lsq").point
            held = reached(best[None, :])[0]
        rise = max(_mean_square(residuals, held) - self.base, 0.0) * self.posed.samples
        root = math.sqrt(rise / self.variance) if self.variance > 0.0 else math.inf
        if math.isfinite(root):
            self.seen[float(value)] = root
        return root, held

    def fill(self, ends: Sequence[float | None]) -> None:
        """Compute the rises between the optimum and the ends, and a little beyond, that a figure needs."""
        middle = float(self.point[self.at])
        for end in ends:
            if end is not None:
                for share in PROFILE_RANGE:
                    self.rise(min(max(middle + share * (end - middle), 0.0), 1.0), self.point)


def _mean_square(residuals: Callable[[Array], Array], point: Array) -> float:
    values = residuals(point[None, :])[0]
    return float(values @ values) / len(values)
