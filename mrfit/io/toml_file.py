"""Files that users write in TOML: read, and checked against their tables."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from mrfit.errors import ConfigError
from mrfit.io.faults import plain_fault


class TomlTable(BaseModel):
    """A table of such a file: unknown keys are errors, and ``true`` is no number."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    @field_validator("*", mode="before")
    @classmethod
    def _true_is_not_one(cls, value: object, info: ValidationInfo) -> object:
        kinds = set(_kinds_in(cls.model_fields[str(info.field_name)].annotation))
        if kinds & {int, float} and bool not in kinds and _holds_truth(value):
            raise PydanticCustomError("true_as_number", "true and false are no numbers")
        return value


def _holds_truth(value: object) -> bool:
    inside = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return isinstance(value, bool) or any(map(_holds_truth, inside))


def _kinds_in(annotation: object) -> Iterator[object]:
    yield type(annotation) if isinstance(annotation, int | float) else annotation
    for one in get_args(annotation):
        yield from _kinds_in(one)


Written = TypeVar("Written", bound=TomlTable)


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """Return the content of a TOML file; ``what`` it is to be is said where it cannot be read.

    Raises
    ------
    ConfigError
        If the file is missing or is no TOML; the message has the line.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror}); give the path of {what}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: is not valid TOML: {error}") from error


def read_tables(path: Path, kind: type[Written], what: str) -> Written:
    """Return the content of a TOML file, checked.

    Raises
    ------
    ConfigError
        As ``read_toml`` does, and if it holds a wrong or unknown key; the message names it.
    """
    content = read_toml(path, what)
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        raise ConfigError(f"{path}: {plain_fault(error, kind)}") from error
