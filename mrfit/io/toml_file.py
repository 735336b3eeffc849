"""Files that users write in TOML: read, and checked against their tables."""

import tomllib
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from mrfit.errors import ConfigError
from mrfit.io.faults import plain_fault


class TomlTable(BaseModel):
    """A table of such a file: unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)


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
