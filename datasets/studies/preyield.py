"""Logs of the preyield paper's bench: 100 sines, 4 to 16 mm by 0.1 to 4 Hz by 0 to 1 A, on a damper like its RD-8040-1.

None of the paper's nine models made them. The piston moves x; a leak past the fluid's plug, a dashpot C0, is in series
with the plug, which moves w:

    F = C0(i)*(dx/dt - dw/dt) + K*x + f0,    C0(i)*(dx/dt - dw/dt) = fy(i)*s(w) + C(i)*dw/dt/sqrt(1 + |dw/dt|/v1)

s is a set of stop operators in w (elastic chains of particles that yield one after the other), so that a pre-yield
spring, a pre-yield dashpot and a hysteresis in displacement are all there. fy and C0 at 0 and 1 A and C at 0 A are near
the paper's Tables 1-2 (LMH); K and f0 are those of a gas chamber of 300 psi behind a rod of 10 mm.
"""

from pathlib import Path

import numpy as np

from datasets.rig.stop import Array, StopLaw

AMPLITUDES = (0.004, 0.008, 0.012, 0.016)
FREQUENCIES = (0.1, 0.5, 1.0, 2.0, 4.0)
CURRENTS = (0.0, 0.25, 0.5, 0.75, 1.0)
CYCLES, PER_CYCLE, OVERSAMPLING = 6, 400, 4
FORCE_NOISE, STROKE_NOISE = 3.0, 2e-6
STIFFNESS, OFFSET = 900.0, 160.0
SHEAR_SPEED = 0.25
THRESHOLDS = np.geomspace(20e-6, 300e-6, 7)
NEWTON_STEPS = 5


def yield_force(current: Array) -> Array:
    """Return fy in N: 75 N without current, 850 N at 1 A, saturating."""
    return 75.0 + 1130.0 * current - 355.0 * current**2


def post_yield(current: Array) -> Array:
    """Return C in N*s/m at standstill."""
    return 1000.0 + 3400.0 * current - 500.0 * current**2


def pre_yield(current: Array) -> Array:
    """Return C0 in N*s/m."""
    return 2.0e4 + 1.9e5 * current - 5.0e4 * current**2


def plug_force(position: Array, current: Array, step: Array) -> Array:
    """Return the force of plug and leak in N, shape (runs, samples).

    Parameters
    ----------
    position
        Piston stroke in m, shape (runs, samples).
    current
        Current in A, shape (runs,).
    step
        Interval in s, shape (runs,).
    """
    law = StopLaw(THRESHOLDS, np.full(len(THRESHOLDS), 1.0 / len(THRESHOLDS)) / THRESHOLDS)
    fy, c, c0 = yield_force(current), post_yield(current), pre_yield(current)
    state = law.rest(len(position))
    moved = np.diff(position, axis=1)
    force = np.zeros_like(position)
    slip = moved[:, 0].copy()
    for n in range(moved.shape[1]):
        for _ in range(NEWTON_STEPS):
            # implicit Euler: leak and plug carry the same force at the end of the step
            speed = slip / step
            thinned = np.sqrt(1.0 + np.abs(speed) / SHEAR_SPEED)
            ahead = law.advance(state, slip)
            gap = fy * law.output(ahead) + c * speed / thinned - c0 * (moved[:, n] - slip) / step
            viscous = c / thinned * (1.0 - 0.5 * np.abs(speed) / (SHEAR_SPEED * thinned**2))
            slip = slip - gap / (fy * law.slope(ahead) + (viscous + c0) / step)
        state = law.advance(state, slip)
        force[:, n + 1] = c0 * (moved[:, n] - slip) / step
    return force


def tests() -> tuple[Array, Array, Array]:
    """Return amplitude (m), frequency (Hz) and current (A) of the hundred tests."""
    grid = np.meshgrid(AMPLITUDES, FREQUENCIES, CURRENTS, indexing="ij")
    return grid[0].ravel(), grid[1].ravel(), grid[2].ravel()


def make(out: Path, seed: int) -> None:
    """Write a hundred logs of six cycles, 400 samples each, as a test machine saves them."""
    rng = np.random.default_rng([seed, 3])
    amplitude, frequency, current = tests()
    fine = PER_CYCLE * OVERSAMPLING
    phase = 2.0 * np.pi * np.arange(CYCLES * fine) / fine
    position = amplitude[:, None] * np.sin(phase)
    step = 1.0 / (frequency * fine)
    force = plug_force(position, current, step) + STIFFNESS * position + OFFSET
    position, force = position[:, ::OVERSAMPLING], force[:, ::OVERSAMPLING]
    position = position + STROKE_NOISE * rng.standard_normal(position.shape)
    force = force + FORCE_NOISE * rng.standard_normal(force.shape)
    for k in range(len(amplitude)):
        stem = f"sine_{1e3 * amplitude[k]:02.0f}mm_{frequency[k]:g}Hz_{current[k]:g}A"
        time = np.arange(position.shape[1]) / (frequency[k] * PER_CYCLE)
        held = np.full(len(time), current[k])
        with (out / f"{stem}.csv").open("w", newline="\n", encoding="ascii") as file:
            file.write("Time,Displacement,Load,Current\ns,mm,N,A\n")
            columns = np.stack([time, 1e3 * position[k], force[k], held], axis=1)
            np.savetxt(file, columns, "%.8g", ",")
