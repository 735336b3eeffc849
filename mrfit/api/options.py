"""Options of a call: the fields of the stages' settings, by name, as a notebook writes them.

An option is defined once, in the settings of its stage. From there it has its name, type and default here.
"""

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, fields
from difflib import get_close_matches
from operator import index
from textwrap import wrap
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from mrfit.errors import ConfigError

Made = TypeVar("Made")
Options = Mapping[str, object]
# How the command line calls an option whose field has another name
COMMAND_NAMES = {"opt": "optimizer", "opt_set": "options", "fix": "fixed"}
# Least values of whole numbers
LEAST = {"seed": 0, "budget": 1, "jobs": 1, "seeds": 1}


def settings_of(kind: type[Made], given: Options, **decided: object) -> Made:
    """Return settings of a kind with those of the given options that are its fields, and what is decided already.

    Raises
    ------
    ConfigError
        If a value is not one that the option takes.
    """
    hints = get_type_hints(kind)
    own = {f.name for f in _fields(kind)} - decided.keys()
    values = {name: _value(name, value, hints[name]) for name, value in _canonical(given).items() if name in own}
    return kind(**values, **decided)


def check_names(kinds: Sequence[type[Any]], given: Options, decided: Sequence[str] = ()) -> None:
    """Refuse options that none of some settings has.

    Raises
    ------
    ConfigError
        If there is one; the message has near names.
    """
    known = [f.name for kind in kinds for f in _fields(kind) if f.name not in decided]
    for name in _canonical(given):
        if name not in known:
            near = get_close_matches(name, known, n=2)
            hint = f"did you mean {' or '.join(near)}?" if near else f"there are {', '.join(known)}"
            raise ConfigError(f"there is no option '{name}': {hint}")


def with_options(function: Callable[..., Made], kinds: Sequence[type[Any]], decided: Sequence[str]) -> None:
    """Give a function the signature that its options have, in place of ``**options``, and list them in its help."""
    own = inspect.signature(function)
    named = [p for p in own.parameters.values() if p.kind is not p.VAR_KEYWORD]
    more = [
        inspect.Parameter(f.name, inspect.Parameter.KEYWORD_ONLY, default=_default(f), annotation=f.type)
        for kind in kinds
        for f in _fields(kind)
        if f.name not in (*decided, *(p.name for p in named))
    ]
    setattr(function, "__signature__", own.replace(parameters=[*named, *more]))  # noqa: B010
    listed = "\n".join(wrap(", ".join(f"{p.name}={p.default!r}" for p in more), 100))
    function.__doc__ = f"{inspect.getdoc(function)}\n\nOptions and defaults\n--------------------\n{listed}\n"


def _canonical(given: Options) -> dict[str, object]:
    return {COMMAND_NAMES.get(name, name): value for name, value in given.items()}


def _fields(kind: type[Any]) -> tuple[Field[Any], ...]:
    return fields(kind)


def _default(field: Field[Any]) -> object:
    return inspect.Parameter.empty if field.default is MISSING else field.default


def _value(name: str, value: object, kind: object) -> object:
    """Return a value as its settings take it: mappings as tuples, numbers as Python's own."""
    allowed = [a for part in _alternatives(kind) if get_origin(part) is Literal for a in get_args(part)]
    if name == "bounds":
        return _limits(name, value)
    if name in ("start", "fixed", "options"):
        return _numbers(name, value)
    if name == "current_order":
        pairs = value.items() if isinstance(value, Mapping) else None
        return str(value) if pairs is None else ",".join(f"{n}={order}" for n, order in pairs)
    if isinstance(value, str) or value is None:
        if value not in allowed and not {str, type(value)} & set(_alternatives(kind)):
            raise ConfigError(f"{name} takes {_listed(kind, allowed)}, not {value!r}")
        return value
    if name in LEAST:
        return _whole(name, value)
    if float in _alternatives(kind):
        return _number(name, value)
    return value


def _alternatives(kind: object) -> tuple[object, ...]:
    parts = get_args(kind) if get_origin(kind) is not Literal else ()
    return parts or (kind,)


def _listed(kind: object, allowed: Sequence[object]) -> str:
    return " or ".join(map(repr, allowed)) or "a number"


def _whole(name: str, value: object) -> int:
    try:
        number = index(value)  # type: ignore[arg-type]
    except TypeError:
        raise ConfigError(f"{name} takes a whole number, not {value!r}") from None
    if number < LEAST[name]:
        raise ConfigError(f"{name} takes {LEAST[name]} or more, not {number}")
    return number


def _number(name: str, value: object) -> float:
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise ConfigError(f"{name} takes a number, not {value!r}") from None
    if not math.isfinite(number):
        raise ConfigError(f"{name}: {value!r} is not finite")
    return number


def _numbers(name: str, value: object) -> tuple[tuple[str, float], ...]:
    if not isinstance(value, Mapping):
        raise ConfigError(f"{name} takes a dictionary of names and numbers, not {value!r}")
    return tuple((str(n), _number(f"{name} {n}", v)) for n, v in value.items())


def _limits(name: str, value: object) -> tuple[tuple[str, float, float], ...]:
    if not isinstance(value, Mapping):
        raise ConfigError(f"{name} takes a dictionary of names and (low, high), not {value!r}")
    found = []
    for parameter, ends in value.items():
        if not (isinstance(ends, Sequence) and not isinstance(ends, str) and len(ends) == 2):
            raise ConfigError(f"{name} {parameter} takes (low, high), not {ends!r}")
        low, high = (_number(f"{name} {parameter}", end) for end in ends)
        found.append((str(parameter), low, high))
    return tuple(found)
