"""A test as the specimen sees it: every channel that a model takes, predicted where the rig does not set it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.advise.drives import RigBench as Rigged
from mrfit.advise.drives import Test, least_cycles
from mrfit.advise.rig import Rig, current_reach, motion_reach
from mrfit.core.channels import ANTIDERIVATIVES, WORK_AGAINST
from mrfit.core.recording import HEAT_BEFORE, RECORD_CONSTANTS
from mrfit.core.specs import Array
from mrfit.discover.evidence.bench import Bench
from mrfit.errors import ConfigError
from mrfit.signal.smoothing import TIME_CHANNEL
from mrfit.simulate.assembly import Assembly

TEMPERATURE, CURRENT = "temperature", "current"
# Share of the rig's currents from which on those of the data are a range
TESTED = 0.2


@dataclass(frozen=True)
class Channels:
    """Names of the channel that drives a specimen and of its derivatives; empty where there is none."""

    motion: str
    rate: str
    second: str

    @classmethod
    def of(cls, output: str) -> "Channels":
        """Return those of a model's output.

        Raises
        ------
        ConfigError
            If no rig drives what the output works against.
        """
        motion, rate = WORK_AGAINST.get(output, ("", ""))
        if not motion or motion == "flux":
            raise ConfigError(f"no test is known for a model of {output}; advise takes models of force, torque or flux")
        second = next((n for n, sources in ANTIDERIVATIVES.items() if (motion, 2) in sources), "")
        return cls(motion, rate, second)


@dataclass(frozen=True)
class Specimen:
    """What is known of the specimen beside its models, from the data there are.

    Attributes
    ----------
    channels
        What drives it.
    levels
        Mean of every channel.
    heating
        Kelvin per joule of work that its temperature rises by; 0 where the data do not tell.
    temperatures
        Range of the rig in degC, or None.
    """

    channels: Channels
    levels: Mapping[str, float]
    heating: float
    temperatures: tuple[float, float] | None

    @classmethod
    def of(cls, bench: Bench, assembly: Assembly, rig: Rig) -> "Specimen":
        """Return what the data of a bench tell of a specimen."""
        channels = Channels.of(assembly.spec.output)
        names = [n for n in dict.fromkeys(n for s in bench.stretches for n in s.names) if n != TIME_CHANNEL]
        found = {n: [v for s in bench.stretches if (v := s.channel(n)) is not None] for n in names}
        levels = {n: float(np.mean([v.mean() for v in values])) for n, values in found.items() if values}
        return cls(channels, levels, _heating(bench, channels), rig.temperature)

    def moves(self, name: str, rig: Rig) -> bool:
        """Return whether a test can move a channel, or it needs not move."""
        own = (self.channels.motion, self.channels.rate, self.channels.second, TIME_CHANNEL, *RECORD_CONSTANTS)
        if name == TEMPERATURE:
            return rig.temperature is not None or self.heating > 0.0
        return name in own or name == CURRENT and rig.current is not None

    def driven(self, test: Test) -> dict[str, Array]:
        """Return the channels of a test by name (N,), temperature at its level before any heating."""
        samples = test.motion.shape[1]
        channels = {n: np.full(samples, level) for n, level in self.levels.items()}
        own = self.channels
        names = (own.motion, own.rate, own.second)
        channels |= {n: row for n, row in zip(names, test.motion, strict=True) if n}
        if own.motion != CURRENT:
            channels[own.motion] = channels[own.motion] + self.levels.get(own.motion, 0.0)
        if len(test.current):
            channels[CURRENT] = test.current
        channels |= {TIME_CHANNEL: test.time, HEAT_BEFORE: np.zeros(samples)}
        if len(test.warmth) and self.temperatures:
            low, high = self.temperatures
            channels[TEMPERATURE] = low + (high - low) * test.warmth
        return channels

    def heated(self, channels: Mapping[str, Array], output: Array, dt: float) -> dict[str, Array]:
        """Return channels in which the work done against an output (N,) has warmed the specimen."""
        if TEMPERATURE not in channels or not self.heating:
            return dict(channels)
        work = np.cumsum(np.abs(output * channels[self.channels.rate])) * dt
        return {**channels, TEMPERATURE: channels[TEMPERATURE] + self.heating * work}


def rows_of(channels: Mapping[str, Array], assembly: Assembly) -> Array:
    """Return the drive (C, N) of a model.

    Raises
    ------
    ConfigError
        If it takes a channel that is neither driven nor in the data.
    """
    lacking = [n for n in assembly.spec.inputs if n not in channels]
    if lacking:
        raise ConfigError(f"{assembly.name} takes {lacking[0]}, which no test of this rig moves and no log has")
    return np.ascontiguousarray(np.stack([channels[n] for n in assembly.spec.inputs]))


def _heating(bench: Bench, channels: Channels) -> float:
    """Return the kelvin per joule by which the temperature rose with the work done, by least squares over records."""
    rises: list[Array] = []
    works: list[Array] = []
    for stretch in bench.stretches:
        temperature, rate = stretch.channel(TEMPERATURE), stretch.channel(channels.rate) if channels.rate else None
        if temperature is None or rate is None:
            return 0.0
        work = np.cumsum(np.abs(stretch.measured * rate)) * stretch.block.dt
        rises.append(temperature - temperature.mean())
        works.append(work - work.mean())
    rise, work = np.concatenate(rises), np.concatenate(works)
    power = float(work @ work)
    return max(float(work @ rise) / power, 0.0) if power > 0.0 else 0.0


def unmovable(effects_inputs: Sequence[str], specimen: Specimen, rig: Rig) -> str:
    """Return the first channel of an effect that a rig cannot move, or an empty string."""
    return next((n for n in effects_inputs if not specimen.moves(n, rig)), "")


def rigged_of(bench: Bench, channels: Channels, rig: Rig) -> Rigged:
    """Return the rig as tests see it."""
    rate = rig.sampling or 1.0 / float(np.median([s.block.dt for s in bench.stretches]))
    if channels.motion == CURRENT:
        return Rigged(rig, current_reach(rig, least_cycles(), rate), None, 1.0 / rate)
    return Rigged(rig, motion_reach(rig, least_cycles(), rate), _currents(bench, rig), 1.0 / rate)


def _currents(bench: Bench, rig: Rig) -> tuple[float, float] | None:
    """Return the currents of tests: those of the data there are where they range, beyond which no law is known."""
    found = [c for s in bench.of_role("train") if (c := s.channel(CURRENT)) is not None]
    if rig.current is None or not found:
        return rig.current
    low = max(rig.current[0], min(float(c.min()) for c in found))
    high = min(rig.current[1], max(float(c.max()) for c in found))
    return (low, high) if high - low > TESTED * (rig.current[1] - rig.current[0]) else rig.current
