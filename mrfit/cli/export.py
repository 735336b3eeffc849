"""The command that takes a fit out of the tool."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import mrfit.settings.export
from mrfit.cli import console
from mrfit.cli.options import CommandAnswer, FinishedFit, SetOfCondition, Work, options
from mrfit.core.counting import few
from mrfit.core.progress import Progress
from mrfit.errors import DataError

if TYPE_CHECKING:
    from mrfit.io.schemas.export import Exported

To = Annotated[
    list[str],
    typer.Option(
        "--to",
        metavar="c|fmu|json|lookup|matlab|modelica|ssv",
        help="Formats, by commas.",
        show_default=False,
    ),
]


FILES_SHOWN = 4


@options()
def export(
    fit_name: FinishedFit,
    to: To,
    *,
    out: Annotated[Path | None, typer.Option("--out", help="Folder; default: export/NAME in the workspace.")] = None,
    condition: SetOfCondition = "",
    without: Annotated[list[str] | None, typer.Option("--without", help="Effect to leave out; repeat.")] = None,
    settings: mrfit.settings.export.Settings,
    work: Work,
    progress: Progress,
) -> CommandAnswer:
    """Write a fitted model as C, FMU, JSON, lookup tables, MATLAB, Modelica or SSP parameter sets.

    Example: mrfit export --fit tanh.auto.all --to c,fmu
    """
    place = Place(out, condition, tuple(without or ()))
    formats = [name for text in to for name in text.split(",")]
    summary = exported(work, fit_name, formats, place, settings, progress)
    return CommandAnswer(summary, show, check=check_all_made)


@dataclass(frozen=True)
class Place:
    """Folder of an export, and the part of a fit that it takes."""

    out: Path | None
    condition: str
    without: tuple[str, ...]


def exported(
    work: Path,
    name: str,
    to: Sequence[str],
    place: Place,
    settings: mrfit.settings.export.Settings,
    progress: Progress,
) -> "Exported":
    """Write a fit of a workspace in formats; return what was written.

    Raises
    ------
    ConfigError
        If a format or a condition does not exist, or a program is missing.
    DataError
        If there is no such fit, or it has no form in a format.
    """
    from mrfit.export import stage
    from mrfit.export.source import source_of
    from mrfit.export.workspace import read_fit_and_logs
    from mrfit.io.schemas.export import Exported, Format
    from mrfit.io.workspace import Workspace

    stage.check(to)
    with Workspace(work).locked() as workspace:
        found = read_fit_and_logs(workspace, name)
        source = source_of(found.content, found.assembly, found.stretches, place.condition, place.without)
        folder = place.out or workspace.root / "export" / name
        written = stage.run(source, to, folder, settings, progress)
    formats = [
        Format(format=f, files=written.files[f], said=written.said[f], error=written.errors[f]) for f in written.files
    ]
    return Exported(
        fit=name,
        model=source.assembly.name,
        folder=str(folder),
        formats=formats,
        failed=written.failed,
        outdated=found.content.outdated,
    )


def check_all_made(summary: "Exported") -> None:
    """Raise the DataError of an export in which some formats could not be made, after the others were written."""
    if summary.failed:
        told = "; ".join(f"{name}: {text}" for name, text in summary.failed.items())
        raise DataError(f"the other formats are written, but not {told}")


def show(summary: "Exported") -> None:
    """Print the files of every format and their differences."""
    rows = [[row.format, few(row.files, FILES_SHOWN), row.error] for row in summary.formats]
    title = f"{summary.model} of the fit {summary.fit}, in {summary.folder}"
    console.print_table(title, ["format", "files", "difference / range"], rows)
    for row in summary.formats:
        console.say_each(row.said, f"{row.format}: ")
    outdated({summary.fit: "; ".join(summary.outdated)})
    made = ", ".join(row.format for row in summary.formats) or "nothing"
    console.conclude(f"Export of {summary.fit}: {made}; {summary.folder}")


def outdated(reasons: Mapping[str, str]) -> None:
    """Print the reasons of fits that are out of date, by name; an empty reason prints nothing."""
    for name, reason in reasons.items():
        if reason:
            console.say(f"  {console.outdated_line(f'{name}: {reason}')}")
