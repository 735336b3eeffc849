"""What the fits at single currents say of a law of current: where it would take the parameters, and the error there.

At each level the base model's own fit gives its optimum θ_l, the residuals left, and their sensitivities J_l. With
those the best coefficients of any law, forms and orders for all parameters, are a small least-squares problem,

    min Σ_l |J_l·(w(c, I_l) − w_l) + r_l|²/(variance of r_l),

w the coordinates in which the response bends least: the parameter itself where it enters linearly, else its logarithm.
Left out of the sum, a level is predicted from its neighbours; the error there is simulated, not linearised.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from mrfit.core.specs import Array, Index, ModelSpec
from mrfit.fit.diagnostics.uncertainty import effective_samples, sensitivities
from mrfit.kernels.cube import Mask
from mrfit.search import run as search
from mrfit.search.chain import Chain
from mrfit.search.cube import Cube
from mrfit.search.limits import Limits
from mrfit.search.problem import LeastSquares, Posed
from mrfit.search.starts import OTHER_LEVELS, Level
from mrfit.simulate.current_dependence import LOG, coordinate
from mrfit.simulate.current_levels import POLYNOMIAL_ROLES

# Gauss-Newton steps to the coefficients of a law, and the share of its own curvature that damps each
STEPS, DAMPING = 3, 1e-9
# Shares of a step that are tried one after the other
SHARES = (1.0, 0.25)
# Bounds in the cube of a parameter's spread over levels, and how many times levels are drawn together
NARROWEST, WIDEST = 0.003, 0.1
PASSES = 5
# Share of that spread for parameters that are no force, stiffness or damping: of two that may stand for each other, as
# a loop's scale for its force, the other then changes
STIFF = 0.3
# Samples that what the model itself leaves of one condition is worth: the branches of a cycle, on each of which it errs
# in its own way
STROKE = 4.0
# Share of the output's deviation below which no error is the model's own, however little noise there is
SMALL = 1e-3
# Least share of a block's sum of squares that counts as left over: below it is rounding
ROUNDING = 1e-16


@dataclass(frozen=True)
class Law:
    """Form, ``plain`` or ``log``, and order of one parameter's polynomial of current."""

    form: str
    order: int


@dataclass(frozen=True)
class Posing:
    """The problem at one current, and the noise floor of each of its blocks, in the output's unit."""

    posed: Posed
    floors: Array

    def part(self, members: list[int]) -> "Posing":
        """Return the problem of some of its blocks."""
        posed = self.posed
        own = Posed([posed.blocks[k] for k in members], posed.weights[members], posed.assembly, posed.cube)
        return Posing(own, self.floors[members])

    def by_condition(self) -> list["Posing"]:
        """Return the problems of single conditions."""
        conditions = [b.segment.condition for b in self.posed.blocks]
        return [self.part([k for k, c in enumerate(conditions) if c == one]) for one in dict.fromkeys(conditions)]

    def excess(self, rows: Array) -> float:
        """Return the RMS of residuals (M,) as a multiple of the noise floor, or of what counts as noise."""
        blocks, posed = self.posed.blocks, self.posed
        floors = [max(f, SMALL * float(np.std(b.target))) for b, f in zip(blocks, self.floors, strict=True)]
        noise = sum(len(b.target) * (w * f) ** 2 for b, w, f in zip(blocks, posed.weights, floors, strict=True))
        return float(np.sqrt(float(rows @ rows) * posed.samples / posed.rows / max(noise, 1e-300)))

    def worth(self, rows: Array) -> float:
        """Return the number of independent samples that residuals (M,) are worth.

        Those that noise leaves are as many as their correlation says. What the model itself leaves is the same in every
        cycle, and says as little of other strokes as few samples would.
        """
        blocks = self.posed.blocks
        parts = np.split(rows, np.cumsum([len(b.target) for b in blocks])[:-1])
        samples = max(sum(effective_samples(part) for part in parts), 2.0)
        excess = self.excess(rows)
        own = max(1.0 - 1.0 / excess**2, 0.0) if excess > 0.0 else 0.0
        return 1.0 / ((1.0 - own) ** 2 / samples + own**2 / STROKE)


@dataclass(frozen=True)
class Tests:
    """The base model about its optimum at each of L currents, seen by U conditions; F free parameters of K.

    Attributes
    ----------
    spec, cube
        The base model and its free parameters.
    currents
        In A, rising, shape (L,).
    theta
        Optima (L, K).
    posed
        The problem of each condition.
    places
        Level of each condition (U,).
    factors, targets
        R (U + L, F, F) and t (U + L, F): the misfit of coordinates w (F,) under a condition is |R·w − t|², in units of
        what differs by chance. The last are those of the penalty that draws levels together.
    squares
        Sum of squares left under each condition (U,).
    unseen
        What is to be added for strokes that no fit has seen (U,): the model errs under one stroke as under several.
    worth
        Independent samples that the residuals under each are worth (U,).
    excess
        Median over conditions of the error left, as a multiple of the noise floor.
    bases, maps
        What ``basis`` and ``through`` remember.
    """

    spec: ModelSpec
    cube: Cube
    currents: Array
    theta: Array
    posed: tuple[Posed, ...]
    places: Index
    factors: Array
    targets: Array
    squares: Array
    unseen: Array
    worth: Array
    excess: float
    bases: dict[tuple[Law, bytes], Array] = field(default_factory=dict)
    maps: dict[tuple[Law, bytes], Array] = field(default_factory=dict)

    @property
    def free(self) -> Index:
        """Columns of the free parameters."""
        return self.cube.free

    @property
    def bent(self) -> Mask:
        """Which free parameters (F,) have their logarithm as coordinate."""
        return _curved(self.spec, self.cube)

    def basis(self, law: Law, currents: bytes) -> Array:
        """Return the Chebyshev polynomials (A, m + 1) of a law at currents as bytes; many laws share them."""
        key = (law, currents)
        if key not in self.bases:
            (low, high), at = (
                coordinate(i, self.currents[[0, -1]], law.form)
                for i in (self.currents[[0, -1]], np.frombuffer(currents))
            )
            x = (2.0 * at - low - high) / (high - low)
            self.bases[key] = np.polynomial.chebyshev.chebvander(x, law.order)
        return self.bases[key]

    def through(self, law: Law, currents: bytes) -> Array:
        """Return the map from values at currents as bytes to the coefficients (m + 1, A) of the nearest law."""
        key = (law, currents)
        if key not in self.maps:
            self.maps[key] = np.linalg.pinv(self.basis(law, currents)).astype(np.float64)
        return self.maps[key]

    def deviance(self, test: int, theta: Array) -> Array:
        """Return n·ln(S/S_0) (P,), S the sum of squares at parameters (P, K), S_0 the optimum's, n its worth."""
        with np.errstate(all="ignore"):
            rows = self.posed[test].of_theta(theta)[:, :-1]
            squares = np.einsum("pm,pm->p", rows, rows)
            least = self.squares[test]
            more = self.unseen[test]
            deviance = self.worth[test] * np.log((np.maximum(squares, ROUNDING) + more) / (least + more))
        return np.where(np.isfinite(squares), deviance, np.inf)


def _curved(spec: ModelSpec, cube: Cube) -> Mask:
    params = [cube.params[k] for k in cube.free]
    return np.array([p.scale == "log" and p.name not in spec.linear for p in params])


def tests_about(spec: ModelSpec, cube: Cube, fits: Sequence[Level], posed: Sequence[Posing]) -> Tests:
    """Return what is known about the optima found at single currents.

    Parameters
    ----------
    spec
        The base model's SPEC.
    cube
        Its free parameters.
    fits
        Optimum at each current, drawn together.
    posed
        The problem at each.
    """
    theta, bent = np.array([f.theta for f in fits]), _curved(spec, cube)
    points = cube.to_points(theta)
    centre, spread = np.median(points, axis=0), _spread(points)
    alone = [(k, one) for k, own in enumerate(posed) for one in own.by_condition()]
    factors, targets, squares, powers, worths, excesses = [], [], [], [], [], []
    for k, one in alone:
        own, (point, coordinates, slopes) = one.posed, _about(cube, theta[k], bent)
        rows = own.residuals(point[None, :])[0, :-1]
        floor = ROUNDING * float(sum(b.target @ b.target for b in own.blocks))
        left, worth = max(float(rows @ rows), floor, 1e-300), one.worth(rows)
        scale = np.sqrt(worth / left)
        jacobian = scale * sensitivities(_rows(own), point) / slopes
        fewest = np.zeros((len(slopes), len(slopes)))
        q, r = np.linalg.qr(np.vstack([jacobian, fewest]))
        factors.append(r)
        targets.append(r @ coordinates - scale * (q[: len(rows)].T @ rows))
        squares.append(left)
        powers.append(
            float(sum(w**2 * np.var(b.target) * len(b.target) for b, w in zip(own.blocks, own.weights, strict=True)))
        )
        worths.append(worth)
        excesses.append(one.excess(rows))
    for at in theta:
        point, coordinates, slopes = _about(cube, at, bent)
        factors.append(np.diag(1.0 / (spread * slopes)))
        targets.append(factors[-1] @ coordinates - (point - centre) / spread)
    return Tests(
        spec,
        cube,
        np.array([f.current for f in fits]),
        theta,
        tuple(one.posed for _, one in alone),
        np.array([k for k, _ in alone]),
        np.array(factors),
        np.array(targets),
        np.array(squares),
        _unseen(np.array([k for k, _ in alone]), np.array(squares), np.array(powers)),
        np.array(worths),
        float(np.median(excesses)),
    )


def _unseen(places: Index, squares: Array, powers: Array) -> Array:
    """Return the squares by which what is left under a condition falls short of the share left at levels with several.

    A fit to one stroke alone takes up what the model errs under it, and leaves less than a model of all strokes can.
    """
    several = np.bincount(places)[places] > 1
    share = float(np.median((squares / powers)[several])) if several.any() else 0.0
    return np.maximum(share * powers - squares, 0.0)


def _about(cube: Cube, theta: Array, bent: Mask) -> tuple[Array, Array, Array]:
    """Return point, coordinates and their gain per length of the cube, each (F,), at parameters (K,)."""
    values = theta[cube.free]
    held = np.where(bent, values, 1.0)
    slopes = cube.slopes(theta[None, :])[0] / held
    return cube.to_points(theta[None, :])[0], np.where(bent, np.log(held), values), slopes


def drawn_together(cube: Cube, fits: Sequence[Level], posed: Sequence[Posing], rng: np.random.Generator) -> list[Level]:
    """Return fits at single currents among which as few parameters differ as the data allow.

    Where the data leave a direction open, as a change of scale of z is in a Bouc-Wen element, each level's fit ends
    anywhere along it, and no law of current goes through such ends. Every level is fitted again from its optimum with a
    penalty on the way from the levels' median, in units of the parameter's own spread: what varies anyway may do so at
    little cost, and what does not need to vary stops.
    """
    fits, roles = list(fits), [cube.params[k].role for k in cube.free]
    ease = np.array([1.0 if role in POLYNOMIAL_ROLES or not role else STIFF for role in roles])
    for turn in range(PASSES):
        points = cube.to_points(np.array([f.theta for f in fits]))
        centre, spread = np.median(points, axis=0), np.full(points.shape[1], WIDEST) if not turn else _spread(points)
        spread = spread * ease
        for k, (at, point) in enumerate(zip(posed, points, strict=True)):
            own = at.posed
            rows = own.residuals(point[None, :])[0, :-1]
            weight = np.sqrt(float(rows @ rows) / at.worth(rows)) / spread
            problem, limits = LeastSquares(_drawn(own, centre, weight)), Limits(1 + OTHER_LEVELS * (len(point) + 1))
            found = search.run(problem, point[None, :], limits, rng, Chain("lsq", scored=True))
            theta = cube.to_theta(found.point[None, :])[0]
            cost = float(np.sqrt(np.mean(own.residuals(found.point[None, :])[0] ** 2)))
            fits[k] = Level(fits[k].current, cost, theta)
    return fits


def _spread(points: Array) -> Array:
    """Return the spread of each parameter over levels (L, F) of the cube, no less and no more than counts."""
    spread: Array = np.clip(np.std(points, axis=0), NARROWEST, WIDEST)
    return spread


def _drawn(posed: Posed, centre: Array, weight: Array) -> Callable[[Array], Array]:
    """Return a problem's residuals with those of a penalty on the way from a point (F,) of the cube."""
    return lambda points: np.hstack([posed.residuals(points), weight * (points - centre)])


def _rows(posed: Posed) -> Callable[[Array], Array]:
    """Return a problem's residuals without the one that no model removes."""
    return lambda points: posed.residuals(points)[:, :-1]


class Laws:
    """The laws of all free parameters that fit some conditions best.

    Parameters
    ----------
    tests
        What is known under each condition.
    laws
        Of each free parameter.
    known
        Conditions used (V,).
    """

    def __init__(self, tests: Tests, laws: Sequence[Law], known: Index) -> None:
        self.tests, self.laws, self.bent = tests, laws, tests.bent
        levels, places = np.unique(tests.places[known], return_inverse=True)
        self.used = np.concatenate([known, len(tests.posed) + levels])
        self.rows = np.concatenate([places, np.arange(len(levels))])
        self.levels = levels
        ends = np.cumsum([0, *(law.order + 1 for law in laws)])
        self.parts = [slice(int(a), int(b)) for a, b in zip(ends, ends[1:], strict=False)]
        self.currents = tests.currents[levels].tobytes()
        self.bases = self._bases(tests.currents[levels])
        params = [tests.cube.params[k] for k in tests.free]
        self.low, self.high = (np.array(e) for e in zip(*((p.low, p.high) for p in params), strict=True))
        self.coefficients = self._fitted()

    def _bases(self, currents: Array) -> list[Array]:
        return [self.tests.basis(law, currents.tobytes()) for law in self.laws]

    def _fitted(self) -> Array:
        """Return the coefficients of all laws, one after the other: Gauss-Newton from those through the optima."""
        theta = self.tests.theta[self.levels][:, self.tests.free]
        start = []
        for k, law in enumerate(self.laws):
            values = np.log(theta[:, k]) if law.form == LOG else theta[:, k]
            start.append(self.tests.through(law, self.currents) @ values)
        found = np.concatenate(start)
        misfit, rows, jacobian = self._model(found)
        for _ in range(STEPS):
            curvature = jacobian.T @ jacobian
            curvature[np.diag_indices_from(curvature)] *= 1.0 + DAMPING
            step = np.linalg.lstsq(curvature, -jacobian.T @ rows, rcond=1e-13)[0]
            for share in SHARES:
                tried = self._model(found + share * step)
                if tried[0] < misfit:
                    break
            else:
                break
            found = found + share * step
            misfit, rows, jacobian = tried
        return found

    def _model(self, coefficients: Array) -> tuple[float, Array, Array]:
        """Return the misfit, its rows (M,) and their derivatives (M, C)."""
        count, free = len(self.levels), len(self.laws)
        coordinates, slopes = np.empty((count, free)), np.zeros((count, free, len(coefficients)))
        with np.errstate(all="ignore"):
            for k, (law, basis) in enumerate(zip(self.laws, self.bases, strict=True)):
                values = basis @ coefficients[self.parts[k]]
                if law.form == LOG and not self.bent[k]:
                    coordinates[:, k] = np.exp(values)
                    slopes[:, k, self.parts[k]] = coordinates[:, k, None] * basis
                elif law.form != LOG and self.bent[k]:
                    held = np.maximum(values, self.low[k])
                    coordinates[:, k] = np.log(held)
                    slopes[:, k, self.parts[k]] = basis / held[:, None]
                else:
                    coordinates[:, k] = values
                    slopes[:, k, self.parts[k]] = basis
            factors = self.tests.factors[self.used]
            rows = np.einsum("uij,uj->ui", factors, coordinates[self.rows]) - self.tests.targets[self.used]
            jacobian = np.matmul(factors, slopes[self.rows]).reshape(-1, len(coefficients))
            misfit = float(np.sum(rows**2))
        return (misfit if np.isfinite(misfit) else np.inf), rows.reshape(-1), np.nan_to_num(jacobian)

    def parameters(self, currents: Array) -> Array:
        """Return the parameters (A, K) at currents (A,), inside their bounds."""
        theta = np.tile(self.tests.theta[0], (len(currents), 1))
        for k, (law, basis) in enumerate(zip(self.laws, self._bases(currents), strict=True)):
            values = basis @ self.coefficients[self.parts[k]]
            if law.form == LOG:
                with np.errstate(over="ignore"):
                    values = np.exp(values)
            theta[:, self.tests.free[k]] = np.clip(values, self.low[k], self.high[k])
        return theta

    def leaves_bounds(self, currents: Array) -> bool:
        """Return whether a positive parameter's polynomial falls below its bound somewhere among currents (A,)."""
        return any(
            law.form != LOG and low > 0.0 and law.order and float((basis @ self.coefficients[part]).min()) < low
            for law, low, basis, part in zip(self.laws, self.low, self._bases(currents), self.parts, strict=True)
        )
