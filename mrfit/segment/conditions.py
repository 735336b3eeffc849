"""Name test conditions and share them out between training and hold-out, whatever the order of the files."""

import fnmatch
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import isclose

import numpy as np

from mrfit.core.counting import few, number_of
from mrfit.core.recording import FLUX_RESISTANCE, NAMING, Segment
from mrfit.core.specs import Array
from mrfit.errors import ConfigError

# Segments are repeats of one condition if they differ by less than this.
SAME_TEST_FREQUENCY, SAME_TEST_AMPLITUDE, SAME_TEST_LEVEL, SAME_TEMPERATURE = 0.03, 0.05, 0.03, 5.0
LEAST_CURRENT = 0.02
# A stated value names a condition if the data agree with it within this share.
STATED_TOLERANCE = 0.25
# Share of the conditions that is held out
CONDITIONS_HELD_OUT = 0.25
FEWEST_FOR_HOLDOUT = 4
BIAS = 0.1
ROUNDED_LEVEL = 0.02
CONDITION_UNITS: Mapping[str, tuple[float, str]] = {
    "current": (1.0, "A"),
    "displacement": (1e3, "mm"),
    "velocity": (1e3, "mmps"),
    "angle": (1.0, "rad"),
    "angular_velocity": (1.0, "radps"),
    "excitation_force": (1.0, "N"),
    "base_acceleration": (1.0, "mps2"),
}
QUANTITIES = (*NAMING, "offset", "temperature")


@dataclass(frozen=True, slots=True)
class _SegmentConditions:
    """A segment with the stated values that its data agree with, nan where there is none.

    ``others`` are the stated values of all other quantities, ``words`` how a name says these.
    """

    segment: Segment
    frequency: float
    amplitude: float
    current: float
    others: Mapping[str, float]
    words: tuple[str, ...]


def name_conditions(
    segments: Sequence[Segment],
    stated: Mapping[str, Mapping[str, float]],
    wording: Mapping[str, Mapping[str, str]] | None = None,
) -> list[Segment]:
    """Return the segments with their conditions named, as in ``sine-5Hz-2mm-0.25A`` or ``sine-5Hz-2mm-0.25A-5bar``.

    Parameters
    ----------
    segments
        Segments of all recordings.
    stated
        Recording id -> the condition its file name or header states. Values that agree with the data within 25 % name
        the condition; otherwise measured values do, rounded within 2 %. Other quantities, as a pressure, are taken as
        stated: logs that do not state the same of them are of different conditions.
    wording
        Recording id -> quantity -> how a name says it; default: its value in SI.
    """
    members = [_agreed(s, stated.get(s.recording, {}), (wording or {}).get(s.recording, {})) for s in segments]
    clusters = sorted(_clusters(members), key=lambda c: _sorting_key([members[i] for i in c]))
    taken: set[str] = set()
    named = list(segments)
    for cluster in clusters:
        name = _unique_name([members[i] for i in cluster], taken)
        taken.add(name)
        for i in cluster:
            named[i] = replace(segments[i], condition=name)
    return named


def _agreed(segment: Segment, stated: Mapping[str, float], wording: Mapping[str, str]) -> _SegmentConditions:
    given = dict(stated)
    if "amplitude" not in given and segment.drive in given:
        # A coil test's file name gives one current: its amplitude.
        given["amplitude"] = given[segment.drive]
    values = {}
    for name in NAMING:
        value, measured = given.get(name, np.nan), float(getattr(segment, name))
        agrees = abs(value - measured) <= max(
            STATED_TOLERANCE * abs(measured), LEAST_CURRENT if name == "current" else 0.0
        )
        values[name] = value if agrees else np.nan
    own = {*values, segment.drive, "resistance", FLUX_RESISTANCE}
    others = {n: v for n, v in sorted(given.items()) if n not in own and not n.startswith("measured_")}
    words = tuple(wording.get(n) or _worded(n, v) for n, v in others.items())
    return _SegmentConditions(segment, **values, others=others, words=words)


def _worded(name: str, value: float) -> str:
    return f"{value:.6g}degC" if name == "temperature" else f"{name}{value:.6g}"


def _clusters(members: Sequence[_SegmentConditions]) -> list[list[int]]:
    """Return indices grouped so that segments that are alike, or linked by a chain of alike ones, are together."""
    clusters = [c for island in _islands(members) for c in _linked(members, island)]
    return sorted(clusters, key=lambda cluster: cluster[0])


def _islands(members: Sequence[_SegmentConditions]) -> list[list[int]]:
    """Return indices parted where no chain of alike segments crosses a gap in frequency, or in amplitude.

    Comparing every two segments of a thousand logs would take longer than reading these.
    """
    islands = [list(range(len(members)))]
    for name, share in (("frequency", SAME_TEST_FREQUENCY), ("amplitude", SAME_TEST_AMPLITUDE)):
        parted = []
        for island in islands:
            values = np.array([float(getattr(members[i].segment, name)) for i in island])
            order = np.argsort(values, kind="stable")
            gaps = np.diff(values[order]) > share * values[order][1:]
            pieces = np.split(order, np.flatnonzero(gaps) + 1)
            parted += [sorted(island[k] for k in piece) for piece in pieces if len(piece)]
        islands = parted
    return islands


def _linked(members: Sequence[_SegmentConditions], left: list[int]) -> list[list[int]]:
    """Return indices grouped by chains of alike segments, all compared with each other."""
    clusters = []
    while left:
        cluster, fresh = [], [left.pop(0)]
        while fresh:
            cluster += fresh
            near = [j for j in left if any(_alike(members[i], members[j]) for i in fresh)]
            left = [j for j in left if j not in near]
            fresh = near
        clusters.append(sorted(cluster))
    return clusters


def _alike(one: _SegmentConditions, other: _SegmentConditions) -> bool:
    a, b = one.segment, other.segment
    if (a.waveform, a.drive) != (b.waveform, b.drive):
        return False
    # Conditions stated to differ do differ, however close their data are.
    if any(abs(getattr(one, n) - getattr(other, n)) > 1e-9 for n in NAMING):
        return False
    if one.others.keys() != other.others.keys():
        return False
    if not all(isclose(v, other.others[n]) for n, v in one.others.items()):
        return False
    amplitude = max(a.amplitude, b.amplitude)
    limits = {
        "frequency": SAME_TEST_FREQUENCY * max(a.frequency, b.frequency),
        "amplitude": SAME_TEST_AMPLITUDE * amplitude,
        "current": max(SAME_TEST_LEVEL * max(abs(a.current), abs(b.current)), LEAST_CURRENT),
        "temperature": SAME_TEMPERATURE,
        "offset": SAME_TEST_AMPLITUDE * amplitude if a.drive == "current" else np.inf,
    }
    return not any(abs(getattr(a, n) - getattr(b, n)) > limit for n, limit in limits.items()) and (
        np.isnan(a.current) == np.isnan(b.current)
    )


def _median(members: Sequence[_SegmentConditions], name: str) -> float:
    values = [v for m in members if np.isfinite(v := float(getattr(m.segment, name)))]
    return float(np.median(values)) if values else float("nan")


def _sorting_key(members: Sequence[_SegmentConditions]) -> tuple[object, ...]:
    first = members[0].segment
    return (first.waveform, first.drive, *(np.nan_to_num(_median(members, n), nan=-1e300) for n in QUANTITIES))


def _unique_name(members: Sequence[_SegmentConditions], taken: set[str]) -> str:
    """Return the shortest name not yet taken: with the temperature, or with more digits, where the plain one is."""
    temperature = _median(members, "temperature")
    tail = f"-{temperature:.0f}degC" if np.isfinite(temperature) and "temperature" not in members[0].others else ""
    for digits in (1, 2, 3, 4, 6):
        for extra in ("", tail):
            name = _name(members, digits) + extra
            if name not in taken:
                return name
    return next(n for k in range(2, len(taken) + 3) if (n := f"{_name(members, 6)}-{k}") not in taken)


def _name(members: Sequence[_SegmentConditions], digits: int) -> str:
    first = members[0].segment
    scale, unit = CONDITION_UNITS.get(first.drive, (1.0, first.drive))
    parts = [first.waveform]
    if first.frequency > 0.0:
        parts.append(f"{_shown(members, 'frequency', 1.0, digits)}Hz")
    parts.append(f"{_shown(members, 'amplitude', scale, digits)}{unit}")
    bias, amplitude = _median(members, "offset"), _median(members, "amplitude")
    if first.drive == "current" and abs(bias) > BIAS * amplitude:
        parts.append(f"bias{_rounded(bias, digits)}A")
    if np.isfinite(first.current):
        parts.append(f"{_shown(members, 'current', 1.0, digits)}A")
    return "-".join([*parts, *min(m.words for m in members)])


def _shown(members: Sequence[_SegmentConditions], name: str, scale: float, digits: int) -> str:
    stated = [v for m in members if np.isfinite(v := getattr(m, name))]
    if stated:
        return f"{float(f'{stated[0] * scale:.6g}'):g}"
    value = _median(members, name)
    if name == "current" and abs(value) < LEAST_CURRENT:
        return "0"
    return _rounded(value * scale, digits)


def _rounded(value: float, digits: int) -> str:
    """Return a number in as few digits, ``digits`` or more, as hold it within 2 %."""
    texts = [f"{float(f'{value:.{n}g}'):.10g}" for n in range(digits, digits + 3)]
    return next((t for t in texts if abs(float(t) - value) <= ROUNDED_LEVEL * abs(value)), texts[-1])


def cut_blocks(segments: Sequence[Segment], cycles: int) -> list[Segment]:
    """Return the segments with steady stretches cut into blocks of ``cycles``, each a condition of its own.

    The condition of a block ends in the cycles of its recording, as in ``sine-5Hz-2mm-1A-cycles101to200``. A rest of
    less than a block is left out; a stretch of less than two blocks stays whole. All but the first block of a stretch
    are led in by the cycle before them.
    """
    found: list[Segment] = []
    passed: dict[str, int] = {}
    for segment in segments:
        first, count = passed.get(segment.recording, 0), segment.cycles // cycles
        passed[segment.recording] = first + segment.cycles
        if count < 2:
            found.append(segment)
            continue
        period = segment.samples / segment.cycles
        for k in range(count):
            start, stop = (segment.start + round(c * period) for c in (k * cycles, (k + 1) * cycles))
            place = f"cycles{first + k * cycles + 1}to{first + (k + 1) * cycles}"
            block = replace(segment, id=f"{segment.id}.{k + 1}", condition=f"{segment.condition}-{place}")
            warm_up = round(period) if k else segment.warm_up
            found.append(replace(block, start=start, stop=stop, warm_up=warm_up, cycles=cycles))
    return found


def left_of_blocks(segment: Segment, cycles: int) -> tuple[int, str]:
    """Return the samples of a stretch that ``cut_blocks`` leaves out, and the words for a stretch not cut in full."""
    count, rest = divmod(segment.cycles, cycles)
    if not segment.cycles or (count > 1 and not rest):
        return 0, ""
    whole = f"{segment.recording}: of {number_of('cycle', segment.cycles)}"
    if count < 2:
        return 0, f"{whole} no two blocks of {cycles} can be cut: the stretch stays whole"
    samples = round(segment.samples * rest / segment.cycles)
    return samples, f"{whole} the last {rest} fill no block of {cycles}: left out"


def assign_roles(segments: Sequence[Segment], holdout: str) -> list[Segment]:
    """Return the segments with their roles: ``holdout`` for the chosen conditions, ``train`` for the rest.

    Parameters
    ----------
    segments
        Segments with named conditions.
    holdout
        ``none``; ``auto``: a quarter of the conditions, none below four tests, never more than half of all tests or of
        one kind of test (waveform, current held or moving), and one of each kind that has two. First come conditions
        whose current and temperature others keep in training, then those between two such levels, then those inside the
        grid of frequency, amplitude and current; or, separated by commas, ``quantity=value`` (within 5 %) and patterns
        on condition names. A test is a condition, or a record without cycles.

    Raises
    ------
    ConfigError
        If a choice matches no condition, or all conditions are chosen.
    """
    conditions = sorted({s.condition for s in segments})
    if holdout == "auto":
        chosen = _auto(segments, conditions)
    elif holdout == "none":
        chosen = set()
    else:
        chosen = {s.condition for term in holdout.split(",") for s in _matching(segments, term.strip(), conditions)}
    if conditions and chosen == set(conditions):
        raise ConfigError(f"--holdout '{holdout}' leaves nothing to train on; choose fewer of {few(conditions)}")
    return [replace(s, role="holdout" if s.condition in chosen else "train") for s in segments]


def hold_out_after(segments: Sequence[Segment], text: str, intervals: Mapping[str, float]) -> list[Segment]:
    """Return the segments cut where hold-out begins in time, the state of a model going on through the cut.

    A periodic segment is cut between whole cycles. What is held out is led in by everything before it, so that a
    simulation needs no initial state and every sample of it counts.

    Parameters
    ----------
    segments
        Segments with named conditions.
    text
        Seconds from the start of each recording.
    intervals
        Recording id -> sample interval in s.

    Raises
    ------
    ConfigError
        If the time is no number, or leaves nothing to train on or nothing to hold out.
    """
    try:
        seconds = float(text)
    except ValueError as error:
        raise ConfigError(f"--holdout 'after={text}': '{text}' is no number; give seconds") from error
    parts = [p for s in segments for p in _cut(s, round(seconds / intervals[s.recording]))]
    roles = {p.role for p in parts}
    if roles != {"train", "holdout"}:
        last = max(s.stop * intervals[s.recording] for s in segments)
        what = "to hold out" if "train" in roles else "to train on"
        raise ConfigError(f"--holdout 'after={text}' leaves nothing {what}; segments end after {last:.4g} s at most")
    counts: dict[str, int] = {}
    for place, part in enumerate(parts):
        counts[part.recording] = counts.get(part.recording, 0) + 1
        parts[place] = replace(part, id=f"{part.recording}#{counts[part.recording]}")
    return parts


def _cut(segment: Segment, cut: int) -> list[Segment]:
    """Return the parts of a segment before and from a sample on, by whole cycles where it is periodic."""
    cycles = 0
    if segment.cycles:
        period = segment.samples / segment.cycles
        cycles = min(max(round((cut - segment.start) / period), 0), segment.cycles)
        cut = segment.start + round(cycles * period)
    if cut >= segment.stop:
        return [replace(segment, role="train")]
    if cut <= segment.start:
        return [replace(segment, role="holdout")]
    lead = cut - segment.start + segment.warm_up
    after = replace(segment, role="holdout", start=cut, warm_up=lead, cycles=segment.cycles - cycles)
    return [replace(segment, role="train", stop=cut, cycles=cycles), after]


def _matching(segments: Sequence[Segment], term: str, conditions: Sequence[str]) -> list[Segment]:
    name, equals, text = term.partition("=")
    if equals and name in (*QUANTITIES, "waveform"):
        found = [s for s in segments if _equals(s, name, text)]
    else:
        found = [s for s in segments if fnmatch.fnmatchcase(s.condition, term)]
    if not found:
        point = "; decimals have a point" if term.isdigit() else ""
        raise ConfigError(
            f"--holdout '{term}' matches no condition{point}; there are {few(conditions)} (give auto, none, a pattern "
            f"on these names, {'|'.join(QUANTITIES)}=VALUE in SI units, or after=SECONDS)"
        )
    return found


def _equals(segment: Segment, name: str, text: str) -> bool:
    if name == "waveform":
        return segment.waveform == text
    try:
        value = float(text)
    except ValueError as error:
        raise ConfigError(f"--holdout '{name}={text}': '{text}' is no number; give it in SI units") from error
    # In a coil test `current=3` means the condition of 3 A, which is the drive's amplitude.
    quantity = "amplitude" if name == "current" and segment.drive == "current" else name
    measured = float(getattr(segment, quantity))
    return abs(measured - value) <= max(0.05 * abs(value), LEAST_CURRENT if name == "current" else 0.0)


def _auto(segments: Sequence[Segment], conditions: Sequence[str]) -> set[str]:
    # records without cycles that share a condition move differently, each is a test of its own
    tests = Counter(c for c, _ in {(s.condition, "" if s.cycles else s.recording) for s in segments})
    if tests.total() < FEWEST_FOR_HOLDOUT:
        return set()
    grid, kinds = _grid(segments, conditions)
    levels, inside = _levels(segments, conditions), np.sum((grid > 0.0) & (grid < 1.0), axis=1)
    room = {k: kinds.count(k) // 2 for k in kinds}
    chosen: list[int] = []
    # every kind of test that has two conditions is represented before any has two
    wanted = [k for k in sorted(room) if room[k] > 0]
    share = max(round(CONDITIONS_HELD_OUT * len(conditions)), min(len(wanted), len(conditions) // 2))
    while len(chosen) < share:
        most = tests.total() / 2 - sum(tests[conditions[i]] for i in chosen)
        able = [i for i, c in enumerate(conditions) if i not in chosen and tests[c] <= most]
        open_ = [i for i in able if room[kinds[i]] > 0]
        if not open_:
            break
        fresh = [i for i in open_ if not any(kinds[j] == kinds[i] for j in chosen)]
        best = max(fresh or open_, key=lambda i: (*_kept(levels, i, chosen), inside[i], _spread(grid, i, chosen), -i))
        room[kinds[best]] -= 1
        chosen.append(best)
    return {conditions[i] for i in chosen}


def _spread(grid: Array, i: int, chosen: Sequence[int]) -> float:
    """Return the distance to the nearest condition already held out, or (for the first) minus that to the centre."""
    if not chosen:
        return -float(np.linalg.norm(grid[i] - 0.5))
    return round(min(float(np.linalg.norm(grid[i] - grid[j])) for j in chosen), 9)


def _grid(segments: Sequence[Segment], conditions: Sequence[str]) -> tuple[Array, list[str]]:
    """Return each condition's place among the steps of frequency, amplitude and current, (conditions, 3), 0 to 1.

    Beside it each condition's kind: its waveform, and whether the current was held.
    """
    first = {s.condition: s for s in reversed(segments)}
    columns = [
        _places(np.nan_to_num(_values(first, conditions, name)), tolerance)
        for name, tolerance in (
            ("frequency", SAME_TEST_FREQUENCY),
            ("amplitude", SAME_TEST_AMPLITUDE),
            ("current", SAME_TEST_LEVEL),
        )
    ]
    kinds = [
        f"{first[c].waveform} {'at held' if np.isfinite(first[c].current) else 'under moving'} current"
        for c in conditions
    ]
    return np.stack(columns, axis=1), kinds


def _levels(segments: Sequence[Segment], conditions: Sequence[str]) -> Array:
    """Return each condition's place among the levels of current and of temperature, (conditions, 2), -1 for none."""
    first = {s.condition: s for s in reversed(segments)}
    columns = []
    for name, tolerance, least in (("current", SAME_TEST_LEVEL, LEAST_CURRENT), ("temperature", 0.0, SAME_TEMPERATURE)):
        values = _values(first, conditions, name)
        known = np.isfinite(values)
        columns.append(np.full(len(values), -1.0))
        columns[-1][known] = _places(values[known], tolerance, least)
    return np.stack(columns, axis=1)


def _kept(levels: Array, i: int, chosen: Sequence[int]) -> tuple[int, ...]:
    """Return the rest of a condition's levels without it: 2 for a test, 1 for levels on both sides, 0 for neither.

    No law of current or temperature goes through a level without a test in training, nor on beyond the last one.
    """
    others = [j for j in range(len(levels)) if j != i and j not in chosen]
    left = np.where((levels[others] == levels[i]).any(axis=0), 2, (levels[i] > 0.0) & (levels[i] < 1.0))
    return tuple(left.tolist())


def _values(first: Mapping[str, Segment], conditions: Sequence[str], name: str) -> Array:
    return np.array([float(getattr(first[c], name)) for c in conditions])


def _places(values: Array, tolerance: float, least: float = 1e-12) -> Array:
    """Return the place of each value among the steps of all, 0 to 1: values are a step apart by a share, or more."""
    if not len(values):
        return values
    order = np.argsort(values, kind="stable")
    ordered = values[order]
    step = np.diff(ordered) > np.maximum(tolerance * np.abs(ordered[1:]), least)
    ranks = np.empty(len(values))
    ranks[order] = np.concatenate([[0], np.cumsum(step)])
    return ranks / max(float(ranks.max()), 1.0)
