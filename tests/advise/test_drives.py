"""Tests keep the limits of the rig, whatever the point; what they drive is consistent."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.advise.drives import RigBench, least_cycles, lengthened, test_at
from mrfit.advise.rig import Rig, current_reach, motion_reach

test_at.__test__ = False
RATE = 400.0
POINT = st.lists(st.floats(0.0, 1.0), min_size=5, max_size=5).map(np.array)


def press(**limits: object) -> RigBench:
    rig = Rig.model_validate({"seconds": 9.0, "stroke": 0.06, "speed": 0.3, "acceleration": 6.0, **limits})
    return RigBench(rig, motion_reach(rig, least_cycles(), RATE), rig.current, 1 / RATE)


@st.composite
def presses(draw: st.DrawFn) -> RigBench:
    """A press of any size that leaves some test, with a current that can be stepped."""
    return press(
        stroke=draw(st.floats(0.01, 0.3)),
        speed=draw(st.floats(0.05, 1.0)),
        acceleration=draw(st.floats(2.0, 50.0)),
        seconds=draw(st.floats(8.0, 30.0)),
        current=(draw(st.floats(0.0, 1.0)), draw(st.floats(1.5, 4.0))),
        current_rate=draw(st.none() | st.floats(1.0, 100.0)),
        temperature=(18.0, 50.0),
    )


@settings(max_examples=40, deadline=None)
@given(presses(), st.sampled_from(("sine", "triangle", "sweep", "steps", "repeat", "warm-up")), POINT, st.floats(1, 9))
def test_limits_are_always_kept(bench, kind, point, factor):
    if kind not in bench.kinds:
        return
    rig = bench.rig
    for test in (made := test_at(kind, point, bench), lengthened(made, factor, bench)):
        x, v, a = np.abs(test.motion).max(axis=1)
        assert x <= rig.stroke / 2 and v <= rig.speed and a <= rig.acceleration
        assert 0 < x and np.isfinite(test.motion).all()
        assert test.seconds <= rig.seconds + bench.dt
        assert rig.current[0] - 1e-12 <= test.current.min() and test.current.max() <= rig.current[1] + 1e-12
        if rig.current_rate is not None:
            assert np.abs(np.diff(test.current)).max() <= rig.current_rate * bench.dt * (1 + 1e-9)


@settings(max_examples=20, deadline=None)
@given(st.sampled_from(("sine", "triangle", "sweep", "steps", "repeat")), POINT)
def test_motion_starts_and_ends_at_rest_and_its_rates_are_its_derivatives(kind, point):
    # sampled so finely that sums are integrals
    bench = replace(press(current=2.0, frequency=6.0, seconds=4.0), dt=5e-5)
    x, v, a = test_at(kind, point, bench).motion
    assert abs(x[0]) < 1e-9 and abs(v[0]) < 1e-3 * np.abs(v).max()
    assert abs(x[-1]) < 0.02 * np.abs(x).max()
    for value, rate in ((x, v), (v, a)):
        travelled = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * bench.dt)]) + value[0]
        assert np.abs(travelled - value).max() <= 0.03 * np.ptp(value)


def test_a_coil_is_driven_by_its_current():
    rig = Rig.model_validate({"seconds": 5.0, "current": 3.0, "current_rate": 500.0, "frequency": [2.0, 60.0]})
    bench = RigBench(rig, current_reach(rig, least_cycles(), 5000.0), None, 1 / 5000)
    assert "steps" not in bench.kinds
    test = test_at("sine", np.full(5, 0.9), bench)
    assert np.abs(test.motion[0]).max() <= 3.0 and np.abs(test.motion[1]).max() <= 500.0
    assert not len(test.current)


def test_kinds_follow_what_the_rig_has():
    assert set(press().kinds) == {"sine", "triangle", "repeat", "sweep"}
    assert set(press(current=2.0, temperature=[20, 40]).kinds) >= {"steps", "warm-up"}
    assert "sweep" not in press(frequency=[1.0, 2.0]).kinds
    # two bursts do not fit
    assert "repeat" not in press(frequency=1.5).kinds


def test_a_test_is_made_longer_up_to_the_longest_one():
    bench = press(frequency=6.0)
    test = test_at("sine", np.array([1.0, 1.0, 0.5, 0.5, 0.5]), bench)
    longer = lengthened(test, 100.0, bench)
    assert 2 * test.seconds <= longer.seconds <= 9.0 + bench.dt
    assert longer.numbers == pytest.approx(test.numbers)
    assert lengthened(test, 0.5, bench) is test
