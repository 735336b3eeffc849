"""Logs of the Hammerstein-Wiener paper's bench: constant speeds, sines, current steps, a slow heating, and two roads.

The damper is none of the models: the pre-yield slope bends smoothly into the post-yield one, the force passes an
elastic oil column, the field follows the current through two lags and a dead time, and the fluid thins with
temperature as exp(B/(T + C)). 5000 samples a second; force, stroke, speed, current and oil temperature are recorded.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from datasets.rig.damper import lagged, shifted
from datasets.rig.stop import Array

RATE, OVERSAMPLING = 5000.0, 2
DT = 1.0 / (RATE * OVERSAMPLING)
FORCE_NOISE, SPEED_NOISE, CURRENT_NOISE, TEMPERATURE_NOISE = 25.0, 1e-3, 5e-3, 0.1
C_PRE, C_POST = 2.6e4, 1700.0
FIELD_LAGS, DEAD_TIME = (0.0048, 0.0012), 0.003
COLUMN_LAG, COLUMN_FREQUENCY, COLUMN_DAMPING = 0.0016, 80.0, 0.6
OIL_B, OIL_C, REFERENCE = 370.0, 150.0, 25.0
OFFSET = 60.0
PEAK_SPEED = 0.3
SPEEDS = ((0.03, 0.006), (0.1, 0.02), (0.3, 0.025))
LEVELS = (0.0, 0.8, 1.6)


@dataclass(frozen=True)
class Test:
    """One log at the solver's rate: speed (m/s), current (A), oil temperature (degC), each (N,)."""

    name: str
    speed: Array
    current: Array
    temperature: Array


def alpha(temperature: Array) -> Array:
    """Return the factor on the force, 1 at 25 degC."""
    return np.exp(OIL_B / (temperature + OIL_C) - OIL_B / (REFERENCE + OIL_C))


def static(speed: Array, field: Array) -> Array:
    """Return the force in N of a speed under a field that stands for a current in A."""
    knee = 0.022 * field + 0.007
    bent = speed / (1.0 + (speed / knee) ** 4) ** 0.25
    force: Array = (C_PRE - C_POST) * bent + C_POST * speed
    return force


def column(force: Array) -> Array:
    """Return the force behind the oil column: a lag, and a damped mode."""
    late = lagged(force[None, :], COLUMN_LAG, DT)
    w = 2.0 * np.pi * COLUMN_FREQUENCY * DT
    pole = np.exp(-COLUMN_DAMPING * w + 1j * w * np.sqrt(1.0 - COLUMN_DAMPING**2))
    back = [1.0, -2.0 * pole.real, abs(pole) ** 2]
    first = late[:, :1]
    shaken = lfilter([sum(back)], back, late - first, axis=1) + first
    found: Array = 0.7 * late[0] + 0.3 * shaken[0]
    return found


def measured(test: Test) -> Array:
    """Return the force in N."""
    field = test.current[None, :]
    for lag in FIELD_LAGS:
        field = lagged(field, lag, DT)
    field = shifted(field, DEAD_TIME, DT)[0]
    return OFFSET + column(static(test.speed, field) * alpha(test.temperature))


def constant_speed(speed: float, stroke: float, current: float) -> Test:
    """Return triangular strokes: what the force settles to is the static map."""
    frequency = speed / (4.0 * stroke)
    time = np.arange(round(3.0 / frequency / DT)) * DT
    moved = speed * np.sign(np.sin(2.0 * np.pi * (time + DT / 2.0) * frequency))
    return _warm(f"speed_{speed:g}_{current:g}A", moved, np.full(len(time), current))


def sine(frequency: float, current: float) -> Test:
    """Return a sine of the common peak speed: the faster, the wider the loop."""
    time = np.arange(round(6.0 / frequency / DT)) * DT
    moved = PEAK_SPEED * np.cos(2.0 * np.pi * frequency * time)
    return _warm(f"sine_{frequency:g}Hz_{current:g}A", moved, np.full(len(time), current))


def step(speed: float, current: float) -> Test:
    """Return triangular strokes with the current switched on in the middle of each and off at its end."""
    still = constant_speed(speed, 0.025, 0.0)
    phase = np.arange(len(still.speed)) * DT * speed / 0.1
    return _warm(f"step_{current:g}A", still.speed, np.where((2.0 * phase) % 1.0 > 0.5, current, 0.0))


def heating(current: float, seconds: float = 16.0) -> Test:
    """Return a sine of 2.5 Hz over which the oil warms from -25 to 75 degC."""
    time = np.arange(round(seconds / DT)) * DT
    warm = 75.0 - 100.0 * np.exp(-time / (seconds / 4.0))
    return Test("heating_2.5Hz", PEAK_SPEED * np.cos(5.0 * np.pi * time), np.full(len(time), current), warm)


def road(name: str, temperature: float, rng: np.random.Generator, seconds: float = 8.0) -> Test:
    """Return random strokes up to 12 Hz under a binary current of random levels, within 0 to 20 Hz."""
    time = np.arange(round(seconds / DT)) * DT
    rates, phases = np.linspace(0.3, 12.0, 60), rng.random(60)
    moved = sum(0.022 * np.sin(2.0 * np.pi * (f * time + p)) for f, p in zip(rates, phases, strict=True))
    levels = rng.uniform(0.0, 1.8, 600) * (rng.random(600) > 0.5)
    held = np.repeat(levels, rng.integers(round(0.025 / DT), round(0.12 / DT), 600))[: len(time)]
    warm = np.full(len(time), temperature) + 2.0 * time / seconds
    return Test(name, np.asarray(moved), held, warm)


def _warm(name: str, speed: Array, current: Array) -> Test:
    return Test(name, speed, current, np.full(len(speed), REFERENCE))


def make(out: Path, seed: int) -> None:
    """Write the four kinds of tests and two roads, at 25 and at -20 degC."""
    rng = np.random.default_rng([seed, 6])
    tests = [constant_speed(v, x, i) for v, x in SPEEDS for i in LEVELS]
    tests += [sine(f, i) for f in (1.5, 4.0, 10.0) for i in (0.4, 1.2)]
    tests += [step(0.1, i) for i in (0.8, 1.6)]
    tests += [heating(1.2), road("road_25degC", 25.0, rng), road("road_-20degC", -20.0, rng)]
    kept = slice(None, None, OVERSAMPLING)
    for test in tests:
        stroke = np.cumsum(test.speed) * DT
        noise = rng.standard_normal((4, len(test.speed[kept])))
        columns = [
            np.arange(len(noise[0])) / RATE,
            1e3 * (stroke - stroke.mean())[kept],
            test.speed[kept] + SPEED_NOISE * noise[0],
            measured(test)[kept] + FORCE_NOISE * noise[1],
            test.current[kept] + CURRENT_NOISE * noise[2],
            test.temperature[kept] + TEMPERATURE_NOISE * noise[3],
        ]
        with (out / f"{test.name}.csv").open("w", newline="\n", encoding="ascii") as file:
            file.write("Time,Displacement,Velocity,Load,Current,Temperature\ns,mm,m/s,N,A,degC\n")
            np.savetxt(file, np.stack(columns, axis=1), "%.7g", ",")
