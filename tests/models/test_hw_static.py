"""The static map against its printed branches, and as the base of the chain that is Hammerstein-Wiener."""

import numpy as np
import pytest

from mrfit.models import hammerstein_wiener, hw_static
from mrfit.simulate.assembly import assemble

DT = 1e-3
MAP = {"c_pre": 3e4, "c_post": 1200.0, "a": 0.02, "b": 0.004, "f0": -20.0}
M = {"q1": 60.0, "q2": 400.0, "zero": 200.0, "tau": 0.0023}
H = {"p1": 150.0, "p2": 300.0, "p3": 600.0, "p4": 1200.0, "omega": 400.0, "xi": 0.7}
M_LINK = {"T": 1 / 60, "r_2": 60 / 400, "r_z": 60 / 200, "tau": 0.0023}
H_LINK = {"T": 1 / 150, "r_2": 1 / 2, "r_3": 1 / 4, "r_4": 1 / 8, "r_w": 150 / 400, "xi": 0.7}
WHOLE = "hw-static+current-filter+force-filter"


def drive() -> np.ndarray:
    """Return a chirped velocity in m/s and current steps in A, (2, 3000)."""
    t = np.arange(3000) * DT
    return np.stack([0.2 * np.sin(2 * np.pi * (1.5 * t + t**2)), np.where(np.sin(9 * t) > 0, 1.2, 0.1)])


def theta_of(name: str, values: dict[str, float]) -> np.ndarray:
    return np.array([[values.get(p.name, p.start) for p in assemble(name).spec.params]])


def linked(**effects: dict[str, float]) -> dict[str, float]:
    return {f"{e.replace('_', '-')}.{n}": v for e, values in effects.items() for n, v in values.items()}


@pytest.mark.parametrize("current", [0.0, 0.5, 2.0])
def test_force_is_that_of_the_printed_branches_with_the_third_mended(current: float) -> None:
    v = np.linspace(-0.3, 0.3, 201)
    turn = MAP["a"] * current + MAP["b"]
    beyond = MAP["c_post"] * (v - np.sign(v) * turn) + MAP["c_pre"] * turn * np.sign(v)
    expected = np.where(np.abs(v) > turn, beyond, MAP["c_pre"] * v) - 20.0
    found = hw_static.response(np.stack([v, np.full(201, current)]), theta_of("hw-static", MAP), DT)[0]
    assert found == pytest.approx(expected, rel=1e-12)


def test_start_values_share_out_the_yield_velocity_at_the_mean_current() -> None:
    t = np.linspace(0, 2, 4001)
    inputs = np.stack([0.3 * np.sin(2 * np.pi * t), np.full(4001, 0.8)])
    found = hw_static.start_values(inputs, hw_static.response(inputs, theta_of("hw-static", MAP), t[1])[0], t[1])
    assert found["a"] * 0.8 + found["b"] == pytest.approx(0.02, rel=0.2)
    assert found["c_post"] == pytest.approx(1200.0, rel=0.05)


def test_with_both_filters_it_is_hammerstein_wiener() -> None:
    expected = hammerstein_wiener.response(drive(), theta_of("hammerstein-wiener", MAP | M | H), DT)
    whole = assemble(WHOLE)
    assert whole.spec.inputs == ("velocity", "current")
    found = whole.simulate(drive(), theta_of(WHOLE, MAP | linked(current_filter=M_LINK, force_filter=H_LINK)), DT)
    assert np.abs(found - expected).max() <= 1e-9 * np.ptp(expected)


@pytest.mark.parametrize(
    ("name", "left"),
    [
        ("hw-static", {}),
        ("hw-static+force-filter", linked(force_filter=H_LINK)),
        ("hw-static+current-filter", linked(current_filter=M_LINK)),
    ],
)
def test_every_partial_model_is_nested_in_the_whole_bit_for_bit(name: str, left: dict[str, float]) -> None:
    partial = assemble(name).simulate(drive(), theta_of(name, MAP | left), DT)
    assert np.array_equal(assemble(WHOLE).simulate(drive(), theta_of(WHOLE, MAP | left), DT), partial)


def test_temperature_scales_the_force_of_hammerstein_wiener_as_alpha_does() -> None:
    warming = np.vstack([drive(), np.linspace(20.0, 80.0, 3000)])
    slow = H | {"p1": 5e3, "p2": 5e3, "p3": 5e3, "p4": 5e3, "omega": 1e4}
    cold = hammerstein_wiener.response(drive(), theta_of("hammerstein-wiener", MAP | M | slow), DT)[0]
    name = "hammerstein-wiener+temperature"
    warm = assemble(name).simulate(warming, theta_of(name, MAP | M | slow | {"temperature.b_viscous": 0.01}), DT)[0]
    alpha = np.exp(-0.01 * (warming[2] - 25.0))
    assert warm + 20.0 == pytest.approx(alpha * (cold + 20.0), rel=1e-3, abs=0.2)
