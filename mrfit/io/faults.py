"""Faults that pydantic finds in a file, in one plain sentence: the key, the values it takes, the value there."""

import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pydantic import BaseModel, ValidationError

# What pydantic puts into a path for the members of a union
_MEMBER = re.compile(
    r"(float|int|str|bool|none|date|is-instance.*|[a-z-]*(constrained|literal|list|dict|tuple|function|lax|json)\b.*)"
)
_TAKES = {
    kind: value
    for value, kinds in {
        "a number": "float_type float_parsing",
        "a finite number": "finite_number",
        "a whole number": "int_type int_parsing int_from_float",
        "a smaller whole number": "int_parsing_size",
        "text": "string_type",
        "true or false": "bool_type bool_parsing",
        "a list": "list_type tuple_type",
        "a table": "dict_type model_type dataclass_type dataclass_exact_type model_attributes_type mapping_type",
        "nothing": "none_required",
        "a plain name of letters, digits, . _ and -": "string_pattern_mismatch",
    }.items()
    for kind in kinds.split()
}
_LIMITS = {
    "greater_than": ("above", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("below", "lt"),
    "less_than_equal": ("at most", "le"),
}


# What pydantic calls a key too many: of its own models, of dataclasses
UNKNOWN_KEYS = ("extra_forbidden", "unexpected_keyword_argument")


def plain_fault(error: "ValidationError", model: "type[BaseModel] | None" = None) -> str:
    """Return the first fault of a file in words: its key, and what is allowed there.

    Parameters
    ----------
    error
        What pydantic raised.
    model
        What a TOML file was read as, for the keys that are known where one is not; None for JSON.
    """
    faults = error.errors(include_url=False)
    unknown = next((f for f in faults if f["type"] in UNKNOWN_KEYS), None)
    if unknown is not None:
        return _unknown(unknown["loc"], model)
    key = _toml_key if model else _json_key
    path = _path(faults[0]["loc"])
    # a union fails once for each of its members
    same: list[Mapping[str, Any]] = [f for f in faults if _path(f["loc"]) == path]
    first = same[0]
    if first["type"] in ("too_short", "too_long", "missing") and isinstance(first["loc"][-1], int):
        return f"{key(path[:-1])} has too few values"
    if first["type"] == "missing":
        return f"{key(path)} is missing"
    if first["type"] in ("too_short", "too_long"):
        return f"{key(path)} has too {'few' if first['type'] == 'too_short' else 'many'} values"
    if first["type"] == "list_type" and isinstance(first["input"], dict):
        return f"{key(path)} is one table; write [[{key(path)}]] for each of several"
    takes = list(dict.fromkeys(filter(None, map(_takes, same))))
    takes = [t for t in takes if t != "a whole number" or "a number" not in takes]
    if not takes:
        text = str(first["msg"]).removeprefix("Value error, ")
        return f"{key(path)}: {text}" if path else text[:1].lower() + text[1:]
    return f"{key(path)} takes {' or '.join(takes)}, not {_shown(first['input'])}"


def _takes(fault: Mapping[str, Any]) -> str:
    """Return a description of the expected value, as in ``a number above 0``."""
    kind, context = fault["type"], fault.get("ctx", {})
    if kind == "literal_error":
        return str(context["expected"])
    if kind in _LIMITS:
        words, name = _LIMITS[kind]
        return f"a number {words} {context[name]:g}"
    return _TAKES.get(kind, "")


def _path(loc: Sequence[str | int]) -> tuple[str | int, ...]:
    """Return a path without the members of unions at its end."""
    parts = list(loc)
    while len(parts) > 1 and isinstance(parts[-1], str) and _MEMBER.fullmatch(parts[-1]):
        parts.pop()
    return tuple(parts)


def _toml_key(path: Sequence[str | int]) -> str:
    """Return a path as a reader of TOML finds it: ``[flux] rule``, ``[[fit]] 2: bounds.n``, tables counted from 1."""
    if not path:
        return "the file"
    if len(path) == 1:
        return str(path[0])
    table, *rest = path
    if isinstance(rest[0], int):
        number, *rest = rest
        # a member of a list, or a table of several
        return f"[[{table}]] {int(number) + 1}: {'.'.join(map(str, rest))}" if rest else f"{table}.{number}"
    return f"[{table}] {'.'.join(map(str, rest))}"


def _json_key(path: Sequence[str | int]) -> str:
    """Return a path as programs write it: ``recordings[0].dt``."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.removeprefix(".") or "the file"


def _unknown(path: Sequence[str | int], model: "type[BaseModel] | None") -> str:
    known = _known(path[:-1], model)
    near = get_close_matches(str(path[-1]), known, n=1)
    hint = f"; did you mean '{near[0]}'?" if near else f"; it may be one of {', '.join(known)}" if known else ""
    key = _toml_key if model else _json_key
    return f"{key(path)} is no key mrfit knows{hint}"


def _known(path: Sequence[str | int], model: "type[BaseModel] | None") -> list[str]:
    """Return the keys of the table at a path."""
    from typing import get_args

    for part in path:
        if model is None or isinstance(part, int):
            continue
        kind: Any = model.model_fields[part].annotation
        model = next((k for k in (kind, *get_args(kind)) if hasattr(k, "model_fields")), None)
    return list(model.model_fields) if model else []


def _shown(value: object) -> str:
    text = repr(value) if isinstance(value, str) else str(value)
    text = {"True": "true", "False": "false", "None": "nothing"}.get(text, text)
    return text if len(text) <= 60 else text[:57] + "…"
