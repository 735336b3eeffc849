"""The project file: ``mrfit.toml`` in the current folder may hold the workspace and defaults of options.

    work = "results"
    [fit]
    model = "tanh"
    bounds = {fy = [1, 500]}

Its tables ``[fit]`` and ``[discover]`` have the keys of a pipeline file. What the command line or MRFIT_WORK says goes
before. The same file may be a channel map.
"""

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from mrfit.core.setting import Defined, defined, flag_of, key_of
from mrfit.errors import ConfigError

FILE = Path("mrfit.toml")
TABLES = ("fit", "discover")


def defaults(commands: Iterable[str], groups: Mapping[str, Iterable[str]]) -> dict[str, Any]:
    """Return the defaults of options by command, as click takes them.

    Parameters
    ----------
    commands
        Names of all commands.
    groups
        Names of the commands of each group of commands.

    Raises
    ------
    ConfigError
        If ``work`` is no name, or a table has an unknown key or a wrong value.
    """
    found = _read()
    work = found.get("work", "")
    if not isinstance(work, str):
        raise ConfigError(f'{FILE}: work takes the name of a folder, not {work!r}; write work = "results"')
    given: dict[str, Any] = {name: {"work": work} if work else {} for name in commands}
    for name, inner in groups.items():
        given[name] = {one: given[name] for one in inner}
    for name in TABLES:
        if name in found:
            given[name] = {**given[name], **_options(name, found[name])}
    return given


def _read() -> dict[str, Any]:
    try:
        return tomllib.loads(FILE.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
        # what is wrong with it is said where it is read as a channel map
        return {}


def _options(name: str, table: object) -> dict[str, object]:
    """Return the values of a table as they would be written on the command line."""
    from pydantic import ValidationError

    import mrfit.settings.discover
    import mrfit.settings.fit
    from mrfit.cli.config import table_of
    from mrfit.io.faults import plain_fault

    settings = {"fit": mrfit.settings.fit.Settings, "discover": mrfit.settings.discover.Settings}[name]
    fields = {key_of(f): f for f in defined(settings)}
    # the model may be left to the command line
    given = {"model": "", **table} if isinstance(table, dict) else table
    try:
        checked: Any = table_of(settings).model_validate(given)
    except ValidationError as error:
        raise ConfigError(f"{FILE}: [{name}] {plain_fault(error, table_of(settings))}") from error
    named = [key for key in fields if key in checked.model_fields_set and (key != "model" or checked.model)]
    return {flag_of(fields[key]): _written(fields[key], getattr(checked, key)) for key in named}


def _written(field: Defined, value: object) -> object:
    """Return a value of TOML as the option of its field is written: NAME=VALUE or NAME=LOW:HIGH of a table."""
    if isinstance(value, dict):
        return [f"{n}={':'.join(map(str, v)) if isinstance(v, (list, tuple)) else v}" for n, v in value.items()]
    repeated = field.setting is not None and field.setting.form is not None and "list" in str(field.setting.form.option)
    if isinstance(value, (list, tuple)):
        return [str(v) for v in value] if repeated else ",".join(map(str, value))
    return value
