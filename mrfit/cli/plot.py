"""``mrfit plot``: the raw signals of logs, before any fit."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mrfit.cli import console
from mrfit.cli.apply import read_logs
from mrfit.cli.options import CommandAnswer, Only, ReadLogs, options
from mrfit.core.counting import number_of
from mrfit.core.progress import Progress
from mrfit.settings import ingest

if TYPE_CHECKING:
    from mrfit.sheet.signals import Signals

PLOT_FOLDER = Path("mrfit-plot")


@options(plugins=False)
def plot(
    logs: ReadLogs,
    *,
    png: Annotated[bool, typer.Option("--png", help="Also a PNG of every log.")] = False,
    out: Annotated[Path, typer.Option("--out", help="Folder for signals.html.")] = PLOT_FOLDER,
    reading: Annotated[ingest.Settings, Only(("map", "pattern"))],
    progress: Progress,
) -> CommandAnswer:
    """Draw logs as recorded: series with zoom, loops, where a log is cut, warnings at their time.

    Example: mrfit plot datasets/damper-sines --png
    """
    from mrfit.sheet.signals import write

    recordings = read_logs(logs, reading.map, reading.pattern)
    files, found = write(recordings, len(recordings), out, png, progress)
    rows = [
        {"log": one.recording.source, "cuts": len(one.segments), "said": [*one.said, *_texts(one)]} for one in found
    ]
    return CommandAnswer({"files": [str(path) for path in files], "logs": rows}, _show, found)


def _show(summary: "dict[str, list[str]]", found: "Sequence[Signals]") -> None:
    for one in found:
        console.say(f"  {one.recording.id}: {', '.join(s.condition for s in one.segments) or 'not cut'}")
        console.say_each([*one.said, *_texts(one)], "    ")
    conclude(summary["files"])


def conclude(files: Sequence[object]) -> None:
    """Print the path of the page and the number of pictures beside it."""
    more = f" and {number_of('PNG file', len(files) - 1)} beside it" if len(files) > 1 else ""
    console.conclude(f"Signals: {files[0]}{more}")


def _texts(one: "Signals") -> list[str]:
    return [finding.text for finding in one.recording.findings]
