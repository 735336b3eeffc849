"""Temperature on a Bingham damper, where yield force and viscous force stand side by side, and on a bent curve."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from mrfit.effects.temperature import factors
from mrfit.simulate.assembly import assemble

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


# tanh-like models with the place of what makes their knee: temperature must leave it where it is
BENT = {
    "tanh": (400.0, 90.0, 60.0, 900.0, 500.0, 30.0),
    "guo": (400.0, 900.0, 90.0, 2.0, 30.0),
    "biviscous": (400.0, 900.0, 0.02, 30.0),
    "regularised-bingham": (400.0, 900.0, 0.02, 30.0),
    "hysteretic-regularised-bingham": (400.0, 900.0, 0.02, 0.004, 30.0),
}


@pytest.mark.parametrize("name", BENT)
def test_planted_falling_rates_are_found_where_the_knee_stays_at_its_velocity(name: str) -> None:
    base, whole = assemble(name), assemble(f"{name}+temperature")
    t = np.linspace(0.0, 20.0, 2001)
    x, v = 0.01 * np.sin(6.3 * t), 0.063 * np.cos(6.3 * t)
    channels = {"displacement": x, "velocity": v, "acceleration": -(6.3**2) * x, "temperature": 20.0 + 2.5 * t}
    drive = np.stack([channels[n] for n in whole.spec.inputs])
    roles = [p.role for p in base.spec.params]
    # the truth is simulated sample by sample, each at its own temperature, by the base alone
    scaled = np.repeat(np.array([BENT[name]]), len(t), axis=0)
    for role, rate in (("yield", 0.0105), ("viscous", 0.004)):
        force = [p.unit == "N" if role == "yield" else r == role for p, r in zip(base.spec.params, roles, strict=True)]
        force[-1] = False  # the offset
        scaled[:, force] *= np.exp(-rate * (channels["temperature"] - 25.0))[:, None]
    truth = np.diag(base.simulate(np.ascontiguousarray(drive[: len(base.spec.inputs)]), scaled, 0.01))
    scale = np.array([*BENT[name], 0.01, 0.01])

    def residuals(point: np.ndarray) -> np.ndarray:
        return whole.simulate(drive, (scale * point)[None, :], 0.01)[0] - truth

    found = scale * least_squares(residuals, np.r_[np.full(len(BENT[name]), 1.1), 0.0, 0.0], x_scale=0.1).x
    assert found[-2:] == pytest.approx([0.0105, 0.004], abs=2e-5)
    assert found[:-2] == pytest.approx(BENT[name], rel=2e-3)
