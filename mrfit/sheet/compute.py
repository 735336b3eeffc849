"""The sheet of one or several units: quantities, verdicts by two levels, who stands out, and what has changed."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from mrfit.core.counting import number_of
from mrfit.core.progress import Progress, silent
from mrfit.core.recording import Recording
from mrfit.errors import DataError
from mrfit.io.schemas.sheet import ChangeRow, QuantityRow, SheetCondition, SheetFile, StandsOut, UnitRow
from mrfit.io.workspace import plain
from mrfit.measure.quantity import SHEET_QUANTITIES
from mrfit.settings.sheet import Settings
from mrfit.sheet.limits import LimitsFile, batch_verdicts, read_limits, verdict_of, verdicts
from mrfit.sheet.measured import CycleCourse, MeanLoop, Measurements, measured, unit_of

AGAINST = "\0"
"""Unit of the logs that are compared with, which no path names."""
FEWEST_UNITS = 5
LEAST_Z, TO_SIGMA = 3.5, 1.4826
"""Robust z-score of a unit that stands out, and standard deviations in a median absolute deviation (Iglewicz, 1993)."""


@dataclass(frozen=True)
class SheetContent:
    """A sheet, and what its pages draw: mean loops, history of cycles, and the loops it is compared with."""

    file: SheetFile
    loops: list[MeanLoop]
    courses: list[CycleCourse]
    against: list[MeanLoop]


def sheet_of(
    recordings: Sequence[Recording], settings: Settings, against: Sequence[Recording] = (), progress: Progress = silent
) -> SheetContent:
    """Return the sheet of recordings.

    Parameters
    ----------
    recordings
        Logs of displacement and force, in SI.
    settings
        How the sheet is computed.
    against
        Logs to compare with, as of the same unit before a test or of another one; conditions are matched by name.
    progress
        Reports every condition.

    Raises
    ------
    ConfigError
        If the limits or the pattern of units are wrong.
    DataError
        If no recording gives any quantity; the message says why the first does not.
    """
    limits = read_limits(settings.limits) if settings.limits else None
    units_of = {r.id: unit_of(r.source, settings.unit_from) for r in recordings}
    # conditions are named together, so that one name means the same test in both
    others = [replace(r, id=f"against-{r.id}") for r in against]
    units_of |= {r.id: AGAINST for r in others}
    everything = measured([*recordings, *others], units_of, settings, progress)
    found, compared = everything.of_units(lambda u: u != AGAINST), everything.of_units(lambda u: u == AGAINST)
    if not found.rows:
        reason = found.left_out[0][1] if found.left_out else "there is no log"
        more = len(found.left_out) - 1
        raise DataError(
            f"no test here gives a sheet, which needs steady cycles at a held current; {reason}"
            + (f" (and {number_of('more reason', more)})" if more > 0 else "")
        )
    names = list(dict.fromkeys(row.unit for row in found.rows))
    about = dict(settings.about)
    units = [_unit(name, found, limits, about) for name in names]
    changes, unmatched = _changes(found.rows, compared.rows) if against else ([], [])
    nothing = ["no condition is in both: nothing is compared"] if against and not changes else []
    file = SheetFile(
        convention=(
            f"force positive where it resists positive velocity; {settings.rebound} velocity is rebound (extension); "
            "+ and - of a name are the sign of the velocity, of Fd that of the displacement"
        ),
        settings=plain({n: str(v) if n == "limits" and v else v for n, v in asdict(settings).items() if n != "jobs"}),
        limits=(limits.title or str(settings.limits)) if limits else "",
        guard=limits.guard if limits else "",
        units=units,
        batch=batch_verdicts(limits, {u.unit: u.conditions for u in units}, found.across) if limits else [],
        stands_out=_stands_out(units),
        changes=changes,
        unmatched=unmatched,
        left_out=[*(text for _, text in found.left_out + compared.left_out), *nothing],
    )
    return SheetContent(file, found.loops, found.courses, compared.loops)


def _unit(name: str, found: Measurements, limits: LimitsFile | None, about: Mapping[str, str]) -> UnitRow:
    rows = [row for row in found.rows if row.unit == name]
    across = list(found.across.get(name, []))
    judged = verdicts(limits, name, rows, across) if limits else []
    return UnitRow(
        unit=name,
        about=dict(about),
        conditions=rows,
        across=across,
        verdicts=judged,
        verdict=verdict_of(judged),
        left_out=[text for unit, text in found.left_out if unit == name],
    )


def _stands_out(units: Sequence[UnitRow]) -> list[StandsOut]:
    """Return the values of units that are far from those of the others, by quantity and condition."""
    values: dict[tuple[str, str], list[tuple[str, float, float]]] = {}
    for unit in units:
        for condition in unit.conditions:
            for one in condition.quantities:
                if one.name != "closure" and one.value is not None and one.low is not None and one.high is not None:
                    width = (one.high - one.low) / 2.0
                    values.setdefault((condition.condition, one.name), []).append((unit.unit, one.value, width))
    found = []
    for (at, name), rows in values.items():
        numbers = np.array([value for _, value, _ in rows])
        if len({whose for whose, _, _ in rows}) < FEWEST_UNITS:
            continue
        median = float(np.median(numbers))
        sigma = TO_SIGMA * float(np.median(np.abs(numbers - median)))
        for whose, value, width in rows:
            if abs(value - median) > max(LEAST_Z * sigma, width) and sigma > 0.0:
                z = (value - median) / sigma
                found.append(StandsOut(unit=whose, condition=at, quantity=name, value=value, median=median, z=z))
    return sorted(found, key=lambda one: -abs(one.z))


def _changes(rows: Sequence[SheetCondition], others: Sequence[SheetCondition]) -> tuple[list[ChangeRow], list[str]]:
    """Return every quantity beside that of the same condition of other logs, and the conditions without a partner."""
    partners: dict[str, SheetCondition] = {}
    for partner in others:
        partners.setdefault(partner.condition, partner)
    found = []
    for row in rows:
        other = partners.get(row.condition)
        theirs = {q.name: q for q in other.quantities} if other else {}
        for one in row.quantities:
            beside = theirs.get(one.name)
            if beside is None or one.value is None or beside.value is None or one.name not in SHEET_QUANTITIES:
                continue
            widths = [(q.high - q.low) / 2.0 for q in (one, beside) if q.low is not None and q.high is not None]
            half = float(np.hypot(widths[0], widths[1])) if len(widths) == 2 else None
            apart, over = one.value - beside.value, _size(beside)
            found.append(
                ChangeRow(
                    unit=row.unit,
                    condition=row.condition,
                    quantity=one.name,
                    value=one.value,
                    against=beside.value,
                    change=apart / over if over else None,
                    low=(apart - half) / over if over and half is not None else None,
                    high=(apart + half) / over if over and half is not None else None,
                    changed=half is not None and abs(apart) > half,
                )
            )
    names = {row.condition for row in rows}
    alone = [c for c in dict.fromkeys([*names, *partners]) if (c in names) != (c in partners)]
    return found, sorted(alone)


def _size(row: QuantityRow) -> float:
    """Return a quantity's magnitude, of which a change is a share; 0 where it is not distinct from zero."""
    known = row.value is not None and not (row.low is not None and row.high is not None and row.low <= 0.0 <= row.high)
    return abs(row.value or 0.0) if known else 0.0
