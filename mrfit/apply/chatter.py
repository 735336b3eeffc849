"""Chatter: whether a controlled damper's force trembles, how fast, and what makes it.

The force's turning points are found, those of small swings left out. Where many follow each other faster than any mass
of the car swings and the road drives it, the force chatters. What makes it is told by simulating the same ride without
one cause at a time: the current's lag; the control's sample time, a quarter of it; the damper's pre-yield slope, its
force faded out about standstill. Beside it stands the limit cycle: an oscillation that does not die away once the road
is level.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mrfit.apply.car import Ride, Timing, rms
from mrfit.core.specs import Array, Index, Mask
from mrfit.io.schemas.apply import Chatter
from mrfit.signal.cycles import turning_points as extremes
from mrfit.signal.runs import runs

# A swing counts from this share of the ride's greatest force on
_SWING = 0.02
# Turning points closer than this share of the fastest period of car or road belong to chatter: four times as fast
CHATTER_SHARE = 1.0 / 8.0
# So many of them in a row make a burst, and bursts that take this share of the time are chatter
BURST, _LEAST = 6, 0.02
# A limit cycle: the second half of what follows the road's end has this share of the first half's rms acceleration, and
# this share of the greatest acceleration
_KEPT, LASTING = 0.7, 0.02
# It is looked for on so many s of level road, and has so many periods in the second half of them
_LEFT, PERIODS = 0.4, 2
# Chatter is gone if this share of its swings times their time is left; causes are alike if they leave as much but for
# this share
_GONE, _ALIKE = 0.35, 0.02
OR = " or "
"""Between causes without each of which as little is left."""
SOFTENING = 0.02
# Time in s that is simulated again behind the first burst
_AFTER = 1.0
# A jump: this share of the greatest force within half a step, and so many times what is before and behind it
_JUMP, _ABOVE = 0.05, 5.0
FINER = 4


def look(ride: Ride, fastest: float) -> Chatter:
    """Return the findings of a ride, without a cause; ``fastest`` is the car's highest natural frequency in Hz."""
    turns, sizes = turning_points(ride.force)
    at = ride.time[turns]
    quick = np.diff(at) <= CHATTER_SHARE / max(fastest, ride.road.top)
    starts, stops = bursts(quick)
    inside = np.zeros(len(turns), dtype=bool)
    lasting = 0.0
    for start, stop in zip(starts, stops, strict=True):
        inside[start : stop + 1] = True
        lasting += float(at[stop] - at[start])
    count = int(np.count_nonzero(inside))
    middle = 0.5 * (ride.current.max() + ride.current.min())
    crossings = np.count_nonzero(np.diff(ride.current > middle)) if np.ptp(ride.current) > 0.0 else 0
    return Chatter(
        found=bool(lasting > _LEAST * (ride.time[-1] - ride.time[0])),
        share=lasting / float(ride.time[-1] - ride.time[0]),
        rate=0.5 * count / lasting if lasting else 0.0,
        turns=count,
        swing=float(np.median(sizes[inside])) if count else 0.0,
        first=float(at[starts[0]]) if count else float("nan"),
        switching=float(crossings) / ride.road.duration,
        jumps=jumps(ride),
        limit_cycle=limit_cycle(ride),
    )


def jumps(ride: Ride) -> float:
    """Return the rate in 1/s of jumps of the force within half a step of a held command, smooth on either side."""
    leaps = np.abs(np.diff(ride.force))
    if len(leaps) < 3:
        return 0.0
    beside = np.maximum(leaps[:-2], leaps[2:])
    least = np.maximum(_JUMP * float(np.max(np.abs(ride.force), initial=0.0)), _ABOVE * beside)
    held = np.diff(ride.current)[1:-1] == 0.0
    return float(np.count_nonzero((leaps[1:-1] > least) & held & (least > 0.0))) / ride.road.duration


def turning_points(force: Array) -> tuple[Index, Array]:
    """Return the samples at which a force turns after a swing of some size, and the sizes of the swings up to there."""
    least = _SWING * float(np.max(np.abs(force - np.median(force)), initial=0.0))
    turns = extremes(force, least) if least > 0.0 else np.empty(0, dtype=np.int64)
    # where it begins and ends, it does not turn
    turns = turns[(turns > 0) & (turns < len(force) - 1)]
    swings = np.abs(np.diff(force[turns]))
    return turns, np.concatenate([swings[:1], swings]) if len(swings) else np.full(len(turns), least)


def bursts(quick: Mask) -> tuple[Index, Index]:
    """Return first and last turning points of the runs in which at least ``BURST`` follow each other quickly."""
    starts, stops = runs(quick).T
    long = stops - starts + 1 >= BURST
    return starts[long], stops[long]


def limit_cycle(ride: Ride) -> float:
    """Return the frequency in Hz of an oscillation that goes on after the road's end, 0 without one."""
    left = float(ride.time[-1]) - ride.road.ends
    after = ride.acceleration[ride.time > ride.road.ends + 0.25 * left]
    if left < _LEFT:
        return 0.0
    one, other = np.array_split(after - np.mean(after), 2)
    last = rms(other)
    if last < _KEPT * rms(one) or last < LASTING * np.max(np.abs(ride.acceleration)):
        return 0.0
    crossings = np.count_nonzero(np.diff(np.sign(other - np.mean(other))) != 0)
    step = float(ride.time[1] - ride.time[0])
    return float(0.5 * crossings / (len(other) * step)) if crossings >= 2 * PERIODS else 0.0


Again = Callable[[Sequence[Ride], Timing, bool], list[Ride]]
"""again(rides, timing, lagless) simulates the same controls and roads otherwise."""


def told_apart(rides: Sequence[Ride], timing: Timing, fastest: float, again: Again, lags: bool) -> list[Chatter]:
    """Return the findings of rides, with the cause of chatter and limit cycles.

    Parameters
    ----------
    rides
        The rides.
    timing
        Of their simulation.
    fastest
        The car's highest natural frequency in Hz.
    again
        Simulates some of them otherwise.
    lags
        Whether the current has a lag that could be taken away.
    """
    found = [look(ride, fastest) for ride in rides]
    odd = [k for k, one in enumerate(found) if one.found or one.limit_cycle]
    if not odd:
        return found
    some = [rides[k] for k in odd]
    # what is tried takes no longer than it has to
    firsts = {k: found[k].first for k in odd if found[k].found}
    until = max([rides[k].time[-1] if (first := firsts.get(k)) is None else first + _AFTER for k in odd])
    timing = replace(timing, until=float(until))
    seen = [look(cut(ride, timing.until), fastest) for ride in some]
    tries: dict[str, list[tuple[Chatter, Ride]]] = {}
    changes = {"lag": (timing, True)} if lags else {}
    changes |= {
        "sample time": (replace(timing, sample=timing.sample / FINER), False),
        "pre-yield slope": (replace(timing, soft=SOFTENING), False),
    }
    for cause, (changed, lagless) in changes.items():
        tries[cause] = [(look(ride, fastest), ride) for ride in again(some, changed, lagless)]
    for place, k in enumerate(odd):
        own = {cause: one[place] for cause, one in tries.items()}
        whole = weight(seen[place], cut(some[place], timing.until))
        evidence = (("as it is", whole), *((f"without {cause}", weight(*one)) for cause, one in own.items()))
        found[k] = replace(
            found[k], cause=cause_of(seen[place], own, cut(some[place], timing.until)), evidence=evidence
        )
    return found


def cut(ride: Ride, until: float) -> Ride:
    """Return the beginning of a ride."""
    kept = int(np.searchsorted(ride.time, until, "right"))
    arrays: dict[str, Any] = {
        n: v[:kept] for n in ride.__dataclass_fields__ if isinstance(v := getattr(ride, n), np.ndarray)
    }
    return replace(ride, **arrays)


def weight(one: Chatter, ride: Ride) -> float:
    """Return a ride's swing in N times its share of the time, or the rms of its limit cycle if it has only that.

    A shorter sample time makes what it clocks faster: numbers of turning points would say that it grew.
    """
    if one.limit_cycle and not one.turns:
        late = ride.time > 0.5 * (ride.road.ends + ride.road.duration)
        return rms(ride.force[late] - np.mean(ride.force[late]))
    return one.share * one.swing


def cause_of(one: Chatter, without: dict[str, tuple[Chatter, Ride]], ride: Ride) -> str:
    """Return the cause without which least is left, if chatter is gone then, and those that leave as little."""
    there = weight(one, ride)
    left = {cause: weight(*changed) for cause, changed in without.items()}
    least = min(left.values())
    if least > _GONE * there:
        return "not told apart"
    return OR.join(cause for cause in left if left[cause] <= least + _ALIKE * there)
