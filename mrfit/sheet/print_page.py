"""One A4 page of a unit as PDF, drawn by matplotlib: it is there already, needs no browser and embeds its fonts."""

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

from mrfit.core.counting import few, number_of
from mrfit.io.atomic import write_atomic
from mrfit.io.escapes import visible
from mrfit.io.schemas.sheet import UnitRow
from mrfit.report.svg import style
from mrfit.sheet import figures
from mrfit.sheet.compute import SheetContent
from mrfit.sheet.page import facts_of, title_of
from mrfit.sheet.tables import MAIN_QUANTITIES, judged_of, main_table
from mrfit.sheet.words import limits_text, number_text, numbers_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

A4_INCHES = (8.27, 11.69)
LEFT_EDGE, RIGHT_EDGE, BOTTOM_EDGE = 0.075, 0.94, 0.045
FOOT_LETTERS = 170
LINE_HEIGHT = 0.0128
"""Height of a line of text over that of the page."""
PRINTED_QUANTITIES = (*MAIN_QUANTITIES, "friction", "gas force")
FACTS = 8
IN_FULL, CONDITION_WIDTH = 3, 0.2
"""Conditions whose quantities have a row each, and the share of a line for their names where they have not."""


def write(path: Path, sheet: SheetContent, unit: UnitRow) -> None:
    """Write the page of a unit; the same bytes for the same sheet."""
    with style():
        canvas = draw(sheet, unit)
        title = title_of(sheet.file, unit.unit)
        about = {"Title": visible(title), "Creator": "mrfit", "Producer": "mrfit", "CreationDate": None}
        write_atomic(path, lambda place: canvas.savefig(place, format="pdf", metadata=about))


def draw(sheet: SheetContent, unit: UnitRow) -> "Figure":
    """Return the page as a figure of A4 size."""
    from matplotlib.figure import Figure

    several = len(sheet.file.units) > 1
    canvas = Figure(figsize=A4_INCHES)
    top = _head(canvas, sheet, unit, several)
    loops = [one for one in sheet.loops if one.unit == unit.unit]
    courses = [one for one in sheet.courses if one.unit == unit.unit]
    if loops:
        height, gap, width = 0.19, 0.062, (RIGHT_EDGE - LEFT_EDGE - 0.085) / 2.0
        right = LEFT_EDGE + 0.045 + width + 0.075
        places = [(LEFT_EDGE + 0.035, top - height), (right - 0.01, top - height)]
        places += [(x, y - height - gap) for x, y in places]
        axes = [canvas.add_axes((x, y, width, height)) for x, y in places]
        figures.draw_loops(axes[0], loops, sheet.against, "displacement")
        figures.draw_loops(axes[1], loops, sheet.against, "velocity")
        figures.draw_peaks(axes[2], unit.conditions)
        figures.draw_history(axes[3], courses)
        for one in axes:
            one.tick_params(labelsize=6.5)
            one.xaxis.label.set_fontsize(7.5)
            one.yaxis.label.set_fontsize(7.5)
        top = places[2][1] - 0.07
    _tables(canvas, top, unit)
    foot = f"mrfit {version('mrfit')}. Intervals: 95 %. Sign: {sheet.file.convention}."
    lines = "\n".join(wrap(visible(foot), FOOT_LETTERS))
    canvas.text(LEFT_EDGE, 0.03, lines, fontsize=5.5, color="#52606f", va="top")
    return canvas


def _head(canvas: "Figure", sheet: SheetContent, unit: UnitRow, several: bool) -> float:
    """Write the head, specimen and verdict; return the height at which the figures begin."""
    y = 0.958
    canvas.text(LEFT_EDGE, y, _cut(title_of(sheet.file, unit.unit if several else ""), 58), fontsize=14, weight="bold")
    if unit.verdict:
        colour = {"pass": "#0f766e", "fail": "#9a3412"}.get(unit.verdict, "#475569")
        canvas.text(RIGHT_EDGE, y, unit.verdict, fontsize=14, weight="bold", color=colour, ha="right")
    facts = [*([("Unit", unit.unit)] if several else []), *facts_of(sheet.file)]
    facts = [(k, v) for k, v in facts if k not in ("Sign", "Intervals", "Judged")]
    counts = {"condition": len(unit.conditions), "cycle": sum(c.cycles for c in unit.conditions)}
    tests = ", ".join(number_of(noun, count) for noun, count in counts.items())
    sources = sorted({Path(c.source).name for c in unit.conditions})
    if sheet.file.limits:
        facts += [("Limits", sheet.file.limits), ("Verdicts", judged_of([unit]))]
    for number, (label, text) in enumerate(facts[: 2 * FACTS]):
        x, line = LEFT_EDGE + (number % 2) * 0.45, number // 2
        canvas.text(x, y - 0.024 - line * LINE_HEIGHT, _cut(f"{label}:", 16), fontsize=7.5, color="#52606f")
        canvas.text(x + 0.085, y - 0.024 - line * LINE_HEIGHT, _cut(text, 46), fontsize=7.5)
    y -= 0.024 + (min(len(facts), 2 * FACTS) + 1) // 2 * LINE_HEIGHT
    canvas.text(LEFT_EDGE, y, "Tests:", fontsize=7.5, color="#52606f")
    canvas.text(LEFT_EDGE + 0.085, y, _cut(f"{tests}; {few(sources, 3)}", 110), fontsize=7.5)
    return y - 0.021


def _tables(canvas: "Figure", top: float, unit: UnitRow) -> None:
    """Write the verdicts and the main quantities, as many as there is room for."""
    if unit.verdicts:
        heads = ("condition", "quantity", "value (95 % interval)", "limits", "verdict")
        order = {"fail": 0, "cannot be judged": 1, "pass": 2}
        rows = []
        for v in sorted(unit.verdicts, key=lambda v: order[v.verdict]):
            name = f"{v.quantity}, each cycle" if v.level == "cycle" else v.quantity
            rows.append((v.condition, name, number_text(v), limits_text(v), v.verdict))
        top = _table(canvas, top, (heads, *rows), (0.0, 0.27, 0.43, 0.70, 0.865)) - LINE_HEIGHT
    if len(unit.conditions) > IN_FULL:
        main = main_table(unit.conditions)
        step = (1.0 - CONDITION_WIDTH) / max(len(main.heads) - 1, 1)
        places = (0.0, *(CONDITION_WIDTH + k * step for k in range(len(main.heads) - 1)))
        names = [head.partition(" (")[0] for head in main.heads]
        units = [head.partition(" (")[2].rstrip(")") for head in main.heads]
        _table(canvas, top, (names, units, *main.cells), places)
        return
    heads = ("condition", "quantity", "value", "95 % interval", "over cycles")
    rows = []
    for condition in unit.conditions:
        for one in condition.quantities:
            if one.name in PRINTED_QUANTITIES and one.value is not None:
                value, interval, text, words = numbers_of(one)
                rows.append((condition.condition, one.name, f"{value} {text}", f"{interval} {text}", words))
    _table(canvas, top, (heads, *rows), (0.0, 0.25, 0.335, 0.445, 0.66))


def _table(canvas: "Figure", top: float, cells: Sequence[Sequence[str]], places: Sequence[float]) -> float:
    """Write a table, its heads first, as far as there is room; return where it ends."""
    heads, rows = cells[0], cells[1:]
    room = max(int((top - BOTTOM_EDGE) / LINE_HEIGHT) - 2, 0)
    if not room or not rows:
        return top
    _line(canvas, top, heads, places, weight="bold")
    for number, row in enumerate(rows[:room], 1):
        _line(canvas, top - number * LINE_HEIGHT, row, places)
    if len(rows) > room:
        text = f"{number_of('more row', len(rows) - room)} in sheet.html and sheet.csv"
        canvas.text(LEFT_EDGE, top - (room + 1) * LINE_HEIGHT, text, fontsize=6.5, color="#52606f")
    return top - (min(len(rows), room) + 2) * LINE_HEIGHT


def _line(canvas: "Figure", y: float, cells: Sequence[str], places: Sequence[float], weight: str = "normal") -> None:
    span = RIGHT_EDGE - LEFT_EDGE
    for k, (text, place) in enumerate(zip(cells, places, strict=True)):
        end = places[k + 1] if k + 1 < len(places) else 1.0
        colour = {"pass": "#0f766e", "fail": "#9a3412"}.get(text, "#000000")
        # so many characters of this size fit into the width of a page
        shown = _cut(text, int((end - place) * 138))
        canvas.text(LEFT_EDGE + place * span, y, shown, fontsize=6.8, color=colour, weight=weight)


def _cut(text: str, most: int) -> str:
    clean = visible(text)
    return clean if len(clean) <= most else clean[: most - 1] + "…"
