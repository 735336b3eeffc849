"""Options of commands: those that settings classes define, and those that belong to the command line alone."""

import inspect
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, is_dataclass
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import typer

from mrfit.core.setting import UNSET, Defined, Setting, defined, defined_as, flag_of
from mrfit.errors import ConfigError
from mrfit.settings.shared import CORES as CORES

# Before a command loads numpy: matrices are small here, and threads of BLAS would wait for each other beside --jobs
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@dataclass(frozen=True)
class Default:
    """What an option of several commands is where it is not written."""

    value: object


def _use(paths: list[Path] | None) -> list[Path] | None:
    """Run plug-in files before the command, so that their items are known to it by name."""
    if paths:
        from mrfit.core import plugins

        for path in paths:
            plugins.use(path)
    return paths


WORK = Path("mrfit-work")
Work = Annotated[Path, typer.Option("--work", help="Workspace folder.", envvar="MRFIT_WORK"), Default(WORK)]
Json = Annotated[
    bool,
    typer.Option("--json", help="Print a machine-readable summary, alone, to standard output."),
    Default(False),
]
Plugins = Annotated[
    list[Path] | None,
    typer.Option(
        "--plugin",
        metavar="FILE",
        help="Plug-in with models, effects, optimizers or readers of your own; always: in MRFIT_PLUGINS.",
        callback=_use,
        show_default=False,
    ),
    Default(None),
]
Logs = Annotated[list[Path], typer.Argument(help="Log files, or folders of them.", show_default=False)]
DataSet = Annotated[str, typer.Argument(help="Data set to fetch; without it all are listed.", show_default=False)]
Folder = Annotated[Path | None, typer.Option("--to", help="Folder for the files; default: one of the set's name.")]
Catalog = Annotated[Path | None, typer.Option("--catalog", help="Catalog (TOML) of your own instead of mrfit's.")]


def options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options that its parameters define, in place of these.

    A parameter that is a settings class becomes the options of its fields; one with a ``Setting`` in its annotation
    becomes an option; one with a ``Default`` has that default. Options that change no result come after all others but
    those of several commands.
    """
    hints = get_type_hints(command, include_extras=True)
    given = inspect.signature(command).parameters
    own: list[inspect.Parameter] = []
    late: list[inspect.Parameter] = []
    common: list[inspect.Parameter] = []
    for name, hint in _arguments(hints, given):
        written = given[name].default
        if is_dataclass(hint):
            for field in _offered(hint):
                (own if field.setting.changes_result else late).append(_option(field))  # type: ignore[union-attr]
        elif (field := defined_as(name, hint, UNSET if written is inspect.Parameter.empty else written)).setting:
            (own if field.setting.changes_result else late).append(_option(field))
        else:
            default = next((a for a in get_args(hint) if isinstance(a, Default)), None)
            chosen = default.value if default and written is inspect.Parameter.empty else written
            parameter = inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=chosen, annotation=hint)
            (common if default else own).append(parameter)
    taken = [*own, *late, *common]

    @wraps(command)
    def called(**values: Any) -> None:
        command(**{name: _argument(name, hint, given[name].default, values) for name, hint in _arguments(hints, given)})

    called.__signature__ = inspect.Signature(taken)  # type: ignore[attr-defined]
    called.__annotations__ = {p.name: p.annotation for p in taken}
    return called


def _arguments(hints: Mapping[str, Any], given: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    return ((name, hints[name]) for name in given)


def _offered(kind: Any) -> list[Defined]:
    return [field for field in defined(kind) if field.setting]


def _argument(name: str, hint: Any, written: object, values: Mapping[str, Any]) -> object:
    """Return what a command gets for one of its parameters, of the values of its options."""
    if is_dataclass(hint):
        kind: Any = hint
        return kind(**{f.name: value_of(f, values[flag_of(f)]) for f in _offered(hint)})
    field = defined_as(name, hint, written)
    return value_of(field, values[flag_of(field)]) if field.setting else values[name]


def value_of(field: Defined, written: Any) -> Any:
    """Return the value of a field whose option was written so.

    Raises
    ------
    ConfigError
        If the field does not take it.
    """
    option = f"--{flag_of(field).replace('_', '-')}"
    if field.setting and field.setting.form:
        return field.setting.form.parse(option, written)
    if field.choices and written is not None:
        return choice(option, written, field.choices)
    return written


def _option(field: Defined) -> inspect.Parameter:
    """Return the option of a field as a parameter that typer reads."""
    setting = field.setting or Setting("")
    flag = flag_of(field)
    names = [f"--{flag.replace('_', '-')}", *([setting.short] if setting.short else [])]
    kind: Any = _written_as(field)
    annotation = Annotated[kind, _typer_option(setting, *names)]
    return inspect.Parameter(flag, inspect.Parameter.KEYWORD_ONLY, default=_default(field), annotation=annotation)


def _typer_option(setting: Setting, *names: str) -> Any:
    return typer.Option(
        *names,
        help=setting.help,
        metavar=setting.metavar,
        min=setting.low if setting.above is None else setting.above,
        max=setting.high,
        show_default=setting.show_default,
    )


def _written_as(field: Defined) -> Any:
    """Return the type of an option: text for words, the field's own elsewhere."""
    if field.setting and field.setting.form:
        return field.setting.form.option
    if not field.choices:
        return field.kind
    rest = tuple(a for a in field.alternatives if get_origin(a) is not Literal)
    return Union[(str, *rest)] if rest else str


def _default(field: Defined) -> object:
    setting = field.setting or Setting("")
    if setting.command_default is not UNSET:
        return setting.command_default
    if field.default is UNSET:
        return inspect.Parameter.empty
    return setting.form.nothing if setting.form and not field.default else field.default


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
