"""Tables of a test sheet, the same in the terminal and on the page."""

from collections.abc import Sequence
from itertools import groupby

from mrfit.core.counting import number_of
from mrfit.io.schemas.sheet import FAIL, PASS, UNDECIDED, AcrossRow, SheetCondition, SheetFile, UnitRow, VerdictRow
from mrfit.report.numbers import unit_html
from mrfit.report.sections import Table
from mrfit.sheet.limits import verdict_of
from mrfit.sheet.words import change_text, limits_text, number_text, numbers_of, shown

MAIN_QUANTITIES = ("F0+", "F0-", "Fd+", "Fd-", "Fmax+", "Fmax-", "E", "K_eff", "xi_eff", "C_eq")
VERDICT_LEVELS = {"unit": "all cycles", "cycle": "each cycle", "batch": "all units"}
CHANGES_SHOWN = 200


def main_table(conditions: Sequence[SheetCondition], caption: str = "Main quantities, SI") -> Table:
    """Return the main quantities, a row for each condition; all there are where no condition has a main one."""
    values = [{q.name: q.value for q in c.quantities} for c in conditions]
    units = {q.name: q.unit for c in conditions for q in c.quantities}
    there = [n for n in units if any(v.get(n) is not None for v in values)]
    names = [n for n in MAIN_QUANTITIES if n in there] or there
    heads = ("condition", "cycles", "v (m/s)", *(f"{n} ({unit_html(units[n])})" if units[n] else n for n in names))
    rows = [
        [c.condition, c.cycles, c.peak_velocity, *(v.get(n) for n in names)]
        for c, v in zip(conditions, values, strict=True)
    ]
    return Table(caption, heads, rows, digits=4)


def lacks_main(condition: SheetCondition) -> bool:
    """Return whether a condition has no main quantity."""
    return not any(q.value is not None for q in condition.quantities if q.name in MAIN_QUANTITIES)


def condition_table(condition: SheetCondition, unknown: bool = True) -> Table:
    """Return every quantity of a condition; those ``unknown`` with the reason."""
    rows = [[q.name, *numbers_of(q)] for q in condition.quantities if unknown or q.value is not None]
    caption = (
        f"{condition.condition}: {number_of('cycle', condition.cycles)} of {condition.frequency:.4g} Hz, stroke "
        f"{1e3 * condition.stroke:.4g} mm, peak velocity {condition.peak_velocity:.4g} m/s; {condition.source}"
    )
    last = "over cycles, or why not" if unknown else "over cycles"
    return Table(caption, ("quantity", "value", "95 % interval", "unit", last), rows)


def across_table(rows: Sequence[AcrossRow]) -> Table:
    """Return the quantities of several conditions together, in one row those that have none for the same reason."""
    heads = ("conditions", "quantity", "value", "95 % interval", "unit", "note")
    alike = groupby(rows, lambda a: (a.conditions, a.quantity.reason or a.quantity.name))
    cells = [
        [
            first.conditions,
            ", ".join([first.quantity.name, *(a.quantity.name for a in more)]),
            *numbers_of(first.quantity),
        ]
        for _, (first, *more) in alike
    ]
    return Table("Quantities across conditions", heads, cells)


def verdict_table(rows: Sequence[VerdictRow], caption: str = "Verdicts", several: bool = False) -> Table:
    """Return verdicts; those of several units begin with the unit."""
    heads = ("condition", "level", "quantity", "value", "limits", "verdict", "reason")
    cells = [
        [v.condition, VERDICT_LEVELS[v.level], v.quantity, number_text(v), limits_text(v), v.verdict, v.reason]
        for v in rows
    ]
    if several:
        return Table(caption, ("unit", *heads), [[v.unit, *row] for v, row in zip(rows, cells, strict=True)])
    return Table(caption, heads, cells)


def summary_of(file: SheetFile) -> str:
    """Return the numbers of conditions, units and verdicts."""
    conditions = sum(len(unit.conditions) for unit in file.units)
    text = f"{number_of('condition', conditions)} of {number_of('unit', len(file.units))}"
    if file.unmatched and not file.changes:
        text += ", none of them in the logs compared with"
    if not file.limits:
        return f"{text}, without limits"
    verdicts = [unit.verdict for unit in file.units]
    counts = ", ".join(f"{verdicts.count(word)} {word}" for word in (PASS, FAIL, UNDECIDED))
    judged = judged_of(file.units)
    if len(verdicts) == 1:
        return f"{text}, limits '{file.limits}': {judged}: {verdicts[0]}"
    mean = f"; mean of all units: {verdict_of(file.batch)}" if file.batch else ""
    return f"{text}, limits '{file.limits}': {judged}; units by their worst verdict: {counts}{mean}"


def judged_of(units: Sequence[UnitRow]) -> str:
    """Return the number of verdicts, and of the conditions that they are on, in words."""
    verdicts = [(unit.unit, v.condition) for unit in units for v in unit.verdicts]
    conditions = [(unit.unit, c.condition) for unit in units for c in unit.conditions]
    on, across = sum(c in verdicts for c in conditions), bool(set(verdicts) - set(conditions))
    of = number_of("condition", len(conditions))
    return f"{number_of('verdict', len(verdicts))} on {on} of {of}{' and across them' * across}"


def unit_table(file: SheetFile) -> Table:
    """Return the verdicts of every unit as counts."""
    rows = [
        [u.unit, len(u.conditions), *(sum(v.verdict == w for v in u.verdicts) for w in (PASS, FAIL, UNDECIDED))]
        + [u.verdict]
        for u in file.units
    ]
    return Table("Units", ("unit", "conditions", PASS, FAIL, UNDECIDED, "verdict"), rows)


def change_table(file: SheetFile, most: int = CHANGES_SHOWN) -> Table:
    """Return the changes from other logs, those beyond the intervals first."""
    rows = [
        [c.condition, c.quantity, *(shown(c.quantity, v) for v in (c.value, c.against)), change_text(c)]
        + ["changed" if c.changed else "within the intervals"]
        for c in sorted(file.changes, key=lambda c: not c.changed)[:most]
    ]
    heads = ("condition", "quantity", "value", "compared with", "change (95 % interval)", "verdict")
    changed = sum(c.changed for c in file.changes)
    return Table(f"Changed, SI: {changed} of {len(file.changes)} quantities", heads, rows, digits=4)
