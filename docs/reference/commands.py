"""The page of commands and options, of the command line itself."""

from typing import Any

import typer.main

from docs.reference.markdown import fenced, plain, table
from mrfit.cli.main import app


def commands() -> dict[str, Any]:
    """Return every command by its full name, those of groups included."""
    found: dict[str, Any] = {}
    _collect("mrfit", typer.main.get_command(app), found)
    return found


def page() -> str:
    """Return the page of all commands."""
    text = [
        "# Commands",
        "Exit codes: 0 done; 1 the data or the fit cannot be used; 2 the command line or a settings file is wrong. "
        "Every error is one line on standard error that names the file or value and what to do.",
        *(_described(name, command) for name, command in commands().items()),
    ]
    return "\n\n".join(text) + "\n"


def _collect(name: str, command: Any, found: dict[str, Any]) -> None:
    found[name] = command
    for word, one in getattr(command, "commands", {}).items():
        _collect(f"{name} {word}", one, found)


def _described(name: str, command: Any) -> str:
    about, _, example = (command.help or "").partition("Example:")
    rows = [row for p in command.params if (row := _option(p))]
    parts = [f"## {name}", plain(" ".join(about.split()))]
    if example:
        parts.append(fenced(" ".join(example.split()), "console"))
    return "\n\n".join([*parts, table(("option", "default", "meaning"), rows) if rows else ""])


def _option(param: Any) -> list[str] | None:
    text = getattr(param, "help", "") or ""
    if param.param_type_name == "argument":
        return [f"`{param.metavar or param.name.upper() + '...' * (param.nargs == -1)}`", "", plain(text)]
    if "--help" in param.opts:
        return None
    names = ", ".join(f"`{n}`" for n in param.opts)
    default = param.default
    shown = "" if default in (None, False, (), [], "") or callable(default) else f"`{default}`"
    # as many as the machine has
    return [names, "number of cores" if "--jobs" in param.opts else shown, plain(" ".join(text.split()))]
