"""The command that draws figures for print."""

from pathlib import Path
from typing import Annotated

import typer

import mrfit.settings.figure
from mrfit.cli import console
from mrfit.cli.options import Json, Plugins, Work, options


@options
def figure(
    kind: Annotated[str, typer.Argument(help=", ".join(mrfit.settings.figure.KINDS) + ".", show_default=False)],
    settings: mrfit.settings.figure.Settings,
    *,
    out: Annotated[Path | None, typer.Option("--out", help="Folder; default: report/paper in the workspace.")] = None,
    work: Work,
    plugins: Plugins,
    as_json: Json,
) -> None:
    """Draw loops, parameters, predicted, correlation of the residual, starts or profiles for print (PDF, SVG).

    Example: mrfit figure loops --overlay fits --width 84mm
    """
    from dataclasses import asdict

    from mrfit.io.workspace import Workspace
    from mrfit.report import paper_stage

    workspace = Workspace(work)
    with workspace.locked():
        written = paper_stage.run(workspace, kind, settings, out)
    if as_json:
        return console.print_json(asdict(written))
    console.say(f"Figure of {written.kind}, {settings.width} wide: {', '.join(written.files)}")
    if written.left_out:
        total = written.conditions + len(written.left_out)
        console.say(
            f"{written.conditions} of {total} conditions are drawn, not {', '.join(written.left_out)}: "
            "name them with --condition, or put conditions on shared axes with --overlay conditions"
        )
