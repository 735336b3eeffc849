"""Options of a call: the fields of the stages' settings, by name, as a notebook writes them.

An option is defined once, in the settings of its stage (``mrfit/settings``); from there it has its name, type, limits
and default here.
"""

import inspect
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from operator import index
from textwrap import wrap
from typing import Any, TypeVar, get_origin

from mrfit.core.arguments import one_line
from mrfit.core.setting import UNSET, SettingField, defined, explained, flag_of
from mrfit.errors import ConfigError
from mrfit.settings.forms import of_python

Made = TypeVar("Made")
Options = Mapping[str, object]


def settings_of(kind: type[Made], given: Options, **decided: object) -> Made:
    """Return settings of a kind with those of the given options that are its fields, and what is decided already.

    Raises
    ------
    ConfigError
        If a value is not one that the option takes.
    """
    own = {f.name: f for f in defined(kind) if f.name not in decided}
    named = canonical([kind], given)
    values = {name: _value(own[name], value) for name, value in named.items() if name in own}
    return kind(**values, **decided)


def check_names(kinds: Sequence[type[Any]], given: Options, decided: Sequence[str] = ()) -> None:
    """Refuse options that none of some settings has.

    Raises
    ------
    ConfigError
        If there is one; the message has near names.
    """
    known = [f.name for kind in kinds for f in defined(kind) if f.name not in decided]
    for name in canonical(kinds, given):
        if name not in known:
            near = get_close_matches(name, known, n=2)
            hint = f"did you mean {' or '.join(near)}?" if near else f"there are {', '.join(known)}"
            raise ConfigError(f"there is no option '{name}': {hint}")


def canonical(kinds: Sequence[type[Any]], given: Options) -> dict[str, object]:
    """Return options by the names of the fields of some settings; the command line's name of a field is one, too.

    Raises
    ------
    ConfigError
        If one is given by both names.
    """
    fields = {flag_of(f): f.name for kind in kinds for f in defined(kind)}
    found: dict[str, object] = {}
    for name, value in given.items():
        own = fields.get(name, name)
        if own in found:
            raise ConfigError(f"{' and '.join(n for n in given if fields.get(n, n) == own)} are one option: give one")
        found[own] = value
    return found


def with_options(function: Callable[..., Made], kinds: Sequence[type[Any]], decided: Sequence[str]) -> None:
    """Give a function the signature that its options have, in place of ``**options``, and explain them in its help."""
    own = inspect.signature(function)
    named = [p for p in own.parameters.values() if p.kind is not p.VAR_KEYWORD]
    more, lines = [], []
    for kind in kinds:
        texts = explained(kind)
        for f in defined(kind):
            if f.name in (*decided, *(p.name for p in named)):
                continue
            more.append(
                inspect.Parameter(f.name, inspect.Parameter.KEYWORD_ONLY, default=_default(f), annotation=f.argument)
            )
            also = f" On the command line ``{flag_of(f)}``, which is taken here too." if flag_of(f) != f.name else ""
            lines += [
                str(more[-1]),
                *wrap(texts.get(f.name, "") + also, 100, initial_indent="    ", subsequent_indent="    "),
            ]
    setattr(function, "__signature__", own.replace(parameters=[*named, *more]))  # noqa: B010
    listed = "\n".join(lines)
    function.__doc__ = f"{inspect.getdoc(function)}\n\nOptions\n-------\n{listed}\n"


def _default(field: SettingField) -> object:
    if field.default is UNSET:
        return inspect.Parameter.empty
    return {} if get_origin(field.argument) is dict else field.default


def _value(field: SettingField, value: object) -> object:
    """Return a value as its settings take it: mappings as tuples, numbers as Python's own.

    Raises
    ------
    ConfigError
        If the field does not take it.
    """
    if field.setting and field.setting.form:
        return field.setting.form.take(field.name, value)
    kinds = field.alternatives
    if value is None and field.optional or isinstance(value, bool) and bool in kinds:
        return value
    if isinstance(value, str) and (value in field.choices or str in kinds):
        return value
    for kind, taken in ((int, _whole), (float, of_python)):
        if kind in kinds and value is not None and not isinstance(value, str):
            return _within(field, taken(field.name, value))
    raise ConfigError(f"{field.name} takes {_listed(field)}, not {one_line(value)}")


def _listed(field: SettingField) -> str:
    words = " or ".join(map(repr, field.choices))
    rest = {str: "text", bool: "True or False", int: "a number", float: "a number"}
    return words or next((text for kind, text in rest.items() if kind in field.alternatives), "another value")


def _whole(name: str, value: object) -> int:
    try:
        return index(value)  # type: ignore[arg-type]
    except TypeError:
        raise ConfigError(f"{name} takes a whole number, not {one_line(value)}") from None


def _within(field: SettingField, number: float) -> float:
    """Return a number that keeps the limits of its field."""
    refusal = field.setting.refusal(field.name, number) if field.setting else ""
    if refusal:
        raise ConfigError(refusal)
    return number
