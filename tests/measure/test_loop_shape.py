"""Widths of a loop at stated speeds, and the reasons where a record tells no width, travel or ripple."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.measure.cycles import Cycles
from mrfit.measure.forces import forces_of
from mrfit.measure.intervals import PerCycle
from mrfit.measure.loop_shape import NO_CROSSING, quantities, ripple
from mrfit.measure.quantity import Quantity
from tests.measure.rigs import cycles, recording

RATE, OMEGA, SIZE = 250.0, 4.0 * np.pi, 0.01
SPEED, SPRING, DASHPOT = SIZE * OMEGA, 2e4, 1500.0


def motion(seconds: float = 4.0, rate: float = RATE) -> tuple[Array, Array]:
    time = np.arange(int(seconds * rate)) / rate
    return SIZE * np.sin(OMEGA * time + 0.3), SPEED * np.cos(OMEGA * time + 0.3)


@cache
def spring_and_dashpot(constant: float = 0.0, rate: float = RATE) -> Cycles:
    moved, speed = motion(rate=rate)
    force = SPRING * moved + DASHPOT * speed + constant
    return cycles(recording("k", 1.0 / rate, displacement=moved, force=force))


def shape(whole: Cycles, speed: float | None = None) -> dict[str, Quantity]:
    return {one.name: one for one in quantities(whole, forces_of(whole), speed)}


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
def test_the_width_of_a_loop_at_a_speed_is_that_of_its_spring_at_both_places_of_it(share: float) -> None:
    found = shape(spring_and_dashpot(), share * SPEED)
    # while the speed rises the displacement is below the middle, as far as while it falls it is above
    width = 2.0 * SPRING * SIZE * np.sqrt(1.0 - share**2)
    for name, truth in (("width+", -width), ("width-", width)):
        one = found[name].estimate
        assert one is not None and one.value == pytest.approx(truth, rel=5e-3)


def test_a_width_is_taken_at_half_of_the_greatest_speed_where_none_is_stated() -> None:
    whole = spring_and_dashpot()
    half, stated = shape(whole)["width+"].estimate, shape(whole, 0.5 * whole.peak_velocity)["width+"].estimate
    assert half is not None and stated is not None and half.value == stated.value


def test_a_width_at_a_speed_that_is_not_reached_is_none() -> None:
    found = shape(spring_and_dashpot(), 1.01 * SPEED)
    for name in ("width+", "width-"):
        assert found[name].estimate is None and "the speed does not reach 0.1269 m/s" in found[name].reason


@pytest.mark.parametrize(("constant", "crosses"), [(0.0, True), (100.0, True), (400.0, False), (-400.0, False)])
def test_a_force_of_one_sign_has_no_width_over_velocity(constant: float, crosses: bool) -> None:
    # spring and dashpot make 275 N together
    found = shape(spring_and_dashpot(constant))["width v"]
    assert (found.estimate is not None) is crosses and found.reason == ("" if crosses else NO_CROSSING)


def test_a_constant_force_moves_the_width_over_velocity_as_the_law_says() -> None:
    found = shape(spring_and_dashpot(100.0))["width v"].estimate
    # k*x + c*v + 100 N = 0 on the circle x = A*sin(p), v = A*w*cos(p): c*w*cos(p) + k*sin(p) = -100/A
    size, phase = np.hypot(SPRING, DASHPOT * OMEGA), np.arctan2(SPRING, DASHPOT * OMEGA)
    off = np.arccos(-100.0 / SIZE / size)
    first, second = SPEED * np.cos(phase - off), SPEED * np.cos(phase + off)
    assert found is not None and found.value == pytest.approx(first - second, rel=5e-3)


@pytest.mark.parametrize(("rate", "reason"), [(190.0, "95 samples a cycle; 100 are needed"), (210.0, "")])
def test_a_ripple_takes_a_hundred_samples_a_cycle(rate: float, reason: str) -> None:
    whole = spring_and_dashpot(rate=rate)
    found = ripple(whole, forces_of(whole))
    assert found.reason == reason and (found.estimate is None) == bool(reason)


def test_one_cycle_does_not_tell_a_ripple_from_noise() -> None:
    whole = spring_and_dashpot()
    one = replace(whole, reversals=whole.reversals[:3], middles=whole.middles[:1],
                  gains=PerCycle(whole.gains.values[:1], whole.gains.noise[:1]))  # fmt: skip
    assert ripple(one, forces_of(one)).reason == "one cycle; two are needed to tell a ripple from noise"


@pytest.mark.parametrize(("skew", "refused"), [(0.24, False), (0.26, True), (-0.26, True)])
def test_a_skew_of_half_a_cycle_is_refused(skew: float, refused: bool) -> None:
    moved, speed = motion()
    record = recording("k", 1.0 / RATE, displacement=moved, force=SPRING * moved + DASHPOT * speed)
    if refused:
        with pytest.raises(DataError, match=f"a skew of {skew:g} s is half a cycle of 0.5 s or more"):
            cycles(record, skew)
    else:
        assert cycles(record, skew).count > 2


def test_negated_cycles_have_the_opposite_force_and_work() -> None:
    whole = spring_and_dashpot(100.0)
    other = replace(whole, zero=2.0).negated()
    assert np.array_equal(other.force, -whole.force) and other.zero == -2.0
    assert other.work.values == pytest.approx(-whole.work.values)
