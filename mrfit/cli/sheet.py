"""``mrfit measure sheet``: a damper's test sheet, without a model, against limits."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import mrfit.settings.sheet
from mrfit.cli import console
from mrfit.cli.apply import read_logs
from mrfit.cli.options import Json, Only, options
from mrfit.settings import ingest

if TYPE_CHECKING:
    from mrfit.io.schemas.sheet import SheetCondition, SheetFile

OUT = Path("mrfit-sheet")
LISTED, IN_FULL = 6, 2
"""Units and rows that the terminal lists, and conditions of which it shows every quantity; all are in the files."""
MAIN = ("F0+", "F0-", "Fmax+", "Fmax-", "E", "K_eff", "C_eq")
Logs = Annotated[list[Path], typer.Argument(help="Logs or folders of logs.", show_default=False)]


@options
def sheet(
    logs: Logs,
    settings: mrfit.settings.sheet.Settings,
    *,
    against: Annotated[
        list[Path] | None, typer.Option("--against", help="Logs to compare with, as before a test.")
    ] = None,
    pdf: Annotated[bool, typer.Option("--pdf", help="Also one A4 page per unit as PDF.")] = False,
    out: Annotated[Path, typer.Option("--out", help="Folder for sheet.html, sheet.csv and sheet.json.")] = OUT,
    reading: Annotated[ingest.Settings, Only(("map", "pattern"))],
    as_json: Json,
) -> None:
    """Write a damper's test sheet: forces, energy, stiffness, damping with 95 % intervals, against limits.

    Example: mrfit measure sheet datasets/damper-sines --limits datasets/limits/damper.toml
    """
    from mrfit.sheet.write import write

    recordings = read_logs(logs, reading.map, reading.pattern)
    others = read_logs(against, reading.map, reading.pattern) if against else []
    with console.progress_bar() as progress:
        found = write(recordings, settings, others, out, pdf, progress)
    if as_json:
        from mrfit.io.workspace import to_json

        return console.print_json(to_json(found))
    return show(found)


def show(found: "SheetFile") -> None:
    """Print the sheet of every unit."""
    several = len(found.units) > 1
    for unit in found.units if len(found.units) <= LISTED else []:
        for row in unit.conditions if len(unit.conditions) <= IN_FULL and not several else []:
            _condition(row)
        if several or len(unit.conditions) > IN_FULL:
            _conditions(f"Unit {unit.unit}" if several else "Conditions", unit.conditions)
        across = [[a.conditions, a.quantity.name, *_numbers(a.quantity)] for a in unit.across]
        if across:
            columns = ("conditions", "quantity", "value", "95 % interval", "unit", "note")
            console.print_table("Across conditions", columns, across)
    _judged(found)
    for one in found.stands_out[:LISTED]:
        console.say(
            f"  stands out: {one.unit}, {one.condition}: {one.quantity} {one.value:.4g}, median {one.median:.4g}"
        )
    if found.changes:
        _changes(found)
    from mrfit.sheet.words import notes_of

    for text in notes_of([row for unit in found.units for row in unit.conditions]):
        console.say(f"  note: {text}")
    for text in found.left_out:
        console.say(f"  left out: {text}")
    console.say(f"Sign: {found.convention}")
    console.conclude(f"{_summary(found)}; {', '.join(found.files)}")


def _summary(found: "SheetFile") -> str:
    conditions = sum(len(unit.conditions) for unit in found.units)
    units = len(found.units)
    text = f"Sheet: {units} unit{'s' * (units != 1)}, {conditions} condition{'s' * (conditions != 1)}"
    if found.limits:
        counts = {
            word: sum(unit.verdict == word for unit in found.units) for word in ("pass", "fail", "cannot be judged")
        }
        text += f", {counts['pass']} pass, {counts['fail']} fail, {counts['cannot be judged']} cannot be judged"
    return text


def _numbers(row: object) -> list[object]:
    from mrfit.sheet.words import numbers_of

    return list(numbers_of(row))  # type: ignore[arg-type]


def _condition(row: "SheetCondition") -> None:
    """Print the quantities of one condition."""
    reasons: dict[str, list[str]] = {}
    for one in row.quantities:
        if one.value is None:
            reasons.setdefault(one.reason, []).append(one.name)
    rows = [[q.name, *_numbers(q)] for q in row.quantities if q.value is not None]
    title = f"{row.condition}: {row.cycles} cycles, peak velocity {row.peak_velocity:.4g} m/s ({row.source})"
    console.print_table(title, ("quantity", "value", "95 % interval", "unit", "over cycles"), rows)
    for reason, names in reasons.items():
        console.say(f"  no {', '.join(names)}: {reason}")


def _conditions(title: str, rows: "Sequence[SheetCondition]") -> None:
    """Print the main quantities of several conditions."""
    shown = []
    for row in rows[: 4 * LISTED]:
        values = {q.name: q.value for q in row.quantities}
        shown.append([row.condition, row.cycles, row.peak_velocity, *(values.get(name) for name in MAIN)])
    columns = (
        "condition",
        "cycles",
        "v (m/s)",
        "F0+ (N)",
        "F0- (N)",
        "Fmax+ (N)",
        "Fmax- (N)",
        "E (J)",
        "K_eff (N/m)",
        "C_eq (N*s/m)",
    )
    console.print_table(title, columns, shown)
    if len(rows) > len(shown):
        console.say(f"  and {len(rows) - len(shown)} more conditions, in the files")


def _judged(found: "SheetFile") -> None:
    from mrfit.sheet.words import limits_text, number_text

    rows = [v for unit in found.units for v in unit.verdicts] + list(found.batch)
    several = len(found.units) > 1
    if several and len(rows) > 8 * LISTED:
        counted = [
            [
                u.unit,
                u.verdict,
                *(sum(v.verdict == w for v in u.verdicts) for w in ("pass", "fail", "cannot be judged")),
            ]
            for u in found.units
        ]
        console.print_table(
            f"Units against {found.limits}", ("unit", "verdict", "pass", "fail", "cannot be judged"), counted
        )
        rows = [v for v in rows if v.verdict == "fail" or v.level == "batch"][: 8 * LISTED]
    shown = [
        [*([v.unit] if several else []), v.condition, v.level, v.quantity, number_text(v), limits_text(v), v.verdict]
        for v in rows
    ]
    if shown:
        columns = (*(("unit",) if several else ()), "condition", "level", "quantity", "value", "limits", "verdict")
        console.print_table(f"Verdicts, {found.limits}", columns, shown)
    for reason in dict.fromkeys(
        f"{v.quantity}, {v.condition}: {v.reason}" for v in rows if v.reason and v.value is None
    ):
        console.say(f"  cannot be judged: {reason}")


def _changes(found: "SheetFile") -> None:
    from mrfit.sheet.words import change_text

    rows = [[c.condition, c.quantity, c.value, c.against, change_text(c)] for c in found.changes if c.changed]
    console.print_table(
        f"Changed against the other logs, {len(rows)} of {len(found.changes)} quantities",
        ("condition", "quantity", "value", "against", "change"),
        rows[: 8 * LISTED],
    )
    for name in found.unmatched:
        console.say(f"  in one of the two only: {name}")
