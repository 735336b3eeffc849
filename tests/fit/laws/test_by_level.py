"""Coefficients of many laws at once, against scipy's least squares of the same misfit one law at a time."""

import numpy as np
import pytest
from scipy.optimize import least_squares

import mrfit.fit.stage
from mrfit.core.specs import Array
from mrfit.fit.laws import by_level
from mrfit.fit.laws.by_level import CurrentLaw, Laws
from mrfit.fit.laws.laws_of_current import base_cube
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import coordinate

CURRENTS = np.array([0.0, 0.3, 0.7, 1.0])
PLACES = np.array([0, 0, 1, 2, 2, 3])


def about_optima(seed: int) -> by_level.Tests:
    """Return what is known of a hysteretic-biviscous damper under six conditions at four currents."""
    rng, spec = np.random.default_rng(seed), assemble("hysteretic-biviscous").spec
    cube = base_cube(mrfit.fit.stage.Settings("hysteretic-biviscous", per="all"))
    free, count = len(cube.free), len(PLACES) + len(CURRENTS)
    theta = spec.start * np.exp(np.outer(CURRENTS, rng.uniform(0.1, 0.8, len(spec.start))))
    bent = np.array([p.scale == "log" and p.name not in spec.linear for p in spec.params])[cube.free]
    at = np.where(bent, np.log(np.where(bent, theta[:, cube.free], 1.0)), theta[:, cube.free])
    unit = np.where(bent, 0.05, 0.05 * np.abs(theta[:, cube.free]).max(axis=0) + 1e-3)
    factors = rng.standard_normal((count, free, free)) / unit
    optima = at[np.concatenate([PLACES, np.arange(len(CURRENTS))])]
    targets = np.einsum("uij,uj->ui", factors, optima) + 0.1 * rng.standard_normal((count, free))
    alone = np.zeros(len(PLACES))
    return by_level.Tests(
        spec, cube, CURRENTS, theta, tuple([None] * len(PLACES)), PLACES, factors, targets, alone, alone, alone, 1.0
    )  # type: ignore[arg-type]


def misfit(tests: by_level.Tests, laws: list[CurrentLaw], known: Array, theta: Array) -> Array:
    """Return the rows of the misfit of parameters (A, K) at the levels of the known conditions."""
    levels = np.unique(tests.places[known])
    values = theta[:, tests.free]
    at = np.where(tests.bent, np.log(np.where(tests.bent, values, 1.0)), values)
    rows = [tests.factors[u] @ at[list(levels).index(tests.places[u])] - tests.targets[u] for u in known]
    rows += [tests.factors[len(PLACES) + k] @ at[j] - tests.targets[len(PLACES) + k] for j, k in enumerate(levels)]
    return np.concatenate(rows)


@pytest.mark.parametrize("known", [np.arange(6), np.array([0, 3, 4, 5])])
def test_laws_of_every_form_are_those_of_least_misfit(known: Array) -> None:
    tests = about_optima(1)
    free = len(tests.free)
    choices = [
        [CurrentLaw(form, order)]
        + [CurrentLaw("log", 1) if tests.bent[k] else CurrentLaw("plain", 1) for k in range(1, free)]
        for form in ("plain", "log", "sat")
        for order in (0, 1, 2)
    ]
    levels = CURRENTS[np.unique(tests.places[known])]
    found = Laws(tests, choices, known).parameters(levels)

    for laws, own in zip(choices, found, strict=True):

        def parameters(coefficients: Array, laws: list[CurrentLaw] = laws) -> Array:
            theta, column = np.tile(tests.theta[0], (len(levels), 1)), 0
            for k, law in zip(tests.free, laws, strict=True):
                powers = np.vander(coordinate(levels, CURRENTS[[0, -1]], law.form), law.order + 1)
                values = powers @ coefficients[column : column + law.order + 1]
                theta[:, k] = np.exp(values) if law.form == "log" else values
                column += law.order + 1
            return theta

        start = []
        for k, law in zip(tests.free, laws, strict=True):
            powers = np.vander(coordinate(levels, CURRENTS[[0, -1]], law.form), law.order + 1)
            values = tests.theta[np.unique(tests.places[known]), k]
            start.append(np.linalg.lstsq(powers, np.log(values) if law.form == "log" else values, rcond=None)[0])
        best = least_squares(
            lambda c, laws=laws: misfit(tests, laws, known, parameters(c, laws)), np.concatenate(start), x_scale="jac"
        )
        assert np.sum(misfit(tests, laws, known, own) ** 2) <= 1.001 * 2.0 * best.cost


def test_laws_fitted_together_are_those_fitted_alone() -> None:
    tests, known = about_optima(2), np.arange(6)
    free = len(tests.free)
    choices = [[CurrentLaw("plain", k)] * free for k in range(3)] + [
        [CurrentLaw("sat", 2)] + [CurrentLaw("plain", 0)] * (free - 1)
    ]
    together = Laws(tests, choices, known)
    for k, laws in enumerate(choices):
        alone = Laws(tests, [laws], known)
        np.testing.assert_allclose(together.parameters(CURRENTS)[k], alone.parameters(CURRENTS)[0], rtol=1e-9)
        assert together.leaves_bounds(CURRENTS)[k] == alone.leaves_bounds(CURRENTS)[0]
