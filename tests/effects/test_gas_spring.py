"""Gas spring: no work over a cycle, and at one frequency the same as a negative mass."""

import numpy as np

from mrfit.effects import inertia
from mrfit.effects.gas_spring import term

STROKE = 0.015


def force(stiffness: float, angle: np.ndarray) -> np.ndarray:
    return term({"displacement": STROKE * np.sin(angle)}, np.array([[stiffness]]), 1e-3)[0]


def test_spring_gives_back_what_it_takes() -> None:
    angle = np.linspace(0, 2 * np.pi, 4001)
    assert abs(np.trapezoid(force(5000.0, angle), STROKE * np.sin(angle))) <= 1e-12


def test_spring_looks_like_a_negative_mass_at_one_frequency_only() -> None:
    angle = np.linspace(0, 2 * np.pi, 401)
    stiffness, w = 5000.0, 2 * np.pi * 3.0
    for factor, alike in ((1, True), (3, False)):
        acceleration = -STROKE * (factor * w) ** 2 * np.sin(angle)
        mass = inertia.term({"acceleration": acceleration}, np.array([[-stiffness / w**2]]), 1e-3)[0]
        assert np.allclose(force(stiffness, angle), mass) is alike
