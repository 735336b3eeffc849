"""Quadratic drag: four times the force at twice the speed, its work per cycle, and how it falls with temperature."""

import numpy as np
import pytest

from mrfit.effects.quadratic_drag import term
from mrfit.search.cube import cube_of
from mrfit.simulate.assembly import assemble


def test_force_is_odd_and_quadratic() -> None:
    force = term({"velocity": np.array([0.3, 0.6, -0.6])}, np.array([[100.0, 0.0]]), 1e-3)[0]
    assert force == pytest.approx([9.0, 36.0, -36.0])


def test_work_per_cycle_is_eight_thirds_of_drag_times_speed_squared_times_amplitude() -> None:
    w, stroke = 12.0, 0.03
    angle = np.linspace(0, 2 * np.pi, 20_001)
    force = term({"velocity": stroke * w * np.cos(angle)}, np.array([[150.0, 0.0]]), 1e-3)[0]
    assert np.trapezoid(force, stroke * np.sin(angle)) == pytest.approx(8 / 3 * 150.0 * w**2 * stroke**3, rel=1e-6)


def test_a_drag_falls_at_its_own_rate_beside_what_falls_with_the_fluid() -> None:
    whole = assemble("bingham+quadratic-drag+temperature")
    temperature, v, rate = np.array([15.0, 25.0, 45.0]), np.array([-0.4, 0.3, 0.2]), 0.011
    values = {"fy": 400.0, "C_inf": 900.0, "f0": 30.0, "quadratic-drag.c2": 700.0, "quadratic-drag.b_drag": rate}
    values |= {"temperature.b_yield": 0.004, "temperature.b_viscous": 0.02}
    drive = np.stack([{"velocity": v, "temperature": temperature}[n] for n in whole.spec.inputs])
    excess = temperature - 25.0
    expected = 400.0 * np.sign(v) * np.exp(-0.004 * excess) + 900.0 * v * np.exp(-0.02 * excess) + 30.0
    expected += 700.0 * v * np.abs(v) * np.exp(-rate * excess)
    assert whole.simulate(drive, whole.spec.theta(values)[None], 1e-3)[0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("name", "held"), [("tanh+quadratic-drag", True), ("tanh+quadratic-drag+temperature", False)])
def test_its_falling_rate_is_fitted_only_where_the_model_takes_the_temperature(name: str, held: bool) -> None:
    spec = assemble(name).spec
    cube = cube_of(spec, {}, {}, {})
    assert ("quadratic-drag.b_drag" not in [spec.names[k] for k in cube.free]) == held


def test_a_fit_of_a_model_without_temperature_need_not_have_the_rate() -> None:
    spec = assemble("bingham+quadratic-drag").spec
    assert spec.theta({"fy": 1.0, "C_inf": 2.0, "f0": 3.0, "quadratic-drag.c2": 4.0}).tolist() == [1, 2, 3, 4, 0]
    with pytest.raises(KeyError, match=r"quadratic-drag\.c2"):
        spec.theta({"fy": 1.0, "C_inf": 2.0, "f0": 3.0})
