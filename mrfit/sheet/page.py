"""The page of a test sheet: one HTML file that opens offline, needs no scripts and prints on A4."""

from collections.abc import Callable, Sequence

from mrfit.io.schemas.sheet import FAIL, PASS, UNDECIDED, SheetFile, UnitRow, VerdictRow
from mrfit.measure.quantity import SHEET_QUANTITIES
from mrfit.report.figures import panels_of
from mrfit.report.sections import Section, SectionFigure, Table
from mrfit.report.sections import render as render_sections
from mrfit.report.svg import Axes, inline, style, to_svg
from mrfit.sheet import figures
from mrfit.sheet.compute import SheetContent
from mrfit.sheet.tables import (
    CHANGES_SHOWN,
    across_table,
    change_table,
    condition_table,
    main_table,
    summary_of,
    unit_table,
    verdict_table,
)
from mrfit.sheet.words import notes_of, unmatched_of

PANELS_HEIGHT = 3.4
"""Inches of a row of panels."""
UNITS_SHOWN = 12
"""Units with a section of their own: those that fail first, then those that cannot be judged."""
DISTRIBUTIONS_SHOWN = 6


def render(sheet: SheetContent) -> str:
    """Return the page."""
    file = sheet.file
    several = len(file.units) > 1
    sections = _fleet(file) if several else []
    worst = sorted(file.units, key=lambda u: (FAIL, UNDECIDED, "", PASS).index(u.verdict))[:UNITS_SHOWN]
    for number, unit in enumerate([u for u in file.units if u in worst], 1):
        sections += unit_sections(sheet, unit, f"u{number}", several)
    sections += _changes(file)
    names = Table("Names of quantities", ("quantity", "meaning"), [(n, m) for n, (_, m) in SHEET_QUANTITIES.items()])
    sections.append(Section("Names", (), [names], folded=True))
    if file.left_out:
        sections.append(Section("Left out", file.left_out))
    lead = f"{summary_of(file)}."
    if len(file.units) > UNITS_SHOWN:
        lead += f" Of {len(file.units)} units {UNITS_SHOWN} have a section, those that fail or cannot be judged first."
    return render_sections(title_of(file), lead, facts_of(file), sections, "sheet.json, sheet.csv")


def title_of(file: SheetFile, unit: str = "") -> str:
    """Return the heading: what was tested."""
    about = dict(file.settings.get("about") or [])  # type: ignore[call-overload]
    name = next((str(about[k]) for k in about if k.lower() in ("specimen", "title", "damper")), "")
    return f"Test sheet: {name}" if name else f"Test sheet of {unit}" if unit else "Test sheet of a damper"


def facts_of(file: SheetFile) -> list[tuple[str, str]]:
    """Return the head of a sheet as labels and words."""
    about = [(str(k), str(v)) for k, v in (file.settings.get("about") or [])]  # type: ignore[attr-defined]
    rules = {
        "interval": "with its whole 95 % interval within the limits: pass; outside: fail; else it cannot be judged",
        "none": "by the value alone, without its interval",
    }
    facts = [*about, ("Sign", file.convention), ("Intervals", "95 %, from the scatter over the cycles and the noise")]
    if file.limits:
        facts.append(("Judged", rules[file.guard]))
    if file.settings.get("skew"):
        facts.append(("Skew", f"the force was taken {file.settings['skew']} s earlier than recorded"))
    return facts


def unit_sections(sheet: SheetContent, unit: UnitRow, anchor: str, several: bool) -> list[Section]:
    """Return the sections of a unit."""
    name = f"Unit {unit.unit}: " if several else ""
    loops = [one for one in sheet.loops if one.unit == unit.unit]
    courses = [one for one in sheet.courses if one.unit == unit.unit]
    shown = []
    if loops:
        words = "Mean cycle of every condition, in the colour of its current"
        words += "; dashed: the logs compared with." if sheet.against else "."
        panels: list[Callable[[Axes], object]] = [
            lambda axes: figures.draw_loops(axes, loops, sheet.against, "displacement"),
            lambda axes: figures.draw_loops(axes, loops, sheet.against, "velocity"),
        ]
        shown.append(drawn(f"{anchor}l", "Loops.", words, panels))
        panels = [
            lambda axes: figures.draw_peaks(axes, unit.conditions),
            lambda axes: figures.draw_history(axes, courses),
        ]
        words = "Left the peak force over the peak velocity, with its interval; right that of every cycle."
        shown.append(drawn(f"{anchor}p", "Peak force and history.", words, panels))
    tables = [verdict_table(unit.verdicts)] if unit.verdicts else []
    heading = (unit.verdict if name else f"Verdict: {unit.verdict}") if unit.verdict else "Loops and forces"
    found = [Section(name + heading, (), tables, shown)]
    main = [main_table(unit.conditions), *([across_table(unit.across)] if unit.across else [])]
    found.append(Section(f"{name}quantities" if name else "Quantities", notes_of(unit.conditions), main))
    whole = [condition_table(c) for c in unit.conditions]
    found.append(Section(f"{name}every quantity" if name else "Every quantity by condition", (), whole, folded=True))
    return found


def drawn(prefix: str, title: str, caption: str, panels: "Sequence[Callable[[Axes], object]]") -> SectionFigure:
    """Return panels, two beside each other, as a figure of a page."""
    with style():
        canvas, axes = panels_of(len(panels), 2, PANELS_HEIGHT, 0.0)
        for one, draw in zip(axes, panels, strict=True):
            draw(one)
        return SectionFigure(title, caption, inline(to_svg(canvas, title), prefix, f"{title} {caption}"))


def _fleet(file: SheetFile) -> list[Section]:
    """Return the section of all units: verdicts of both levels, distributions, who stands out."""
    tables, pictures = [], []
    if file.limits:
        if file.batch:
            tables.append(verdict_table(file.batch))
        tables.append(unit_table(file))
        wanted: dict[tuple[str, str], VerdictRow] = {}
        for unit in file.units:
            for v in unit.verdicts:
                if v.level == "unit" and v.value is not None:
                    wanted.setdefault((v.condition, v.quantity), v)
        panels: list[Callable[[Axes], object]] = [
            lambda axes, one=one: figures.draw_distribution(axes, file.units, one)  # type: ignore[misc]
            for one in list(wanted.values())[:DISTRIBUTIONS_SHOWN]
        ]
        if panels:
            pictures.append(
                drawn("fleet", "Distributions.", "Every unit with its 95 % interval; dashed: the limits.", panels)
            )
    if file.stands_out:
        cells = [[s.unit, s.condition, s.quantity, s.value, s.median, s.z] for s in file.stands_out[:CHANGES_SHOWN]]
        tables.append(Table("Units that stand out", ("unit", "condition", "quantity", "value", "median", "z"), cells))
    words = [] if file.stands_out else ["No unit stands out from the others."]
    return [Section("All units", words, tables, pictures)]


def _changes(file: SheetFile) -> list[Section]:
    if not file.changes:
        return []
    words = [f"Without a partner: {', '.join(unmatched_of(file))}."] if file.unmatched else []
    return [Section("Beside the logs compared with", words, [change_table(file)])]
