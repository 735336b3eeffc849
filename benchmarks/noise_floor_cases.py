"""Records whose noise is known: drives, generating laws and noises for the benchmark of noise floors."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.signal import butter, lfilter, sosfiltfilt

from mrfit.core.recording import Recording
from mrfit.core.specs import Array

RATE, SECONDS = 1000.0, 20.0
STROKE = 0.015
DISPLACEMENT_NOISE = 1e-5


def _time() -> Array:
    return np.arange(int(RATE * SECONDS)) / RATE


def _sine(rng: np.random.Generator) -> Array:
    return STROKE * np.sin(2 * np.pi * rng.uniform(0.8, 2.0) * _time())


def _triangle(rng: np.random.Generator) -> Array:
    phase = rng.uniform(0.6, 1.5) * _time()
    return STROKE * (2.0 * np.abs(2.0 * ((phase + 0.25) % 1.0) - 1.0) - 1.0) * -1.0


def _trapezoid(rng: np.random.Generator) -> Array:
    return np.clip(2.0 * _triangle(rng), -STROKE, STROKE)


def _steps(rng: np.random.Generator) -> Array:
    """Levels held for 0.4 to 1.2 s, approached by an actuator of second order, critically damped at 6 Hz."""
    ends = np.cumsum(rng.uniform(0.4, 1.2, 60))
    at = np.searchsorted(ends, _time())
    command = rng.uniform(-STROKE, STROKE, 61)[at]
    pole = np.exp(-2 * np.pi * 6.0 / RATE)
    return lfilter([(1 - pole) ** 2], [1.0, -2.0 * pole, pole**2], command)


def _chirp(rng: np.random.Generator) -> Array:
    t, first, last = _time(), rng.uniform(0.2, 0.5), rng.uniform(6.0, 9.0)
    phase = first * t + (last - first) * t**2 / (2 * SECONDS)
    return STROKE / (1.0 + phase / 30.0) * np.sin(2 * np.pi * phase)


def _road(rng: np.random.Generator) -> Array:
    """ISO 8608's displacement spectrum 1/n^2 at constant speed, between 0.2 and 15 Hz."""
    walk = np.cumsum(rng.standard_normal(int(RATE * SECONDS) + 4000))
    return _scaled(sosfiltfilt(butter(2, (0.2, 15.0), "bandpass", fs=RATE, output="sos"), walk)[2000:-2000])


def _random(rng: np.random.Generator) -> Array:
    white = rng.standard_normal(int(RATE * SECONDS) + 4000)
    return _scaled(sosfiltfilt(butter(4, (0.5, 5.0), "bandpass", fs=RATE, output="sos"), white)[2000:-2000])


def _scaled(x: Array) -> Array:
    return STROKE * x / float(np.max(np.abs(x)))


DRIVES: dict[str, Callable[[np.random.Generator], Array]] = {
    "sine": _sine,
    "triangle": _triangle,
    "trapezoid": _trapezoid,
    "steps": _steps,
    "chirp": _chirp,
    "road": _road,
    "band-pass random": _random,
}


def _rates(x: Array) -> tuple[Array, Array]:
    v = np.gradient(x, 1 / RATE)
    return v, np.gradient(v, 1 / RATE)


def tanh_law(x: Array, rng: np.random.Generator) -> Array:
    """A yield force as tanh, viscous damping, a spring and a mass."""
    v, a = _rates(x)
    yields, sharp, damping, spring, mass = rng.uniform((200, 40, 300, 500, 1), (600, 150, 1500, 4000, 8))
    return yields * np.tanh(sharp * v) + damping * v + spring * x + mass * a


def iwan_law(x: Array, rng: np.random.Generator) -> Array:
    """Twelve stops in parallel, an orifice loss and a hardening spring: no model of the library."""
    v, _ = _rates(x)
    force = rng.uniform(2e4, 6e4) * v * np.abs(v) + rng.uniform(2e8, 8e8) * x**3
    for reach in np.geomspace(2e-4, 6e-3, 12) * rng.uniform(0.7, 1.4):
        force = force + rng.uniform(20, 60) * _stop(x, reach) / reach
    return force


def maxwell_law(x: Array, rng: np.random.Generator) -> Array:
    """A viscoplastic dashpot (Papanastasiou) in series with a spring, and a gas column: no model of the library."""
    v, _ = _rates(x)
    yields, creep, damping, stiff = rng.uniform((200, 0.005, 300, 3e5), (600, 0.02, 1500, 8e5))
    grid = np.linspace(-1.0, 1.0, 4001) * 1.5 * float(np.max(np.abs(v)))
    curve = yields * np.sign(grid) * -np.expm1(-np.abs(grid) / creep) + damping * grid
    force, fine = np.empty(len(x)), 8
    now = float(np.interp(v[0], grid, curve))
    between = np.linspace(1 / fine, 1.0, fine)
    for k in range(len(x)):
        for rate in v[max(k - 1, 0)] + between * (v[k] - v[max(k - 1, 0)]):
            now += stiff * (rate - np.interp(now, curve, grid)) / (RATE * fine)
        force[k] = now
    return force + rng.uniform(50, 150) * ((1.0 - x / 0.06) ** -1.3 - 1.0)


def _stop(x: Array, reach: float) -> Array:
    stop, state = np.empty(len(x)), 0.0
    for k, move in enumerate(np.diff(x, prepend=x[0])):
        state = min(max(state + move, -reach), reach)
        stop[k] = state
    return stop


LAWS = {"tanh": tanh_law, "Iwan": iwan_law, "Maxwell": maxwell_law}


@dataclass(frozen=True)
class Case:
    """One record with its noise floor: of the drive, law and noise named, the noise a share of the force's range."""

    drive: str
    law: str
    noise: str
    level: float
    seed: int

    def made(self) -> tuple[Recording, Array, Array]:
        """Return the record, the noise in it (N,), and where it is measured rather than patched (N,)."""
        x, force = _clean(self.drive, self.law, self.seed)
        drawn = np.random.default_rng([self.seed, *f"{self.noise}{self.level}".encode()])
        measured, kept = NOISES[self.noise](force, self.level * float(np.ptp(force)), drawn)
        seen = x + DISPLACEMENT_NOISE * drawn.standard_normal(len(x))
        record = Recording(
            id=f"{self.drive}-{self.law}-{self.noise}",
            source="made.csv",
            sha256="",
            reader="none",
            dt=1 / RATE,
            start=0.0,
            channels={"displacement": seen, "force": measured},
            units={"displacement": "m", "force": "N"},
        )
        return record, measured - force, kept


@lru_cache(maxsize=8)
def _clean(drive: str, law: str, seed: int) -> tuple[Array, Array]:
    rng = np.random.default_rng([seed, *f"{drive}{law}".encode()])
    x = DRIVES[drive](rng)
    return x, LAWS[law](x, rng)


def coloured(samples: int, pole: float, rng: np.random.Generator) -> Array:
    """Return AR(1) noise (N,) of unit variance."""
    drawn = rng.standard_normal(samples + 2000)
    return np.asarray(lfilter([np.sqrt(1 - pole**2)], [1.0, -pole], drawn))[2000:]


Noise = Callable[[Array, float, np.random.Generator], tuple[Array, Array]]


def _ar(pole: float) -> Noise:
    def measured(force: Array, rms: float, rng: np.random.Generator) -> tuple[Array, Array]:
        return force + rms * coloured(len(force), pole, rng), np.ones(len(force), dtype=bool)

    return measured


def _quantised(force: Array, rms: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Round to a step whose own noise is the rms asked for."""
    step = rms * np.sqrt(12.0)
    return step * np.round(force / step), np.ones(len(force), dtype=bool)


def _patched(share: float, held: bool) -> Noise:
    def measured(force: Array, rms: float, rng: np.random.Generator) -> tuple[Array, Array]:
        values = force + rms * coloured(len(force), 0.5, rng)
        kept = np.ones(len(force), dtype=bool)
        while np.mean(~kept) < share:
            first, length = int(rng.integers(1, len(force) - 200)), int(rng.integers(10, 120))
            last = first + length
            ends = (values[first - 1], values[first - 1] if held else values[last])
            values[first:last] = np.linspace(*ends, length + 2)[1:-1]
            kept[first - 1 : last + 1] = False
        return values, kept

    return measured


NOISES: dict[str, Noise] = {
    "white": _ar(0.0),
    "AR 0.5": _ar(0.5),
    "AR 0.9": _ar(0.9),
    "AR 0.98": _ar(0.98),
    "quantised": _quantised,
    "line patches 30 %": _patched(0.3, False),
    "held patches 60 %": _patched(0.6, True),
}
LEVELS = (0.003, 0.01, 0.03)
