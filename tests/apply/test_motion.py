"""Motions: sines by their closed forms, what is written of them, logs, and forces of a file at their samples."""

from dataclasses import replace

import numpy as np
import pytest

from mrfit.api.recordings import Recording
from mrfit.apply.motion import (
    Motion,
    check_length,
    desired_series,
    moving_stretch,
    of_recordings,
    sine,
    sine_phase,
    written_sine,
)
from mrfit.errors import ConfigError, DataError

DT = 2e-3
TIME = DT * np.arange(2000)
STROKE, SPEED = 0.01 * np.sin(8.0 * np.pi * TIME), 0.08 * np.pi * np.cos(8.0 * np.pi * TIME)


def log(**more: np.ndarray) -> Recording:
    return Recording.from_arrays(dt=DT, name="log", displacement=STROKE, velocity=SPEED, **more)


@pytest.mark.parametrize(("output", "unit"), [("force", "m"), ("torque", "rad")])
def test_a_sine_is_displacement_velocity_and_acceleration_of_one_motion(output: str, unit: str) -> None:
    found = sine(2.0, 0.03, 1.5, 1e-3, output)
    place, speed, rate = found.channels.values()
    w = 4.0 * np.pi
    np.testing.assert_allclose(place, 0.03 * np.sin(w * found.time), atol=1e-15)
    np.testing.assert_allclose(speed, 0.03 * w * np.cos(w * found.time), atol=1e-13)
    np.testing.assert_allclose(rate, -(w**2) * place, atol=1e-12)
    assert list(found.channels)[0] == {"force": "displacement", "torque": "angle"}[output]
    assert found.name == f"sine 2 Hz, 0.03 {unit}" and found.force is None
    # its last sample is that at which all cycles are over
    assert found.samples == 751 and found.time[-1] == pytest.approx(0.75)


@pytest.mark.parametrize(("dt", "taken"), [(0.025, True), (0.0251, False)])
def test_a_sine_has_twenty_samples_a_cycle_or_more(dt: float, taken: bool) -> None:
    if taken:
        assert len(sine_phase(2.0, 1.0, dt)) == 21
        return
    with pytest.raises(ConfigError, match=r"cannot be sampled every 0.0251 s \(--dt\): take 20 samples a cycle"):
        sine_phase(2.0, 1.0, dt)


@pytest.mark.parametrize(("cycles", "taken"), [(199.999, True), (200.0, False)])
def test_a_sine_has_no_more_samples_than_are_simulated(cycles: float, taken: bool) -> None:
    if taken:
        assert len(sine_phase(1.0, cycles, 1e-3)) == 200_000
        return
    with pytest.raises(ConfigError, match="200000 at most"):
        sine_phase(1.0, cycles, 1e-3)


@pytest.mark.parametrize("given", [(0.0, 0.01), (1.0, -0.01), (1.0, 0.01, 0.0), (1.0, 0.01, 1.0, 0.0)])
def test_a_sine_of_nothing_is_refused(given: tuple[float, ...]) -> None:
    with pytest.raises(ConfigError, match="a sine needs a frequency, an amplitude, cycles and a sample interval above"):
        sine(*given)
    with pytest.raises(ConfigError, match="dt takes a finite number, not inf"):
        sine(1.0, 0.01, 1.0, np.inf)
    with pytest.raises(ConfigError, match="a sine is for a force or a torque, not for 'flux'"):
        sine(1.0, 0.01, output="flux")


def test_a_written_sine_has_four_cycles_where_none_are_given() -> None:
    assert written_sine("5:0.03", "WB") == (5.0, 0.03, 4.0)
    assert written_sine("5:0.03:7", "WB") == (5.0, 0.03, 7.0)


@pytest.mark.parametrize("text", ["5", "5:0.03:7:1", "5:-1", "5:0.1:0"])
def test_a_written_sine_that_is_none_says_its_form(text: str) -> None:
    with pytest.raises(ConfigError, match=f"--sine takes HZ:WB or HZ:WB:CYCLES above 0, not '{text}'"):
        written_sine(text, "WB")


def test_a_log_longer_than_what_is_simulated_is_refused() -> None:
    check_length("a.csv", 200_000)
    with pytest.raises(DataError, match=r"^a.csv: more than 200000 samples; cut the log"):
        check_length("a.csv", 200_001)


def test_the_motion_of_a_log_has_the_channels_of_its_output_and_those_that_are_asked_for() -> None:
    force, warmth = 900.0 * SPEED, 30.0 + 0.0 * TIME
    (one,) = of_recordings([log(force=force, temperature=warmth)], ("velocity", "current", "temperature"), "force")
    # the current is to be chosen, and is none of the motion
    assert list(one.channels) == ["displacement", "velocity", "acceleration", "temperature"]
    assert one.name == "log" and one.dt == DT
    rate = -((8.0 * np.pi) ** 2) * STROKE[: one.samples]
    np.testing.assert_allclose(one.channels["acceleration"][50:-50], rate[50:-50], atol=0.05)
    assert one.force is not None
    np.testing.assert_allclose(one.force, force[: one.samples])
    (bare,) = of_recordings([log(current=warmth)], ("velocity",), "force")
    assert bare.force is None


def test_a_log_that_stands_still_has_no_motion() -> None:
    still = Recording.from_arrays(dt=DT, name="still", displacement=0.0 * TIME, force=1.0 + 0.0 * TIME)
    with pytest.raises(DataError):
        moving_stretch(still)


def test_forces_of_a_file_are_read_at_the_samples_of_a_motion() -> None:
    motion = sine(1.0, 0.01, 1.0, 0.01)
    ramp = Recording.from_arrays(dt=0.04, name="f", force=100.0 * 0.04 * np.arange(26))
    np.testing.assert_allclose(desired_series([ramp], motion, "force"), 100.0 * motion.time, atol=1e-9)
    # a file may end half a sample before the motion, and no earlier
    for last, taken in ((0.996, True), (0.994, False)):
        short = Recording.from_arrays(dt=last / 50, name="short", force=np.ones(51))
        if taken:
            assert desired_series([short], motion, "force").shape == (101,)
            continue
        with pytest.raises(DataError, match=r"ends after 0.994 s, the motion after 1 s; give a force for all of it"):
            desired_series([short], motion, "force")
    for wrong in ([ramp, ramp], [], [replace(ramp, channels={"displacement": np.ones(26)})]):
        with pytest.raises(DataError, match="needs a column 'force' beside the time, in one stretch without gaps"):
            desired_series(wrong, motion, "force")


def test_times_of_a_motion_begin_at_its_first_sample() -> None:
    one = Motion("m", 0.5, {"displacement": np.zeros(3)})
    assert one.samples == 3 and one.time.tolist() == [0.0, 0.5, 1.0]
