"""The command that fits every log of a folder."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import mrfit.settings.batch
import mrfit.settings.fit
import mrfit.settings.ingest
from mrfit.cli import console
from mrfit.cli.options import CommandAnswer, Default, Only, options
from mrfit.core.counting import number_of
from mrfit.core.progress import Progress

if TYPE_CHECKING:
    from mrfit.io.schemas.batch import BatchFile

# Logs that failed, as many as are printed
LOGS_LISTED = 10
Batch = Annotated[
    Path, typer.Option("--work", help="The batch's folder.", envvar="MRFIT_BATCH"), Default(Path("mrfit-batch"))
]


@options(sends=True)
def batch(
    folder: Annotated[Path, typer.Argument(help="Folder of logs.", show_default=False)],
    fitting: mrfit.settings.fit.Settings,
    settings: mrfit.settings.batch.Settings,
    reading: Annotated[mrfit.settings.ingest.Settings, Only(("map", "pattern"))],
    *,
    work: Batch,
    progress: Progress,
) -> CommandAnswer:
    """Fit every log of a folder, only what changed, and show what stands out among them.

    Example: mrfit batch datasets/coil --model boucwen-flux
    """
    from mrfit.batch import stage

    summary = stage.run(folder, work, settings, stage.Stages(reading, fitting), progress)
    return CommandAnswer(summary, show)


def show(summary: "BatchFile") -> None:
    """Print the result of a batch."""
    from mrfit.batch.fleet import findings

    failed = len(summary.failed)
    for row in summary.failed[:LOGS_LISTED]:
        console.say(f"failed: {row.error if row.log in row.error else f'{row.log}: {row.error}'}")
    if failed > LOGS_LISTED:
        console.say(f"and {failed - LOGS_LISTED} more, all on the page")
    console.conclude(
        f"{number_of('log', summary.logs)}: {summary.logs - failed} fitted, {failed} failed "
        f"({summary.done} processed now, {summary.unchanged} unchanged, "
        f"{summary.logs - summary.done - summary.unchanged} refused unread); "
        f"{findings(summary.outliers, summary.drifts, summary.most)}; "
        f"table {summary.table}, page {summary.page}"
    )
