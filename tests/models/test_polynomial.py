"""The polynomials against numpy's Legendre series, and their start values against the force they came from."""

import numpy as np
import pytest

from mrfit.models.polynomial import ORDER, SPEC, response, start_values

RNG = np.random.default_rng(5)
THETA = np.append(RNG.normal(size=2 * ORDER + 2) * 300, 0.25)
V = np.linspace(-0.25, 0.25, 400)


@pytest.mark.parametrize(("a", "first"), [(-1.0, 0), (1.0, ORDER + 1)])
def test_each_branch_is_a_legendre_series(a: float, first: int) -> None:
    expected = np.polynomial.legendre.legval(V / 0.25, THETA[first : first + ORDER + 1])
    assert response(np.stack([V, np.full(400, a)]), THETA[None], 1e-3)[0] == pytest.approx(expected)


def test_basis_choice_does_not_change_what_can_be_described() -> None:
    wider = np.append(np.zeros(2 * ORDER + 2), 0.5)
    basis = np.polynomial.legendre.legvander(V / 0.5, ORDER)
    force = response(np.stack([V, np.ones(400)]), THETA[None], 1e-3)[0]
    wider[ORDER + 1 : -1] = np.linalg.lstsq(basis, force, rcond=None)[0]
    assert response(np.stack([V, np.ones(400)]), wider[None], 1e-3)[0] == pytest.approx(force, abs=1e-3)


def test_start_values_reproduce_a_polynomial_force() -> None:
    drive = np.stack([np.concatenate([V, V[::-1]]), np.repeat([1.0, -1.0], 400)])
    force = response(drive, THETA[None], 1e-3)[0]
    found = start_values(drive, force, 1e-3)
    again = response(drive, np.array([[found[name] for name in SPEC.names]]), 1e-3)[0]
    assert np.abs(again - force).max() < 1e-6 * np.ptp(force)
