"""Limits of a test sheet and the verdicts of a unit, of its cycles and of a batch.

A value passes where its whole 95 % interval lies within the limits, fails where all of it lies outside, and cannot be
judged where it straddles one. So at most 2.5 % of the units at a limit pass wrongly, and at most 2.5 % fail wrongly.

Source: decision rules with a guard band, JCGM 106:2012, clauses 8.3.2 and 8.3.3.
"""

import fnmatch
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import ConfigDict, Field
from scipy.special import ndtri

from mrfit.errors import ConfigError, near
from mrfit.ingest.meaning.units import compatible, known, to_unit
from mrfit.io.schemas.sheet import FAIL, PASS, UNDECIDED, AcrossRow, QuantityRow, SheetCondition, VerdictRow
from mrfit.io.toml_file import TomlTable, read_tables
from mrfit.measure.quantity import SHEET_QUANTITIES

Tolerance = float | str
Place = tuple[str, str, str]
"""Level, unit and condition of a verdict."""
PERCENT = re.compile(r"\s*(\d+(?:\.\d+)?)\s*%\s*")
SIGNED = ("F0-", "Fd-", "Fmax-")
"""Quantities of negative direction, whose target may be written as a magnitude."""
WRONG_VERDICT = 0.025
"""Chance of a wrong verdict at a limit."""


class Limit(TomlTable):
    """A limit of a quantity.

    Attributes
    ----------
    quantity, condition
        Which quantity, and a pattern on conditions.
    target, tolerance
        Wanted value, and what it may differ by, in ``unit`` or as ``"15 %"`` of the target.
    least, most
        Limits in ``unit``, instead of target and tolerance or beside them.
    unit
        Unit of the numbers; empty for SI.
    batch_tolerance
        What the mean of all units may differ from the target by.
    cycle_tolerance
        What one cycle may differ from the mean of all cycles by.
    """

    model_config = ConfigDict(allow_inf_nan=False)

    quantity: str
    condition: str = "*"
    target: float | None = None
    tolerance: Tolerance | None = None
    least: float | None = None
    most: float | None = None
    unit: str = ""
    batch_tolerance: Tolerance | None = None
    cycle_tolerance: Tolerance | None = None


class LimitsFile(TomlTable):
    """A file of limits; ``guard`` says whether a value is judged with its interval or alone."""

    title: str = ""
    guard: Literal["interval", "none"] = "interval"
    limit: list[Limit] = Field(min_length=1)


def read_limits(path: Path) -> LimitsFile:
    """Return a file of limits, its numbers in SI.

    Raises
    ------
    ConfigError
        If the file cannot be read, or a key, a quantity, a unit or a number in it is wrong.
    """
    found = read_tables(path, LimitsFile, "a file of limits")
    limits = [_in_si(one, f"{path}: [[limit]] {k}") for k, one in enumerate(found.limit, 1)]
    return found.model_copy(update={"limit": limits})


def quantity_named(text: str) -> str | None:
    """Return the name of a quantity, whatever the case of its letters and the kind of its minus sign; None if none."""
    wanted = text.replace("−", "-").strip().lower()
    return next((name for name in SHEET_QUANTITIES if name.lower() == wanted), None)


def _in_si(one: Limit, where: str) -> Limit:
    name = quantity_named(one.quantity)
    if name is None:
        meant = near(one.quantity, SHEET_QUANTITIES)
        raise ConfigError(
            f"{where}: there is no quantity '{one.quantity}'{meant}; there are {', '.join(SHEET_QUANTITIES)}"
        )
    where, unit = f"{where}, {name}", SHEET_QUANTITIES[name][0] or "1"
    scale = 1.0
    if one.unit and one.unit != unit:
        if not known(one.unit) or "alpha" in unit or not compatible(one.unit, unit):
            raise ConfigError(f"{where}: '{one.unit}' is no unit of this quantity; give one of {_plain(unit)}")
        scale = to_unit(one.unit, unit).scale
    if one.target is None and one.least is None and one.most is None and one.cycle_tolerance is None:
        raise ConfigError(f"{where}: says no limit; give target with tolerance, least, most, or cycle_tolerance")
    for key in ("tolerance", "batch_tolerance", "cycle_tolerance"):
        _check_tolerance(one, key, where)
    if one.target is not None and one.tolerance is None and one.batch_tolerance is None:
        raise ConfigError(f'{where}: target without tolerance; add tolerance = "15 %", or a number in its unit')
    if one.least is not None and one.most is not None and one.least > one.most:
        raise ConfigError(f"{where}: least {one.least:g} is above most {one.most:g}")
    scaled = {
        n: scale * v
        for n in ("target", "least", "most", "tolerance", "batch_tolerance", "cycle_tolerance")
        if isinstance(v := getattr(one, n), float)
    }
    return one.model_copy(update={"quantity": name, **scaled})


def _plain(unit: str) -> str:
    return "a pure number, as 1 or %" if unit == "1" else f"{unit}, or what converts to it"


def _check_tolerance(one: Limit, key: str, where: str) -> None:
    value = getattr(one, key)
    if isinstance(value, str) and not PERCENT.fullmatch(value):
        raise ConfigError(f"{where}: {key} takes a share as \"15 %\" or a number, not '{value}'")
    if isinstance(value, float) and value < 0.0:
        raise ConfigError(f"{where}: {key} is negative, {value:g}; give what may differ in either direction")
    if value is not None and key != "cycle_tolerance" and one.target is None:
        raise ConfigError(f"{where}: {key} without a target; add target = …")


def _width(tolerance: Tolerance, of: float) -> float:
    """Return a tolerance in SI."""
    if isinstance(tolerance, float):
        return tolerance
    share = PERCENT.fullmatch(tolerance)
    assert share
    return float(share[1]) / 100.0 * abs(of)


def decide(value: tuple[float, float, float], ends: tuple[float, float], guard: bool = True) -> str:
    """Return pass, fail or cannot be judged of (value, low, high) within the limits ``ends``."""
    middle, low, high = value if guard else (value[0],) * 3
    if ends[0] <= low and high <= ends[1]:
        return PASS
    return FAIL if high < ends[0] or low > ends[1] else UNDECIDED


def verdicts(
    limits: LimitsFile, unit: str, conditions: Sequence[SheetCondition], across: Sequence[AcrossRow]
) -> list[VerdictRow]:
    """Return the verdicts of a unit: of every limit on every condition that its pattern matches."""
    found = []
    rows = _rows(conditions, across)
    for limit in limits.limit:
        own = [(c, q) for c, q in rows if q.name == limit.quantity and fnmatch.fnmatchcase(c, limit.condition)]
        for condition, row in own:
            if limit.tolerance is not None or limit.least is not None or limit.most is not None:
                found.append(_of_value(limits, limit, unit, condition, row))
            if limit.cycle_tolerance is not None:
                found.append(_of_cycles(limits, limit, unit, condition, row))
        if not own:
            of = "no condition of this unit" if limit.condition == "*" else f"no condition like '{limit.condition}'"
            found.append(_undecided(limit, ("unit", unit, limit.condition), f"{of} has this quantity"))
    return found


def _rows(conditions: Sequence[SheetCondition], across: Sequence[AcrossRow]) -> list[tuple[str, QuantityRow]]:
    """Return the quantities of a unit, each behind the name of its conditions."""
    own = [(c.condition, q) for c in conditions for q in c.quantities]
    return own + [(a.conditions, a.quantity) for a in across]


def verdict_of(rows: Sequence[VerdictRow]) -> str:
    """Return the verdict of several: the worst; empty of none."""
    there = {row.verdict for row in rows}
    return next((one for one in (FAIL, UNDECIDED, PASS) if one in there), "")


def batch_verdicts(
    limits: LimitsFile,
    units: Mapping[str, Sequence[SheetCondition]],
    across: Mapping[str, Sequence[AcrossRow]] | None = None,
) -> list[VerdictRow]:
    """Return the verdicts on the mean of all units, by limit and condition, quantities across conditions among them."""
    found = []
    every = [row for unit, own in units.items() for row in _rows(own, (across or {}).get(unit, ()))]
    for limit in limits.limit:
        if limit.batch_tolerance is None or limit.target is None:
            continue
        there = dict.fromkeys(c for c, q in every if q.name == limit.quantity)
        names = [n for n in there if fnmatch.fnmatchcase(n, limit.condition)]
        if not names:
            place = ("batch", "all units", limit.condition)
            found.append(_undecided(limit, place, "no unit has this quantity in such a condition"))
        for condition in names:
            rows = [q for c, q in every if c == condition and q.name == limit.quantity]
            place = ("batch", "all units", condition)
            values = [(q.value, q.low, q.high) for q in rows if None not in (q.value, q.low, q.high)]
            if not values:
                found.append(_undecided(limit, place, "no unit has a value with an interval"))
                continue
            numbers = np.array(values, dtype=np.float64)
            mean = float(numbers[:, 0].mean())
            half = float(np.sqrt(np.sum(((numbers[:, 2] - numbers[:, 1]) / 2.0) ** 2))) / len(numbers)
            target = _signed(limit.target, mean, limit.quantity)
            width = _width(limit.batch_tolerance, limit.target)
            found.append(
                _row(limit, place, (mean, mean - half, mean + half), (target - width, target + width), limits.guard)
            )
    return found


def _signed(target: float, value: float, quantity: str) -> float:
    """Return a target with the sign of the direction, where it was written as a magnitude."""
    return -target if quantity in SIGNED and target > 0.0 > value else target


def _of_value(limits: LimitsFile, limit: Limit, unit: str, condition: str, row: QuantityRow) -> VerdictRow:
    place = ("unit", unit, condition)
    if row.value is None or row.low is None or row.high is None:
        return _undecided(limit, place, row.reason or "its interval is not known")
    least, most = limit.least, limit.most
    if limit.quantity in SIGNED and row.value < 0.0 and (least or 0.0) >= 0.0 and (most or 0.0) >= 0.0:
        # written as magnitudes
        least, most = (None if most is None else -most), (None if least is None else -least)
    low, high = (-np.inf if least is None else least), (np.inf if most is None else most)
    if limit.target is not None and limit.tolerance is not None:
        target, width = _signed(limit.target, row.value, limit.quantity), _width(limit.tolerance, limit.target)
        low, high = max(low, target - width), min(high, target + width)
    return _row(limit, place, (row.value, row.low, row.high), (float(low), float(high)), limits.guard)


def _of_cycles(limits: LimitsFile, limit: Limit, unit: str, condition: str, row: QuantityRow) -> VerdictRow:
    place = ("cycle", unit, condition)
    assert limit.cycle_tolerance is not None
    if row.value is None or len(row.cycles) < 2 or row.greatest_deviation is None or row.noise is None:
        return _undecided(limit, place, row.reason or "one cycle; two are needed")
    off = row.greatest_deviation * abs(row.value)
    # the greatest of all cycles
    half = float(ndtri(1.0 - WRONG_VERDICT / len(row.cycles))) * row.noise
    width = _width(limit.cycle_tolerance, row.value)
    return _row(limit, place, (off, max(off - half, 0.0), off + half), (0.0, width), limits.guard)


def _row(
    limit: Limit, place: Place, value: tuple[float, float, float], ends: tuple[float, float], guard: str
) -> VerdictRow:
    said = decide(value, ends, guard == "interval")
    least, most = (end if np.isfinite(end) else None for end in ends)
    row = _undecided(limit, place, "the interval straddles a limit" if said == UNDECIDED else "")
    return replace(row, value=value[0], low=value[1], high=value[2], least=least, most=most, verdict=said)


def _undecided(limit: Limit, place: Place, reason: str) -> VerdictRow:
    level, unit, condition = place
    return VerdictRow(
        level=level,
        unit=unit,
        condition=condition,
        quantity=limit.quantity,
        si_unit=SHEET_QUANTITIES[limit.quantity][0],
        verdict=UNDECIDED,
        reason=reason,
    )
