"""The project file: ``mrfit.toml`` in the current folder may hold the workspace and defaults of options.

    work = "results"
    [fit]
    model = "tanh"
    bounds = {fy = [1, 500]}

Its tables ``[flux]``, ``[segment]``, ``[fit]`` and ``[discover]`` have the keys of a pipeline file, ``[flux]`` also the
resistance. The command line and MRFIT_WORK take precedence. The same file may be a channel map.
"""

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal

from mrfit.core.setting import SettingField, defined, flag_of, key_of
from mrfit.errors import ConfigError

FILE = Path("mrfit.toml")
TABLES = ("flux", "segment", "fit", "discover")


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
        If the file cannot be read, ``work`` is no name, or a key is unknown or has a wrong value.
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
    if not FILE.exists():
        return {}
    from mrfit.io.toml_file import read_toml

    found = read_toml(FILE, "a project file or a channel map")
    if not found.keys() <= {"work", *TABLES}:
        from mrfit.ingest.meaning.channel_map import check_keys

        check_keys(FILE, found)
    return found


def unused_map(logs: Iterable[Path]) -> str:
    """Return a note where the file is a channel map and no log lies beside it; empty elsewhere."""
    # a name that no file can have is said where the logs are read
    folders = {(path if os.path.isdir(path) else path.parent).resolve() for path in logs}
    if "channels" not in _read() or Path.cwd() in folders:
        return ""
    return (
        f"  {FILE} of this folder is a channel map, but holds for logs beside it only: move it there, or --map {FILE}"
    )


def settings_of(name: str) -> Any:
    """Return the settings of a stage, ``flux`` or ``segment``, with the defaults of the project file.

    Raises
    ------
    ConfigError
        If its table has an unknown key or a wrong value.
    """
    from mrfit.cli.config import made_of

    table = _read().get(name, {})
    kind, checked = _kinds()[name], _checked(name, table)
    given = {"resistance": checked.resistance} if "resistance" in checked.model_fields_set else {}
    return made_of(kind, checked, **given)


def _kinds() -> dict[str, Any]:
    """Return the settings of every table; they are loaded where a file has one."""
    import mrfit.settings.discover
    import mrfit.settings.fit
    import mrfit.settings.flux
    import mrfit.settings.segment

    return {name: getattr(mrfit.settings, name).Settings for name in TABLES}


def _checked(name: str, table: object) -> Any:
    from pydantic import ValidationError

    from mrfit.cli.config import table_of
    from mrfit.io.faults import plain_fault

    # a pipeline file has the resistance in [ingest]
    more = {"resistance": (float | Literal["auto"] | None, None)} if name == "flux" else {}
    kind = table_of(_kinds()[name], **more)
    # the model may be left to the command line
    required = {"model": ""} if name in ("fit", "discover") else {}
    try:
        return kind.model_validate({**required, **table} if isinstance(table, dict) else table)
    except ValidationError as error:
        raise ConfigError(f"{FILE}: [{name}] {plain_fault(error, kind)}") from error


def _options(name: str, table: object) -> dict[str, object]:
    """Return the values of a table as they would be written on the command line."""
    fields = {key_of(f): f for f in defined(_kinds()[name])}
    checked = _checked(name, table)
    named = [key for key in fields if key in checked.model_fields_set and (key != "model" or checked.model)]
    return {flag_of(fields[key]): _written(fields[key], getattr(checked, key)) for key in named}


def _written(field: SettingField, value: object) -> object:
    """Return a value of TOML as the option of its field is written: NAME=VALUE or NAME=LOW:HIGH of a table."""
    form = field.setting.form if field.setting else None
    if isinstance(value, dict) and form:
        # of constants of one optimizer a table is in the table
        return [f"{name}={':'.join(map(str, rest))}" for name, *rest in form.load(value)]
    repeated = form is not None and "list" in str(form.option)
    if isinstance(value, (list, tuple)):
        return [str(v) for v in value] if repeated else ",".join(map(str, value))
    return value
