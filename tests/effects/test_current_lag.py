"""Current lag against the step response of a first-order system."""

import numpy as np
import pytest

from mrfit.effects.current_lag import transform
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence


def step(dt: float, duration: float) -> np.ndarray:
    """Return a current that rises from 0.2 to 1 A between the samples around t = 0.1 s."""
    t = np.arange(int(round(duration / dt)) + 1) * dt
    return np.where(t >= 0.1 + dt / 2, 1.0, 0.2)


@pytest.mark.parametrize("dt", [1e-4, 1e-3])
def test_field_has_risen_by_63_percent_after_one_time_constant(dt: float) -> None:
    tau = 0.02
    field = transform({"current": step(dt, 0.3)}, np.array([tau, 0.0]), dt)["current"]
    at = int(round((0.1 + dt / 2 + tau) / dt * 2)) / 2
    assert np.interp(at, np.arange(len(field)), field) == pytest.approx(0.2 + 0.8 * (1 - np.exp(-1)), abs=1e-3 + dt)
    assert field[0] == 0.2
    assert field[-1] == pytest.approx(1.0, abs=1e-4)


def test_rate_of_paper_004_is_a_time_constant_of_20_ms() -> None:
    dt, nu = 1e-4, 50.0
    current = step(dt, 0.2)
    field, euler = transform({"current": current}, np.array([1 / nu, 0.0]), dt)["current"], np.empty(len(current))
    euler[0] = current[0]
    for j in range(1, len(current)):
        euler[j] = euler[j - 1] + dt * nu * (current[j - 1] - euler[j - 1])
    assert np.abs(field - euler).max() <= 0.8 * dt * nu


def test_a_constant_current_shows_nothing() -> None:
    dependence = CurrentDependence((("fy", 2),), 0.0, 1.0)
    base, whole = assemble("bingham", dependence), assemble("bingham+current-lag", dependence)
    v = np.sin(np.arange(300) / 20)
    drive = np.stack([v, np.full(300, 0.7)])
    theta = np.array([[50.0, 400.0, 700.0, 800.0, 5.0]])
    assert np.array_equal(
        whole.simulate(drive, np.column_stack([theta, [[0.05, 0.0]]]), 1e-3), base.simulate(drive, theta, 1e-3)
    )


def test_force_of_a_linear_yield_follows_the_field() -> None:
    dependence = CurrentDependence((("fy", 1),), 0.0, 1.0)
    whole = assemble("bingham+current-lag", dependence)
    current = step(1e-3, 0.3)
    force = whole.simulate(np.stack([np.ones(301), current]), np.array([[100.0, 900.0, 50.0, 0.0, 0.03, 0.0]]), 1e-3)[0]
    field = transform({"current": current}, np.array([0.03, 0.0]), 1e-3)["current"]
    assert np.allclose(force, 100 + 800 * field + 50, rtol=1e-12)


@pytest.mark.parametrize("late", [0.0073, -0.0031])
def test_dead_time_moves_the_whole_response_between_samples_too(late: float) -> None:
    dt, tau = 2e-3, 0.02
    t = np.arange(600) * dt
    ramp = np.clip(t - 0.4, 0.0, 0.3)
    found = transform({"current": ramp}, np.array([tau, late]), dt)["current"]

    def response(since: np.ndarray) -> np.ndarray:
        return np.where(since > 0, since - tau * -np.expm1(-np.maximum(since, 0) / tau), 0.0)

    assert np.abs(found - (response(t - 0.4 - late) - response(t - 0.7 - late))).max() <= 2e-5
