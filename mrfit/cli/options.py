"""Options of commands: those that settings classes define, and those that belong to the command line alone."""

import inspect
import math
import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, is_dataclass
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, Literal, Union, cast, get_args, get_origin, get_type_hints

import typer

from mrfit.cli import console, logbook, names
from mrfit.core.setting import UNSET, Setting, SettingField, defined, defined_as, flag_of
from mrfit.errors import ConfigError
from mrfit.settings.shared import CORES as CORES

# Before a command loads numpy: matrices are small here, and threads of BLAS would wait for each other beside --jobs
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@dataclass(frozen=True)
class Default:
    """Default of an option of several commands."""

    value: object


@dataclass(frozen=True)
class Only:
    """Fields of its settings that are options of a command; the others are at their defaults."""

    fields: tuple[str, ...]


def _use(paths: list[Path] | None) -> list[Path] | None:
    """Run plug-in files before the command, so that their items are known to it by name."""
    if paths:
        from mrfit.core import plugins

        for path in paths:
            plugins.use(path)
    return paths


WORK = Path("mrfit-work")
Work = Annotated[Path, typer.Option("--work", help="Workspace folder.", envvar="MRFIT_WORK"), Default(WORK)]
JSON_OPTION = Annotated[
    bool, typer.Option("--json", help="Print a machine-readable summary, alone, to standard output.")
]
QUIET_OPTION = Annotated[bool, typer.Option("--quiet", "-q", help="Print one line.")]
VERBOSE_OPTION = Annotated[
    bool, typer.Option("--verbose", "-v", help="Print every step and its time to standard error.")
]
PLUGINS_OPTION = Annotated[
    list[Path] | None,
    typer.Option(
        "--plugin",
        metavar="FILE",
        help="Plug-in with models, effects, optimizers or readers of your own; always: in MRFIT_PLUGINS.",
        callback=_use,
        show_default=False,
    ),
]
On = Annotated[
    str,
    typer.Option(
        "--on",
        metavar="ADDRESS",
        help="Dask scheduler that has the work done, as tcp://10.0.0.5:8786; does not change the result.",
        envvar="MRFIT_ON",
        show_default=False,
    ),
]
Shared = Annotated[
    bool,
    typer.Option("--shared", help="The scheduler's workers see the same paths as this command: no log is sent."),
]
Logs = Annotated[list[Path], typer.Argument(help="Log files, or folders of them.", show_default=False)]
ReadLogs = Annotated[list[Path], typer.Argument(help="Logs or folders of logs.", show_default=False)]
FinishedFit = Annotated[
    str, typer.Option("--fit", help="Name of a finished fit.", show_default=False, autocompletion=names.fit)
]
SetOfCondition = Annotated[str, typer.Option(help="Whose parameters, of a fit with several sets.")]
DataSet = Annotated[str, typer.Argument(help="Data set to fetch; without it all are listed.", show_default=False)]
Folder = Annotated[Path | None, typer.Option("--to", help="Folder for the files; default: one of the set's name.")]
Catalog = Annotated[Path | None, typer.Option("--catalog", help="Catalog (TOML) of your own instead of mrfit's.")]


def send(on: str, shared: bool) -> None:
    """Have the work of a command done by the workers of a scheduler, if one was named.

    Raises
    ------
    ConfigError
        If the paths of no scheduler are said to be shared, or dask.distributed is not installed.
    """
    if shared and not on:
        raise ConfigError("--shared says that the workers of --on ADDRESS see the same paths; give --on too")
    if on:
        from mrfit.core.executors import order

        order.use(on, shared)


class CommandAnswer:
    """Result of a command, the function that prints it for a person, and further arguments of this function."""

    def __init__(
        self, result: object, show: Callable[..., object], *more: object, check: Callable[[Any], None] | None = None
    ) -> None:
        self.result, self.show, self.more, self.check = result, show, more, check

    def give(self) -> None:
        """Print the result, as JSON alone or for a person; raise what ``check`` finds wrong in it."""
        console.print_json(self.result) if console.VERBOSITY.as_json else self.show(self.result, *self.more)
        if self.check:
            self.check(self.result)


Command = Callable[..., CommandAnswer | None]


def options(*, plugins: bool = True, sends: bool = False) -> Callable[[Command], Callable[..., None]]:
    """Give a command the options that its parameters define, in place of these, and print its answer.

    ``plugins`` says that it takes plug-ins, ``sends`` that a scheduler can do its work. A parameter ``progress`` is a
    listener that draws bars, or prints lines in a pipe.

    A parameter that is a settings class becomes the options of its fields, or of ``Only`` some; one with a ``Setting``
    in its annotation becomes an option; one with a ``Default`` has that default. Options that change no result come
    after all others but those of several commands.
    """
    return lambda command: _with_options(command, plugins, sends)


def _with_options(command: Command, plugins: bool, sends: bool) -> Callable[..., None]:
    taken = _Parameters([], [], [])
    hints = get_type_hints(command, include_extras=True)
    given = {name: p.default for name, p in inspect.signature(command).parameters.items() if name != "progress"}
    if sends:
        taken.common.extend([_keyword("on", "", On), _keyword("shared", False, Shared)])
    for name, written in given.items():
        fields = _fields(name, hints[name], written)
        for field in fields:
            (taken.own if field.setting and field.setting.changes_result else taken.late).append(_option(field))
        if not fields:
            default = next((a for a in get_args(hints[name]) if isinstance(a, Default)), None)
            chosen = default.value if default and written is inspect.Parameter.empty else written
            (taken.common if default else taken.own).append(_keyword(name, chosen, hints[name]))
    taken.common.extend([_keyword("plugins", None, PLUGINS_OPTION)] if plugins else [])
    taken.common.extend(_keyword(*one) for one in (("as_json", False, JSON_OPTION), ("quiet", False, QUIET_OPTION)))
    taken.common.append(_keyword("verbose", False, VERBOSE_OPTION))

    @wraps(command)
    def called(**values: Any) -> None:
        set_verbosity(values.pop("quiet"), values.pop("verbose"))
        console.VERBOSITY.as_json = values.pop("as_json")
        started = time.monotonic()
        if sends:
            send(values.pop("on"), values.pop("shared"))
        arguments = {name: _argument(name, hints[name], written, values) for name, written in given.items()}
        with _told_of_replaced(command.__name__):
            if "progress" in hints:
                with console.progress_bar() as arguments["progress"]:
                    answer = command(**arguments)
            else:
                answer = command(**arguments)
            if answer:
                answer.give()
        seconds = time.monotonic() - started
        console.finish()
        if console.VERBOSITY.verbose:
            console.note(f"{seconds:.1f} s")
        reads_only = values.get("preview") or values.get("suggest_map") or values.get("save") == ""
        if command.__name__ in logbook.WRITING and values.get("work") and not reads_only:
            logbook.append(values["work"], seconds)

    called.__signature__ = inspect.Signature(taken.all)  # type: ignore[attr-defined]
    called.__annotations__ = {p.name: p.annotation for p in taken.all}
    return called


def _keyword(name: str, default: object, annotation: object) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


@contextmanager
def _told_of_replaced(command: str) -> Iterator[None]:
    """List the files that a command has replaced by other content, where it names them by what they show."""
    if command not in logbook.COMMANDS_NAMED:
        yield
        return
    # help and completion load no file system code
    from mrfit.io.replaced import replaced_files

    with replaced_files() as found:
        yield
    if found:
        console.note(f"  replaced, other content before: {', '.join(map(str, found))}")


def set_verbosity(quiet: bool, verbose: bool) -> None:
    """Set the amount of a command's output.

    Raises
    ------
    ConfigError
        If it is to print less and more.
    """
    if quiet and verbose:
        raise ConfigError("give --quiet or --verbose, not both")
    shown = console.VERBOSITY
    shown.quiet, shown.verbose, shown.last, shown.concluded = quiet, verbose, "", False


@dataclass(frozen=True)
class _Parameters:
    """Options of a command: its own, those that change no result, those of several commands."""

    own: list[inspect.Parameter]
    late: list[inspect.Parameter]
    common: list[inspect.Parameter]

    @property
    def all(self) -> list[inspect.Parameter]:
        return [*self.own, *self.late, *self.common]


def _fields(name: str, hint: Any, written: object) -> list[SettingField]:
    """Return the fields that a parameter of a command stands for; none where typer reads it as it is."""
    kind, *said = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    if is_dataclass(kind):
        only = next((one.fields for one in said if isinstance(one, Only)), None)
        return [f for f in defined(cast(type, kind)) if f.setting and (only is None or f.name in only)]
    field = defined_as(name, hint, UNSET if written is inspect.Parameter.empty else written)
    return [field] if field.setting else []


def _argument(name: str, hint: Any, written: object, values: Mapping[str, Any]) -> object:
    """Return the argument for one parameter of a command, from the values of its options."""
    fields = _fields(name, hint, written)
    if not fields:
        return _finite(name, hint, values[name])
    found = {f.name: value_of(f, values[flag_of(f)]) for f in fields}
    kind: Any = get_args(hint)[0] if get_origin(hint) is Annotated else hint
    return kind(**found) if is_dataclass(kind) else found[name]  # type: ignore[operator]


def _finite(name: str, hint: Any, value: object) -> object:
    """Return the value of an option that typer alone reads.

    Raises
    ------
    ConfigError
        If it is a number that is not finite.
    """
    if isinstance(value, float) and not math.isfinite(value):
        declared = [d for one in get_args(hint) for d in getattr(one, "param_decls", None) or ()]
        raise ConfigError(Setting("").refusal((declared or [f"--{name.replace('_', '-')}"])[0], value))
    return value


def value_of(field: SettingField, written: Any) -> Any:
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
    # typer keeps the other limits itself
    refusal = field.setting.refusal(option, written) if field.setting and isinstance(written, (int, float)) else ""
    if refusal:
        raise ConfigError(refusal)
    return written


def _option(field: SettingField) -> inspect.Parameter:
    """Return the option of a field as a parameter that typer reads."""
    setting = field.setting or Setting("")
    flag = flag_of(field)
    # the name that Python has of it is one, too
    words = dict.fromkeys([flag, field.name])
    names = [*(f"--{word.replace('_', '-')}" for word in words), *([setting.short] if setting.short else [])]
    kind: Any = _written_as(field)
    annotation = Annotated[kind, _typer_option(setting, *names)]
    return _keyword(flag, _default(field), annotation)


def _typer_option(setting: Setting, *written: str) -> Any:
    return typer.Option(
        *written,
        help=setting.help,
        metavar=setting.metavar,
        min=setting.low if setting.above is None else setting.above,
        max=setting.high,
        show_default=setting.show_default,
        autocompletion=names.OF.get(setting.names),
    )


def _written_as(field: SettingField) -> Any:
    """Return the type of an option: text for words, the field's own elsewhere."""
    if field.setting and field.setting.form:
        return field.setting.form.option
    if not field.choices:
        return field.kind
    rest = tuple(a for a in field.alternatives if get_origin(a) is not Literal)
    return Union[(str, *rest)] if rest else str


def _default(field: SettingField) -> object:
    setting = field.setting or Setting("")
    if setting.command_default is not UNSET:
        return setting.command_default
    if field.default is UNSET:
        return inspect.Parameter.empty
    return setting.form.write(field.default) if setting.form else field.default


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
