"""Relief valve: nothing below its opening, a share of what is above it, in one direction or both."""

import numpy as np
import pytest

import mrfit
from mrfit.effects.relief_valve import shape
from mrfit.simulate.assembly import assemble


def relieved(force: np.ndarray, x: np.ndarray, *theta: float) -> np.ndarray:
    return shape(force[None], {"displacement": x}, np.array([theta]), 1e-3)[0]


def test_a_share_is_taken_above_the_opening_of_each_direction_and_nothing_below() -> None:
    force, x = np.array([-1000.0, -300.0, -100.0, 0.0, 299.0, 300.0, 800.0]), np.zeros(7)
    assert relieved(force, x, 0.4, 0.0, 300.0, 0.0) == pytest.approx([-1000, -300, -100, 0, 299, 300, 600])
    assert relieved(force, x, 0.0, 1.0, 300.0, 0.0) == pytest.approx([-300, -300, -100, 0, 299, 300, 800])
    assert relieved(force, x, 0.4, 0.2, 300.0, 0.0) == pytest.approx([-860, -300, -100, 0, 299, 300, 600])


def test_directions_exchange_with_the_shares() -> None:
    rng = np.random.default_rng(1)
    force, x = rng.normal(0.0, 500.0, 200), rng.normal(0.0, 0.01, 200)
    there = relieved(force, x, 0.7, 0.1, 250.0, 2000.0)
    assert relieved(-force, -x, 0.1, 0.7, 250.0, 2000.0) == pytest.approx(-there)


def test_a_spring_beside_the_valve_stays_as_it_is() -> None:
    x = np.linspace(-0.02, 0.02, 41)
    fluid = np.linspace(-900.0, 900.0, 41)
    alone = relieved(fluid, x, 0.5, 0.3, 400.0, 0.0)
    assert relieved(fluid + 3000.0 * x, x, 0.5, 0.3, 400.0, 3000.0) == pytest.approx(alone + 3000.0 * x)


def test_a_valve_only_takes_work() -> None:
    """Behind the valve the force has the sign of before and is never larger, whatever the shares."""
    rng = np.random.default_rng(2)
    force = rng.normal(0.0, 800.0, 500)
    for shares in ((0.0, 0.0), (0.3, 0.9), (1.0, 1.0)):
        behind = relieved(force, np.zeros(500), *shares, 200.0, 0.0)
        assert np.all(behind * force >= 0.0) and np.all(np.abs(behind) <= np.abs(force))


def test_opening_and_share_are_found_beside_a_spring() -> None:
    """Sines of three speeds, with noise, under a valve that opens in extension only."""
    rng, dt, logs = np.random.default_rng(3), 1e-3, []
    whole = assemble("tanh+relief-valve")
    theta = whole.spec.start[None].copy()
    planted = {"fy": 250.0, "a1": 40.0, "c": 900.0, "k": 4000.0, "f0": 0.0}
    planted |= {"relief-valve.r_p": 0.6, "relief-valve.r_n": 0.0, "relief-valve.F_o": 420.0, "relief-valve.k_b": 4000.0}
    for name, value in planted.items():
        theta[0, whole.spec.names.index(name)] = value
    for frequency, stroke in ((1.0, 0.01), (3.0, 0.01), (5.0, 0.015)):
        turn = 2 * np.pi * frequency * np.arange(0.0, 4.0, dt)
        rows = {"displacement": stroke * np.sin(turn), "velocity": stroke * 2 * np.pi * frequency * np.cos(turn)}
        force = whole.simulate(np.stack([rows[n] for n in whole.spec.inputs]), theta, dt)[0]
        force = force + rng.normal(0.0, 3.0, len(force))
        logs.append(mrfit.Recording.from_arrays(dt=dt, force=force, name=f"{frequency:g} Hz", **rows))
    found = mrfit.fit(logs, "tanh+relief-valve", per="all", holdout="none", progress=False).params["value"]
    assert found["relief-valve.F_o"] == pytest.approx(420.0, rel=0.02)
    assert found["relief-valve.r_p"] == pytest.approx(0.6, abs=0.02)
    assert found["relief-valve.r_n"] == pytest.approx(0.0, abs=0.02)
