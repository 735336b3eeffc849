"""A coil of resistance and inductance on a PWM driver, and the commands that controllers give it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .motions import FINE_RATE, Motion

COMMANDS = ("constant", "stairs", "skyhook", "clipped")


@dataclass(frozen=True)
class Coil:
    """Coil and driver: ohm, henry, volt, switching frequency (Hz), volt against a falling current, loop gain (V/A)."""

    resistance: float
    inductance: float
    supply: float
    switching: float
    clamp: float
    gain: float


def draw_coil(rng: np.random.Generator, greatest: float) -> Coil:
    """Draw a coil; a current rises by the supply's voltage and falls by that of the diode, so the two times differ."""
    resistance = float(rng.uniform(2.5, 8.0))
    inductance = resistance * float(rng.uniform(0.006, 0.03))
    return Coil(
        resistance=resistance,
        inductance=inductance,
        supply=greatest * resistance * float(rng.uniform(1.5, 4.0)),
        switching=float(rng.choice([1000.0, 2000.0])),
        clamp=float(rng.choice([0.7, 0.7, 6.0])),
        gain=inductance * float(rng.uniform(150.0, 500.0)),
    )


def drive_coil(coil: Coil, command: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return current (A) and mean voltage of each switching period (V) on the fine grid, for a command on that grid.

    Within a period the circuit is solved exactly: L di/dt = V - R i while the switch is on, L di/dt = -V_c - R i after.
    """
    each = round(FINE_RATE / coil.switching)
    tau = coil.inductance / coil.resistance
    period = 1 / coil.switching
    high, low = coil.supply / coil.resistance, -coil.clamp / coil.resistance
    n = command.size // each + 1
    starts, duties = np.empty(n), np.empty(n)
    i, sum_of_errors = float(command[0]), 0.0
    for k in range(n):
        wanted = float(command[min(k * each, command.size - 1)])
        error = wanted - i
        raw = (coil.resistance * wanted + coil.gain * error) / coil.supply + sum_of_errors
        duty = min(max(raw, 0.0), 1.0)
        if raw == duty:
            sum_of_errors += 0.02 * error * coil.gain / coil.supply
        starts[k], duties[k] = i, duty
        i = high + (i - high) * np.exp(-duty * period / tau)
        i = max(low + (i - low) * np.exp(-(1 - duty) * period / tau), 0.0)
    phase = np.arange(each)[None, :] / FINE_RATE
    on = duties[:, None] * period
    rising = high + (starts[:, None] - high) * np.exp(-np.minimum(phase, on) / tau)
    current = np.maximum(low + (rising - low) * np.exp(-np.maximum(phase - on, 0.0) / tau), 0.0)
    return current.ravel()[: command.size], np.repeat(duties * coil.supply, each)[: command.size]


def make_command(how: str, rng: np.random.Generator, motion: Motion, levels: np.ndarray, level: float) -> np.ndarray:
    """Make the wanted current (A): constant, in stairs over ``levels``, or by a controller of the motion."""
    n = motion.x.size
    if how == "constant":
        return np.full(n, level)
    if how == "stairs":
        return _stairs(rng, n, levels)
    every = round(float(rng.choice([0.002, 0.004])) * FINE_RATE)
    v = np.repeat(motion.v[::every], every)[:n]
    body = np.repeat(motion.body[::every], every)[:n]
    share = np.clip(body / np.where(np.abs(v) < 1e-4, 1e-4, v) * float(rng.uniform(0.3, 0.8)), 0.0, 1.0)
    if how == "skyhook":
        return np.where(body * v > 0, level, 0.15 * level)
    return level * (0.05 + 0.95 * share)


def _stairs(rng: np.random.Generator, n: int, levels: np.ndarray) -> np.ndarray:
    """Levels in turn, up and down and at random, held for 0.2 to 0.7 s."""
    command, at, last = np.empty(n), 0, -1
    while at < n:
        held = round(float(rng.uniform(0.2, 0.7)) * FINE_RATE)
        level = int(rng.integers(levels.size))
        if level == last:
            level = (level + 1) % levels.size
        command[at : at + held] = levels[level]
        at, last = at + held, level
    return command
