"""A damper on the rig: the law, the field behind its coil, oil, valves, seals, gas and masses, on the fine grid."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from .laws import FieldLaw, Law, Shape, travel_memory
from .motions import FINE_RATE, Motion

DT = 1 / FINE_RATE


@dataclass(frozen=True)
class Damper:
    """The damper without anything hidden; ``offset`` (N), ``spring`` (N/m) are the base's own, ``drift`` its flaw."""

    law: Law
    shape: Shape
    field: FieldLaw
    offset: float = 0.0
    spring: float = 0.0
    drift: float = 0.0  # share by which the knee grows with the current: a base that is nearly exact
    ripple: float = 0.0  # share of the yield force that depends on the place in the stroke, as nearly exact bases have


@dataclass(frozen=True)
class Test:
    """One test: motion, the coil's current and voltage on the fine grid, and the oil's temperature at its start."""

    motion: Motion
    current: np.ndarray
    voltage: np.ndarray
    start_temperature: float
    command: str


# strengths of hidden effects by name; a name that is absent does not act
Strengths = Mapping[str, float]


@dataclass(frozen=True)
class Details:
    """Numbers of hidden effects beside their strength."""

    dead_time: float = 0.0  # s, of the field's lag
    valve_speed: float = 0.02  # m/s, over which a check valve opens
    valve_side: float = 1.0
    valve_viscous: float = 1.0  # share of the valve's effect on the damping beside that on the yield force
    relief: float = 500.0  # N, at which a relief valve opens
    stribeck_speed: float = 0.02  # m/s
    seal_travel: float = 1e-4  # m, over which a seal is bent
    gas_length: float = 0.15  # m, of the gas column
    heat: float = 300.0  # J/K, of the oil
    cooling: float = 5.0  # W/K
    void: float = 0.002  # m, of travel without force after a reversal
    speed: float = 0.2  # m/s and m, of the specimen's motions
    stroke: float = 0.01


def lag(signal: np.ndarray, tau: float, dead: float) -> np.ndarray:
    """First-order lag (s) of a signal that is held between fine samples, after a dead time (s)."""
    shift = round(dead * FINE_RATE)
    late = np.concatenate([np.full(shift, signal[0]), signal[: signal.size - shift]]) if shift else signal
    if tau <= 0:
        return late
    keep = np.exp(-DT / tau)
    return lfilter([1 - keep], [1, -keep], late, zi=[keep * late[0]])[0]


def release(signal: np.ndarray, tau: float) -> np.ndarray:
    """Signal that rises at once and falls with a time constant (s)."""
    keep, at, out = float(np.exp(-DT / tau)), float(signal[0]), np.empty(signal.size)
    for k, u in enumerate(signal.tolist()):
        at = u if u > at else u + (at - u) * keep
        out[k] = at
    return out


def remanence(signal: np.ndarray, width: float) -> np.ndarray:
    """Field of a core of three kinds of domains: plays of half, one and one and a half times ``width`` (A)."""
    out = np.zeros(signal.size)
    values = signal.tolist()
    for factor, share in ((0.5, 0.25), (1.0, 0.5), (1.5, 0.25)):
        w, at, play = factor * width, 0.0, np.empty(signal.size)
        for k, u in enumerate(values):
            if at < u - w:
                at = u - w
            elif at > u + w:
                at = u + w
            play[k] = at
        out += share * play
    return out


def _field(test: Test, on: Strengths, d: Details) -> np.ndarray:
    i = test.current
    if "residual-magnetism" in on:
        i = remanence(i, on["residual-magnetism"])
    if "slow-release" in on:
        i = 0.5 * i + 0.5 * release(i, on["slow-release"])
    if "current-lag" in on:
        i = lag(i, on["current-lag"], d.dead_time)
    return i


def _check_valve(v: np.ndarray, d: Details) -> np.ndarray:
    """Opening of a spring-loaded check valve, between 0 and 1, in one direction."""
    return np.clip(d.valve_side * v / d.valve_speed, 0.0, 1.0)


def _void(motion: Motion, d: Details) -> np.ndarray:
    """Share of the force that is there: none in extension before the travel ``void`` since the last reversal."""
    side = np.sign(motion.v * d.valve_side)
    starts = np.flatnonzero(np.diff(side, prepend=side[0]) != 0)
    since = np.abs(
        motion.x - motion.x[np.concatenate([[0], starts])[np.searchsorted(starts, np.arange(side.size), "right")]]
    )
    return np.where(side > 0, np.clip(since / d.void - 0.5, 0.0, 1.0), 1.0)


def _added(test: Test, on: Strengths, d: Details) -> np.ndarray:
    m, force = test.motion, np.zeros(test.current.size)
    if "gas-spring" in on:  # polytropic gas of a column of a length, by its stiffness in the middle
        force += on["gas-spring"] * d.gas_length / 1.3 * ((1 - m.x / d.gas_length) ** -1.3 - 1)
    if "linear-spring" in on:
        force += on["linear-spring"] * m.x
    if "inertia" in on:
        force += on["inertia"] * m.a
    if "stribeck" in on:
        force += on["stribeck"] * np.exp(-((m.v / d.stribeck_speed) ** 2)) * travel_memory(m.x, d.seal_travel)
    if "coulomb-friction" in on:
        force += on["coulomb-friction"] * travel_memory(m.x, d.seal_travel)
    if "quadratic-drag" in on:
        force += on["quadratic-drag"] * m.v * np.abs(m.v)
    return force


def _warm(test: Test, force: np.ndarray, d: Details) -> np.ndarray:
    """Temperature (degC) of the oil that takes up the work of the force and gives heat to the air at 22 degC."""
    heating = np.maximum(force * test.motion.v, 0.0) / d.heat + d.cooling * 22.0 / d.heat
    keep = np.exp(-DT * d.cooling / d.heat)
    gain = (1 - keep) * d.heat / d.cooling
    return lfilter([gain], [1, -keep], heating, zi=[keep * test.start_temperature])[0]


def simulate(damper: Damper, test: Test, on: Strengths, d: Details) -> tuple[np.ndarray, np.ndarray]:
    """Return force (N) and temperature (degC) on the fine grid with the hidden effects ``on``."""
    m, law = test.motion, damper.law
    v = m.v
    if "velocity-hysteresis" in on:
        v = v + on["velocity-hysteresis"] * m.x  # about the middle of the stroke, where every motion has its zero
    field = _field(test, on, d)
    shape = dict(damper.shape)
    u, w = law.parts(m.x, v, shape)
    if damper.drift and "vy" in shape:
        wide, _ = law.parts(m.x, v, {**shape, "vy": shape["vy"] * 1.2})
        u = u + (wide - u) * damper.drift / 0.2 * field / damper.field.greatest
    if damper.ripple:
        u = u * (1 + damper.ripple * np.cos(2 * np.pi * m.x / (0.7 * d.stroke)))
    yielding, viscous = damper.field.yield_force(field) * u, damper.field.damping_at(field) * w
    if "asymmetry" in on:
        opening = _check_valve(v, d)
        yielding = yielding * (1 - on["asymmetry"] * opening)
        viscous = viscous * (1 - on["asymmetry"] * d.valve_viscous * opening)
    rest = damper.offset + damper.spring * m.x + _added(test, on, d)
    temperature = np.full(m.x.size, test.start_temperature)
    b = on.get("temperature", 0.0)
    fluid = yielding + viscous
    for _ in range(4 if b else 1):
        if b:  # Arrhenius for the oil, a weaker fall of the yield force
            inverse = 1 / (temperature + 273.15) - 1 / 298.15
            fluid = viscous * np.exp(b * inverse) + yielding * np.exp(0.35 * b * inverse)
        if "relief" in on:
            over = np.maximum(d.valve_side * fluid - d.relief, 0.0)
            fluid = fluid - d.valve_side * on["relief"] * over
        if "cavitation" in on:
            fluid = fluid * (1 - on["cavitation"] * (1 - _void(m, d)))
        temperature = _warm(test, fluid + rest, d)
    force = fluid + rest
    if "delay" in on:
        force = lag(force, 0.0, on["delay"])
    return force, temperature
