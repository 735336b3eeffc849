"""Check the items of a plug-in file: ``python -m mrfit.contracts FILE.py``; exit code 1 if one breaks its contract."""

from mrfit.core import current_folder

# before anything is imported that may lie there
current_folder.leave_out()

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from mrfit.cli import console
from mrfit.contracts import effects, models, optimizers, readers
from mrfit.contracts.check import Check, applying, broken
from mrfit.core import plugins, registry, temporary
from mrfit.core.built_in import Kind
from mrfit.io.atomic import accessing

_CHECKS: dict[str, Sequence[Check[Any]]] = {
    "model": models.MODEL_CHECKS,
    "effect": effects.EFFECT_CHECKS,
    "optimizer": optimizers.OPTIMIZER_CHECKS,
}
app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


@app.command()
def contracts(
    files: Annotated[list[Path], typer.Argument(help="Plug-in files, Python or TOML.", show_default=False)],
    logs: Annotated[list[Path] | None, typer.Option("--log", help="Log that a reader in them reads.")] = None,
) -> int:
    """Check the models, effects, optimizers and readers of plug-in files against what each kind has to keep."""
    before = {(p.kind, p.name) for p in plugins.of_files()}
    for file in files:
        plugins.use(file)
    wrong = 0
    for plugin in plugins.of_files():
        if (plugin.kind, plugin.name) in before:
            continue
        console.say(f"{plugin.kind} {plugin.name} ({plugin.where})")
        results = of_reader(plugin.name, logs or []) if plugin.kind == "reader" else of_item(plugin.kind, plugin.name)
        told = set[str]()
        for text, fault in results:
            shown = "(as above)" if fault in told else fault
            console.say(f"  BROKEN  {text} {shown}" if fault else f"  holds   {text}")
            wrong += bool(fault)
            told.add(fault)
        if plugin.kind == "reader" and not logs:
            console.say("  not checked on a log: name one with --log")
    console.say(f"{wrong} broken" if wrong else "all hold")
    return int(wrong > 0)


def of_item(kind: Kind, name: str) -> Iterator[tuple[str, str]]:
    """Yield the checks of a model, effect or optimizer, each with its fault, or nothing."""
    item = registry.load(kind, name)
    return ((check.text, broken(check, item)) for check in applying(_CHECKS[kind], item))


def of_reader(name: str, logs: Sequence[Path]) -> Iterator[tuple[str, str]]:
    """Yield the checks of a reader on each log, with their faults, or nothing."""
    reader = registry.load("reader", name)
    cases = [(log.name, _content(log)) for log in logs] or [("", b"")]
    for log, data in cases:
        for check in readers.READER_CHECKS:
            with temporary.folder("contracts") as folder:
                case = readers.Case(reader, folder, log, data)
                if check.applies(case):
                    yield check.text + (f" [{log}]" if log else ""), broken(check, case)


def _content(log: Path) -> bytes:
    with accessing(log, "; give the path of a log", "cannot be read"):
        return log.read_bytes()


if __name__ == "__main__":
    console.run(app)
