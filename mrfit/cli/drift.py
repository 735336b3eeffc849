"""The command ``mrfit drift``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import mrfit.settings.drift
from mrfit.cli import console
from mrfit.cli.options import CommandAnswer, Default, options
from mrfit.core.counting import number_of

if TYPE_CHECKING:
    from mrfit.io.schemas.drift import DriftFile

OUT_OF_DRIFT = Path("mrfit-drift")
ROWS_SHOWN = 20


@options()
def drift(
    inputs: Annotated[
        list[Path], typer.Argument(help="Tables of batches, workspaces, or folders of workspaces.", show_default=False)
    ],
    settings: mrfit.settings.drift.Settings,
    *,
    out: Annotated[
        Path, typer.Option("--out", help="Folder for drift.html, drift.csv and drift.json."), Default(OUT_OF_DRIFT)
    ],
) -> CommandAnswer:
    """Compare fits: what drifts over cycles, temperature or time, which unit stands out, in which range all lie.

    Example: mrfit drift mrfit-batch/batch.parquet --over date
    """
    from mrfit.drift.analysis import compare
    from mrfit.drift.call import UnitComparison
    from mrfit.drift.source import read_values
    from mrfit.io.workspace import checked

    found, trends = compare(read_values(inputs, settings), settings)
    return CommandAnswer(UnitComparison(checked(found), trends).save(out), _show)


def _show(made: "DriftFile") -> None:
    from mrfit.drift.page import ODD_HEADS, RANGE_HEADS, SLOPE_HEADS, odd_rows, range_rows, slope_rows

    rows = made.parameters
    shown = (
        ("Changes with covariates", SLOPE_HEADS, slope_rows(rows)),
        ("Units that stand out", ODD_HEADS, odd_rows(rows)),
        ("Ranges of all units", RANGE_HEADS, range_rows(rows)),
    )
    for title, columns, cells in shown:
        if cells:
            console.print_table(title, columns, cells[:ROWS_SHOWN])
        if len(cells) > ROWS_SHOWN:
            console.say(f"  and {len(cells) - ROWS_SHOWN} more, in the files")
    for r in rows:
        if r.change:
            console.say(f"  step: {r.parameter}, {r.condition}: at {r.change.covariate} {r.change.at:.4g}")
    for cause in made.causes:
        named = "no candidate" if cause.effect == "none named" else f"candidate: {cause.effect}"
        console.say_each([f"{named}: {cause.text}"])
    console.say_each(made.notes[:ROWS_SHOWN])
    drifts = sum(s.drifts for r in rows for s in r.slopes)
    odd = len({o.specimen for r in rows for o in r.stands_out})
    console.conclude(
        f"Drift: {number_of('unit', made.units)}, {number_of('test', made.tests)}; "
        f"{number_of('drift', drifts)}, {number_of('unit', odd)} "
        f"that stand{'s' * (odd == 1)} out; {', '.join(made.files)}"
    )
