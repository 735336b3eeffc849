"""Which steps of a current count, which way they go, and what an answer is measured by."""

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.measure.current_steps import REST_SAMPLES, quantities
from mrfit.measure.quantity import Quantity
from tests.measure.test_forms_of_answers import DT, LAG, SPEED, answering, answers


def count(found: dict[str, Quantity], name: str) -> int:
    one = found[name].estimate
    return 0 if one is None else len(one.cycles)


def test_a_current_that_grows_below_nought_goes_up() -> None:
    current, force = answering((2.0, 4.0))
    plain, mirrored = answers(current, force), answers(-current, force)
    for name in ("t63 up", "t63 down"):
        one, other = plain[name].estimate, mirrored[name].estimate
        assert one is not None and other is not None and one.value == pytest.approx(other.value)


def test_a_force_against_a_negative_speed_answers_alike() -> None:
    current, force = answering((2.0, 4.0))
    pushed = answers(current, -force, np.full(len(current), -SPEED))
    one, other = answers(current, force)["t90 up"].estimate, pushed["t90 up"].estimate
    assert one is not None and other is not None and one.value == pytest.approx(other.value)


@pytest.mark.parametrize(("size", "steps"), [(0.08, 1), (0.13, 2)])
def test_a_step_is_a_tenth_of_the_range_of_the_current(size: float, steps: int) -> None:
    current, force = answering((2.0,))
    late = np.arange(len(current)) * DT >= 4.0
    since = np.maximum(np.arange(len(current)) * DT - 4.0, 0.0)
    # of the range, which it widens itself
    current = current + late * size
    force = force + late * 400.0 * size * -np.expm1(-since / LAG)
    assert count(answers(current, force), "t63 up") == steps


@pytest.mark.parametrize(("rest", "steps"), [(REST_SAMPLES - 2, 0), (60, 1)])
def test_a_step_holds_for_a_rest_before_it(rest: int, steps: int) -> None:
    samples = 2000
    current = np.where(np.arange(samples) >= 1000, 1.0, 0.0)
    # the current has fallen from another level so many samples before
    current[: 1000 - rest] = 3.0
    force = 200.0 + 400.0 * np.where(current == 1.0, -np.expm1(-(np.arange(samples) - 999.0) * DT / 0.005), 0.0)
    force[: 1000 - rest] = 1400.0
    found = answers(current, force + 0.1 * np.random.default_rng(0).standard_normal(samples))
    assert count(found, "t63 up") == steps


@pytest.mark.parametrize(("change", "holds"), [(0.03, True), (0.08, False)])
def test_a_speed_within_a_twentieth_holds(change: float, holds: bool) -> None:
    current, force = answering((3.0,))
    # from the step on the speed is another
    velocity = SPEED * (1.0 + change * (current > 0.0) * np.tile([0.0, 1.0], len(current) // 2))
    found = answers(current, force, velocity)
    assert (found["t63 up"].estimate is not None) is holds
    assert holds or "the speed does not hold while the force answers" in found["t63 up"].reason


def delayed(dead: float, tau: float, noise: float = 0.2) -> tuple[Array, Array]:
    time = DT * np.arange(6000)
    current = (time >= 3.0).astype(np.float64)
    late = np.where(time >= 3.0 + dead, -np.expm1(-np.maximum(time - 3.0 - dead, 0.0) / tau), 0.0)
    return current, 200.0 + 400.0 * late + noise * np.random.default_rng(3).standard_normal(len(time))


@pytest.mark.parametrize(("dead", "tau"), [(0.05, 0.04), (0.02, 0.1)])
def test_dead_time_and_lag_are_told_apart(dead: float, tau: float) -> None:
    found = {n: q.estimate for n, q in answers(*delayed(dead, tau)).items()}
    truths = {"dead time up": dead, "t63 up": dead + tau, "t90 up": dead + tau * np.log(10.0), "overshoot up": 0.0}
    for name, truth in truths.items():
        one = found[name]
        assert one is not None and one.value == pytest.approx(truth, abs=2e-3), name


def test_times_are_in_seconds_whatever_the_rate() -> None:
    current, force = delayed(0.02, 0.1)
    half, whole = (
        {q.name: q.estimate for q in quantities(current, force, np.full(6000, SPEED), dt)} for dt in (DT, 2 * DT)
    )
    for name, times in (("t63 up", 2.0), ("dead time up", 2.0), ("overshoot up", 1.0)):
        one, other = half[name], whole[name]
        assert one is not None and other is not None and other.value == pytest.approx(times * one.value)


@pytest.mark.parametrize(("over", "told"), [(0.001, False), (0.1, True)])
def test_an_overshoot_is_more_than_the_noise(over: float, told: bool) -> None:
    current, force = delayed(0.0, 0.01, noise=2.0)
    since = np.maximum(np.arange(6000) * DT - 3.1, 0.0)
    force = force + 400.0 * over * np.exp(-((since - 0.05) ** 2) / 2.0 / 0.015**2) * (since > 0.0)
    one = answers(current, force)["overshoot up"].estimate
    assert one is not None and (one.value > 0.0) is told
    assert not told or one.value == pytest.approx(over, rel=0.2)
