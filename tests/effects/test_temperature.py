"""Temperature on a Bingham damper, where yield force and viscous force stand side by side."""

import numpy as np
import pytest

from mrfit.assembly import assemble
from mrfit.effects.temperature import factors

WHOLE = assemble("bingham+temperature")
FY, C, F0 = 400.0, 900.0, 30.0


def force(temperature: np.ndarray, b_yield: float, b_viscous: float) -> np.ndarray:
    assert WHOLE.spec.names == ("fy", "C_inf", "f0", "temperature.b_yield", "temperature.b_viscous")
    drive = np.stack([np.full(len(temperature), 0.5), temperature])
    return WHOLE.simulate(drive, np.array([[FY, C, F0, b_yield, b_viscous]]), 1e-3)[0]


@pytest.mark.parametrize("temperature", [np.array([5.0, 25.0, 65.0]), np.full(3, 65.0)])
def test_yield_and_viscous_force_fall_each_at_its_own_rate_and_the_offset_stays(temperature: np.ndarray) -> None:
    expected = FY * np.exp(-0.004 * (temperature - 25)) + C * 0.5 * np.exp(-0.01 * (temperature - 25)) + F0
    assert np.allclose(force(temperature, 0.004, 0.01), expected, rtol=1e-12)


def test_paper_001_s_loss_of_57_percent_over_80_kelvin_is_a_rate_of_0_0105() -> None:
    cold, warm = factors({"temperature": np.array([-10.0, 70.0])}, np.array([[0.0105, 0.0]]), 1.0)["yield"][0]
    assert 1 - warm / cold == pytest.approx(0.57, abs=0.005)


def test_parameters_are_those_at_25_degrees() -> None:
    assert np.allclose(force(np.full(4, 25.0), 0.05, -0.05), FY + 0.5 * C + F0, rtol=1e-14)
