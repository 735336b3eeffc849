"""The channel map: what the user writes once, in TOML, about logs that do not say it themselves."""

import fnmatch
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from mrfit.core.channels import CHANNELS
from mrfit.errors import ConfigError
from mrfit.io.toml_file import TomlTable, read_toml

FILE_NAME = "mrfit.toml"
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


# Keys of which the last that is given holds
LAST_HOLDS = ("resistance", "lever", "decimate", "pattern", "join", "coil")
BUILTINS = ("float", "int", "str", "TimeRule", "ChannelRule")


class ChannelRule(TomlTable):
    """Column of a channel and the meaning of its numbers: value = sign·scale·number + offset, in ``unit``.

    ``low_pass`` is the limit in Hz of a filter of zero phase.
    """

    column: str | int | list[str]
    unit: str | None = None
    scale: Finite = 1.0
    offset: Finite = 0.0
    sign: Literal[1, -1] = 1
    low_pass: Positive | None = None

    @property
    def columns(self) -> Sequence[str | int]:
        """The column, or those of the list."""
        return self.column if isinstance(self.column, list) else [self.column]


class TimeRule(TomlTable):
    """Column of the times."""

    column: str | int
    unit: str | None = None


class CoilRule(TomlTable):
    """The coil of a log of field strength H and flux density B: i = H·length/turns, λ = turns·area·B.

    Its turns, the length in m of the path that the field takes, and the area in m² of its cross-section.
    """

    turns: Positive
    length: Positive
    area: Positive


class MapSection(TomlTable):
    """Keys that hold for all files, or for those a ``[[files]]`` pattern matches."""

    resistance: Positive | Literal["auto"] | None = None
    dt: Positive | None = None
    decimate: Annotated[int, Field(ge=1)] | None = None
    low_pass: Positive | None = None
    rate: Positive | None = None
    lever: Positive | None = None
    pattern: str | None = None
    join: str | None = None
    time: str | int | TimeRule | None = None
    ignore: list[str] = []
    condition: dict[str, Finite | list[Finite]] = {}
    coil: CoilRule | None = None
    channels: dict[str, ChannelRule] = {}


class FilesPart(MapSection):
    """Keys for the files whose name matches ``match``."""

    match: str


class MapFile(MapSection):
    """A whole channel map."""

    files: list[FilesPart] = []
    # limits of the rig, which `mrfit advise` reads and checks: they say nothing about logs
    rig: dict[str, Any] = {}
    # defaults of commands, which `mrfit.cli.project` reads and checks where the file is in the current folder
    work: str = ""
    flux: dict[str, Any] = {}
    segment: dict[str, Any] = {}
    fit: dict[str, Any] = {}
    discover: dict[str, Any] = {}


@dataclass(frozen=True, slots=True)
class Rules:
    """Rules of the map for one file.

    Attributes
    ----------
    where
        Path of the map, or empty if there is none.
    lever
        Length in m of the lever between a press and a rotary device, or None.
    decimate
        Samples of the log for each one that is kept.
    join
        Name of the record that files with the same name here hold together, column beside column; None for none.
    low_pass
        Limits in Hz of zero-phase low-passes by channel, ``*`` for all others.
    believed
        Whether names and units are the user's own words, and their sizes not doubted.
    """

    where: str = ""
    resistance: float | None = None
    dt: float | None = None
    lever: float | None = None
    decimate: int = 1
    pattern: str | None = None
    join: str | None = None
    time: TimeRule | None = None
    ignore: tuple[str, ...] = ()
    condition: Mapping[str, float | list[float]] = field(default_factory=dict)
    coil: CoilRule | None = None
    channels: Mapping[str, ChannelRule] = field(default_factory=dict)
    low_pass: Mapping[str, float] = field(default_factory=dict)
    believed: bool = False

    @property
    def columns(self) -> tuple[str | int, ...]:
        """Columns that the map takes as times and channels, by name or place."""
        clock: list[str | int] = [self.time.column] if self.time else []
        return (*clock, *(one for rule in self.channels.values() for one in rule.columns))

    def of_test(self, number: int, tests: int) -> "Rules":
        """Return the rules of one of the tests of a log: of a list of conditions as long, its own value."""
        if tests == 1:
            return self
        lists = {key: v[number] for key, v in self.condition.items() if isinstance(v, list) and len(v) == tests}
        return replace(self, condition={**self.condition, **lists})

    def leaves_out(self, name: str) -> bool:
        """Return whether a column that is written so is left out, so that it is no clock."""
        return name.strip() in map(str.strip, self.ignore)


def load_map(path: Path) -> MapFile:
    """Return a channel map.

    Raises
    ------
    ConfigError
        If the file is missing, is no TOML, or holds an unknown key or a wrong value; the message names the key.
    """
    content = read_toml(path, "a channel map, by --map")
    try:
        loaded = MapFile.model_validate(content)
    except ValidationError as error:
        raise ConfigError(f"{path}: {_first_fault(error)}") from None
    for part in (loaded, *loaded.files):
        _check(path, part)
    return loaded


def check_keys(path: Path, content: Mapping[str, Any]) -> None:
    """Check that the outermost keys of a map are known.

    Raises
    ------
    ConfigError
        If one is not; the message names it.
    """
    for key in content:
        if key not in MapFile.model_fields:
            raise ConfigError(f"{path}: {_unknown(key, key)}")


def _unknown(key: str, last: str) -> str:
    known = [n for m in (ChannelRule, CoilRule, FilesPart, MapFile, TimeRule) for n in m.model_fields]
    near = get_close_matches(last, known, n=1)
    return f"unknown key '{key}'; " + (f"did you mean '{near[0]}'?" if near else "remove it")


def _first_fault(error: ValidationError) -> str:
    faults = error.errors()
    fault = next((f for f in faults if f["type"] == "extra_forbidden"), faults[0])
    # pydantic puts the member of a union into the path, as in resistance.constrained-float
    key = ".".join(str(p) for p in fault["loc"] if isinstance(p, int) or p.isidentifier() and p not in BUILTINS)
    if fault["type"] in ("model_type", "model_attributes_type", "dict_type"):
        given = json.dumps(fault.get("input"), default=str)
        table = f"{fault['loc'][-1]} = {{column = {given}}}" if "channels" in fault["loc"][:-1] else f"[{key}]"
        return f"key '{key}' takes a table, not {given}; write {table}"
    if fault["type"] != "extra_forbidden":
        return f"key '{key}': {fault['msg'].lower()} (got {fault.get('input')!r}); correct it"
    return _unknown(key, str(fault["loc"][-1]))


def _check(path: Path, part: MapSection) -> None:
    if part.dt is not None and part.rate is not None:
        raise ConfigError(f"{path}: both dt and rate are given; keep one")
    clock = part.time.column if isinstance(part.time, TimeRule) else part.time
    for name, rule in part.channels.items():
        if rule.scale == 0.0:
            remedy = "write the factor that turns the file's numbers into its unit"
            raise ConfigError(f"{path}: key 'channels.{name}.scale' is 0, so that nothing is left; {remedy}")
        if rule.column == clock:
            raise ConfigError(f"{path}: keys 'time' and 'channels.{name}' both name column {clock!r}; correct one")
        if name not in CHANNELS and (near := get_close_matches(name, CHANNELS, n=1, cutoff=0.8)):
            raise ConfigError(f"{path}: unknown channel '{name}'; did you mean '{near[0]}'?")
        if name == "time":
            raise ConfigError(f"{path}: time is no channel; write time = … at the top of the map")


def rules_for(file: Path, loaded: MapFile | None, where: str) -> Rules:
    """Return the rules of a map for one file: the general keys, then those of every matching pattern in order."""
    if loaded is None:
        return Rules()
    parts: list[MapSection] = [loaded]
    parts += [p for p in loaded.files if fnmatch.fnmatch(file.name.lower(), p.match.lower())]
    dt, time = None, None
    last: dict[str, Any] = {}
    ignore: list[str] = []
    condition: dict[str, float | list[float]] = {}
    channels: dict[str, ChannelRule] = {}
    low_pass: dict[str, float] = {}
    for part in parts:
        dt = part.dt or (1.0 / part.rate if part.rate else dt)
        time = part.time if part.time is not None else time
        last |= {name: value for name in LAST_HOLDS if (value := getattr(part, name))}
        ignore += part.ignore
        condition |= part.condition
        channels |= part.channels
        low_pass |= {"*": part.low_pass} if part.low_pass else {}
        low_pass |= {n: rule.low_pass for n, rule in part.channels.items() if rule.low_pass}
    if last.get("resistance") == "auto":
        del last["resistance"]
    return Rules(
        where=where,
        dt=dt,
        time=time if isinstance(time, TimeRule) or time is None else TimeRule(column=time),
        ignore=tuple(ignore),
        condition=condition,
        channels=channels,
        low_pass=low_pass,
        **last,
    )
