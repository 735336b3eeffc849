"""Roads: their heights by closed forms, the spectrum of ISO 8608, and what a written name gives."""

import numpy as np
import pytest

from mrfit.apply.roads import LONGEST_WAVE, ROUGHNESS, SHORTEST_WAVE, Bump, RandomRoad, Road, Sweep, road
from mrfit.errors import ConfigError


def test_a_bump_is_a_rounded_one_over_its_length_and_level_before_and_behind() -> None:
    bump = Bump(rise=0.04, length=2.0, speed=5.0, start=0.3)
    assert (bump.name, bump.ends, bump.top, bump.settled) == ("bump 40 mm", pytest.approx(0.7), 2.5, 0.0)
    # a quarter, half and three quarters of its length behind its start
    height, rate = bump.height(np.array([0.3, 0.4, 0.5, 0.6, 0.7]))
    np.testing.assert_allclose(height, [0.0, 0.02, 0.04, 0.02, 0.0], atol=1e-15)
    steepest = 0.02 * 2.0 * np.pi * 2.5
    np.testing.assert_allclose(rate, [0.0, steepest, 0.0, -steepest, 0.0], atol=1e-12)
    level, still = bump.height(np.array([0.0, 0.299, 0.701, 2.0]))
    assert not level.any() and not still.any()


def test_a_sweep_grows_exponentially_from_its_lowest_frequency_to_its_highest() -> None:
    sweep = Sweep(amplitude=0.002, low=1.0, high=16.0, duration=4.0)
    t = np.linspace(0.0, 4.0, 20001)
    height, rate = sweep.height(t)
    # two octaves in half of the time
    omega = 2.0 * np.pi * 16.0 ** (t / 4.0)
    np.testing.assert_allclose(height**2 + (rate / omega) ** 2, 0.002**2, rtol=1e-9)
    assert height[0] == 0.0 and rate[0] == pytest.approx(0.002 * 2.0 * np.pi)
    periods = 4.0 * (16.0 - 1.0) / np.log(16.0)
    assert np.count_nonzero(np.diff(np.sign(height[1:])) != 0) == int(2.0 * periods)
    assert (sweep.name, sweep.top, sweep.ends, sweep.settled) == ("sweep 1 to 16 Hz", 16.0, 4.0, 0.0)


def test_the_variance_of_a_random_road_is_the_integral_of_its_spectrum() -> None:
    # over all waves, by a time in which each of them meets every other in every phase
    t = 0.37 * np.arange(16_000)
    height = RandomRoad("B", seed=4).height(t)[0][t > 1.0]
    wanted = 64e-6 * 0.1**2 * (1.0 / LONGEST_WAVE - 1.0 / SHORTEST_WAVE)
    assert np.var(height) == pytest.approx(wanted, rel=0.03)


def test_a_random_road_is_one_of_distance_and_a_class_is_twice_as_high_as_the_one_before() -> None:
    t = 1.0 + 0.01 * np.arange(200)
    height = RandomRoad("A", 10.0, seed=2).height(t)[0]
    # twice as fast the same place is reached in half of the time, and passed twice as fast
    sooner, faster = RandomRoad("A", 20.0, seed=2).height(0.5 * (t + 1.0))
    later, slower = RandomRoad("A", 10.0, seed=2).height(t + 1.0)
    np.testing.assert_allclose(sooner, later, atol=1e-12)
    np.testing.assert_allclose(faster, 2.0 * slower, atol=1e-12)
    # each class has four times the spectral density of the one before
    np.testing.assert_allclose(RandomRoad("B", 10.0, seed=2).height(t)[0], 2.0 * height, rtol=1e-12)
    assert [ROUGHNESS[k] / ROUGHNESS["A"] for k in "ABCD"] == [1.0, 4.0, 16.0, 64.0]


def test_a_random_road_is_never_level_and_settles_after_a_second() -> None:
    one = RandomRoad("C", duration=8.0)
    assert (one.name, one.ends, one.settled, one.top) == ("ISO 8608 C", 8.0, 1.0, 0.0)
    with pytest.raises(ConfigError, match="roads here are A to D, not 'E'"):
        RandomRoad("E")
    with pytest.raises(ConfigError, match="duration of 2 s or more, not 1.5 s: the first 1 s lead onto it"):
        RandomRoad("C", duration=1.5)


@pytest.mark.parametrize(
    ("made", "expected"),
    [
        (road("bump"), Bump()),
        (road("bump", 8.0, 2.0), Bump(speed=8.0, duration=2.0)),
        (road("sweep", 8.0, 2.0), Sweep(duration=2.0)),
        (road("B"), RandomRoad("B")),
        (road("D", 30.0, 5.0, 7), RandomRoad("D", 30.0, 5.0, 7)),
    ],
)
def test_a_written_road_has_the_speed_the_duration_and_the_seed_that_are_given(made: Road, expected: Road) -> None:
    assert made == expected and isinstance(made, Road)


@pytest.mark.parametrize("text", ["E", "a", "Bump", ""])
def test_a_road_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match=f"--road takes bump, A, B, C, D or sweep, not '{text}'"):
        road(text)
