"""The command ``mrfit track-parameters``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mrfit.cli import console
from mrfit.cli.options import CommandAnswer, FinishedFit, Only, SetOfCondition, Work, options
from mrfit.core.counting import few
from mrfit.settings import ingest

if TYPE_CHECKING:
    from mrfit.io.schemas.track import TracksFile

TABLES_SHOWN = 4


@options()
def track_parameters(
    logs: Annotated[list[Path], typer.Argument(help="Logs with inputs and output of the model.", show_default=False)],
    fit_name: FinishedFit,
    track: Annotated[str, typer.Option("--track", help="Parameters, by commas.", show_default=False)],
    *,
    condition: SetOfCondition = "",
    reading: Annotated[ingest.Settings, Only(("map",))],
    work: Work,
) -> CommandAnswer:
    """Follow parameters of a fit along logs: estimates with bands, block-wise refits, innovations.

    Example: mrfit track-parameters datasets/damper/sine_1Hz_12mm.csv --fit tanh.auto.all --track fy,c
    """
    from mrfit.cli.apply import note_outdated, read_logs
    from mrfit.export.source import source_of
    from mrfit.export.workspace import read_fit_and_logs
    from mrfit.io.workspace import Workspace
    from mrfit.track.call import tracked

    workspace = Workspace(work)
    found = read_fit_and_logs(workspace, fit_name)
    source = source_of(found.content, found.assembly, found.stretches, condition)
    note_outdated(fit_name, found.content.outdated)
    made = tracked(source, read_logs(logs, reading.map), [n.strip() for n in track.split(",") if n.strip()])
    with workspace.locked():
        return CommandAnswer(made.save(workspace.root / "track", fit_name), _show)


def _show(made: "TracksFile") -> None:
    from mrfit.track.call import table_name
    from mrfit.track.page import HEADS, rows_of

    console.print_table(f"Parameters of {made.fit} along logs", ("log", *HEADS), rows_of(made))
    page = Path(made.page)
    tables = [table_name(page.stem, log.recording) for log in made.logs]
    console.say(f"Tables beside the page: {few(tables, TABLES_SHOWN)}")
    console.say(f"Page: {page}")
