"""Values that people write otherwise than their types say: NAME=VALUE pairs, bounds, ohms, sizes, lists of names."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Literal

from mrfit.core.arguments import one_line
from mrfit.core.setting import SettingForm
from mrfit.errors import ConfigError

Names = tuple[str, ...]
Pairs = tuple[tuple[str, float], ...]
Limits = tuple[tuple[str, float, float], ...]
SIZES = {"": 1.0, "K": 1e3, "M": 1e6, "G": 1e9, "T": 1e12, "KI": 2.0**10, "MI": 2.0**20, "GI": 2.0**30, "TI": 2.0**40}


def ohms(text: str | None) -> float | Literal["auto"] | None:
    """Return a resistance option as a number, ``auto`` or None.

    Raises
    ------
    ConfigError
        If it is neither, or not positive.
    """
    if text is None:
        return None
    if text == "auto":
        return "auto"
    try:
        value = float(text)
    except ValueError as error:
        raise ConfigError(f"--resistance takes a number of ohms or 'auto', not '{text}'") from error
    if not 0.0 < value < float("inf"):
        raise ConfigError(f"--resistance must be a positive number of ohms, not {text}")
    return value


def size_of(text: str) -> float:
    """Return the bytes of a text such as ``500MB``, ``2 GB`` or ``1.5GiB``.

    Raises
    ------
    ConfigError
        If it is no positive size.
    """
    match = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*([KMGT]?I?)B?\s*", text, re.IGNORECASE)
    if match is None or match[2].upper() not in SIZES or float(match[1]) == 0.0:
        raise ConfigError(f"--max-memory takes a size such as 500MB or 2GB, not '{text}'")
    return float(match[1]) * SIZES[match[2].upper()]


def pairs(option: str, items: Iterable[str] | None, form: str = "NAME=VALUE") -> list[tuple[str, str]]:
    """Split NAME=VALUE items of a repeated option; messages say its ``form``.

    Raises
    ------
    ConfigError
        If an item has no equals sign.
    """
    split = [item.partition("=") for item in items or []]
    for name, sign, value in split:
        if not (name and sign and value):
            point = "; decimals have a point, as c=1.5" if not sign and name.strip().isdigit() else ""
            raise ConfigError(f"{option} takes {form}, not '{name}{sign}{value}'{point}")
    return [(name.strip(), value.strip()) for name, _, value in split]


def _apart(items: Iterable[str] | None) -> list[str]:
    return [one for item in items or [] for one in item.split(",")]


def number(option: str, text: str) -> float:
    """Return an option's text as a finite number.

    Raises
    ------
    ConfigError
        If it is none.
    """
    try:
        value = float(text)
    except ValueError as error:
        raise ConfigError(f"{option}: '{text}' is not a number") from error
    if not math.isfinite(value):
        raise ConfigError(f"{option}: '{text}' is not finite")
    return value


def numbers(option: str, items: Iterable[str] | None) -> Pairs:
    """Return NAME=VALUE items of an option, repeated or parted by commas, with their numbers.

    Raises
    ------
    ConfigError
        If an item has no equals sign, or no number.
    """
    return tuple((name, number(option, value)) for name, value in pairs(option, _apart(items)))


def limits(option: str, items: Iterable[str] | None) -> Limits:
    """Return NAME=LOW:HIGH items of an option, repeated or parted by commas, with their numbers.

    Raises
    ------
    ConfigError
        If an item has no equals sign, or not two numbers.
    """
    found = []
    for name, value in pairs(option, _apart(items), "NAME=LOW:HIGH"):
        low, colon, high = value.partition(":")
        if not colon:
            raise ConfigError(f"{option} takes NAME=LOW:HIGH, not '{name}={value}'")
        found.append((name, number(option, low), number(option, high)))
    return tuple(found)


def names(text: str) -> tuple[str, ...]:
    """Return names written with commas."""
    return tuple(n.strip() for n in text.split(",")) if text else ()


def of_python(name: str, value: object) -> float:
    """Return an argument as a finite number.

    Raises
    ------
    ConfigError
        If it is none.
    """
    try:
        found = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise ConfigError(f"{name} takes a number, not {one_line(value)}") from None
    if not math.isfinite(found):
        raise ConfigError(f"{name}: {one_line(value)} is not finite")
    return found


def _numbers_taken(name: str, value: object) -> Pairs:
    if not isinstance(value, Mapping):
        raise ConfigError(f"{name} takes a dictionary of names and numbers, not {one_line(value)}")
    return tuple((str(n), of_python(f"{name} {n}", v)) for n, v in value.items())


def _limits_taken(name: str, value: object) -> Limits:
    if not isinstance(value, Mapping):
        raise ConfigError(f"{name} takes a dictionary of names and (low, high), not {one_line(value)}")
    found = []
    for parameter, ends in value.items():
        if not (isinstance(ends, Sequence) and not isinstance(ends, str) and len(ends) == 2):
            raise ConfigError(f"{name} {parameter} takes (low, high), not {one_line(ends)}")
        low, high = (of_python(f"{name} {parameter}", end) for end in ends)
        found.append((str(parameter), low, high))
    return tuple(found)


def _texts_taken(name: str, value: object) -> tuple[tuple[str, str], ...]:
    if not isinstance(value, Mapping):
        raise ConfigError(f"{name} takes a dictionary of names and texts, not {one_line(value)}")
    return tuple((str(n), str(v)) for n, v in value.items())


def _order_taken(name: str, value: object) -> str:
    return ",".join(f"{n}={order}" for n, order in value.items()) if isinstance(value, Mapping) else str(value)


def _written(name: str, value: object) -> str:
    return value if isinstance(value, str) else repr(of_python(name, value))


def _ohms_taken(name: str, value: object) -> object:
    # the flux stage says what is wrong with other words
    return value if value is None or isinstance(value, str) else of_python(name, value)


def _size_taken(name: str, value: object) -> float | None:
    return None if value is None else size_of(value) if isinstance(value, str) else of_python(name, value)


def _names_taken(name: str, value: object) -> tuple[str, ...]:
    if isinstance(value, str):
        return names(value)
    try:
        return tuple(str(n).strip() for n in value)  # type: ignore[attr-defined]
    except TypeError:
        raise ConfigError(f"{name} takes names, not {one_line(value)}") from None


def _path_taken(name: str, value: object) -> Path | None:
    if not isinstance(value, (str, PathLike, type(None))) or "\0" in str(value):
        raise ConfigError(f"{name} takes a path, not {one_line(value)}")
    return Path(value) if value else None


def _flat(tables: Mapping[str, Any]) -> Pairs:
    """Return constants of optimizers; ``mwoa.b = 1.2`` is a table in a table for TOML."""
    whole = ((n, v if isinstance(v, dict) else {"": v}) for n, v in tables.items())
    return tuple((f"{name}.{own}".rstrip("."), value) for name, table in whole for own, value in table.items())


NUMBERS = SettingForm(list[str] | None, numbers, dict[str, float], lambda table: tuple(table.items()), _numbers_taken)
TEXTS = SettingForm(
    list[str] | None,
    lambda option, items: tuple(pairs(option, items)),
    dict[str, str],
    lambda table: tuple(table.items()),
    _texts_taken,
)
CONSTANTS = SettingForm(
    list[str] | None,
    numbers,
    dict[str, float | dict[str, float]],
    _flat,
    lambda name, value: _numbers_taken(name, dict(_flat(value)) if isinstance(value, Mapping) else value),
)
LIMITS = SettingForm(
    list[str] | None,
    limits,
    dict[str, tuple[float, float]],
    lambda table: tuple((n, low, high) for n, (low, high) in table.items()),
    _limits_taken,
)
OHMS = SettingForm(
    str | None,
    lambda option, text: ohms(text),
    float | Literal["auto"] | None,
    lambda value: value,
    _ohms_taken,
)
ORDER_FORM = SettingForm(str, lambda option, text: text, str | int, str, _order_taken)
NUMBER_OR_WORD = SettingForm(str, lambda option, text: text, str | float, str, _written, write=str)
SIZE = SettingForm(
    str | None,
    lambda option, text: None if text is None else size_of(text),
    str | None,
    lambda text: None if text is None else size_of(text),
    _size_taken,
)
NAMES = SettingForm(str, lambda option, text: names(text), list[str], tuple, _names_taken, write=",".join)
LISTED = SettingForm(list[str] | None, lambda option, items: tuple(items or ()), list[str], tuple, _names_taken)
PATH = SettingForm(Path | None, lambda option, path: path, str | None, lambda t: Path(t) if t else None, _path_taken)
