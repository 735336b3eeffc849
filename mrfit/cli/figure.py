"""The command that draws figures for print."""

from pathlib import Path
from typing import Annotated

import typer

import mrfit.settings.figure
from mrfit.cli.options import CommandAnswer, Work, options


@options()
def figure(
    kind: Annotated[str, typer.Argument(help=", ".join(mrfit.settings.figure.FIGURE_KINDS) + ".", show_default=False)],
    settings: mrfit.settings.figure.Settings,
    *,
    out: Annotated[Path | None, typer.Option("--out", help="Folder; default: report/paper in the workspace.")] = None,
    work: Work,
) -> CommandAnswer:
    """Draw loops, parameters, predicted, correlation of the residual, starts or profiles for print (PDF, SVG).

    Example: mrfit figure loops --overlay fits --width 84mm
    """
    from mrfit.cli import output, pipeline

    return CommandAnswer(pipeline.figure(work, kind, settings, out), output.figure)
