"""Motions of a test rig in closed form: displacement, velocity and acceleration at any time."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rng = np.random.Generator


@dataclass(frozen=True)
class Harmonics:
    """A sum of sines: amplitudes (m), angular frequencies (rad/s), phases (rad), each (K,)."""

    amplitude: Array
    omega: Array
    phase: Array

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Return displacement, velocity and acceleration at times (N,)."""
        x, v, a = np.zeros_like(t), np.zeros_like(t), np.zeros_like(t)
        for q, w, p in zip(self.amplitude, self.omega, self.phase, strict=True):
            s, c = np.sin(w * t + p), np.cos(w * t + p)
            x += q * s
            v += q * w * c
            a -= q * w * w * s
        return x, v, a


@dataclass(frozen=True)
class Chirp:
    """x = A*(f/f_first)^-taper*sin(phase), its frequency f moving geometrically over the duration; taper 0 or 1."""

    amplitude: float
    first: float
    last: float
    duration: float
    taper: float = 0.0

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Return displacement, velocity and acceleration at times (N,)."""
        rate = np.log(self.last / self.first) / self.duration
        growth = np.exp(rate * t)
        phase, omega = 2 * np.pi * self.first * (growth - 1) / rate, 2 * np.pi * self.first * growth
        size, fall = self.amplitude * growth**-self.taper, -self.taper * rate
        s, c = np.sin(phase), np.cos(phase)
        v = size * (fall * s + omega * c)
        a = size * ((fall**2 - omega**2) * s + (2 * fall + rate) * omega * c)
        return size * s, v, a


Motion = Harmonics | Chirp


@dataclass(frozen=True)
class Drive:
    """Scales of a test: half-stroke (m), middle frequency (Hz) and duration (s) of a record."""

    stroke: float
    frequency: float
    duration: float


def sine(drive: Drive, rng: Rng, amplitude: float, factor: float) -> Motion:
    """Return a sine of a share of the stroke at a multiple of the middle frequency."""
    phase = rng.uniform(0, 2 * np.pi)
    return Harmonics(*(np.array([q]) for q in (amplitude * drive.stroke, 2 * np.pi * factor * drive.frequency, phase)))


def two_sines(drive: Drive, rng: Rng, amplitude: float, factor: float) -> Motion:
    """Return a sine with another one on top, of an irrational multiple of its frequency."""
    share, other = rng.uniform(0.1, 0.35), rng.uniform(2.1, 2.9)
    size = amplitude * drive.stroke * np.array([1.0, share]) / (1 + share)
    omega = 2 * np.pi * factor * drive.frequency * np.array([1.0, other])
    return Harmonics(size, omega, rng.uniform(0, 2 * np.pi, 2))


def _periodic(drive: Drive, rng: Rng, amplitude: float, factor: float, series: Callable[[Array], Array]) -> Motion:
    # the smoothed series (Lanczos) of an odd wave: a rig's controller rounds the corners as well
    k = np.arange(1.0, 20.0, 2.0)
    size = series(k) * np.sinc(k / 21)
    turn = np.linspace(0, 2 * np.pi, 2000)
    size *= amplitude * drive.stroke / np.abs(np.sin(np.outer(turn, k)) @ size).max()
    return Harmonics(size, 2 * np.pi * factor * drive.frequency * k, k * rng.uniform(0, 2 * np.pi))


def triangle(drive: Drive, rng: Rng, amplitude: float, factor: float) -> Motion:
    """Return a triangle with corners rounded by a rig."""
    return _periodic(drive, rng, amplitude, factor, lambda k: (-1.0) ** ((k - 1) / 2) / k**2)


def trapezoid(drive: Drive, rng: Rng, amplitude: float, factor: float) -> Motion:
    """Return a trapezoid: ramps, and rests at either end for a part of the period."""
    ramp = rng.uniform(0.35, 0.8) * np.pi / 2
    return _periodic(drive, rng, amplitude, factor, lambda k: np.sin(k * ramp) / k**2)


def chirp_up(drive: Drive, rng: Rng, amplitude: float, factor: float) -> Motion:
    """Return a sweep over two and a half octaves at one amplitude."""
    first = 0.45 * factor * drive.frequency
    return Chirp(amplitude * drive.stroke, first, rng.uniform(5, 6.5) * first, drive.duration)


def chirp_down(drive: Drive, rng: Rng, amplitude: float, factor: float) -> Motion:
    """Return a sweep downwards, its amplitude growing as the frequency falls so that the speed stays."""
    top, ratio = 2.0 * factor * drive.frequency, rng.uniform(3.5, 5)
    return Chirp(amplitude * drive.stroke / ratio, top, top / ratio, drive.duration, 1.0)


def _spectrum(drive: Drive, rng: Rng, amplitude: float, factor: float, density: Callable[[Array], Array]) -> Motion:
    # frequencies at random within equal steps of their logarithm: the sum never repeats
    count = 40
    edges = np.geomspace(0.3, 4.0, count + 1)
    ratio = edges[:-1] * (edges[1:] / edges[:-1]) ** rng.random(count)
    size = np.sqrt(density(ratio) * np.diff(edges)) * rng.rayleigh(1.0, count)
    omega, phase = 2 * np.pi * factor * drive.frequency * ratio, rng.uniform(0, 2 * np.pi, count)
    x, _, _ = Harmonics(size, omega, phase).at(np.linspace(0, drive.duration, 4000))
    return Harmonics(size * amplitude * drive.stroke / np.abs(x).max(), omega, phase)


def road(drive: Drive, rng: Rng, amplitude: float, factor: float) -> Motion:
    """Return a road of ISO 8608 (waviness 2) under a wheel that follows it up to its own frequency."""
    return _spectrum(drive, rng, amplitude, factor, lambda f: f**-2.0 / (1 + (f / 2.5) ** 4))


def rough_road(drive: Drive, rng: Rng, amplitude: float, factor: float) -> Motion:
    """Return a road of another waviness with the wheel hopping on it."""
    waviness, hop = rng.uniform(1.6, 2.6), rng.uniform(2.0, 3.0)
    return _spectrum(
        drive, rng, amplitude, factor, lambda f: f**-waviness / ((1 - (f / hop) ** 2) ** 2 + (0.5 * f / hop) ** 2)
    )


def noise(drive: Drive, rng: Rng, amplitude: float, factor: float) -> Motion:
    """Return coloured noise, its density falling with a power of the frequency."""
    power, corner = rng.uniform(0.5, 2.0), rng.uniform(0.8, 2.0)
    return _spectrum(drive, rng, amplitude, factor, lambda f: f**-power / (1 + (f / corner) ** 6))


# What a kind of test is made of, by split: no drive is in both
DRIVES = {
    "development": {"sines": sine, "triangles": triangle, "chirps up": chirp_up, "roads": road},
    "evaluation": {
        "two-tone sines": two_sines,
        "trapezoids": trapezoid,
        "chirps down": chirp_down,
        "rough roads": rough_road,
        "coloured noise": noise,
    },
}
