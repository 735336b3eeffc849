"""A study of a quarter car: its rows by hand from its rides, and its findings in words."""

from dataclasses import replace

import numpy as np
import pytest

from mrfit.apply.car import AdaptiveCheck, Car, Control, Ride, Timing, rms
from mrfit.apply.damper import Damper, damper
from mrfit.apply.ride import QuarterCar, quarter_car
from mrfit.apply.roads import Bump, RandomRoad
from mrfit.io.schemas.apply import Chatter, RideRow
from mrfit.settings.apply import Amplifier
from tests.apply.dampers import monotone

BUMP, ROUGH = Bump(), RandomRoad("D", seed=5)


LAG, SAMPLE, SLOPE = "lag", "sample time", "pre-yield slope"


def chatter(
    cause: str = "", swing: float = 0.0, rate: float = 100.0, cycle: float = 0.0, left: tuple[float, ...] = ()
) -> Chatter:
    """Return a finding; ``left`` is what is left without each of its causes, as a share of what is there."""
    evidence = (
        ("as it is", 0.5),
        *((f"without {n}", 0.5 * v) for n, v in zip(cause.split(" or "), left, strict=False)),
    )
    return Chatter(
        found=swing > 0.0, share=0.3, rate=rate, turns=9, swing=swing, first=0.1, switching=2.0, jumps=0.0,
        limit_cycle=cycle, cause=cause, evidence=evidence,
    )  # fmt: skip


def row(control: str = "skyhook", road: str = BUMP.name, lag: bool = True, **more: object) -> RideRow:
    given: dict[str, object] = {
        "acceleration": 1.0, "tyre_load": 0.1, "least_load": 0.5, "travel": 0.01, "greatest_travel": 0.02,
        "current": 0.4, "chatter": chatter(), **more,
    }  # fmt: skip
    return RideRow(road=road, control=control, lag=lag, **given)  # type: ignore[arg-type]


def study(*rows: RideRow, one: Damper | None = None, **checks: AdaptiveCheck) -> QuarterCar:
    controls = tuple(Control(name) for name in dict.fromkeys(r.control for r in rows))
    made = tuple((name.replace("_", "-"), check) for name, check in checks.items())
    return QuarterCar(one or monotone(), Car(), Timing(), Amplifier(), controls, (BUMP, ROUGH), rows, made, ())


def test_rows_are_numbers_of_the_rides_and_lag_is_taken_away_for_half_of_them() -> None:
    late = {"current-lag.tau": 0.02, "delay.tau": 0.01, "delay.s": 0.0}
    car, road = Car(), Bump(duration=0.7)
    controls = [Control("passive-high"), Control("skyhook-on-off")]
    found = quarter_car(monotone("tanh+current-lag+delay", **late), car, controls, [road], Timing(5e-3, 8), check=False)
    # a delay is one of the rig's record
    assert found.damper.model == "tanh+current-lag"
    assert [(r.control, r.lag) for r in found.rows] == [
        ("passive-high", True), ("skyhook-on-off", True), ("passive-high", False), ("skyhook-on-off", False),
    ]  # fmt: skip
    assert found.lags and [r.control.name for r in found.rides] == ["passive-high", "skyhook-on-off"]
    ride, (first, *_) = found.rides[0], found.rows
    # on an even road from its first sample: rest counts
    assert first.acceleration == pytest.approx(rms(ride.acceleration), rel=1e-12)
    assert first.tyre_load == pytest.approx(rms(ride.tyre_load) / (440.0 * 9.81), rel=1e-12)
    assert first.least_load == pytest.approx(1.0 - ride.tyre_load.max() / (440.0 * 9.81), rel=1e-12)
    assert first.travel == pytest.approx(rms(ride.travel), rel=1e-12)
    assert first.greatest_travel == np.abs(ride.travel).max() > 1.2 * first.travel
    assert first.current == pytest.approx(1.0)
    # the field follows within five time constants
    assert ride.field[0] == 0.0 and ride.field[-1] == pytest.approx(1.0, abs=1e-6)
    frame = found.to_frame()
    assert list(frame["control"]) == [r.control for r in found.rows] and "switching" in frame and "chatter" not in frame
    content = found.document
    speed = 15.0 / 3.6
    shape = {"rise": 0.02, "length": 1.0, "speed": speed, "duration": 0.7, "start": 0.5}
    assert content.roads == [{"name": "bump 20 mm", **shape}]
    assert content.fit == found.damper.name and content.findings == found.findings and content.rows == list(found.rows)


def test_a_rigid_wheel_has_no_load_of_a_tyre() -> None:
    found = quarter_car(
        monotone(), Car(500.0, 0.0), [Control("passive-low")], [Bump(duration=0.6)], Timing(5e-3, 4), check=False
    )
    (only,) = found.rows
    assert np.isnan([only.tyre_load or 0.0, only.least_load or 0.0]).all() and not found.lags
    assert not any("load" in text for text in found.findings)


def test_fixed_and_adaptive_steps_are_compared_on_the_first_road_with_its_lag() -> None:
    other = [row("skyhook", ROUGH.name, acceleration=9.0), row("skyhook", lag=False, acceleration=5.0)]
    said = study(
        row("skyhook"), row("hybrid"), row("groundhook"), row("passive-low"), *other,
        skyhook=AdaptiveCheck(1.019, 60, 3.0, 3.0),
        hybrid=AdaptiveCheck(0.979, 60, 3.0, 3.0),
        groundhook=AdaptiveCheck(float("nan"), 60, 0.3, 3.0),
        passive_low=AdaptiveCheck(0.981, 60, 3.0, 3.0),
    ).findings  # fmt: skip
    assert said == [
        "hybrid on bump 20 mm: fixed steps (1 m/s²) and adaptive ones (0.979 m/s²) disagree by more than 2 %",
        "groundhook on bump 20 mm: the adaptive simulation came to 0.3 s of 3 s within its bound on steps; "
        "the fixed steps alone stand for the rest",
        "Fixed and adaptive steps agree within 2 % on bump 20 mm: skyhook, passive-low.",
    ]


def rides(count: int) -> tuple[Ride, ...]:
    return (Ride(Control("skyhook"), BUMP, *[np.zeros(3)] * 10),) * count


def test_a_wheel_that_leaves_the_road_is_counted_with_the_lag_and_on_its_roads() -> None:
    lifted = [row(least_load=-0.1), row(road=ROUGH.name, least_load=-0.01)]
    others = [row("hybrid", least_load=0.0), row(lag=False, least_load=-0.3), row("hybrid", least_load=None)]
    (text,) = replace(study(*lifted, *others), rides=rides(4)).findings
    assert text.startswith(
        "The tyre's load falls below 0 in 2 of 4 rides (bump 20 mm, ISO 8608 D): there a wheel would leave the road"
    )
    assert replace(study(*others), rides=rides(4)).findings == []


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (
            [row(chatter=chatter(LAG, 45.24, 119.7, left=(0.052,)))],
            "skyhook on bump 20 mm chatters at 120 Hz for 30 % of the time, 45.2 N a swing. "
            "Cause: the current's lag: without it 5.2 % of swing × time is left.",
        ),
        (
            [
                row("hybrid", chatter=chatter(f"{LAG} or {SAMPLE}", 1234.4, 100.0, left=(0.05, 0.06))),
                row("hybrid", ROUGH.name, chatter=chatter(f"{LAG} or {SAMPLE}", 15.0, 140.0, left=(0.1, 0.11))),
            ],
            "hybrid on bump 20 mm; hybrid on ISO 8608 D chatter at 100 to 140 Hz for 30 % of the time, "
            "15 to 1234 N a swing. Cause: the current's lag or the control's sample time (a quarter of it tried): "
            "without it 5 to 11 % of swing × time is left.",
        ),
        (
            [row(lag=False, chatter=chatter("not told apart", cycle=9.04))],
            "skyhook on bump 20 mm, without lag goes on oscillating at 9.04 Hz on the level road (limit cycle). "
            "Cause: none of lag, sample time and pre-yield slope alone; what is left is the switching of the "
            "control's law.",
        ),
        (
            [row(c, chatter=chatter(SLOPE, 50.0, cycle=9.0, left=(0.0,))) for c in ("skyhook", "hybrid")],
            "skyhook, hybrid on bump 20 mm chatter at 100 Hz for 30 % of the time, 50 N a swing and go on oscillating "
            "at 9 Hz on the level road (limit cycle). Cause: the pre-yield slope (faded out below 20 mm/s): without it "
            "0 % of swing × time is left.",
        ),
    ],
)  # fmt: skip
def test_chatter_of_one_cause_is_told_in_one_sentence(rows: list[RideRow], said: str) -> None:
    assert study(*rows).findings == [said]


def test_rides_of_other_causes_or_without_lag_are_other_sentences() -> None:
    same = chatter(LAG, 20.0, left=(0.0,))
    found = study(
        row(chatter=same), row("hybrid", lag=False, chatter=same), row("groundhook", chatter=chatter("", 20.0))
    )
    assert [text.split(" chatters")[0] for text in found.findings] == [
        "skyhook on bump 20 mm", "hybrid on bump 20 mm, without lag", "groundhook on bump 20 mm",
    ]  # fmt: skip
    assert found.lags and not study(row()).lags


def test_a_model_that_branches_by_the_acceleration_is_told_where_the_slope_makes_it_chatter() -> None:
    ends = {"fy@0A": 70.0, "fy@1A": 800.0, "C_inf": 900.0, "C0": 1e4, "vh": 1e-3, "f0": 0.0}
    branching = damper("hysteretic-biviscous", ends, {"fy": 1})
    slope = row(chatter=chatter(SLOPE, 20.0, left=(0.1,)))
    told = "; the model branches by the sign of an acceleration that its own force makes."
    assert study(slope, one=branching).findings[0].endswith(told)
    assert not study(slope).findings[0].endswith(told)
    assert not study(row(chatter=chatter(LAG, 20.0, left=(0.1,))), one=branching).findings[0].endswith(told)
