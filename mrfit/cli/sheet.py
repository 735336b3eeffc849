"""``mrfit measure sheet``: a damper's test sheet, without a model, against limits."""

from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import mrfit.settings.sheet
from mrfit.cli import console
from mrfit.cli.apply import read_logs
from mrfit.cli.options import CommandAnswer, Only, ReadLogs, options
from mrfit.core.counting import number_of
from mrfit.core.progress import Progress
from mrfit.settings import ingest
from mrfit.settings.shared import READ_BY_PROCESSES

if TYPE_CHECKING:
    from mrfit.io.schemas.sheet import SheetFile
    from mrfit.report.sections import Table

SHEET_FOLDER = Path("mrfit-sheet")
UNITS_LISTED, ROWS_LISTED, CONDITIONS_IN_FULL = 6, 24, 2
"""Units and rows that the terminal lists, and conditions of which it shows every quantity; all are in the files."""


@options(plugins=False)
def sheet(
    logs: ReadLogs,
    settings: mrfit.settings.sheet.Settings,
    *,
    against: Annotated[
        list[Path] | None, typer.Option("--against", help="Logs to compare with, as before a test.")
    ] = None,
    pdf: Annotated[bool, typer.Option("--pdf", help="Also one A4 page per unit as PDF.")] = False,
    out: Annotated[Path, typer.Option("--out", help="Folder for sheet.html, sheet.csv and sheet.json.")] = SHEET_FOLDER,
    reading: Annotated[ingest.Settings, Only(("map", "pattern"))],
    progress: Progress,
) -> CommandAnswer:
    """Write a damper's test sheet: forces, energy, stiffness, damping with 95 % intervals, against limits.

    Example: mrfit measure sheet datasets/damper-sines --limits datasets/limits/damper.toml
    """
    if sum(1 for path in logs for _ in (path.rglob("*") if path.is_dir() else (path,))) >= READ_BY_PROCESSES:
        from mrfit.core.executors.processes import begin

        begin(settings.jobs, ["mrfit.ingest.elsewhere", "mrfit.sheet.page"])
    from mrfit.sheet.write import write

    recordings = read_logs(logs, reading.map, reading.pattern, settings.jobs)
    others = read_logs(against, reading.map, reading.pattern, settings.jobs) if against else []
    return CommandAnswer(write(recordings, settings, others, out, pdf, progress), show)


def show(found: "SheetFile") -> None:
    """Print the sheet of every unit."""
    from mrfit.sheet.tables import across_table, change_table, condition_table, lacks_main, main_table, summary_of
    from mrfit.sheet.words import notes_of, unmatched_of

    several = len(found.units) > 1
    for unit in found.units if len(found.units) <= UNITS_LISTED else []:
        if several or len(unit.conditions) > CONDITIONS_IN_FULL:
            listed, caption = unit.conditions[:ROWS_LISTED], f"Unit {unit.unit}" if several else "Conditions"
            # a record under a current that moves has quantities of its own
            for _, rows in groupby(sorted(listed, key=lacks_main), lacks_main):
                _print(main_table(list(rows), caption))
            if len(unit.conditions) > ROWS_LISTED:
                console.say(f"  and {number_of('more condition', len(unit.conditions) - ROWS_LISTED)}, in the files")
        else:
            for row in unit.conditions:
                _print(condition_table(row, unknown=False))
                for reason in dict.fromkeys(q.reason for q in row.quantities if q.value is None):
                    names = [q.name for q in row.quantities if q.value is None and q.reason == reason]
                    console.say(f"  no {', '.join(names)}: {reason}")
        if unit.across:
            _print(across_table(unit.across))
    _print_verdicts(found)
    for one in found.stands_out[:UNITS_LISTED]:
        console.say(
            f"  stands out: {one.unit}, {one.condition}: {one.quantity} {one.value:.4g}, median {one.median:.4g}"
        )
    if found.changes:
        _print(change_table(found, ROWS_LISTED))
    console.say_each(unmatched_of(found), "  without a partner: ")
    console.say_each(notes_of([row for unit in found.units for row in unit.conditions]), "  note: ")
    console.say_each(found.left_out, "  left out: ")
    console.say(f"Sign: {found.convention}")
    console.conclude(f"Sheet: {summary_of(found)}; {', '.join(found.files)}")


def _print(table: "Table") -> None:
    console.print_table(table.caption, table.heads, table.rows)


def _print_verdicts(found: "SheetFile") -> None:
    """Print the verdicts; of many units their counts, and those that fail."""
    from mrfit.sheet.tables import unit_table, verdict_table

    rows = [v for unit in found.units for v in unit.verdicts] + list(found.batch)
    several = len(found.units) > 1
    if several and len(rows) > ROWS_LISTED:
        _print(unit_table(found))
        rows = [v for v in rows if v.verdict == "fail" or v.level == "batch"][:ROWS_LISTED]
    if rows:
        _print(verdict_table(rows, f"Verdicts, {found.limits}", several))
