"""Rules that find chatter and limit cycles in a ride and tell their causes: each on both sides of its threshold."""

from collections.abc import Sequence

import numpy as np
import pytest

from mrfit.apply.car import Control, Ride, Timing
from mrfit.apply.chatter import BURST, bursts, cause_of, cut, limit_cycle, look, told_apart, weight
from mrfit.apply.roads import Bump, Road, Sweep
from mrfit.core.specs import Array
from mrfit.io.schemas.apply import Chatter

STEP = 5e-4
LATE = 3.0


def times(duration: float = LATE) -> Array:
    return STEP * np.arange(round(duration / STEP) + 1)


def ride(
    force: Array, acceleration: Array | None = None, current: Array | None = None, road: Road | None = None
) -> Ride:
    time, still = STEP * np.arange(len(force)), np.zeros_like(force)
    moved = still if acceleration is None else acceleration
    own, sent = road or Bump(duration=float(time[-1])), still if current is None else current
    return Ride(Control("skyhook"), own, time, moved, *[still] * 5, force, sent, still)


def finding(swing: float = 0.0, share: float = 1.0, turns: int = 9, cycle: float = 0.0) -> Chatter:
    return Chatter(
        found=swing > 0.0, share=share, rate=100.0, turns=turns, swing=swing, first=0.1, switching=0.0, jumps=0.0,
        limit_cycle=cycle,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("road", "fastest", "limit"), [(None, 10.0, 40.0), (Sweep(high=20.0, duration=LATE), 2.0, 80.0)]
)
def test_chatter_is_four_times_as_fast_as_car_and_road(road: Road | None, fastest: float, limit: float) -> None:
    t = times()
    assert not look(ride(np.sin(2.0 * np.pi * 0.96 * limit * t), road=road), fastest).found
    found = look(ride(np.sin(2.0 * np.pi * 1.04 * limit * t), road=road), fastest)
    assert found.found and found.rate == pytest.approx(1.04 * limit, rel=0.05)


def test_a_burst_has_six_turning_points_in_a_row() -> None:
    quick = np.array([False, *[True] * (BURST - 1), False, *[True] * (BURST - 2), False])
    starts, stops = bursts(quick)
    assert BURST == 6 and (starts.tolist(), stops.tolist()) == ([1], [6])


@pytest.mark.parametrize(("lasting", "found"), [(0.045, False), (0.08, True)])
def test_bursts_are_chatter_where_they_last_a_fiftieth_of_the_time(lasting: float, found: bool) -> None:
    t = times()
    inside = np.abs(t - 1.5) < 0.5 * lasting
    seen = look(ride(np.sin(4.0 * np.pi * t) + 0.5 * inside * np.sin(400.0 * np.pi * t)), 2.0)
    assert seen.found == found and seen.turns >= BURST
    assert seen.share == pytest.approx(lasting / LATE, rel=0.15)
    assert seen.first == pytest.approx(1.5 - 0.5 * lasting, abs=0.006)
    # from trough to peak twice the amplitude
    assert seen.swing == pytest.approx(1.0, rel=0.1)


def test_switching_counts_what_crosses_the_middle_of_the_command() -> None:
    t = times(2.0)
    square = np.where(np.sin(10.0 * np.pi * t + 0.3) > 0.0, 1.0, 0.2)
    assert look(ride(0.0 * t, current=square), 2.0).switching == pytest.approx(10.0)
    # a ripple above the middle crosses nothing
    assert look(ride(0.0 * t, current=np.where(t > 1.0, 1.0 + 0.1 * np.sin(60.0 * t), 0.0)), 2.0).switching == 0.5
    assert look(ride(0.0 * t, current=0.0 * t + 0.7), 2.0).switching == 0.0


def swinging(frequency: float, duration: float = LATE, size: float = 1.0, decay: float = 0.0) -> Ride:
    """Return a ride whose acceleration is 1 m/s² on the bump and swings behind it."""
    t = times(duration)
    behind = t - Bump().ends
    swing = size * np.exp(-decay * np.maximum(behind, 0.0)) * np.sin(2.0 * np.pi * frequency * behind)
    return ride(0.0 * t, np.where(behind > 0.0, swing, 1.0))


@pytest.mark.parametrize(
    ("one", "found"),
    [
        # 0.74 s until the bump is left: so much level road behind it
        (swinging(20.0, 1.12), 0.0),
        (swinging(20.0, 1.16), 20.0),
        # two periods in the second half of the last three quarters
        (swinging(1.5), 0.0),
        (swinging(3.0), 3.0),
        # the second half has 0.7 of the first half's rms, which is 0.85 s before it
        (swinging(9.0, decay=-np.log(0.6) / 0.85), 0.0),
        (swinging(9.0, decay=-np.log(0.8) / 0.85), 9.0),
        # and 0.02 of the greatest acceleration, an amplitude of 0.028
        (swinging(9.0, size=0.025), 0.0),
        (swinging(9.0, size=0.032), 9.0),
    ],
)
def test_a_limit_cycle_lasts_on_a_level_road(one: Ride, found: float) -> None:
    assert limit_cycle(one) == pytest.approx(found, rel=0.12)


def test_the_weight_of_a_limit_cycle_alone_is_the_rms_of_its_force() -> None:
    t = times()
    one = ride(5.0 + 2.0 * np.sin(18.0 * np.pi * t))
    assert weight(finding(4.0, 0.25), one) == 1.0
    assert weight(finding(turns=0, cycle=9.0), one) == pytest.approx(np.sqrt(2.0), rel=0.01)
    assert weight(finding(4.0, 0.25, cycle=9.0), one) == 1.0
    assert weight(finding(turns=0), one) == 0.0


def test_the_beginning_of_a_ride_ends_at_a_time_in_all_its_courses() -> None:
    t = times(1.0)
    short = cut(ride(t, t, t), 0.25)
    assert len(short.time) == 501 and short.time[-1] == 0.25
    assert all(len(getattr(short, n)) == 501 for n in ("force", "acceleration", "current", "field", "wheel"))
    assert len(cut(ride(t), np.inf).force) == len(t)


@pytest.mark.parametrize(
    ("left", "named"),
    [
        ((0.34, 0.9), "lag"),
        ((0.36, 0.9), "not told apart"),
        ((0.10, 0.118), "lag or sample time"),
        ((0.10, 0.122), "lag"),
        ((0.122, 0.10), "sample time"),
    ],
)
def test_a_cause_leaves_a_third_at_most_and_one_like_it_two_percent_more(left: tuple[float, float], named: str) -> None:
    one = ride(times())
    without = {name: (finding(v), one) for name, v in zip(("lag", "sample time"), left, strict=True)}
    assert cause_of(finding(1.0), without, one) == named


@pytest.mark.parametrize(("lags", "cause"), [(True, "lag"), (False, "not told apart")])
def test_each_cause_is_taken_away_alone_and_only_from_rides_that_tremble(lags: bool, cause: str) -> None:
    t = times()
    calm = ride(np.sin(4.0 * np.pi * t))
    trembling = ride(np.sin(4.0 * np.pi * t) + 0.5 * (t > 0.5) * np.sin(400.0 * np.pi * t))
    asked = list[tuple[int, Timing, bool]]()

    def again(some: Sequence[Ride], changed: Timing, lagless: bool) -> list[Ride]:
        asked.append((len(some), changed, lagless))
        return [calm if lagless else trembling] * len(some)

    found = told_apart([calm, trembling], Timing(2e-3, 3), 2.0, again, lags)
    assert not found[0].found and found[0].cause == "" and found[0].evidence == ()
    assert found[1].found and found[1].cause == cause
    names = ["lag"] * lags + ["sample time", "pre-yield slope"]
    assert [name for name, _ in found[1].evidence] == ["as it is", *(f"without {n}" for n in names)]
    shares = dict(found[1].evidence)
    assert not lags or shares["without lag"] == 0.0 < shares["as it is"]
    assert [(n, timing.sample, timing.soft, lagless) for n, timing, lagless in asked] == [
        *[(1, 2e-3, 0.0, True)] * lags,
        (1, 5e-4, 0.0, False),
        (1, 2e-3, 0.02, False),
    ]
    # a second behind the first burst is enough
    assert all(timing.until == pytest.approx(1.5, abs=0.01) and timing.steps == 3 for _, timing, _ in asked)


def test_rides_that_are_calm_are_not_simulated_again() -> None:
    def again(some: Sequence[Ride], changed: Timing, lagless: bool) -> list[Ride]:
        raise AssertionError("simulated again")

    (found,) = told_apart([ride(np.sin(4.0 * np.pi * times()))], Timing(), 2.0, again, True)
    assert not found.found and found.turns == 0 and found.rate == 0.0 and np.isnan(found.first or 0.0)
