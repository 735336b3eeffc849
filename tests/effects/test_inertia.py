"""Inertia: power integrates to kinetic energy."""

import numpy as np
import pytest

from mrfit.effects.inertia import term


def test_work_over_any_time_is_the_change_of_kinetic_energy() -> None:
    t = np.linspace(0, 0.37, 20_001)
    v = 0.4 * np.sin(11 * t) + 0.1 * np.sin(31 * t)
    acceleration = 4.4 * np.cos(11 * t) + 3.1 * np.cos(31 * t)
    force = term({"acceleration": acceleration}, np.array([[2.5]]), t[1])[0]
    work = np.concatenate([[0.0], np.cumsum((force * v)[1:] + (force * v)[:-1]) * t[1] / 2])
    assert np.allclose(work, 2.5 * v**2 / 2, atol=1e-7)


@pytest.mark.parametrize("mass", [1.0, -0.5])
def test_force_grows_with_the_square_of_frequency(mass: float) -> None:
    phase = np.linspace(0, 6, 50)
    slow, fast = (
        np.ptp(term({"acceleration": 0.01 * w**2 * np.sin(phase)}, np.array([[mass]]), 1e-3)) for w in (10.0, 30.0)
    )
    assert fast / slow == pytest.approx(9)
