"""Inverse of delays and filters: the forces before them of those wanted behind them, known ahead."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mrfit.core.specs import Array
from mrfit.kernels.lti import SHORTEST
from mrfit.simulate.program import DamperProgram

# Time constants after which what a filter remembers is forgotten, and the share of a sample below which it is none
_FELT, _SHORT = 10.0, 0.01


def _parts(program: DamperProgram) -> list[tuple[float, tuple[float, ...], tuple[float, float]]]:
    """Return dead time in s, poles in 1/s and zeros of what lies behind the force, from the force on."""
    found: list[tuple[float, tuple[float, ...], tuple[float, float]]] = []
    for _, module, theta in program.behind:
        if module.SPEC.name == "delay":
            tau, share = theta
            filtered = max(share * tau, 0.0)
            found.append((max(tau - filtered, 0.0), (1.0 / filtered,) if filtered > 0.0 else (), (0.0, 0.0)))
        elif module.SPEC.name == "force-filter" and theta[0] > 0.0:
            slowest, second, third, fourth, turn, xi = theta
            slowest = max(slowest, SHORTEST)
            poles = tuple(1.0 / (slowest * r) for r in (1.0, second, third, fourth))
            found.append((0.0, poles, (2.0 * xi * turn * slowest, (turn * slowest) ** 2)))
    return found


def lasting(program: DamperProgram) -> float:
    """Return for how many s the force is felt behind what it passes, to 5e-5."""
    return float(sum(dead + _FELT * sum(1.0 / p for p in poles) for dead, poles, _ in _parts(program)))


def undone(program: DamperProgram, signal: Array, dt: float) -> Array:
    """Return the signals (L, N) before it of smooth ones wanted behind it: known ahead, their last value beyond."""
    for dead, poles, zeros in reversed(_parts(program)):
        if len(poles) == 1:
            signal = signal + _spline(signal, dt)(dt * np.arange(signal.shape[1]), 1) / poles[0]
        elif poles:
            signal = unfiltered(poles, zeros, signal, dt)
        if dead > 0.0:
            time = dt * np.arange(signal.shape[1])
            signal = np.stack([np.interp(time + dead, time, row) for row in signal])
    return signal


def unfiltered(poles: Sequence[float], zeros: tuple[float, float], signal: Array, dt: float) -> Array:
    """Return the signals (L, N) before a cascade of poles in 1/s with unit gain, of smooth ones y wanted behind it.

    w + z_1*w' + z_2*w'' = y is solved for w, exact for y linear between samples; then u = prod(1 + s/p_i)*w, whose
    third and fourth derivatives follow from those of y. Time constants far below a sample are none.
    """
    first, second = zeros
    if 1.0 / min(poles) < _SHORT * dt:
        return signal
    gains = np.array([1.0])
    for pole in poles:
        gains = np.convolve(gains, [1.0, 1.0 / pole])
    time, spline = np.arange(signal.shape[1]) * np.float64(dt), _spline(signal, dt)
    system = np.array([[0.0, 1.0], [-1.0 / second, -first / second]]), np.array([[0.0], [1.0 / second]])
    both = [_followed(system, row, time) for row in signal]
    orders = [np.stack([w[:, k] for w in both]) for k in (0, 1)]
    for k in range(len(poles) - 1):
        orders.append((spline(time, k) - orders[k] - first * orders[k + 1]) / second)
    return np.asarray(sum(gain * own for gain, own in zip(gains, orders, strict=False)))


def _spline(signal: Array, dt: float) -> Any:
    from scipy.interpolate import CubicSpline

    return CubicSpline(dt * np.arange(signal.shape[1]), signal, axis=1)


def _followed(system: tuple[Array, Array], signal: Array, time: Array) -> Array:
    """Return the states (N, 2) of a system at rest at a signal's first value."""
    from scipy.signal import lsim

    start = np.array([signal[0], 0.0])
    found = lsim((*system, np.eye(2), np.zeros((2, 1))), signal, time, X0=start)[2]
    return np.asarray(found)
