"""What the fits at single currents say of a law of current: where it would take the parameters, and the error there.

At each level the base model's own fit gives its optimum θ_l, the residuals left, and their sensitivities J_l. With
those the best coefficients of any law, forms and orders for all parameters, are a small least-squares problem,

    min Σ_l |J_l·(w(c, I_l) − w_l) + r_l|²/(variance of r_l),

w the coordinates in which the response bends least: the parameter itself where it enters linearly, else its logarithm.
Left out of the sum, a level is predicted from its neighbours; the error there is simulated, not linearised.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mrfit.core.specs import Array, Index, Mask, ModelSpec
from mrfit.fit.diagnostics.uncertainty import effective_samples, sensitivities
from mrfit.search.cube import Cube
from mrfit.search.problem import LeastSquaresProblem
from mrfit.search.starts import OTHER_LEVELS, LevelFit, descended
from mrfit.simulate.current_dependence import LOG, coordinate
from mrfit.simulate.current_levels import POLYNOMIAL_ROLES

# Gauss-Newton steps to the coefficients of a law, and the share of its own curvature that damps each
LAW_STEPS, DAMPING = 3, 1e-9
# Shares of a step that are tried one after the other
SHARES = (1.0, 0.25)
# Bounds in the cube of a parameter's spread over levels, and how many times levels are drawn together
SPREAD_MIN, SPREAD_MAX = 0.003, 0.1
DRAWING_PASSES = 5
# Share of that spread for parameters that are no force, stiffness or damping: of two that may stand for each other, as
# a loop's scale for its force, the other then changes
STIFF = 0.3
# Samples that what the model itself leaves of one condition is worth: the branches of a cycle, on each of which it errs
# in its own way
STROKE = 4.0
# Share of the output's deviation below which no error is the model's own, however little noise there is
NOISE_SHARE_MIN = 1e-3
# Least share of a block's sum of squares that counts as left over: below it is rounding
SQUARES_ROUNDING = 1e-16


@dataclass(frozen=True)
class CurrentLaw:
    """Form, ``plain`` or ``log``, and order of one parameter's polynomial of current."""

    form: str
    order: int


@dataclass(frozen=True)
class LevelProblem:
    """The problem at one current, and the noise floor of each of its blocks, in the output's unit."""

    posed: LeastSquaresProblem
    floors: Array

    def part(self, members: list[int]) -> "LevelProblem":
        """Return the problem of some of its blocks."""
        posed = self.posed
        own = LeastSquaresProblem(
            [posed.blocks[k] for k in members], posed.weights[members], posed.assembly, posed.cube
        )
        return LevelProblem(own, self.floors[members])

    def by_condition(self) -> list["LevelProblem"]:
        """Return the problems of single conditions."""
        conditions = [b.segment.condition for b in self.posed.blocks]
        return [self.part([k for k, c in enumerate(conditions) if c == one]) for one in dict.fromkeys(conditions)]

    def excess(self, rows: Array) -> float:
        """Return the RMS of residuals (M,) as a multiple of the noise floor, or of what counts as noise."""
        blocks, posed = self.posed.blocks, self.posed
        floors = [max(f, NOISE_SHARE_MIN * float(np.std(b.target))) for b, f in zip(blocks, self.floors, strict=True)]
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
        own = _own_share(self.excess(rows))
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
    bases, maps, reduced
        What ``basis``, ``through`` and ``by_level`` remember.
    """

    spec: ModelSpec
    cube: Cube
    currents: Array
    theta: Array
    posed: tuple[LeastSquaresProblem, ...]
    places: Index
    factors: Array
    targets: Array
    squares: Array
    unseen: Array
    worth: Array
    excess: float
    bases: dict[tuple[CurrentLaw, bytes], Array] = field(default_factory=dict)
    maps: dict[tuple[CurrentLaw, bytes], Array] = field(default_factory=dict)
    reduced: dict[bytes, tuple[Index, Array, Array]] = field(default_factory=dict)

    @property
    def free(self) -> Index:
        """Columns of the free parameters."""
        return self.cube.free

    @property
    def bent(self) -> Mask:
        """Which free parameters (F,) have their logarithm as coordinate."""
        return _curved(self.spec, self.cube)

    def basis(self, law: CurrentLaw, currents: bytes) -> Array:
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

    def through(self, law: CurrentLaw, currents: bytes) -> Array:
        """Return the map from values at currents as bytes to the coefficients (m + 1, A) of the nearest law."""
        key = (law, currents)
        if key not in self.maps:
            self.maps[key] = np.linalg.pinv(self.basis(law, currents)).astype(np.float64)
        return self.maps[key]

    def by_level(self, known: Index) -> tuple[Index, Array, Array]:
        """Return the levels (A,) of conditions, and R (A, F, F) and t (A, F) of the misfit |R·w − t|² at each."""
        key = known.tobytes()
        if key not in self.reduced:
            levels, factors, targets = np.unique(self.places[known]), [], []
            for level in levels:
                used = [*known[self.places[known] == level], len(self.posed) + level]
                q, r = np.linalg.qr(np.concatenate(self.factors[used]))
                factors.append(r)
                targets.append(q.T @ np.concatenate(self.targets[used]))
            self.reduced[key] = levels, np.array(factors), np.array(targets)
        return self.reduced[key]

    @cached_property
    def information(self) -> Array:
        """Information on the coordinates by the conditions of each level, Σ RᵀR of shape (L, F, F).

        The model errs under a level's only stroke as under all, whatever the fit to it leaves: a condition's error
        counts as no less than the model's own is of its output in the median.
        """
        own = _own_share(self.excess)
        powers = np.array([len(rows) * np.var(rows) for rows in (posed.silent[:-1] for posed in self.posed)])
        left = np.maximum(self.squares, float(np.median(self.squares / powers)) * powers)
        worth = np.minimum(self.worth, STROKE / own**2) if own else self.worth
        told = worth / self.worth * self.squares / left
        rows = self.factors[: len(self.places)]
        found = np.zeros((len(self.currents), *self.factors.shape[1:]))
        np.add.at(found, self.places, told[:, None, None] * (rows.swapaxes(1, 2) @ rows))
        return found

    @cached_property
    def strokes(self) -> Array:
        """Factors R (U, L, F, F): a change dw of the coordinates at a level moves a condition's stroke there by |R·dw|.

        In units of the norm of the output there about its mean. A stroke that diverges there tells nothing.
        """
        found = np.zeros((len(self.posed), len(self.currents), len(self.free), len(self.free)))
        for (test, level), factor in zip(np.ndindex(found.shape[:2]), found.reshape(-1, *found.shape[2:]), strict=True):
            own, (point, _, slopes) = self.posed[test], _about(self.cube, self.theta[level], self.bent)
            output = _rows(own)(point[None, :])[0] - own.silent[:-1]
            if np.isfinite(output).all() and np.ptp(output) > 0.0:
                rows = np.vstack([sensitivities(_rows(own), point) / slopes, np.zeros_like(factor)])
                factor[:] = np.linalg.qr(rows)[1] / np.linalg.norm(output - output.mean())
        return found

    def deviance(self, test: int, theta: Array) -> Array:
        """Return n·ln(S/S_0) (P,), S the sum of squares at parameters (P, K), S_0 the optimum's, n its worth."""
        with np.errstate(all="ignore"):
            rows = self.posed[test].of_theta(theta)[:, :-1]
            squares = np.einsum("pm,pm->p", rows, rows)
            least = self.squares[test]
            more = self.unseen[test]
            deviance = self.worth[test] * np.log((np.maximum(squares, SQUARES_ROUNDING) + more) / (least + more))
        return np.where(np.isfinite(squares), deviance, np.inf)


def _own_share(excess: float) -> float:
    """Return the model's own share of the squares left, of an error in multiples of the noise floor."""
    return max(1.0 - 1.0 / excess**2, 0.0) if excess > 0.0 else 0.0


def _curved(spec: ModelSpec, cube: Cube) -> Mask:
    params = [cube.params[k] for k in cube.free]
    return np.array([p.scale == "log" and p.name not in spec.linear for p in params])


def tests_about(spec: ModelSpec, cube: Cube, fits: Sequence[LevelFit], posed: Sequence[LevelProblem]) -> Tests:
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
        floor = SQUARES_ROUNDING * float(sum(b.target @ b.target for b in own.blocks))
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


def drawn_together(
    cube: Cube, fits: Sequence[LevelFit], posed: Sequence[LevelProblem], rng: np.random.Generator
) -> list[LevelFit]:
    """Return fits at single currents among which as few parameters differ as the data allow.

    Where the data leave a direction open, as a change of scale of z is in a Bouc-Wen element, each level's fit ends
    anywhere along it, and no law of current goes through such ends. Every level is fitted again from its optimum with a
    penalty on the way from the levels' median, in units of the parameter's own spread: what varies anyway may do so at
    little cost, and what does not need to vary stops.
    """
    fits, roles = list(fits), [cube.params[k].role for k in cube.free]
    ease = np.array([1.0 if role in POLYNOMIAL_ROLES or not role else STIFF for role in roles])
    for turn in range(DRAWING_PASSES):
        points = cube.to_points(np.array([f.theta for f in fits]))
        centre, spread = (
            np.median(points, axis=0),
            np.full(points.shape[1], SPREAD_MAX) if not turn else _spread(points),
        )
        spread = spread * ease
        for k, (at, point) in enumerate(zip(posed, points, strict=True)):
            own = at.posed
            rows = own.residuals(point[None, :])[0, :-1]
            weight = np.sqrt(float(rows @ rows) / at.worth(rows)) / spread
            allowed = 1 + OTHER_LEVELS * (len(point) + 1)
            found = descended(_drawn(own, centre, weight), point, allowed)[None, :]
            theta = cube.to_theta(found)[0]
            cost = float(np.sqrt(np.mean(own.residuals(found)[0] ** 2)))
            fits[k] = LevelFit(fits[k].current, cost, theta)
    return fits


def _spread(points: Array) -> Array:
    """Return the spread of each parameter over levels (L, F) of the cube, no less and no more than counts."""
    spread: Array = np.clip(np.std(points, axis=0), SPREAD_MIN, SPREAD_MAX)
    return spread


def _drawn(posed: LeastSquaresProblem, centre: Array, weight: Array) -> Callable[[Array], Array]:
    """Return a problem's residuals with those of a penalty on the way from a point (F,) of the cube."""
    return lambda points: np.hstack([posed.residuals(points), weight * (points - centre)])


def _rows(posed: LeastSquaresProblem) -> Callable[[Array], Array]:
    """Return a problem's residuals without the one that no model removes."""
    return lambda points: posed.residuals(points)[:, :-1]


class Laws:
    """The laws of all free parameters that fit some conditions best, for P choices of these laws at once.

    Parameters
    ----------
    tests
        What is known under each condition.
    laws
        Of each free parameter, P times.
    known
        Conditions used (V,).
    """

    def __init__(self, tests: Tests, laws: Sequence[Sequence[CurrentLaw]], known: Index) -> None:
        self.tests, self.laws = tests, laws
        self.levels, self.factors, self.targets = tests.by_level(known)
        log = np.array([[law.form == LOG for law in own] for own in laws])
        self.log, self.exp, self.ln = log, log & ~tests.bent, ~log & tests.bent
        params = [tests.cube.params[k] for k in tests.free]
        self.low, self.high = (np.array(e) for e in zip(*((p.low, p.high) for p in params), strict=True))
        # the parameter that each of C coefficients belongs to; choices of fewer have some of none
        owners = [np.repeat(np.arange(len(own)), [law.order + 1 for law in own]) for own in laws]
        self.most = max(map(len, owners))
        self.owners = np.array([np.concatenate([own, np.zeros(self.most - len(own), int)]) for own in owners])
        self.basis = self._basis(tests.currents[self.levels])
        # of each choice P, the parameter F that a coefficient C counts for
        self.counts = (self.owners[:, None, :] == np.arange(len(params))[:, None]).astype(np.float64)
        self.coefficients = self._fitted()

    def _basis(self, currents: Array) -> Array:
        """Return each coefficient's polynomial at currents (A,), shape (P, A, C)."""
        at, found = currents.tobytes(), np.zeros((len(self.laws), len(currents), self.most))
        for row, own in zip(found, self.laws, strict=True):
            joined = np.concatenate([self.tests.basis(law, at) for law in own], axis=1)
            row[:, : joined.shape[1]] = joined
        return found

    def _through(self) -> Array:
        """Return the coefficients (P, C) of the laws nearest to the optima."""
        theta, at = self.tests.theta[self.levels][:, self.tests.free], self.tests.currents[self.levels].tobytes()
        logarithms = np.log(np.where(self.log.any(axis=0), theta, 1.0))
        found = np.zeros((len(self.laws), self.most))
        for row, own in zip(found, self.laws, strict=True):
            values = (logarithms if law.form == LOG else theta for law in own)
            joined = [self.tests.through(law, at) @ v[:, k] for k, (law, v) in enumerate(zip(own, values, strict=True))]
            row[: sum(map(len, joined))] = np.concatenate(joined)
        return found

    def _fitted(self) -> Array:
        """Return the coefficients (P, C) of all laws: Gauss-Newton from those through the optima."""
        found = self._through()
        misfit, rows, jacobian = self._model(found)
        searched = np.ones(len(found), dtype=bool)
        for _ in range(LAW_STEPS):
            step = _damped_step(jacobian, rows)
            better = np.zeros(len(found), dtype=bool)
            for share in SHARES:
                tried = found + share * step
                nearer, *others = self._model(tried)
                lower = (nearer < misfit) & searched & ~better
                found, misfit = np.where(lower[:, None], tried, found), np.where(lower, nearer, misfit)
                rows, jacobian = (
                    np.where(lower.reshape(-1, *[1] * (old.ndim - 1)), new, old)
                    for old, new in zip((rows, jacobian), others, strict=True)
                )
                better |= lower
                if (better | ~searched).all():
                    break
            searched &= better
            if not searched.any():
                break
        return found

    def _model(self, coefficients: Array) -> tuple[Array, Array, Array]:
        """Return the misfits (P,), their rows (P, M) and the derivatives of these (P, M, C)."""
        with np.errstate(all="ignore"):
            coordinates, slopes = self._coordinates(coefficients)
            rows = np.matmul(self.factors, coordinates[..., None])[..., 0] - self.targets
            jacobian = np.matmul(self.factors, slopes)
            misfits = np.sum(rows**2, axis=(1, 2))
        count = len(coefficients)
        misfits = np.where(np.isfinite(misfits), misfits, np.inf)
        return misfits, np.nan_to_num(rows.reshape(count, -1)), np.nan_to_num(jacobian.reshape(count, -1, self.most))

    def _coordinates(self, coefficients: Array) -> tuple[Array, Array]:
        """Return the coordinates (P, A, F) at the levels used and their derivatives (P, A, F, C)."""
        values = np.matmul(self.basis * coefficients[:, None, :], self.counts.transpose(0, 2, 1))
        exp, ln = self.exp[:, None, :], self.ln[:, None, :]
        held = np.maximum(values, self.low)
        raised = np.exp(np.where(exp, values, 0.0))
        coordinates = np.where(exp, raised, np.where(ln, np.log(np.where(ln, held, 1.0)), values))
        gains = np.where(exp, raised, np.where(ln, 1.0 / np.where(ln, held, 1.0), 1.0))
        slopes = np.matmul(gains, self.counts) * self.basis
        return coordinates, self.counts[:, None] * slopes[:, :, None, :]

    def standard_errors(self) -> Array:
        """Return the standard error (P, U, L) of the output for every stroke at every level, all levels used.

        It is a share of the output's deviation there. The penalty that draws levels together is no test.
        """
        with np.errstate(all="ignore"):
            slopes = self._coordinates(self.coefficients)[1]
        information = np.einsum("plfc,lfg,plgd->pcd", slopes, self.tests.information, slopes, optimize=True)
        spread = slopes @ _inverse(information)[:, None] @ slopes.swapaxes(2, 3)
        strokes = self.tests.strokes
        errors = np.einsum("ulfg,plgh,ulfh->pul", strokes, spread, strokes, optimize=True)
        found: Array = np.sqrt(np.maximum(np.nan_to_num(errors), 0.0))
        return found

    def parameters(self, currents: Array) -> Array:
        """Return the parameters (P, A, K) at currents (A,), inside their bounds."""
        values = self._values(currents)
        with np.errstate(over="ignore"):
            values = np.where(self.log[:, None, :], np.exp(np.where(self.log[:, None, :], values, 0.0)), values)
        theta = np.tile(self.tests.theta[0], (len(self.laws), len(currents), 1))
        theta[:, :, self.tests.free] = np.clip(values, self.low, self.high)
        return theta

    def _values(self, currents: Array) -> Array:
        """Return the polynomials (P, A, F) at currents (A,)."""
        values: Array = np.matmul(self._basis(currents) * self.coefficients[:, None, :], self.counts.transpose(0, 2, 1))
        return values

    def leaves_bounds(self, currents: Array) -> Mask:
        """Return which choices (P,) let a positive parameter fall below its bound somewhere among currents (A,)."""
        checked = np.array([[law.form != LOG and law.order > 0 for law in own] for own in self.laws]) & (self.low > 0.0)
        below: Mask = (checked & (self._values(currents).min(axis=1) < self.low)).any(axis=1)
        return below


def _damped_step(jacobian: Array, rows: Array) -> Array:
    """Return the damped Gauss-Newton steps (P, C) of P problems."""
    curvature = np.matmul(jacobian.transpose(0, 2, 1), jacobian)
    gradient = np.matmul(jacobian.transpose(0, 2, 1), rows[:, :, None])
    scaled, unit = _damped(curvature)
    return -unit * np.linalg.solve(scaled, unit[:, :, None] * gradient)[:, :, 0]


def _inverse(curvature: Array) -> Array:
    """Return the damped inverses of curvatures (P, C, C): the covariances of coefficients."""
    scaled, unit = _damped(curvature)
    return np.linalg.inv(scaled) * unit[:, :, None] * unit[:, None, :]


def _damped(curvature: Array) -> tuple[Array, Array]:
    """Return curvatures (P, C, C) in units (P, C) in which all are alike, each raised by a share of its own."""
    diagonal = np.einsum("pcc->pc", curvature)
    unit = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    scaled = curvature * unit[:, :, None] * unit[:, None, :]
    scaled[:, np.arange(scaled.shape[1]), np.arange(scaled.shape[1])] = 1.0 + DAMPING
    return scaled, unit
