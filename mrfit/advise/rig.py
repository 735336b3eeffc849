"""The limits of a press or an amplifier: the table ``[rig]`` of a TOML file."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field, ValidationError, model_validator

from mrfit.core.channels import POSITIONS
from mrfit.core.recording import Segment
from mrfit.errors import ConfigError
from mrfit.ingest.meaning.channel_map import FILE_NAME
from mrfit.ingest.meaning.units import compatible, quantity, to_unit
from mrfit.io.faults import plain_fault
from mrfit.io.toml_file import TomlTable, read_toml

# A sine is sampled at least so often in a cycle
LEAST_PER_CYCLE = 25
# Where no highest frequency is given: the one at which speed and acceleration leave this share of the stroke
LEAST_STROKE = 0.02
LEAST_SECONDS = 10.0
"""Length of a test that is proposed where those there are were shorter."""


def _in(*units: str) -> BeforeValidator:
    """Return the reader of a quantity that is written as a number in SI, or with its unit, as ``25 mm``."""

    def read(value: object) -> object:
        if not isinstance(value, str):
            return value
        found = quantity(value)
        unit = next((u for u in units if found and found[1] and compatible(found[1], u)), None)
        if found is None or unit is None:
            raise ValueError(f"a number, or a number with a unit of the kind of {units[0]}")
        conversion = to_unit(found[1], unit)
        return conversion.scale * found[0] + conversion.offset

    return BeforeValidator(read)


def _range(value: object) -> object:
    """Return the range up to a highest value that is written alone, as a number or with its unit."""
    return [0.0, value] if isinstance(value, (int, float, str)) and not isinstance(value, bool) else value


Positive = Field(gt=0, allow_inf_nan=False)
Finite = Field(allow_inf_nan=False)
Metres = Annotated[float, _in("m", "rad"), Positive]
Speed = Annotated[float, _in("m/s", "rad/s"), Positive]
Acceleration = Annotated[float, _in("m/s^2", "rad/s^2"), Positive]
Newtons = Annotated[float, _in("N", "N*m"), Positive]
Hertz = Annotated[float, _in("Hz"), Positive]
Amperes = Annotated[float, _in("A"), Finite]
AmperesPerSecond = Annotated[float, _in("A/s"), Positive]
Degrees = Annotated[float, _in("degC"), Finite]
Seconds = Annotated[float, _in("s"), Positive]


class Rig(TomlTable):
    """What a rig can do, SI.

    Attributes
    ----------
    stroke
        Travel from end to end in m, or rad of a rotating bench.
    speed, acceleration
        Largest ones in m/s and m/s^2, or rad/s and rad/s^2.
    force
        Largest force in N, or torque in N*m.
    frequency
        Lowest and highest in Hz, or the highest.
    current
        Lowest and highest in A, or the highest.
    current_rate
        Largest rate of change in A/s.
    temperature
        Lowest and highest in degC to which the specimen can be brought.
    warm_up
        Seconds that this takes from the lowest to the highest.
    seconds
        Length of the longest test in s.
    sampling
        Rate of the record in Hz; without it that of the data.
    """

    seconds: Seconds
    stroke: Metres | None = None
    speed: Speed | None = None
    acceleration: Acceleration | None = None
    force: Newtons | None = None
    frequency: Annotated[tuple[Hertz | float, Hertz], BeforeValidator(_range)] | None = None
    current: Annotated[tuple[Amperes, Amperes], BeforeValidator(_range)] | None = None
    current_rate: AmperesPerSecond | None = None
    temperature: tuple[Degrees, Degrees] | None = None
    warm_up: Seconds = 600.0
    sampling: Hertz | None = None

    @model_validator(mode="after")
    def _rising(self) -> Self:
        for name in ("frequency", "current", "temperature"):
            ends = getattr(self, name)
            if ends is not None and not ends[0] < ends[1]:
                raise ValueError(f"{name} takes its lowest and its highest value, not {ends[0]:g} and {ends[1]:g}")
        return self


@dataclass(frozen=True, slots=True)
class ChannelReach:
    """What a channel that drives a specimen can do.

    Attributes
    ----------
    amplitude
        Largest departure from the middle.
    speed, acceleration
        Largest rates of its first and second order, infinite where nothing limits them.
    low, high
        Frequencies in Hz.
    """

    amplitude: float
    speed: float
    acceleration: float
    low: float
    high: float


def motion_reach(rig: Rig, cycles: float, rate: float) -> ChannelReach:
    """Return what a press can do.

    Parameters
    ----------
    rig
        Its limits.
    cycles
        Fewest cycles of a test.
    rate
        Samples per second.

    Raises
    ------
    ConfigError
        If a limit lacks that a motion needs, or the limits leave no motion.
    """
    if rig.stroke is None:
        raise ConfigError("[rig] lacks stroke, the press's travel from end to end in m: add stroke = 0.05")
    if rig.speed is None and rig.acceleration is None and rig.frequency is None:
        raise ConfigError("[rig] limits no motion: add speed in m/s, acceleration in m/s^2 or frequency in Hz")
    amplitude = 0.5 * rig.stroke
    speed, acceleration = rig.speed or math.inf, rig.acceleration or math.inf
    least = LEAST_STROKE * amplitude
    highest = min(speed / least, math.sqrt(acceleration / least)) / (2.0 * math.pi)
    return ChannelReach(amplitude, speed, acceleration, *_band(rig, highest, cycles, rate))


def current_reach(rig: Rig, cycles: float, rate: float) -> ChannelReach:
    """Return what an amplifier can do to a coil, see ``motion_reach``.

    Raises
    ------
    ConfigError
        If a limit lacks that a current needs, or the limits leave none.
    """
    if rig.current is None:
        raise ConfigError("[rig] lacks current, the largest one of the coil in A: add current = 3.0")
    if rig.frequency is None and rig.current_rate is None:
        raise ConfigError("[rig] does not limit how fast the current moves: add frequency in Hz or current_rate in A/s")
    lowest, amplitude = rig.current
    if not lowest <= 0.0 < amplitude:
        text = f"[rig] current of {lowest:g} to {amplitude:g} A: a coil is driven to both sides of 0"
        raise ConfigError(f"{text}; write [-A, A], or A alone")
    if lowest < 0.0:
        amplitude = min(amplitude, -lowest)
    speed = rig.current_rate or math.inf
    highest = speed / (2.0 * math.pi * LEAST_STROKE * amplitude)
    return ChannelReach(amplitude, speed, math.inf, *_band(rig, highest, cycles, rate))


def _band(rig: Rig, highest: float, cycles: float, rate: float) -> tuple[float, float]:
    """Return the frequencies in Hz between which so many cycles fit into a test and are sampled often enough."""
    given = rig.frequency or (0.0, math.inf)
    low, high = max(given[0], cycles / rig.seconds), min(given[1], highest, rate / LEAST_PER_CYCLE)
    if not low < high:
        raise ConfigError(
            f"[rig] leaves no test: {cycles:g} cycles take {cycles / rig.seconds:.3g} Hz or more in {rig.seconds:g} s, "
            f"and its other limits leave {high:.3g} Hz or less; give more seconds or wider limits"
        )
    return low, high


def read_rig(path: Path) -> Rig:
    """Return the limits that a TOML file states.

    Raises
    ------
    ConfigError
        If the file cannot be read, has no table ``[rig]``, or a wrong one; the message names the key.
    """
    table = _table(path)
    if table is None:
        raise ConfigError(f"{path}: no table [rig]; state the press's limits, at least seconds, stroke and speed")
    return rig_of(table, str(path))


def rig_of(table: object, where: str = "rig") -> Rig:
    """Return limits given as a table; ``where`` begins the message.

    Raises
    ------
    ConfigError
        If it has an unknown key or a wrong value.
    """
    try:
        return Rig.model_validate(table)
    except ValidationError as error:
        own = next((e for e in error.errors() if e["type"] == "value_error"), None)
        if own is not None:
            key = ".".join(str(k) for k in own["loc"] if isinstance(k, str) and k in Rig.model_fields)
            said = own["msg"].removeprefix("Value error, ")
            text = f"key '{key}' takes {said}, not {own['input']!r}" if key else said
            raise ConfigError(f"{where}: [rig] {text}") from None
        raise ConfigError(f"{where}: [rig] {plain_fault(error, Rig)}") from None


def rig_lines(segments: Sequence[Segment]) -> list[str]:
    """Return a table ``[rig]`` to copy: what the tests of a workspace took, to be replaced by what the rig can do."""
    motions = [s for s in segments if s.drive in POSITIONS and s.amplitude > 0.0]
    currents = [s for s in segments if s.drive == "current" and s.amplitude > 0.0]
    longest = max((s.cycles / s.frequency for s in segments if s.frequency > 0.0), default=0.0)
    lines = ["[rig]", f"seconds = {math.ceil(max(longest, LEAST_SECONDS)):d}  # the longest test"]
    if motions:
        turned = motions[0].drive == "angle"
        factor, unit = (1.0, "rad") if turned else (1e3, "mm")
        stroke = factor * 2.0 * max(s.amplitude for s in motions)
        lines.append(f'stroke = "{stroke:.3g} {unit}"  # from end to end')
        if speeds := [2.0 * math.pi * s.frequency * s.amplitude for s in motions if s.frequency > 0.0]:
            lines.append(f'speed = "{factor * max(speeds):.3g} {unit}/s"')
    if currents and (fastest := max(s.frequency for s in currents)) > 0.0:
        lines.append(f"frequency = {fastest:.3g}  # the highest, in Hz")
    levels = [s.current for s in segments if math.isfinite(s.current)] + [s.amplitude for s in currents]
    if levels and max(levels) > 0.0:
        lines.append(f"current = [{min(0.0, *levels):.3g}, {max(levels):.3g}]  # lowest and highest, in A")
    return lines


def rig_beside(sources: Sequence[str]) -> Path | None:
    """Return the first of ``mrfit.toml`` here and beside the logs that has a table ``[rig]``; None if none has."""
    folders = dict.fromkeys([Path(), *(Path(s).parent for s in sources)])
    files = (folder / FILE_NAME for folder in folders)
    return next((f for f in files if f.is_file() and _table(f) is not None), None)


def _table(path: Path) -> Any:
    return read_toml(path, "a file with a table [rig]").get("rig")
