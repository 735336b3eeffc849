"""Recordings to the quantities of a test sheet: cut into whole cycles by condition, measured, grouped by unit."""

import fnmatch
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from mrfit.core.executors.order import spread
from mrfit.core.progress import Progress, silent
from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array
from mrfit.errors import ConfigError, DataError
from mrfit.io.schemas.sheet import AcrossRow, QuantityRow, SheetCondition
from mrfit.measure import bilinear, conditions, current_steps, energy, forces, loop_shape, slow_cycles
from mrfit.measure.conditions import LEAST_CURRENT, ConditionForce, same_current
from mrfit.measure.cycles import BRANCH_GRID, Cycles, cycles_of
from mrfit.measure.phase import widened
from mrfit.measure.quantity import SHEET_QUANTITIES, Quantity
from mrfit.measure.usable import unusable
from mrfit.report.numbers import significant
from mrfit.segment.conditions import name_conditions
from mrfit.segment.detect import Detection, detect
from mrfit.settings.segment import Settings as SegmentSettings
from mrfit.settings.sheet import Settings
from mrfit.signal.cycles import turning_points
from mrfit.signal.noise import noise_level
from mrfit.signal.savitzky_golay import Smoother

ONE_UNIT = "unit"
LOGS_FOR_PROCESSES = 40
"""Logs from which on processes save more time than their start takes."""
SENSITIVE = 0.002
"""Share by which one sample of skew has to change a quantity to be said."""
UNSTEADY_SWING = 0.05
"""Share of the range below which a swing of an unsteady record is no reversal."""


@dataclass(frozen=True)
class MeanLoop:
    """The mean cycle of a condition as it is drawn: displacement in m, velocity in m/s, force in N, each (N,)."""

    unit: str
    condition: str
    current: float
    displacement: Array
    velocity: Array
    force: Array


@dataclass(frozen=True)
class CycleCourse:
    """Peak force in N and temperature in degC (nan where not logged) of the cycles of a condition, for its history."""

    unit: str
    condition: str
    force: Array
    temperature: Array


@dataclass(frozen=True)
class Measurements:
    """Content of the logs: rows, loops and courses, quantities across conditions by unit, and logs left out."""

    rows: list[SheetCondition]
    loops: list[MeanLoop]
    courses: list[CycleCourse]
    across: Mapping[str, list[AcrossRow]]
    left_out: list[tuple[str, str]]

    def of_units(self, wanted: Callable[[str], bool]) -> "Measurements":
        """Return the part of some units."""
        return Measurements(
            [row for row in self.rows if wanted(row.unit)],
            [loop for loop in self.loops if wanted(loop.unit)],
            [course for course in self.courses if wanted(course.unit)],
            {unit: rows for unit, rows in self.across.items() if wanted(unit)},
            [(unit, text) for unit, text in self.left_out if wanted(unit)],
        )


def unit_of(source: str, pattern: str, option: str = "--unit-from") -> str:
    """Return the name of the unit in the path of a log.

    Raises
    ------
    ConfigError
        If the pattern has no ``{unit}``, or the path does not match it.
    """
    if not pattern:
        return ONE_UNIT
    if pattern.count("{unit}") != 1:
        raise ConfigError(f"{option} '{pattern}' has to hold {{unit}} once, as '*/{{unit}}_*.csv'")
    # Python 3.14 writes the end of a pattern in a small letter
    before, after = (
        fnmatch.translate(part).removeprefix("(?s:").removesuffix(r")\Z").removesuffix(r")\z")
        for part in pattern.split("{unit}")
    )
    anchored = before if before.startswith((".*", "/")) else rf"(?:.*/)?{before}"
    found = re.fullmatch(rf"(?s:{anchored}(?P<unit>[^/]+?){after})", Path(source).as_posix())
    if found is None:
        raise ConfigError(f"{option} '{pattern}' does not match '{source}'; write it for the whole name of a log")
    return found["unit"]


def measured(
    recordings: Sequence[Recording], units: Mapping[str, str], settings: Settings, progress: Progress = silent
) -> Measurements:
    """Return the quantities of recordings, condition by condition.

    Parameters
    ----------
    recordings
        Logs of displacement and force, in SI; others are left out with the reason.
    units
        Unit of every recording, by its id.
    settings
        How the sheet is computed.
    progress
        Reports every recording.
    """
    reasons = {r.id: _unusable(r) for r in recordings}
    left = [(units[r.id], f"{r.source}: {reasons[r.id]}") for r in recordings if reasons[r.id]]
    usable = {r.id: r for r in recordings if not reasons[r.id]}
    tests = [RecordingTest(usable[name], units[name], settings) for name in sorted(usable)]
    jobs = settings.jobs if len(tests) >= LOGS_FOR_PROCESSES else 1
    found = list[MeasuredRecording]()
    for one in spread(_of_recording, tests, jobs, silent):
        found.append(one)
        progress("logs", len(found), len(tests))
    segments = [s for one in found for s in one.detection.segments]
    stated, wording = ({name: getattr(r, kind) for name, r in usable.items()} for kind in ("condition", "wording"))
    names = iter([s.condition for s in name_conditions(segments, stated, wording)])
    rows, loops, courses = list[SheetCondition](), list[MeanLoop](), list[CycleCourse]()
    levels: dict[str, list[list[ConditionForce]]] = {}
    done, refused, said = set(), set(), dict[str, list[str]]()
    for test, one in zip(tests, found, strict=True):
        name, unit = test.recording.id, test.unit
        # a set without any segment has its reasons of its own
        said[name] = [f.partition(": ")[2] for f in one.detection.findings if segments]
        for condition in one.conditions:
            called = next(names)
            if isinstance(condition, str):
                left.append((unit, f"{test.recording.source}: {called}: {condition}"))
                refused.add(name)
            elif condition is not None:
                own = condition.called(called)
                rows.append(replace(own.row, findings=[*own.row.findings, *said[name]]))
                loops.append(own.loop)
                courses.append(own.course)
                levels.setdefault(unit, []).append(own.levels)
                done.add(name)
                said[name] = []
    for name, recording in usable.items():
        whole = _whole_record(recording, units[name], name in done, said[name])
        rows += [whole] if isinstance(whole, SheetCondition) else []
        # of what is refused already, the reason is known
        left += [(units[name], whole)] if isinstance(whole, str) and name not in refused else []
    across = {unit: _across(own) for unit, own in levels.items()}
    return Measurements(rows, loops, courses, across, left)


def _unusable(recording: Recording) -> str:
    """Return the reason against a sheet of a recording; empty where there is none."""
    lacking = [name for name in ("displacement", "force") if name not in recording.channels]
    if lacking:
        there = ", ".join(recording.channels)
        return f"no {' and no '.join(lacking)}; a sheet takes both, and there are {there}; a channel map names columns"
    return next(filter(None, (unusable(name, recording.channels[name]) for name in ("displacement", "force"))), "")


@dataclass(frozen=True)
class RecordingTest:
    """A recording of a unit, and the settings by which it is measured."""

    recording: Recording
    unit: str
    settings: Settings


@dataclass(frozen=True)
class MeasuredCondition:
    """Quantities of one condition, its mean loop and course, and its forces for quantities across conditions."""

    row: SheetCondition
    loop: MeanLoop
    course: CycleCourse
    levels: list[ConditionForce]

    def called(self, condition: str) -> "MeasuredCondition":
        """Return the same under the name of its condition."""
        return MeasuredCondition(
            replace(self.row, condition=condition),
            replace(self.loop, condition=condition),
            replace(self.course, condition=condition),
            [replace(one, condition=condition) for one in self.levels],
        )


@dataclass(frozen=True)
class MeasuredRecording:
    """Segments of a recording, and what each gives: quantities, the reason against any, None without whole cycles."""

    detection: Detection
    conditions: list[MeasuredCondition | str | None]


def cycle_quantities(cycles: Cycles, sine: bool, settings: Settings) -> list[Quantity]:
    """Return the quantities of the whole cycles of a condition; ``sine`` says whether the drive is one."""
    central = settings.central / 100.0

    def quantities(some: Cycles, of_these: forces.Forces) -> list[Quantity]:
        return [
            *forces.quantities(some, of_these, settings.rebound == "positive"),
            *energy.quantities(some, of_these, sine),
            *bilinear.quantities(some, of_these),
            *loop_shape.quantities(some, of_these, settings.width_at),
        ]

    own, late = forces.forces_of(cycles, central), cycles.late_by(cycles.dt)
    found = widened(cycles, quantities(cycles, own), quantities(late, forces.forces_of(late, central, own.peaks)))
    found += [loop_shape.ripple(cycles, own), *slow_cycles.quantities(cycles, settings.slow)]
    by_name = {q.name: q.estimate for q in found if q.estimate}
    for sign in ("+", "-"):
        lost = conditions.fade_over_cycles(by_name[f"Fmax{sign}"])
        found.append(Quantity(f"fade{sign}", lost, "" if lost else "fewer than three cycles"))
    return sorted(found, key=lambda q: list(SHEET_QUANTITIES).index(q.name))


def _of_recording(test: RecordingTest, progress: Progress) -> MeasuredRecording:
    """Return the quantities of a recording, whose conditions have no names yet."""
    cut = SegmentSettings()
    detection = detect(test.recording, "displacement", cut.min_cycles, cut.settle, cut.tolerance)
    return MeasuredRecording(detection, [_of_segment(test, s) if s.cycles else None for s in detection.segments])


def _of_segment(test: RecordingTest, segment: Segment) -> MeasuredCondition | str:
    try:
        return _measured(test.recording, segment, test.unit, test.settings)
    except DataError as error:
        return str(error)


def _measured(recording: Recording, segment: Segment, unit: str, settings: Settings) -> MeasuredCondition:
    if "current" in recording.channels and np.isnan(segment.current):
        raise DataError(
            "the current moves within the cycles, so that of these only the response to its steps is measured"
        )
    cycles, findings = cycles_of(recording, segment, settings.skew), list[str]()
    if float(energy.work_of(cycles).values.mean()) < 0.0:
        cycles = cycles.negated()
        findings.append("the force is negated: its work over a cycle is negative, and a damper takes work")
    found = cycle_quantities(cycles, segment.waveform == "sine", settings)
    by_name = {q.name: q.estimate for q in found if q.estimate}
    findings += _sensitive(cycles, found)
    temperature, doubt = _temperatures(recording, cycles), doubt_of(recording)
    current = 0.0 if abs(segment.current) < LEAST_CURRENT else segment.current
    speed = cycles.peak_velocity * cycles.gain
    levels = [
        ConditionForce(segment.condition, speed, current, segment.temperature, by_name[name])
        for name in ("F0+", "F0-", "Fmax+", "Fmax-")
    ]
    row = SheetCondition(
        unit=unit,
        condition=segment.condition,
        recording=recording.id,
        source=recording.source,
        waveform=segment.waveform,
        frequency=1.0 / cycles.period,
        stroke=cycles.stroke * cycles.gain,
        peak_velocity=speed,
        current=_finite(current),
        temperature=_finite(float(np.mean(temperature))),
        cycles=cycles.count,
        samples_per_cycle=cycles.per_cycle,
        noise=cycles.noise,
        quantities=[quantity_row(q, doubt) for q in found],
        findings=[*findings, *(f.text for f in recording.findings)],
    )
    course = CycleCourse(unit, segment.condition, by_name["Fmax+"].cycles, temperature)
    return MeasuredCondition(row, _loop(cycles, replace(segment, current=current), unit), course, levels)


def _sensitive(cycles: Cycles, found: Sequence[Quantity]) -> list[str]:
    """Return the changes by a skew of one sample that are more than the intervals; peak forces have none."""
    peak = max(abs(q.estimate.value) for q in found if q.name in ("Fmax+", "Fmax-") and q.estimate)
    words = []
    for one in found:
        known = one.estimate
        if one.late is None or known is None or one.name == "closure":
            continue
        scale = peak if SHEET_QUANTITIES[one.name][0] == "N" else abs(known.value) * (abs(known.value) > known.error)
        change = abs(one.late - known.value)
        if change > max(SENSITIVE * scale, known.error) and scale > 0.0:
            words.append(f"{one.name} by {significant(100.0 * change / scale, 2)} %")
    if not words:
        return []
    return [
        f"a force recorded one sample ({1e3 * cycles.dt:.3g} ms) late or early would change "
        f"{', '.join(words)} (forces: of the peak); --skew corrects a known time"
    ]


def _temperatures(recording: Recording, cycles: Cycles) -> Array:
    """Return the mean temperature of every cycle in degC, nan where it is not known."""
    if "temperature" not in recording.channels:
        return np.full(cycles.count, float(recording.condition.get("temperature", np.nan)))
    edges = (cycles.reversals[::2] / recording.dt).astype(np.int64)
    return np.array([np.mean(recording.channels["temperature"][a:b]) for a, b in zip(edges, edges[1:], strict=False)])


def _loop(cycles: Cycles, segment: Segment, unit: str) -> MeanLoop:
    parts = []
    for up in (True, False):
        curve = cycles.pooled(up)
        some = np.unique(np.linspace(0, len(curve.at) - 1, 97).round().astype(np.int64))
        moved, speed = cycles.table[up]
        at = curve.at[some]
        parts.append((np.interp(at, BRANCH_GRID, moved), np.interp(at, BRANCH_GRID, speed), curve.force[some]))
    joined = [np.concatenate([*column, column[0][:1]]) for column in zip(*parts, strict=True)]
    return MeanLoop(unit, segment.condition, segment.current, *joined)


def _whole_record(recording: Recording, unit: str, measured: bool, said: Sequence[str]) -> SheetCondition | str | None:
    """Return quantities beside those of steady cycles: response to steps of the current, yield by growing cycles.

    A text says why it has no sheet at all.
    """
    stroke, force = (np.asarray(recording.channels[n], dtype=np.float64) for n in ("displacement", "force"))
    found: list[Quantity] = []
    if "current" in recording.channels:
        current = np.asarray(recording.channels["current"], dtype=np.float64)
        velocity = (
            Smoother(stroke, moves=True).smoothed(1).values / recording.dt
            if np.ptp(current) > 8.0 * noise_level(current)
            else stroke
        )
        found = [
            q for q in current_steps.quantities(current, force, velocity, recording.dt) if q.estimate or not measured
        ]
        if not any(q.estimate for q in found):
            found = []
    turns = turning_points(stroke, UNSTEADY_SWING * float(np.ptp(stroke)))
    inner = turns[(turns > 0) & (turns < len(stroke) - 1)]
    if not measured:
        if len(inner) < 2:
            return f"{recording.source}: less than a whole cycle; log at least one, better five or more"
        found = [*bilinear.by_peaks(stroke, force, inner.tolist()), *found]
    if not any(q.estimate for q in found):
        reason = said[0] if said else "no steady cycles: amplitude or frequency differ from cycle to cycle"
        return None if measured else f"{recording.source}: {reason}"
    low, high, doubt = float(stroke.min()), float(stroke.max()), doubt_of(recording)
    return SheetCondition(
        unit=unit,
        condition=f"{recording.id} (whole record)",
        recording=recording.id,
        source=recording.source,
        waveform="unsteady",
        frequency=0.0,
        stroke=high - low,
        peak_velocity=float(np.max(np.abs(Smoother(stroke, moves=True).smoothed(1).values))) / recording.dt,
        current=_finite(float(recording.condition.get("current", np.nan))),
        temperature=None,
        cycles=len(inner) // 2,
        samples_per_cycle=0.0,
        noise=noise_level(force),
        quantities=[quantity_row(q, doubt) for q in found],
        findings=list(said),
    )


def doubt_of(recording: Recording) -> str:
    """Return the finding on a force or stroke that is cut off or garbled: intervals are then not known; else empty."""
    measured = (f for f in recording.findings if f.channel in ("force", "displacement"))
    return next((f.text for f in measured if f.kind in ("clipped", "outlier")), "")


def quantity_row(one: Quantity, doubt: str = "") -> QuantityRow:
    """Return a quantity as its row, without an interval where there is a doubt."""
    unit, found = SHEET_QUANTITIES[one.name][0], one.estimate
    if found is None:
        return QuantityRow(name=one.name, unit=unit, reason=one.reason)
    slope = asdict(found.slope) if found.slope else {}
    return QuantityRow(
        name=one.name,
        unit=unit,
        value=found.value,
        low=None if doubt else _finite(found.low),
        high=None if doubt else _finite(found.high),
        reason=doubt,
        cycles=[float(v) for v in found.cycles],
        noise=None if doubt else _finite(found.noise),
        slope=slope.get("value"),
        slope_low=slope.get("low"),
        slope_high=slope.get("high"),
        greatest_deviation=found.greatest_deviation,
        first_to_third=found.first_to_third,
        drift=found.drift,
    )


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _across(levels: Sequence[list[ConditionForce]]) -> list[AcrossRow]:
    """Return the quantities of several conditions of one unit."""
    found = []
    by_current = sorted(levels, key=lambda four: four[0].current)
    for group in conditions.grouped(by_current, lambda one, other: same_current(one[0], other[0])):
        current = group[0][0].current
        name = "all speeds" if np.isnan(current) else f"all speeds, {current:.3g} A"
        for sign, place in (("+", 0), ("-", 1)):
            law = conditions.power_law([one[place] for one in group], sign)
            found += [AcrossRow(conditions=name, quantity=quantity_row(q)) for q in law]
    for name, quantity in conditions.dynamic_range([one[2:] for one in levels]):
        found.append(AcrossRow(conditions=name, quantity=quantity_row(quantity)))
    for sign, place in (("+", 2), ("-", 3)):
        for name, quantity in conditions.fade([one[place] for one in levels], f"fade{sign}"):
            found.append(AcrossRow(conditions=f"{name}, by temperature", quantity=quantity_row(quantity)))
    return found
