"""Models whose parameters move with the current, against their printed equations, all linear between samples."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mrfit.core import registry
from mrfit.core.specs import Array

Equation = Callable[[Array, Array, Array, float], list[float]]


def dahl(s: Array, drive: Array, theta: Array, travel: float) -> list[float]:
    return [theta[2] * (travel - abs(travel) * s[0])]


def lugre(s: Array, drive: Array, theta: Array, travel: float) -> list[float]:
    sigma0, _, _, fc, more, vs, _ = theta
    v = drive[0]
    return [v - sigma0 * abs(v) * s[0] / (fc + more * np.exp(-((v / vs) ** 2)))]


def boucwen(s: Array, drive: Array, theta: Array, travel: float) -> list[float]:
    kappa, beta, gamma, n = theta[4:]
    return [kappa * travel - (beta * travel + gamma * abs(travel) * np.sign(s[0])) * abs(s[0]) ** n]


def boucwen_flux(s: Array, drive: Array, theta: Array, travel: float) -> list[float]:
    return boucwen(s, drive, theta[[0, 1, *range(6)]], travel)


def spencer(s: Array, drive: Array, theta: Array, travel: float) -> list[float]:
    c0, c_inf, _, k_inf, alpha, growth, beta, gamma, n, _ = theta
    w = (c0 * drive[1] - alpha * s[1] - k_inf * s[0]) / (c0 + c_inf)
    return [w, growth * w - (beta * w + gamma * abs(w) * np.sign(s[1])) * abs(s[1]) ** n]


def output(name: str, s: Array, drive: Array, theta: Array) -> float:
    if name == "dahl":
        return float(theta[3] + theta[0] * drive[1] + theta[1] * s[0])
    if name == "lugre":
        rate = lugre(s, drive, theta, 0.0)[0]
        return float(theta[6] + theta[0] * s[0] + theta[1] * rate + theta[2] * drive[0])
    if name == "boucwen":
        return float(theta[0] * drive[1] + theta[1] * (drive[0] - theta[2]) + theta[3] * s[0])
    if name == "boucwen-flux":
        return float(theta[1] * (theta[0] * drive[0] + (1.0 - theta[0]) / theta[6] * s[0]))
    w = spencer(s, drive, theta, 0.0)[0]
    return float(theta[9] + theta[0] * (drive[1] - w) + theta[2] * drive[0])


EQUATIONS: dict[str, tuple[Equation, int, str]] = {
    "dahl": (dahl, 1, "DOP853"),
    "lugre": (lugre, 1, "Radau"),
    "boucwen": (boucwen, 1, "DOP853"),
    "boucwen-flux": (boucwen_flux, 1, "DOP853"),
    "spencer": (spencer, 2, "Radau"),
}


def case(name: str, kind: str) -> tuple[Array, Array, Array]:
    """Return drive (C, N), parameters (K, N) and steps (N,) of a stroke under a current that moves."""
    spec, steps = registry.load("model", name).SPEC, np.full(80, 1e-3)
    if kind == "jittered":
        steps = np.random.default_rng(1).uniform(5e-4, 1.5e-3, 80)
    t = np.concatenate([[0.0], np.cumsum(steps[1:])])
    phase = 2 * np.pi * 8 * t + 0.3
    signals = {"displacement": 0.01 * np.sin(phase), "velocity": 0.5 * np.cos(phase)}
    current = np.where(t < 0.03, 0.1, 1.0) if kind == "step" else 0.5 + 0.4 * np.sin(2 * np.pi * 10 * t)
    if name == "boucwen-flux":
        # its drive is the current itself
        return current[None], np.repeat([[p.start] for p in spec.params], 80, axis=1), steps
    theta = [p.start * (0.2 + current if p.low > 0.0 and p.name != "n" else np.ones(80)) for p in spec.params]
    return np.stack([signals[n] for n in spec.inputs]), np.stack(theta), steps


def printed(name: str, drive: Array, theta: Array, steps: Array) -> Array:
    equation, size, method = EQUATIONS[name]
    state, force = np.zeros(size), [output(name, np.zeros(size), drive[:, 0], theta[:, 0])]
    turning = np.gradient(drive[0]) if name in ("dahl", "boucwen-flux") else drive[-1]
    for j in range(1, len(steps)):
        h, travel = steps[j], (drive[0, j] - drive[0, j - 1]) / steps[j]
        ends = [0.0, h]
        if turning[j - 1] * turning[j] < 0.0:  # no corner within a span
            ends.insert(1, h * turning[j - 1] / (turning[j - 1] - turning[j]))

        def rates(t: float, s: Array, j: int = j, h: float = h, travel: float = travel) -> list[float]:
            now, own = (a[:, j - 1] + (a[:, j] - a[:, j - 1]) * t / h for a in (drive, theta))
            return equation(s, now, own, travel)

        for a, b in zip(ends[:-1], ends[1:], strict=True):
            state = solve_ivp(rates, (a, b), state, method, rtol=1e-10, atol=1e-13).y[:, -1]
        force.append(output(name, state, drive[:, j], theta[:, j]))
    return np.array(force)


@pytest.mark.parametrize("kind", ["10 Hz", "step", "jittered"])
@pytest.mark.parametrize("name", EQUATIONS)
def test_a_moving_current_is_linear_between_samples(name: str, kind: str) -> None:
    drive, theta, steps = case(name, kind)
    expected = printed(name, drive, theta, steps)
    values = theta[None, :, 0] if name == "boucwen-flux" else theta[None]
    found = registry.load("model", name).response(drive, values, steps if kind == "jittered" else 1e-3)[0]
    assert np.abs(found - expected).max() < 1e-6 * np.ptp(expected)
