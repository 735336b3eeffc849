"""Roads under a wheel: a bump, random roads of ISO 8608, a sine sweep; height and its rate at any time."""

from dataclasses import dataclass
from typing import Annotated, Any, Protocol, runtime_checkable

import numpy as np

from mrfit.core.arguments import check_arguments
from mrfit.core.setting import Setting
from mrfit.core.specs import Array
from mrfit.errors import ConfigError

# ISO 8608: displacement spectral density in m^3 at 0.1 cycles/m, geometric mean of each class, falling with n^-2
ROUGHNESS = {"A": 16e-6, "B": 64e-6, "C": 256e-6, "D": 1024e-6}
_REFERENCE, LONGEST_WAVE, SHORTEST_WAVE = 0.1, 0.011, 2.83
_WAVES = 300
# Time in s in which a car comes from a level road onto a random one
_ENTRY = 1.0


@runtime_checkable
class Road(Protocol):
    """A road's height over time at the vehicle's speed."""

    @property
    def name(self) -> str:
        """Name in tables."""

    @property
    def duration(self) -> float:
        """Duration of the drive in s."""

    @property
    def ends(self) -> float:
        """Time in s from which on it is level; its duration if it never is."""

    @property
    def settled(self) -> float:
        """Time in s before which the car is still driven onto it, and nothing is averaged."""

    @property
    def top(self) -> float:
        """Highest frequency in Hz at which it drives a car by itself; 0 where the car's own stand out."""

    def height(self, t: Array) -> tuple[Array, Array]:
        """Return height in m and its rate in m/s."""


@dataclass(frozen=True)
class Bump:
    """A rounded bump, met after 0.5 s: H/2*(1 - cos(2*pi*v/L*(t - 0.5))).

    Source: preyield paper eq. 12, H = 0.02 m, L = 1 m, v = 15 km/h.
    """

    rise: float = 0.02
    length: float = 1.0
    speed: float = 15.0 / 3.6
    duration: float = 3.0
    start: float = 0.5

    @property
    def name(self) -> str:
        """Name in tables."""
        return f"bump {1e3 * self.rise:g} mm"

    @property
    def ends(self) -> float:
        """Time at which the wheel has left it."""
        return self.start + self.length / self.speed

    @property
    def settled(self) -> float:
        """It begins level."""
        return 0.0

    @property
    def top(self) -> float:
        """Its own."""
        return self.speed / self.length

    def height(self, t: Array) -> tuple[Array, Array]:
        """Return height in m and its rate in m/s."""
        omega = 2.0 * np.pi * self.speed / self.length
        on = (t >= self.start) & (t <= self.ends)
        phase = omega * (t - self.start)
        half = 0.5 * self.rise
        return np.where(on, half * (1.0 - np.cos(phase)), 0.0), np.where(on, half * omega * np.sin(phase), 0.0)


@dataclass(frozen=True)
class RandomRoad:
    """A road of an ISO 8608 class: waves of 0.35 to 91 m with random phases, at the class's mean roughness.

    It rises from a level one over the first second, by sin(pi*t/2)^2: a car put on it at rest would drop from a kerb.
    """

    grade: str
    speed: float = 20.0
    duration: float = 10.0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.grade not in ROUGHNESS:
            raise ConfigError(f"ISO 8608 roads here are A to D, not '{self.grade}'")
        if not self.duration >= 2.0 * _ENTRY:
            raise ConfigError(
                f"a random road takes a --duration of {2.0 * _ENTRY:g} s or more, not {self.duration:g} s: "
                f"the first {_ENTRY:g} s lead onto it and are not averaged"
            )

    @property
    def name(self) -> str:
        """Name in tables."""
        return f"ISO 8608 {self.grade}"

    @property
    def ends(self) -> float:
        """It never is level."""
        return self.duration

    @property
    def settled(self) -> float:
        """Time at which it has its full height."""
        return _ENTRY

    @property
    def top(self) -> float:
        """Its waves grow with their length: the car chooses among them."""
        return 0.0

    def height(self, t: Array) -> tuple[Array, Array]:
        """Return height in m and its rate in m/s."""
        edges = np.geomspace(LONGEST_WAVE, SHORTEST_WAVE, _WAVES + 1)
        n, width = np.sqrt(edges[1:] * edges[:-1]), np.diff(edges)
        size = np.sqrt(2.0 * ROUGHNESS[self.grade] * (n / _REFERENCE) ** -2.0 * width)
        omega = 2.0 * np.pi * n * self.speed
        phase = np.random.default_rng(self.seed).uniform(0.0, 2.0 * np.pi, _WAVES)
        waves = size * np.exp(1j * phase)
        height, rate = _swung(np.asarray(t, dtype=np.float64), omega, np.stack([waves, 1j * omega * waves]))
        entered = np.clip(np.asarray(t) / _ENTRY, 0.0, 1.0)
        share, growth = np.sin(0.5 * np.pi * entered) ** 2, 0.5 * np.pi / _ENTRY * np.sin(np.pi * entered)
        return share * height, share * rate + growth * height


def _swung(t: Array, omega: Array, waves: Any) -> Array:
    """Return the real parts (K, N) of sums over waves (K, W) times exp(i*omega*t)."""
    width = int(np.sqrt(t.size))
    if t.ndim == 1 and width > 1 and np.array_equal(t, np.arange(t.size) * t[1]):
        # of even times as products of two turns: a hundredth of the turns
        late, early = (np.exp(1j * np.multiply.outer(some, omega)) for some in (t[::width], t[:width]))
        return np.stack([((late * one) @ early.T).real.ravel()[: t.size] for one in waves])
    turned = np.exp(1j * np.multiply.outer(t, omega))
    return np.stack([(turned @ one).real for one in waves])


@dataclass(frozen=True)
class Sweep:
    """A sine whose frequency grows exponentially."""

    amplitude: float = 0.003
    low: float = 0.5
    high: float = 20.0
    duration: float = 10.0

    @property
    def name(self) -> str:
        """Name in tables."""
        return f"sweep {self.low:g} to {self.high:g} Hz"

    @property
    def ends(self) -> float:
        """It never is level."""
        return self.duration

    @property
    def settled(self) -> float:
        """It begins at its middle, slowly."""
        return 0.0

    @property
    def top(self) -> float:
        """Frequency at its end."""
        return self.high

    def height(self, t: Array) -> tuple[Array, Array]:
        """Return height in m and its rate in m/s."""
        growth = np.log(self.high / self.low) / self.duration
        omega = 2.0 * np.pi * self.low * np.exp(growth * t)
        phase = (omega - 2.0 * np.pi * self.low) / growth
        return self.amplitude * np.sin(phase), self.amplitude * omega * np.cos(phase)


@check_arguments
def road(
    text: str,
    speed: Annotated[float | None, Setting("Speed in m/s.", above=0.0)] = None,
    duration: Annotated[float | None, Setting("Duration in s.", above=0.0)] = None,
    seed: int = 0,
) -> Road:
    """Return the road of a written name: ``bump``, ``A`` to ``D``, ``sweep``.

    Raises
    ------
    ConfigError
        If it is none.
    """
    longer = {} if duration is None else {"duration": duration}
    faster = {} if speed is None else {"speed": speed}
    if text == "bump":
        return Bump(**longer, **faster)
    if text == "sweep":
        return Sweep(**longer)
    if text in ROUGHNESS:
        return RandomRoad(text, seed=seed, **longer, **faster)
    raise ConfigError(f"--road takes bump, A, B, C, D or sweep, not '{text}'")
