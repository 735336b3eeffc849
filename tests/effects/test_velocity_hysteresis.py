"""Velocity hysteresis turns a memoryless base into Guo's model."""

import numpy as np
import pytest

from mrfit.effects.velocity_hysteresis import transform
from mrfit.simulate.assembly import assemble


def motion(middle: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    t = np.arange(6000) / 1000
    return middle + 0.02 * np.sin(2 * np.pi * t), 0.04 * np.pi * np.cos(2 * np.pi * t)


@pytest.mark.parametrize("middle", [0.0, 0.15])
def test_guo_without_memory_becomes_guo_wherever_the_stroke_is_centred(middle: float) -> None:
    x, v = motion()
    guo, whole = assemble("guo"), assemble("guo+velocity-hysteresis")
    assert guo.spec.names == ("fy", "C_inf", "C0", "Omega", "f0")
    expected = guo.simulate(np.stack([x, v]), np.array([[500.0, 900.0, 80.0, 3.0, 10.0]]), 1e-3)
    moved, _ = motion(middle)
    theta = np.array([[500.0, 900.0, 80.0, 0.0, 10.0, 3.0, 0.0]])
    assert np.abs(whole.simulate(np.stack([moved, v]), theta, 1e-3) - expected).max() <= 1e-6 * np.ptp(expected)


def test_force_changes_sign_at_the_critical_velocity() -> None:
    x, v = motion()
    shifted = transform({"displacement": x, "velocity": v}, np.array([2.5, 0.0]), 1e-3)["velocity"]
    falling = np.flatnonzero((shifted[:-1] > 0) & (shifted[1:] <= 0))[1]
    critical = -2.5 * x[falling]
    assert v[falling] == pytest.approx(critical, rel=0.02)
    assert x[falling] > 0 and v[falling] < 0


def test_a_play_holds_the_velocity_until_it_has_turned_by_twice_its_half_width() -> None:
    x, v = motion()
    held = transform({"displacement": x, "velocity": v}, np.array([0.0, 0.01]), 1e-3)["velocity"]
    steady = slice(1000, None)
    assert np.allclose(np.max(held[steady]), np.max(v) - 0.01, atol=1e-6)
    assert np.max(np.abs(held - v)) <= 0.01 + 1e-12
