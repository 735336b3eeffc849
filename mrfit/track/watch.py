"""A stop rule for a test: after whole cycles a fit of what was recorded so far, until its intervals are narrow enough.

A test may stop when the 95 % interval of every parameter that counts is within a share of the value, at two looks
running. The half-width falls with the root of the number of cycles N, so that about N (h / target)^2 are needed.

Intervals include what a parameter drifts, as far again as it did: the difference between both halves of the test, drawn
to 0 by a prior of ``DRIFT`` of what was asked for.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial

from mrfit.api.fitting import fit
from mrfit.core.recording import Recording, Segment
from mrfit.errors import ConfigError, DataError
from mrfit.io.schemas.determined import POOR, SLIGHT, State
from mrfit.io.schemas.fit import Quantity
from mrfit.segment.stage import cut
from mrfit.settings.segment import Settings as SegmentSettings
from mrfit.settings.watch import Settings
from mrfit.simulate.current_dependence import base_name

CYCLES_BETWEEN = 0.05
"""Share of the cycles so far after which a test is looked at again: all looks cost as much as some tens of fits."""
DRIFT = 0.25
"""Standard deviation of a drift before the test is seen, as a share of the half-width that was asked for."""
# Standard deviations in the half-width of a 95 % interval
_HALF = 1.96


@dataclass(frozen=True)
class WatchedValue:
    """A parameter at a look: value with 95 % interval, SI, and whether its half-width is what was asked for."""

    name: str
    unit: str
    value: float
    low: float | None
    high: float | None
    reached: bool


@dataclass(frozen=True)
class LookAtTest:
    """A look at a running test.

    Attributes
    ----------
    cycles
        Steady cycles so far.
    seconds
        Length of the record so far.
    values
        Parameters that count.
    reached
        Whether all of them reach their intervals, now and at the look before.
    needed
        Cycles that the test will need in all; None where the test does not determine a parameter.
    """

    cycles: int
    seconds: float
    values: list[WatchedValue]
    reached: bool
    needed: int | None

    def missed(self, other: "LookAtTest") -> set[str]:
        """Return the parameters whose value at another look lies outside of their intervals at this one."""
        ends = {v.name: (v.low, v.high) for v in self.values if v.low is not None and v.high is not None}
        return {v.name for v in other.values if v.name in ends and not ends[v.name][0] <= v.value <= ends[v.name][1]}


def steady_cycles(record: Recording) -> tuple[int, float]:
    """Return the number of steady cycles of a record and the samples of the shortest; 0 and infinity without any."""
    try:
        segments, _ = cut([record], 1, SegmentSettings(holdout="none"))
    except DataError:
        return 0, math.inf
    periodic = [s for s in segments if s.cycles]
    return sum(s.cycles for s in periodic), min(map(_period, periodic), default=math.inf)


def _period(segment: Segment) -> float:
    return (segment.stop - segment.start) / segment.cycles


def replayed(record: Recording) -> Iterator[Recording]:
    """Yield the record as it was after each of its cycles, and whole.

    Raises
    ------
    DataError
        If it has no steady cycles.
    """
    cycles, period = steady_cycles(record)
    if not cycles:
        raise DataError(f"{record.source or record.id}: no steady cycles; a test is watched by them")
    for number in range(1, math.ceil(record.samples / period)):
        stop = round(number * period)
        yield replace(record, channels={n: v[:stop] for n, v in record.channels.items()})
    yield record


def watch(records: Iterable[Recording], model: str, rule: Settings) -> Iterator[LookAtTest]:
    """Yield looks at a test, the last when its intervals are reached or its records end.

    Parameters
    ----------
    records
        The test so far, again and again: each holds the one before.
    model
        Name of a model.
    rule
        When the test has told enough.

    Raises
    ------
    ConfigError
        If a parameter is not one of the model's.
    """
    due, seen, cycles = rule.least_cycles, 1, 0
    found, record = None, None
    look_at = partial(look, model=model, rule=rule)
    for record in records:
        cycles, _ = steady_cycles(record)
        if cycles < due:
            continue
        before, found = found is not None and found.reached, look_at(record, cycles)
        yield replace(found, reached=found.reached and before)
        if found.reached and before:
            return
        seen, due = cycles, cycles + max(1, math.floor(CYCLES_BETWEEN * cycles))
    # the test is over: what was recorded since the last look, or that look without another that confirms it
    if record is not None and cycles > seen:
        yield look_at(record, cycles)
    elif found is not None and found.reached:
        yield found


def look(record: Recording, cycles: int, model: str, rule: Settings) -> LookAtTest:
    """Return the parameters by a fit of the test so far."""
    found = _fitted(record, model)
    asked = {n for n in rule.parameters if n}
    names = {n for p in found for n in (p.name, base_name(p.name))}
    if unknown := sorted(asked - names):
        raise ConfigError(f"--parameters: {model} has no '{unknown[0]}'; it has {', '.join(sorted(names))}")
    counting = [p for p in found if asked & {p.name, base_name(p.name)}] if asked else []
    counting = counting or [p for p in found if p.determined is State.WELL]
    if max((_share(p, rule.within) for p in counting), default=math.inf) <= 1.0:
        counting = _drifting(counting, record, model, rule.within)
    shares = [_share(p, rule.within) for p in counting]
    values = [
        WatchedValue(p.name, p.unit, p.value, p.low, p.high, s <= 1.0) for p, s in zip(counting, shares, strict=True)
    ]
    worst = max(shares, default=math.inf)
    needed = math.ceil(cycles * max(worst, 1.0) ** 2) if math.isfinite(worst) else None
    return LookAtTest(cycles, record.samples * record.dt, values, worst <= 1.0, needed)


def _fitted(record: Recording, model: str) -> list[Quantity]:
    results = fit(record, model, per="all", holdout="none", progress=False).content.results
    return [p for result in results for p in result.parameters if not p.fixed]


def _drifting(found: list[Quantity], record: Recording, model: str, within: float) -> list[Quantity]:
    """Return parameters whose intervals include what they drift, by fits of both halves of the test."""
    halves = list[dict[str, Quantity]]()
    for half in (slice(None, record.samples // 2), slice(record.samples // 2, None)):
        part = replace(record, channels={n: v[half] for n, v in record.channels.items()})
        try:
            halves.append({p.name: p for p in _fitted(part, model)})
        except DataError:  # too short by itself
            halves.append({})
    return [widened(p, [h.get(p.name) for h in halves], DRIFT * _asked(p, within)) for p in found]


def widened(whole: Quantity, halves: list[Quantity | None], prior: float) -> Quantity:
    """Return a parameter whose interval includes a drift, of a standard deviation that is expected."""
    mean, variance = 0.0, prior**2
    widths = [math.inf if p is None else _half_width(p) for p in halves]
    if halves[0] and halves[1] and math.isfinite(sum(widths)):
        # along the whole test twice what its halves differ by
        seen = 4.0 * (widths[0] ** 2 + widths[1] ** 2) / _HALF**2
        share = variance / (variance + seen)
        mean, variance = share * 2.0 * (halves[1].value - halves[0].value), share * seen
    drift = _HALF**2 * (mean**2 + variance)
    if whole.low is None or whole.high is None:
        return whole
    down, up = (math.hypot(end - whole.value, math.sqrt(drift)) for end in (whole.low, whole.high))
    return replace(whole, low=whole.value - down, high=whole.value + up)


def _share(parameter: Quantity, within: float) -> float:
    """Return the half-width of an interval over what it may be, in percent of the value; infinity for an open one."""
    asked = _asked(parameter, within)
    return _half_width(parameter) / asked if asked else math.inf


def _asked(parameter: Quantity, within: float) -> float:
    """Return the half-width that is asked for; an offset may be zero."""
    return 0.01 * within * max(abs(parameter.value), SLIGHT / POOR * (parameter.added_to or 0.0))


def _half_width(parameter: Quantity) -> float:
    low, high = parameter.low, parameter.high
    return math.inf if low is None or high is None or not math.isfinite(high - low) else (high - low) / 2.0
