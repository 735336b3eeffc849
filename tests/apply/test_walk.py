"""A quarter car on its way: commands of each control, the fading of the force, rest, a road between its points."""

from typing import Any

import numpy as np
import pytest

from mrfit.apply import walk
from mrfit.apply.car import Car, Control, Ride, Timing, drive
from mrfit.apply.damper import Damper, damper
from mrfit.apply.roads import Bump, RandomRoad
from mrfit.apply.stepper import Stepper
from mrfit.errors import ConfigError
from tests.apply.dampers import monotone

TIMING, ROAD = Timing(5e-3, 4), Bump(duration=0.8)
# The course has two points a step of the simulation
APART = 2 * TIMING.steps


def python(kernel: Any) -> Any:
    """Return a compiled function as it is written."""
    return kernel.py_func


def dashpot(rest: float = 0.0) -> Damper:
    """Return a damper of 1500 N*s/m with a force at rest, whatever the current."""
    return damper("bingham", {"fy@0A": 1e-9, "fy@1A": 2e-9, "C_inf": 1500.0, "f0": rest}, {"fy": 1})


def ridden(name: str, one: Damper | None = None, timing: Timing = TIMING, share: float = 0.5) -> Ride:
    return drive(Stepper(one or monotone()), Car(), [(Control(name, 2000.0, share), ROAD)], timing)[0]


@pytest.mark.parametrize(("name", "current"), [("passive-low", 0.0), ("passive-high", 1.0)])
def test_a_passive_control_holds_an_end_of_the_range(name: str, current: float) -> None:
    assert np.all(ridden(name).current == current)


def test_an_on_off_control_is_on_where_body_and_damper_move_alike_and_holds_for_a_sample() -> None:
    ride = ridden("skyhook-on-off")
    sent, kept = ride.current[:-1].reshape(-1, APART), slice(0, -1, APART)
    assert np.all(sent == sent[:, :1])
    on = ride.body[kept] * ride.speed[kept] >= 0.0
    np.testing.assert_array_equal(sent[:, 0], np.where(on, 1.0, 0.0))
    assert 0.2 < on.mean() < 0.9


@pytest.mark.parametrize("name", ["skyhook", "groundhook", "hybrid"])
def test_a_control_of_force_commands_the_current_that_gives_it(name: str) -> None:
    ride, stepper = ridden(name, share=0.3), Stepper(monotone())
    at = np.arange(0, len(ride.time), APART)
    v, body, wheel = ride.speed[at], ride.body[at], ride.wheel[at]
    sky = np.where(body * v > 0.0, 2000.0 * body, 0.0)
    ground = np.where(wheel * v < 0.0, -2000.0 * wheel, 0.0)
    wish = {"skyhook": sky, "groundhook": ground, "hybrid": 0.3 * sky + 0.7 * ground}[name]
    given = {"displacement": ride.travel[at], "velocity": v, "current": ride.current[at]}
    still = {n: np.zeros(1) for n in given}
    rest = float(stepper.step(stepper.rest(still), still, 1e-3).force[0])
    made = stepper.step(stepper.rest(given), given, 1e-3).force - rest
    free = (given["current"] > 1e-9) & (given["current"] < 1.0 - 1e-9)
    assert free.sum() > 5
    np.testing.assert_allclose(made[free], wish[free], rtol=1e-6)


def test_what_a_damper_gives_at_rest_is_carried_by_the_preload() -> None:
    plain, loaded = (ridden("passive-low", dashpot(rest)) for rest in (0.0, 350.0))
    np.testing.assert_allclose(loaded.acceleration, plain.acceleration, atol=1e-9)
    np.testing.assert_allclose(loaded.force - plain.force, 350.0, atol=1e-6)
    assert plain.acceleration[0] == loaded.acceleration[0] == 0.0


def test_a_soft_force_fades_out_about_standstill_and_about_its_rest() -> None:
    ride = ridden("passive-low", dashpot(350.0), Timing(5e-3, 4, soft=0.02))
    faded = 1500.0 * ride.speed * (1.0 - np.exp(-((ride.speed / 0.02) ** 2)))
    np.testing.assert_allclose(ride.force, 350.0 + faded, atol=1e-6)
    sprung = 400.0 * ride.acceleration + 20e3 * ride.travel + faded
    np.testing.assert_allclose(sprung, 0.0, atol=1e-6)


def test_the_tyre_carries_both_masses() -> None:
    ride = ridden("passive-high")
    height = ROAD.height(ride.time)[0]
    wheel = np.cumsum(np.concatenate([[0.0], 0.5 * (ride.wheel[1:] + ride.wheel[:-1]) * np.diff(ride.time)]))
    # a spring on the road: its load from the wheel's velocity alone
    np.testing.assert_allclose(ride.tyre_load, 180e3 * (wheel - height), atol=0.01 * np.abs(ride.tyre_load).max())
    # momentum of both: the load, doubly integrated, is what has been lifted
    lifted = np.trapezoid(-ride.tyre_load, ride.time)
    assert lifted == pytest.approx(400.0 * ride.body[-1] + 40.0 * ride.wheel[-1], abs=0.02 * 400.0 * np.ptp(ride.body))


def test_a_ride_ends_where_it_is_told_to_or_with_its_road() -> None:
    assert Timing(1e-3).samples(ROAD) == 801 and Timing(1e-3, until=0.25).samples(ROAD) == 251
    assert Timing(1e-3, until=9.0).samples(ROAD) == 801
    assert Timing(3e-3).samples(RandomRoad("A", duration=2.0)) == 668
    short = ridden("passive-low", timing=Timing(5e-3, 2, until=0.1))
    assert len(short.time) == 2 * 2 * 20 + 1 and short.time[-1] == pytest.approx(0.1)


def test_the_fastest_of_a_car_is_its_wheel_between_both_springs_or_the_body_on_a_rigid_one() -> None:
    assert Car(unsprung=40.0, spring=20e3, tyre=140e3).fastest == pytest.approx(np.sqrt(4000.0) / (2 * np.pi))
    assert Car(sprung=500.0, unsprung=0.0, spring=20e3).fastest == pytest.approx(np.sqrt(40.0) / (2 * np.pi))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"sprung": 0.0}, "--sprung takes a number above 0, not 0"),
        ({"tyre": -1.0}, "--tyre takes a number above 0, not -1"),
        ({"spring": float("nan")}, "spring takes a finite number, not nan"),
        ({"unsprung": -1.0}, "--unsprung takes 0 or more, not -1"),
        ({"tyre_damping": -2.0}, "--tyre-damping takes 0 or more, not -2"),
    ],
)
def test_a_car_of_impossible_parts_is_refused(given: dict[str, float], said: str) -> None:
    with pytest.raises(ConfigError) as raised:
        Car(**given)
    assert str(raised.value) == said


@pytest.mark.parametrize(("sample", "steps"), [(9e-7, 1), (0.101, 1), (1e-3, 0), (1e-3, 1001)])
def test_a_timing_out_of_range_is_refused(sample: float, steps: int) -> None:
    Timing(1e-6, 1000)
    Timing(0.1, 1)
    with pytest.raises(ConfigError, match="--sample takes 1e-06 to 0.1 s and --steps 1 to 1000, not"):
        Timing(sample, steps)


def test_a_road_is_a_cubic_between_its_points() -> None:
    at = 0.25 * np.arange(5)
    road = np.stack([at**3 - 2.0 * at + 1.0, 3.0 * at**2 - 2.0])
    for t in (0.0, 0.1, 0.25, 0.6, 0.999, 1.0):
        height, rate = python(walk._road_at)(road, 0.25, t)
        assert (height, rate) == (pytest.approx(t**3 - 2.0 * t + 1.0), pytest.approx(3.0 * t**2 - 2.0))


def test_the_tableau_is_dormands_and_princes() -> None:
    rows, times = walk._TABLEAU[:, :6], walk._TABLEAU[:, 6]
    np.testing.assert_allclose(rows.sum(axis=1), times, atol=1e-14)
    weights = rows[6]
    # order 5 on polynomials of time, and the error weights vanish up to order 4
    own = np.concatenate([weights, [0.0]])
    for power in range(5):
        assert own @ times**power == pytest.approx(1.0 / (power + 1))
    for power in range(4):
        assert walk._ERRORS @ times**power == pytest.approx(0.0, abs=1e-14)
    assert abs(walk._ERRORS @ times**4) > 1e-4
