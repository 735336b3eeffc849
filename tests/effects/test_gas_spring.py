"""Gas spring: no work over a cycle, and at one frequency the same as a negative mass."""

import numpy as np
import pytest

from mrfit.effects import inertia
from mrfit.effects.gas_spring import term

STROKE = 0.015


def force(stiffness: float, angle: np.ndarray, column: float = 0.0) -> np.ndarray:
    return term({"displacement": STROKE * np.sin(angle)}, np.array([[stiffness, column]]), 1e-3)[0]


@pytest.mark.parametrize("column", [0.0, 12.0])
def test_spring_gives_back_what_it_takes(column: float) -> None:
    angle = np.linspace(0, 2 * np.pi, 4001)
    assert abs(np.trapezoid(force(5000.0, angle, column), STROKE * np.sin(angle))) <= 1e-12


@pytest.mark.parametrize("length", [0.1, -0.06])
def test_force_is_that_of_a_polytropic_column_and_straight_for_a_long_one(length: float) -> None:
    angle, filled = np.linspace(0, 2 * np.pi, 101), 600.0
    gas = filled * ((1.0 - STROKE * np.sin(angle) / length) ** -1.3 - 1.0)
    assert force(1.3 * filled / length, angle, 1.0 / length) == pytest.approx(gas, rel=1e-9)
    assert force(5000.0, angle, 1e-9) == pytest.approx(force(5000.0, angle), rel=1e-6)


def test_spring_looks_like_a_negative_mass_at_one_frequency_only() -> None:
    angle = np.linspace(0, 2 * np.pi, 401)
    stiffness, w = 5000.0, 2 * np.pi * 3.0
    for factor, alike in ((1, True), (3, False)):
        acceleration = -STROKE * (factor * w) ** 2 * np.sin(angle)
        mass = inertia.term({"acceleration": acceleration}, np.array([[-stiffness / w**2]]), 1e-3)[0]
        assert np.allclose(force(stiffness, angle), mass) is alike
