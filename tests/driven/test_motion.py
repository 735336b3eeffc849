"""A driven mass against closed forms, an independent solver, and the work that its excitation does."""

import numpy as np
import pytest
from scipy.integrate import simpson, solve_ivp
from scipy.optimize import brentq

from mrfit.driven import motion
from mrfit.driven.integrator import PER_SAMPLE
from mrfit.driven.motion import between_samples
from mrfit.errors import ConfigError
from mrfit.models.boucwen_hardening import SPEC
from mrfit.simulate.assembly import assemble

DT = 1e-3
TIME = np.arange(2000) * DT
LINES = ((90.0, 11.0), (60.0, 23.0), (25.0, 47.0))
HARDENING = {"c": 10.0, "k": 5e4, "x0": 0.0, "alpha": 5e4, "b": -2.2, "g": 1.6, "n": 1.0, "z0": 2e-3, "mass": 2.0}


def push(t: np.ndarray) -> np.ndarray:
    return sum(a * np.sin(2 * np.pi * f * t) for a, f in LINES)


def simulated(name: str, values: dict[str, float], drive: np.ndarray, dt: float = DT) -> np.ndarray:
    whole = assemble(name)
    return whole.simulate(drive[None], whole.spec.theta(values)[None], dt)[0]


def test_linear_oscillator_follows_its_closed_form(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motion, "STEP_TOLERANCE", 1e-8)
    k, c, m, f = 8000.0, 6.0, 2.0, 7.0
    found = simulated(
        "linear-spring-dashpot@force", {"k": k, "c": c, "f0": 0.0, "mass": m}, np.sin(2 * np.pi * f * TIME)
    )
    w, decay = 2 * np.pi * f, 0.5 * c / m
    steady = 1.0 / (k - m * w**2 + 1j * w * c)
    own = np.sqrt(k / m - decay**2)
    # x = Im(steady*exp(iwt)) + exp(-decay*t)*(p*cos(own*t) + q*sin(own*t)) from rest
    p = -steady.imag
    q = (decay * p - w * steady.real) / own
    expected = (steady * np.exp(1j * w * TIME)).imag + np.exp(-decay * TIME) * (
        p * np.cos(own * TIME) + q * np.sin(own * TIME)
    )
    assert np.abs(found - expected).max() < 1e-8 * np.ptp(expected)


def test_hardening_loop_agrees_with_an_independent_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motion, "STEP_TOLERANCE", 1e-9)
    p, time = HARDENING, np.arange(1700) * DT / 4

    def rates(t: float, y: np.ndarray) -> list[float]:
        x, v, z = y
        bent = (p["b"] * v + p["g"] * abs(v) * np.sign(z)) * abs(z / p["z0"]) ** p["n"]
        return [v, (push(t) - p["c"] * v - p["k"] * x - p["alpha"] * z) / p["mass"], v - bent]

    solved = solve_ivp(rates, (0.0, 0.4), np.zeros(3), "DOP853", time[:1601], rtol=1e-11, atol=1e-14, max_step=1e-4)
    found = simulated("boucwen-hardening@force", p, push(time), DT / 4)[:1601]
    assert np.abs(found - solved.y[0]).max() < 1e-8 * np.ptp(solved.y[0])


def test_base_and_force_move_it_alike_and_carry_the_base_along() -> None:
    base = push(TIME) / HARDENING["mass"]
    found = {o: simulated(f"boucwen-hardening@base-{o}", HARDENING, base) for o in ("displacement", "acceleration")}
    by_force = simulated("boucwen-hardening@force", HARDENING, -push(TIME))
    assert found["displacement"] == pytest.approx(by_force, abs=1e-15)
    carried = simulated("boucwen-hardening@base-absolute-acceleration", HARDENING, base)
    assert carried == pytest.approx(found["acceleration"] + base)


def test_work_of_the_excitation_is_stored_or_lost_in_the_loop() -> None:
    time, dt = np.arange(8 * len(TIME)) * DT / 8, DT / 8
    drive = push(time) * np.interp(time, (0.0, 0.2, 0.8, 1.0), (0.0, 1.0, 1.0, 0.0)) ** 2
    x, v = (simulated(f"boucwen-hardening@force-{o}", HARDENING, drive, dt) for o in ("displacement", "velocity"))
    law = assemble("boucwen-hardening")
    theta = np.array([[HARDENING[n] for n in SPEC.names]])
    force = law.simulate(np.stack([x, v]), theta, dt)[0]
    given, taken = (simpson(f * v, time) for f in (drive, force))
    assert given == pytest.approx(taken + HARDENING["mass"] * v[-1] ** 2 / 2, rel=5e-4)
    # after the excitation has ended, what is left falls from swing to swing
    late = np.abs(v[time > 1.05])
    swings = late[1:-1][(late[1:-1] > late[:-2]) & (late[1:-1] > late[2:])]
    assert np.all(np.diff(swings) < 0.0)


def test_friction_holds_what_pushes_less() -> None:
    values = {"fy": 50.0, "C_inf": 20.0, "f0": 0.0, "mass": 2.0}
    drive = 49.0 * np.sin(2 * np.pi * 5.0 * TIME)
    held = simulated("bingham@force", values, drive)
    moved = simulated("bingham@force", values, 2.0 * drive)
    assert np.abs(held).max() < 1e-9
    assert np.abs(moved).max() > 1e-4


@pytest.mark.parametrize(("friction", "error"), [(40.0, 3e-4), (70.0, 1e-5), (95.0, 2e-7), (120.0, 2e-7)])
def test_a_mass_that_sticks_and_slips_agrees_with_an_independent_solver(friction: float, error: float) -> None:
    time, m, c = np.arange(4000) * DT / 4, 2.0, 50.0

    def slip(way: float, begins: float, x: float) -> tuple[np.ndarray, float, float]:
        """Return the path from a release until the mass stands, its displacement and time there."""

        def rates(t: float, y: np.ndarray) -> list[float]:
            return [y[1], (push(t) - way * friction - c * y[1]) / m]

        def stands(t: float, y: np.ndarray) -> float:
            return 1.0 if t < begins + 1e-7 else way * y[1]

        stands.terminal, stands.direction = True, -1.0  # type: ignore[attr-defined]
        found = solve_ivp(
            rates,
            (begins, 1.0),
            [x, 0.0],
            "DOP853",
            dense_output=True,
            events=stands,
            rtol=1e-10,
            atol=1e-15,
            max_step=2e-3,
        )
        end = found.t[-1]
        return found.sol(time[(time > begins) & (time <= end)])[0], float(found.y[0, -1]), float(end)

    expected, t, x = np.zeros(len(time)), 0.0, 0.0
    fine = np.arange(200_000) * 5e-6
    over = np.abs(push(fine)) > friction
    while t < 1.0:
        released = np.flatnonzero(over & (fine > t))
        expected[time > t] = x
        if not len(released):
            break
        near = fine[released[0]]
        t = float(near)
        if abs(push(near - 5e-6)) < friction:
            t = float(brentq(lambda s: abs(push(s)) - friction, near - 5e-6, near))
        path, x, t_end = slip(float(np.sign(push(near))), t, x)
        rows = np.flatnonzero(time > t)[: len(path)]
        expected[rows] = path
        t = t_end
    law = {"fy": friction, "C_inf": c, "f0": 0.0, "mass": m}
    found = simulated("bingham@force", law, push(time), DT / 4)
    assert np.abs(found - expected).max() < error * np.ptp(expected)


def test_between_samples_a_drive_is_band_limited() -> None:
    fine = np.arange((len(TIME) - 1) * PER_SAMPLE + 1) * DT / PER_SAMPLE
    inside = slice(64 * PER_SAMPLE, -64 * PER_SAMPLE)
    for f in (11.0, 333.0, 420.0):
        wanted = np.cos(2 * np.pi * f * fine)
        assert np.abs(between_samples(wanted[::PER_SAMPLE]) - wanted)[inside].max() < 3e-6


def test_what_is_no_drive_or_no_force_is_refused() -> None:
    with pytest.raises(ConfigError, match="behind @ stands force or base"):
        assemble("bingham@wind")
    with pytest.raises(ConfigError, match="a mass moves on a model of force"):
        assemble("boucwen-flux@force")


def test_masses_that_follow_give_the_derivatives_of_an_exact_simulation(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, changed = assemble("boucwen-hardening@force"), {**HARDENING, "alpha": HARDENING["alpha"] * (1 + 1e-5)}
    theta = np.stack([whole.spec.theta(HARDENING), whole.spec.theta(changed)])
    slopes = []
    for tolerance in (1e-3, 1e-9):
        monkeypatch.setattr(motion, "STEP_TOLERANCE", tolerance)
        one, other = whole.simulate(push(TIME)[None], theta, DT)
        slopes.append(other - one)
    assert np.abs(slopes[0] - slopes[1]).max() < 0.02 * np.abs(slopes[1]).max()
