"""A magnetorheological damper on a press, with effects that can be switched on: the damper side of the rig.

Without effects F = fy(i) tanh((v + W x)/v0) + c(i) v + k x + F0, or the plain law without spring and hysteresis,
F = fy(i) sign(v) (1 - exp(-|v|/v0)) + c(i) v + F0; fy and c are polynomials of the coil current. All runs go
side by side; memory (slip elements, lags, backlash) is stepped at the solver's rate.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import cont2discrete, lfilter

from datasets.rig.stop import Array

WARM = 25.0
SLIP = 30e-6
STRIBECK_SPEED = 0.03
GAS_STROKE = 0.12
STOP_STROKE = 0.017
CAVITATION_SPEED = 0.09
LOAD_CELL_DAMPING = 0.03
HEAT_CAPACITY = 120.0
COOLING_TIME = 60.0


@dataclass(frozen=True, slots=True)
class Damper:
    """Base law, SI. ``yields`` (N) and ``viscous`` (N s/m) hold the coefficients of 1, i, i^2."""

    yields: tuple[float, float, float] = (150.0, 420.0, -40.0)
    viscous: tuple[float, float, float] = (750.0, 250.0, 0.0)
    knee: float = 0.014
    turn: float = 0.35
    stiffness: float = 1200.0
    offset: float = 60.0
    plain: bool = False

    def force(self, position: Array, speed: Array, current: Array) -> tuple[Array, Array]:
        """Return the damping force and the spring force in N."""
        yield_force = np.polyval(self.yields[::-1], current)
        effective = speed + self.turn * position
        if self.plain:
            rise = -np.sign(effective) * np.expm1(-np.abs(effective) / self.knee)
        else:
            rise = np.tanh(effective / self.knee)
        return yield_force * rise + np.polyval(
            self.viscous[::-1], current
        ) * speed, self.stiffness * position + self.offset


def base_damper(rng: np.random.Generator) -> Damper:
    """Return a damper of its own kind: every parameter of the default one moved by up to 15 %."""
    nominal = Damper()

    def moved(value: float) -> float:
        return value * float(rng.uniform(0.85, 1.15))

    return Damper(
        (moved(nominal.yields[0]), moved(nominal.yields[1]), moved(nominal.yields[2])),
        (moved(nominal.viscous[0]), moved(nominal.viscous[1]), 0.0),
        moved(nominal.knee),
        moved(nominal.turn),
        moved(nominal.stiffness),
        moved(nominal.offset),
    )


def plain_damper(rng: np.random.Generator) -> Damper:
    """Return a damper of its own kind without spring and without hysteresis."""
    return replace(base_damper(rng), turn=0.0, stiffness=0.0, plain=True)


@dataclass(frozen=True, slots=True)
class Motion:
    """What the press does, at the solver's rate; arrays (runs, steps), SI."""

    step: float
    position: Array
    speed: Array
    acceleration: Array
    current: Array
    oil: Array
    """Oil temperature at the start of each run, degC, shape (runs,)."""


@dataclass(frozen=True, slots=True)
class DamperRun:
    """What happened: force on the load cell in N and oil temperature in degC, arrays (runs, steps)."""

    force: Array
    temperature: Array


def play(signal: Array, half_width: float, before: float | None = None) -> Array:
    """Return the play (backlash) operator of a signal (runs, steps), which came from ``before`` or is in mid-gap."""
    if half_width <= 0:
        return signal
    out = np.empty_like(signal)
    start = signal[:, 0]
    held = start if before is None else np.clip(np.full_like(start, before), start - half_width, start + half_width)
    out[:, 0] = held
    for n in range(1, signal.shape[1]):
        held = np.clip(held, signal[:, n] - half_width, signal[:, n] + half_width)
        out[:, n] = held
    return out


def slip_direction(position: Array) -> Array:
    """Return the state of a slip element over its threshold: the sign of motion, turning over 2 x 30 um of travel."""
    out = np.zeros_like(position)
    moved = np.diff(position, axis=1) / SLIP
    held = out[:, 0]
    for n in range(moved.shape[1]):
        held = np.clip(held + moved[:, n], -1.0, 1.0)
        out[:, n + 1] = held
    return out


def lagged(signal: Array, time_constant: float, step: float) -> Array:
    """Return a first-order lag of a signal, exact if that is straight over each step, started in equilibrium."""
    if time_constant <= 0:
        return signal
    ratio = step / time_constant
    keep = float(np.exp(-ratio))
    mean = (1.0 - keep) / ratio
    first: Array = signal[:, :1]
    return first + np.asarray(lfilter([1.0 - mean, mean - keep], [1.0, -keep], signal - first, axis=1))


def resonated(force: Array, frequency: float, step: float) -> Array:
    """Return a force as a load cell with one lightly damped mode shows it."""
    w = 2 * np.pi * frequency
    mode = ([w**2], [1.0, 2 * LOAD_CELL_DAMPING * w, w**2])
    num, den, _ = cont2discrete(mode, step, method="foh")
    first = force[:, :1]
    return first + np.asarray(lfilter(np.ravel(num), den, force - first, axis=1))


def shifted(signal: Array, delay: float, step: float) -> Array:
    """Return signal(t - delay), the ends held; either sign of delay."""
    steps = np.arange(signal.shape[1])
    return np.array([np.interp(steps - delay / step, steps, row) for row in signal])


def simulate(damper: Damper, magnitudes: Mapping[str, float], motion: Motion) -> DamperRun:
    """Return the load cell's force under effects given by canonical name and magnitude (SI; see ``effects.py``)."""
    size = {name: float(value) for name, value in magnitudes.items()}
    geared = _backlash(motion, size.get("backlash", 0.0))
    field = _field(motion, size)
    speed = play(geared.speed, size.get("velocity-hysteresis", 0.0))
    led = speed + size.get("velocity-hysteresis-by-stroke", 0.0) * geared.position
    damping, spring = damper.force(geared.position, led, field)
    damping = damping + size.get("quadratic-drag", 0.0) * speed * np.abs(speed)
    damping = damping * (1.0 + size.get("asymmetry", 0.0) * np.tanh(speed / (2 * damper.knee)))
    temperature = _oil(motion, damping)
    damping = damping * np.exp(-size.get("temperature", 0.0) * (temperature - WARM))
    collapse = 0.5 * (1.0 + np.tanh((speed - CAVITATION_SPEED) / 0.01))
    damping = damping * (1.0 - size.get("cavitation", 0.0) * collapse)
    force = damping + spring + _mechanical(geared, size)
    if "load-cell-resonance" in size:
        force = resonated(force, size["load-cell-resonance"], motion.step)
    force = lagged(force, size.get("delay-by-filter", 0.0), motion.step)
    force = shifted(force, size.get("delay", 0.0), motion.step) + size.get("force-offset", 0.0)
    return DamperRun(force, temperature)


def _field(motion: Motion, size: dict[str, float]) -> Array:
    """Return the current that the fluid feels."""
    current = lagged(motion.current, size.get("current-lag", 0.0), motion.step)
    # every test begins with the current switched on, the core demagnetised
    current = play(current, size.get("residual-magnetism", 0.0), before=0.0)
    knee = size.get("current-saturation", np.inf)
    felt: Array = current / (1.0 + (current / knee) ** 4) ** 0.25
    return felt


def _oil(motion: Motion, damping: Array) -> Array:
    """Return the oil temperature: a heat balance of the work done and cooling to the bench's 22 degC."""
    heat = np.abs(damping * motion.speed) / HEAT_CAPACITY
    keep = float(np.exp(-motion.step / COOLING_TIME))
    warmed = lfilter([motion.step], [1.0, -keep], heat, axis=1)
    cooled = 22.0 + (motion.oil[:, None] - 22.0) * keep ** np.arange(heat.shape[1])
    total: Array = cooled + np.asarray(warmed)
    return total


def _mechanical(motion: Motion, size: dict[str, float]) -> Array:
    """Return the forces beside the fluid's: seals, gas, mass, bump stop."""
    x, v = motion.position, motion.speed
    total = size.get("inertia", 0.0) * motion.acceleration
    friction = size.get("coulomb-friction", 0.0) + size.get("stribeck", 0.0) * np.exp(-((v / STRIBECK_SPEED) ** 2))
    friction = friction + size.get("stribeck-exponential", 0.0) * np.exp(-np.abs(v) / STRIBECK_SPEED)
    if np.any(friction):
        total = total + friction * slip_direction(x)
    compressed = np.maximum(1.0 - x / GAS_STROKE, 0.2)
    total = total + size.get("gas-spring", 0.0) * (compressed**-1.3 - 1.0)
    beyond = np.maximum(np.abs(x) - STOP_STROKE, 0.0)
    stopped: Array = total + size.get("end-stop", 0.0) * beyond**1.5 * np.sign(x)
    return stopped


def _backlash(motion: Motion, gap: float) -> Motion:
    if gap <= 0:
        return motion
    position = play(motion.position, gap)
    return replace(motion, position=position, speed=np.gradient(position, motion.step, axis=1, edge_order=2))
