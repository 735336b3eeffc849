"""Strokes of a press, a road and a drop test on a fine grid of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.linalg import expm
from scipy.signal import butter, sosfiltfilt

FINE_RATE = 8000.0  # Hz, of all physics; loggers take their samples from it
# body and wheel mass (kg), spring, tyre (N/m) and mean damping (N s/m) of the quarter car that makes roads and drops
CAR = {"body": 300.0, "wheel": 40.0, "spring": 2.0e4, "tyre": 1.8e5, "damping": 1500.0}
WAVES = ("sine", "chirp", "triangle", "trapezoid", "road", "drop")


@dataclass(frozen=True)
class Motion:
    """Stroke ``x`` (m), its two derivatives, and the absolute velocity of the body (m/s) that a skyhook law uses."""

    wave: str
    x: np.ndarray
    v: np.ndarray
    a: np.ndarray
    body: np.ndarray


def make_motion(wave: str, rng: np.random.Generator, seconds: float, amplitude: float, speed: float) -> Motion:
    """Make a stroke of about ``amplitude`` (m) whose greatest speed is about ``speed`` (m/s)."""
    n = round(seconds * FINE_RATE)
    t = np.arange(n) / FINE_RATE
    body = None
    if wave == "sine":
        frequency = max(round(speed / (2 * np.pi * amplitude), 1), 0.5)
        x = speed / (2 * np.pi * frequency) * np.sin(2 * np.pi * frequency * t)
        return _with_body(wave, x, rng)
    if wave == "chirp":
        low, high = 0.5, float(rng.uniform(6.0, 12.0))
        rate = low * (high / low) ** (t / seconds)
        phase = 2 * np.pi * cumulative_trapezoid(rate, dx=1 / FINE_RATE, initial=0.0)
        x = np.minimum(amplitude, speed / (2 * np.pi * rate)) * np.sin(phase)
        return _with_body(wave, x, rng)
    if wave in ("triangle", "trapezoid"):
        return _with_body(wave, _integrate(_ramps(wave, rng, t, amplitude, speed)), rng)
    if wave == "road":
        x, body = _road(rng, n)
        scale = speed / np.quantile(np.abs(np.gradient(x, 1 / FINE_RATE)), 0.995)
        return _finish(wave, scale * x, scale * body)
    if wave == "drop":
        x = _drops(rng, n, seconds)
        return _with_body(wave, x * speed / np.max(np.abs(np.gradient(x, 1 / FINE_RATE))), rng)
    raise ValueError(f"no motion is called {wave!r}")


def _finish(wave: str, x: np.ndarray, body: np.ndarray) -> Motion:
    v = np.gradient(x, 1 / FINE_RATE)
    return Motion(wave, x, v, np.gradient(v, 1 / FINE_RATE), body)


def _with_body(wave: str, x: np.ndarray, rng: np.random.Generator) -> Motion:
    """Add a body that moves partly with the stroke and partly on its own (low-passed noise)."""
    v = np.gradient(x, 1 / FINE_RATE)
    own = sosfiltfilt(butter(2, 2.5, fs=FINE_RATE, output="sos"), rng.standard_normal(x.size))
    own *= np.std(v) / np.std(own)
    return _finish(wave, x, 0.5 * v + own)


def _integrate(v: np.ndarray) -> np.ndarray:
    x = cumulative_trapezoid(v, dx=1 / FINE_RATE, initial=0.0)
    return x - (x.max() + x.min()) / 2


def _ramps(wave: str, rng: np.random.Generator, t: np.ndarray, amplitude: float, speed: float) -> np.ndarray:
    """Velocity of a triangle, or of a trapezoid with rests; a press turns round within 10 to 30 ms."""
    ramp = 2 * amplitude / speed
    hold = 0.0 if wave == "triangle" else float(rng.uniform(0.15, 0.35)) * max(ramp, 0.3)
    period = 2 * (ramp + hold)
    phase = (t + ramp / 2) % period
    v = np.where(phase < ramp, speed, 0.0) - np.where((phase >= ramp + hold) & (phase < 2 * ramp + hold), speed, 0.0)
    kernel = np.hanning(round(float(rng.uniform(0.01, 0.03)) * FINE_RATE) + 2)
    half = kernel.size // 2
    padded = np.concatenate([np.full(half, v[0]), v, np.full(kernel.size - half - 1, v[-1])])
    return np.convolve(padded, kernel / kernel.sum(), mode="valid")


def _car_step() -> tuple[np.ndarray, np.ndarray]:
    """Return the exact step of the quarter car: states stroke rate, wheel, body; the input is the road's velocity."""
    c = CAR
    # states: body minus wheel (m), body velocity, wheel minus road (m), wheel velocity
    rates = np.array(
        [
            [0, 1, 0, -1],
            [-c["spring"] / c["body"], -c["damping"] / c["body"], 0, c["damping"] / c["body"]],
            [0, 0, 0, 1],
            [c["spring"] / c["wheel"], c["damping"] / c["wheel"], -c["tyre"] / c["wheel"], -c["damping"] / c["wheel"]],
        ]
    )
    whole = np.zeros((5, 5))
    whole[:4, :4] = rates
    whole[2, 4] = -1.0
    step = expm(whole * 8 / FINE_RATE)  # at an eighth of the fine rate; the press is slower than that
    return step[:4, :4], step[:4, 4]


def _drive_car(road: np.ndarray, state: np.ndarray) -> np.ndarray:
    a, b = _car_step()
    states = np.empty((road.size, 4))
    for k, u in enumerate(road):
        states[k] = state
        state = a @ state + b * u
    return states


def _refine(coarse: np.ndarray, n: int, bandwidth: float) -> np.ndarray:
    """Bring a signal to the fine grid and limit it to the press's bandwidth (Hz)."""
    fine = np.interp(np.arange(n), np.arange(coarse.size) * 8, coarse)
    return sosfiltfilt(butter(4, bandwidth, fs=FINE_RATE, output="sos"), fine)


def _road(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    lead = 1000  # samples of the car before the record begins
    states = _drive_car(rng.standard_normal(n // 8 + lead + 1), np.zeros(4))[lead:]
    bandwidth = float(rng.uniform(12.0, 25.0))
    return _refine(states[:, 0], n, bandwidth), _refine(states[:, 1], n, bandwidth)


def _drops(rng: np.random.Generator, n: int, seconds: float) -> np.ndarray:
    """Make drops one after the other: at rest, impact, free swinging, and back to the start along a cosine."""
    drops = max(round(seconds / 2.0), 2)
    length = n // 8 // drops
    parts = []
    for _ in range(drops):
        rest, back = int(0.08 * length), int(0.25 * length)
        swing = length - rest - back
        fall = float(rng.uniform(0.7, 1.3))
        x = fall * _drive_car(np.zeros(swing), np.array([0.0, -1.0, 0.0, -1.0]))[:, 0]
        cosine = x[-1] * (1 + np.cos(np.linspace(0, np.pi, back))) / 2
        parts += [np.zeros(rest), x, cosine]
    coarse = np.concatenate(parts)
    return _refine(np.pad(coarse, (0, n // 8 + 1 - coarse.size)), n, 40.0)
