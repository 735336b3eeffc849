"""Options that several commands share, and how their text becomes values."""

import os
from pathlib import Path
from typing import Annotated, Literal

import typer

from mrfit.errors import ConfigError

Work = Annotated[Path, typer.Option("--work", help="Workspace folder.", envvar="MRFIT_WORK")]
Json = Annotated[bool, typer.Option("--json", help="Print a machine-readable summary, alone, to standard output.")]
Jobs = Annotated[int, typer.Option("--jobs", "-j", min=1, help="Workers; does not change the result.")]
Resistance = Annotated[
    str | None,
    typer.Option(
        "--resistance",
        help="Coil resistance in ohm, or 'auto' to estimate it; later commands of the workspace keep it.",
        metavar="OHM|auto",
    ),
]
Map = Annotated[Path | None, typer.Option("--map", help="Channel map (TOML); default: mrfit.toml beside the log.")]
Pattern = Annotated[
    str | None,
    typer.Option(
        "--pattern",
        help="Conditions in file names, as '{frequency:Hz}Hz-{current:A}A', of any quantity; * is any text.",
        metavar="PATTERN",
        show_default=False,
    ),
]
Logs = Annotated[list[Path], typer.Argument(help="Log files, or folders of them.", show_default=False)]
MaxMemory = Annotated[
    str | None,
    typer.Option(
        "--max-memory",
        help="Most memory that a log may take once unpacked, as 500MB or 2GB; default: half of what is free.",
        metavar="SIZE",
        show_default=False,
    ),
]
CurrentOrder = Annotated[
    str,
    typer.Option(
        help="Order 0-4 of parameters in current, for all or by name; 1:0.2:2 is order 1 to 0.2 A and 2 from there, "
        "meeting, 1/0.2/2 lets them jump.",
        metavar="auto|ORDER|NAME=ORDER,…",
    ),
]
Stall = Annotated[
    float,
    typer.Option(help="Share of a global search without progress that ends it; 1: none does.", min=0.01, max=1.0),
]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Seed of every random choice.")]
Budget = Annotated[int | None, typer.Option("--budget", min=1, help="Evaluations for each set of parameters.")]
Seconds = Annotated[float | None, typer.Option("--seconds", min=0.0, help="Time limit for each set of parameters.")]
Weight = Annotated[str, typer.Option("--weight", help="none; floor: conditions by their noise; range: alike.")]
Bounds = Annotated[list[str] | None, typer.Option("--bounds", metavar="NAME=LOW:HIGH", help="Change bounds.")]
Start = Annotated[list[str] | None, typer.Option("--start", metavar="NAME=VALUE", help="Change a start value.")]
Fix = Annotated[list[str] | None, typer.Option("--fix", metavar="NAME=VALUE", help="Hold a parameter.")]
OptSet = Annotated[
    list[str] | None,
    typer.Option(
        "--opt-set",
        metavar="NAME=VALUE,…",
        help="Constants of the optimizers, as b=1.2,population=40, of one by mwoa.b=1.2; `mrfit show mwoa` lists them.",
    ),
]
Only = Annotated[str, typer.Option(help="Segments by peak velocity or by condition.", metavar="LMH|MH|PATTERN")]


def _use(paths: list[Path] | None) -> list[Path] | None:
    """Run plug-in files before the command, so that their items are known to it by name."""
    if paths:
        from mrfit.core import plugins

        for path in paths:
            plugins.use(path)
    return paths


Plugins = Annotated[
    list[Path] | None,
    typer.Option(
        "--plugin",
        metavar="FILE",
        help="Plug-in with models, effects, optimizers or readers of your own; always: in MRFIT_PLUGINS.",
        callback=_use,
        show_default=False,
    ),
]
DataSet = Annotated[str, typer.Argument(help="Data set to fetch; without it all are listed.", show_default=False)]
Folder = Annotated[Path | None, typer.Option("--to", help="Folder for the files; default: one of the set's name.")]
Catalog = Annotated[Path | None, typer.Option("--catalog", help="Catalog (TOML) of your own instead of mrfit's.")]
WORK = Path("mrfit-work")
CORES = os.cpu_count() or 1
# Before a command loads numpy: matrices are small here, and threads of BLAS would wait for each other beside --jobs
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
WEIGHTS = ("none", "floor", "range")


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


def pairs(option: str, items: list[str] | None) -> list[tuple[str, str]]:
    """Split NAME=VALUE items of a repeated option.

    Raises
    ------
    ConfigError
        If an item has no equals sign.
    """
    split = [item.partition("=") for item in items or []]
    for name, sign, value in split:
        if not (name and sign and value):
            raise ConfigError(f"{option} takes NAME=VALUE, not '{name}{sign}{value}'")
    return [(name.strip(), value.strip()) for name, _, value in split]


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
    if value != value or value in (float("inf"), float("-inf")):
        raise ConfigError(f"{option}: '{text}' is not finite")
    return value


def numbers(option: str, items: list[str] | None) -> tuple[tuple[str, float], ...]:
    """Return NAME=VALUE items of a repeated option with their numbers.

    Raises
    ------
    ConfigError
        If an item has no equals sign, or no number.
    """
    return tuple((name, number(option, value)) for name, value in pairs(option, items))


def constants(items: list[str] | None) -> tuple[tuple[str, float], ...]:
    """Return the NAME=VALUE,… items of ``--opt-set`` with their numbers.

    Raises
    ------
    ConfigError
        If one has no equals sign, or no number.
    """
    return numbers("--opt-set", [one for item in items or [] for one in item.split(",")])


def limits(items: list[str] | None) -> tuple[tuple[str, float, float], ...]:
    """Return the NAME=LOW:HIGH items of ``--bounds`` with their numbers.

    Raises
    ------
    ConfigError
        If an item has no equals sign, or not two numbers.
    """
    found = []
    for name, value in pairs("--bounds", items):
        low, colon, high = value.partition(":")
        if not colon:
            raise ConfigError(f"--bounds takes NAME=LOW:HIGH, not '{name}={value}'")
        found.append((name, number("--bounds", low), number("--bounds", high)))
    return tuple(found)


def choice(option: str, value: str, allowed: tuple[str, ...]) -> str:
    """Return ``value`` if it is allowed.

    Raises
    ------
    ConfigError
        If it is not; the message lists what is.
    """
    if value not in allowed:
        raise ConfigError(f"{option} takes {' or '.join(allowed)}, not '{value}'")
    return value
