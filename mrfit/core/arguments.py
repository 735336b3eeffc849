"""Types of the arguments of public functions, checked where they are called."""

import builtins
import inspect
import math
import re
import sys
from collections.abc import Callable, Iterable, Mapping
from functools import cache, wraps
from operator import index
from types import UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from mrfit.errors import ConfigError

MADE_BY = {
    "Recording": "; make a recording by mrfit.read or mrfit.Recording.from_frame",
    "DataFrame": "; give a pandas.DataFrame, as by to_frame() or to_pandas()",
    "FitResult": "; make a fit by mrfit.fit or mrfit.load",
}
"""Word of an annotation -> what is said of where such a value comes from."""
LONGEST_VALUE = 200
"""Characters of a value that a message shows at most."""
Called = TypeVar("Called", bound=Callable[..., Any])


class _Names(dict[str, Any]):
    """Names of annotations; one that is imported for type checkers alone is mrfit's or pandas's, or says nothing."""

    def __missing__(self, name: str) -> Any:
        if name == "DataFrame":
            from pandas import DataFrame

            return DataFrame
        return getattr(sys.modules["mrfit"], name, Any)


def check_arguments(called: Called) -> Called:
    """Return a function, or a class, that refuses values of another type, or beyond the limits, of its annotations.

    A number has to be finite.

    Raises
    ------
    ConfigError
        When it is called with such a value; the message says the argument and what it takes.
    """
    if isinstance(called, type):
        called.__init__ = check_arguments(called.__init__)  # type: ignore[misc]
        return called
    signature = inspect.signature(called)
    hints = cache(
        lambda: get_type_hints(called, None, _Names(vars(builtins) | called.__globals__), include_extras=True)
    )

    @wraps(called)
    def checked(*values: Any, **named: Any) -> Any:
        for name, value in signature.bind(*values, **named).arguments.items():
            of = signature.parameters[name]
            if of.kind is not of.VAR_KEYWORD and not is_of(value, hints().get(name, Any)):
                takes = re.sub(r"'|\w+\.", "", inspect.formatannotation(of.annotation))
                made = "".join(text for word, text in MADE_BY.items() if word in takes)
                raise ConfigError(f"{name} takes {takes}, not {one_line(value)}{made}")
            if refusal := _refusal(name, value, hints().get(name, Any)):
                raise ConfigError(refusal)
        return called(*values, **named)

    return checked  # type: ignore[return-value]


def _refusal(name: str, value: Any, hint: Any) -> str:
    """Return the refusal of a number that is not finite, or breaks a ``Setting`` of its annotation; else empty."""
    kind, *said = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    if float not in (kind, *get_args(kind)) or isinstance(value, bool) or not _is_number(value, float):
        return ""
    if not math.isfinite(value):
        return f"{name} takes a finite number, not {one_line(value)}"
    return next((text for one in said if hasattr(one, "refusal") and (text := one.refusal(name, float(value)))), "")


def one_line(value: object) -> str:
    """Return a value as Python writes it, on one line of at most 200 characters."""
    text = " ".join(repr(value).split())
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]}…"


def is_of(value: object, kind: Any) -> bool:  # noqa: PLR0911
    """Return whether a value may stand for an annotation; a number is whatever Python takes for one, but no text."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return is_of(value, parts[0])
    if origin in (Union, UnionType):
        return any(is_of(value, part) for part in parts)
    if origin is Literal:
        return isinstance(value, (str, int)) and value in parts
    if kind in (float, int):
        return _is_number(value, kind)
    if kind is str:
        return isinstance(value, str) and "\0" not in value  # no name, path or unit has one
    if kind is bool:
        return type(value).__name__ in ("bool", "bool_")  # numpy's too
    plain = origin or kind
    if plain is tuple and Ellipsis not in parts:
        return isinstance(value, (tuple, list)) and len(value) == len(parts) and all(map(is_of, value, parts))
    if not isinstance(plain, type) or plain is Any or plain.__name__ == "ndarray":
        return True
    if issubclass(plain, Iterable) and parts:
        return _holds(value, plain, parts)
    return isinstance(value, plain)


def _is_number(value: Any, kind: type) -> bool:
    if isinstance(value, (str, bytes, bytearray)):
        return False
    try:
        index(value) if kind is int else float(value)
    except (TypeError, ValueError, OverflowError):
        return False
    return True


def _holds(value: object, kind: type, parts: tuple[Any, ...]) -> bool:
    """Return whether a value is a mapping, or a row of values, of a kind and what it holds is of its parts."""
    if issubclass(kind, Mapping):
        return isinstance(value, Mapping) and all(is_of(k, parts[0]) and is_of(v, parts[1]) for k, v in value.items())
    try:
        # a stream is read once, by what it is given to
        held = [] if iter(value) is value else list(value)  # type: ignore[call-overload]
    except TypeError:
        return False
    return not isinstance(value, (str, bytes, bytearray, memoryview)) and all(is_of(one, parts[0]) for one in held)
