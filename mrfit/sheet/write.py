"""The files of a test sheet: sheet.json with all numbers, sheet.csv, sheet.html, and a PDF page of every unit."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from mrfit.core.executors.order import in_processes
from mrfit.core.progress import Progress, silent
from mrfit.core.recording import Recording
from mrfit.io.csv_table import csv_table
from mrfit.io.schemas.sheet import QuantityRow, SheetFile, VerdictRow
from mrfit.io.workspace import checked, numbered, write_json, write_text
from mrfit.settings.sheet import Settings
from mrfit.sheet.compute import SheetContent, sheet_of
from mrfit.sheet.measured import LOGS_FOR_PROCESSES

Row = dict[str, str | float | None]
CONDITION_COLUMNS = {
    "unit": "unit",
    "condition": "condition",
    "recording": "recording",
    "frequency_Hz": "frequency",
    "stroke_m": "stroke",
    "peak_velocity_m/s": "peak_velocity",
    "current_A": "current",
    "temperature_degC": "temperature",
    "cycles": "cycles",
}
QUANTITY_COLUMNS = {
    "quantity": "name",
    "value": "value",
    "low": "low",
    "high": "high",
    "si_unit": "unit",
    "slope_per_cycle": "slope",
    "greatest_deviation": "greatest_deviation",
    "first_to_third": "first_to_third",
    "reason": "reason",
}
VERDICT_COLUMNS = ("least", "most", "verdict")
SHEET_COLUMNS = (*CONDITION_COLUMNS, *[c for c in QUANTITY_COLUMNS if c != "reason"], *VERDICT_COLUMNS, "reason")


def write(
    recordings: Sequence[Recording],
    settings: Settings,
    against: Sequence[Recording],
    folder: Path,
    pdf: bool,
    progress: Progress = silent,
) -> SheetFile:
    """Compute the sheet of recordings, write its files into a folder, and return it with their names."""
    jobs = settings.jobs if len(recordings) >= LOGS_FOR_PROCESSES else 1
    return written(sheet_of(recordings, settings, against, progress), folder, pdf, progress, jobs)


def written(
    sheet: SheetContent, folder: Path, pdf: bool = False, progress: Progress = silent, jobs: int = 1
) -> SheetFile:
    """Write the files of a sheet into a folder, by so many processes, and return it with their names."""
    from mrfit.sheet import print_page

    file = checked(sheet.file)
    sheet = replace(sheet, file=file)
    files = [folder / name for name in ("sheet.html", "sheet.csv", "sheet.json")]
    for _ in in_processes(_write_one, [SheetPart(sheet, path) for path in files], jobs, silent):
        pass
    if pdf:
        taken = set[str]()
        for number, unit in enumerate(file.units, 1):
            name = numbered(re.sub(r"[^\w.-]+", "_", unit.unit).strip("._") or f"unit{number}", taken)
            files.append(folder / (f"sheet-{name}.pdf" if len(file.units) > 1 else "sheet.pdf"))
            print_page.write(files[-1], sheet, unit)
            progress("pages", number, len(file.units))
    return replace(file, files=[str(path) for path in files])


@dataclass(frozen=True)
class SheetPart:
    """A sheet, and one of the files that it is written into."""

    sheet: SheetContent
    path: Path


def _write_one(part: SheetPart, progress: Progress) -> None:
    from mrfit.sheet import page

    if part.path.suffix == ".html":
        write_text(part.path, page.render(part.sheet))
    elif part.path.suffix == ".csv":
        write_text(part.path, csv_table(SHEET_COLUMNS, table_rows(part.sheet.file)))
    else:
        write_json(part.path, part.sheet.file)


def table_rows(file: SheetFile) -> list[Row]:
    """Return every quantity of every condition as a row, SI, with its verdict."""
    rows: list[Row] = []
    for unit in file.units:
        judged = {(v.condition, v.quantity): v for v in unit.verdicts if v.level == "unit"}
        for condition in unit.conditions:
            known: Row = {column: getattr(condition, name) for column, name in CONDITION_COLUMNS.items()}
            known["frequency_Hz"] = condition.frequency or None
            rows += [{**known, **_quantity(q, judged.get((condition.condition, q.name)))} for q in condition.quantities]
        for one in unit.across:
            verdict = judged.get((one.conditions, one.quantity.name))
            rows.append({"unit": unit.unit, "condition": one.conditions, **_quantity(one.quantity, verdict)})
        for v in (*(v for v in unit.verdicts if v.level == "cycle"), *(file.batch if unit is file.units[-1] else ())):
            name = f"{v.quantity} ({'cycle off the mean' if v.level == 'cycle' else 'mean of all units'})"
            names = ("unit", "condition", "value", "low", "high", "si_unit")
            rows.append({n: getattr(v, n) for n in names} | {"quantity": name} | _verdict(v))
    return rows


def _quantity(row: QuantityRow, verdict: VerdictRow | None) -> Row:
    found = {column: getattr(row, name) for column, name in QUANTITY_COLUMNS.items()}
    return found | (_verdict(verdict) if verdict else {})


def _verdict(row: VerdictRow) -> Row:
    return {n: getattr(row, n) for n in VERDICT_COLUMNS} | ({"reason": row.reason} if row.reason else {})
