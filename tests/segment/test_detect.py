from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.segment.detect import Detection, detect, drive_channel
from tests.flux.records import recording

STILL = np.zeros(1000)
MOVING = np.sin(np.arange(1000) / 30)


def found(log: Recording, drive: str = "current", settle: int = 1) -> Detection:
    return detect(log, drive, 2, settle, 0.02)


def sine(cycles: float, per_cycle: float, amplitude: float = 1.0, noise: float = 0.0) -> np.ndarray:
    n = np.arange(int(cycles * per_cycle))
    rng = np.random.default_rng(0)
    return amplitude * (np.sin(2 * np.pi * n / per_cycle) + noise * rng.standard_normal(len(n)))


@pytest.mark.parametrize(
    ("channels", "expected"),
    [
        ({"current": MOVING, "voltage": MOVING}, "current"),
        ({"current": MOVING, "flux": MOVING, "displacement": MOVING}, "current"),
        ({"current": STILL + 0.5, "displacement": MOVING, "force": MOVING}, "displacement"),
        ({"current": MOVING, "voltage": MOVING, "displacement": STILL, "force": MOVING}, "current"),
        ({"velocity": MOVING, "force": MOVING}, "velocity"),
        ({"angle": MOVING, "torque": MOVING, "current": STILL}, "angle"),
        ({"current": STILL, "voltage": MOVING}, None),
        ({"force": MOVING}, None),
    ],
)
def test_the_drive_is_what_moves(channels: dict[str, np.ndarray], expected: str | None) -> None:
    assert drive_channel(recording("log", 1e-3, channels), None) == expected


def test_a_wanted_drive_is_taken() -> None:
    log = recording("log", 1e-3, {"displacement": MOVING, "velocity": MOVING})
    assert drive_channel(log, "velocity") == "velocity"
    assert drive_channel(log, "angle") is None


@settings(max_examples=30, deadline=None)
@given(
    per_cycle=st.floats(20.0, 600.0),
    cycles=st.floats(3.2, 12.0),
    amplitude=st.floats(0.01, 100.0),
    noise=st.sampled_from([0.0, 1e-3, 1e-2]),
)
def test_whole_steady_cycles_are_kept(per_cycle: float, cycles: float, amplitude: float, noise: float) -> None:
    dt = 1 / (5.0 * per_cycle)
    log = recording("log", dt, {"current": sine(cycles, per_cycle, amplitude, noise)})
    (segment,) = found(log).segments
    # a cycle whose end falls between two samples may count or not
    whole = {int((log.samples + ahead) / per_cycle) for ahead in (0.0, 0.5, 1.0)}
    assert segment.cycles + 1 in whole
    assert segment.samples == pytest.approx(segment.cycles * per_cycle, abs=1.0)
    assert 0 <= segment.start - segment.warm_up and segment.stop <= log.samples
    assert segment.warm_up >= per_cycle - 2
    assert segment.waveform == "sine"
    assert segment.frequency == pytest.approx(5.0, rel=1e-2 * noise + 1e-6 + noise / cycles)
    assert segment.amplitude == pytest.approx(amplitude, rel=0.05)


def test_two_cycles_are_both_kept() -> None:
    (segment,) = found(recording("log", 1e-3, {"current": sine(2.0, 500)})).segments
    assert (segment.cycles, segment.start, segment.stop, segment.warm_up) == (2, 0, 1000, 0)


def test_more_settling_cycles_can_be_asked_for() -> None:
    (segment,) = found(recording("log", 1e-3, {"current": sine(9.0, 500)}), settle=3).segments
    assert (segment.cycles, segment.warm_up) == (6, 1500)


def test_units_change_nothing_but_the_amplitude() -> None:
    values = sine(8.3, 333.3, 1.0, 0.003)
    (one,) = found(recording("log", 1e-3, {"displacement": values}), "displacement").segments
    (other,) = found(recording("log", 1e-3, {"displacement": values / 1000}), "displacement").segments
    assert (one.start, one.stop, one.cycles, one.waveform) == (other.start, other.stop, other.cycles, other.waveform)
    assert other.amplitude == pytest.approx(one.amplitude / 1000)


def test_a_long_log_of_six_conditions_is_split() -> None:
    parts = []
    for per_cycle in (1000.0, 200.0, 133.4):
        for amplitude in (1.0, 3.0):
            parts += [sine(7, per_cycle, amplitude), np.zeros(300)]
    values = np.concatenate(parts) + 0.005 * np.random.default_rng(1).standard_normal(sum(map(len, parts)))
    segments = found(recording("log", 1e-3, {"current": values})).segments
    assert [s.id for s in segments] == [f"log#{k}" for k in range(1, 7)]
    expected = [(f, a) for f in (1.0, 5.0, 7.496) for a in (1.0, 3.0)]
    for segment, (frequency, amplitude) in zip(segments, expected, strict=True):
        assert (segment.frequency, segment.amplitude) == pytest.approx((frequency, amplitude), rel=0.01)
        assert segment.cycles >= 5


def test_a_long_log_is_split_by_current_level() -> None:
    stroke = 0.01 * sine(40, 200)
    current = np.repeat([0.0, 0.5, 1.0, 1.5], 2000) + 0.002 * np.random.default_rng(2).standard_normal(8000)
    log = recording("log", 1e-3, {"displacement": stroke, "current": current, "force": stroke})
    segments = found(log, "displacement").segments
    assert [round(s.current, 2) for s in segments] == [0.0, 0.5, 1.0, 1.5]


def test_the_level_comes_from_the_condition_where_it_was_not_recorded() -> None:
    log = recording(
        "log", 1e-3, {"displacement": sine(9, 200), "force": sine(9, 200)}, {"current": 0.75, "temperature": 31.0}
    )
    (segment,) = found(log, "displacement").segments
    assert (segment.current, segment.temperature) == (0.75, 31.0)


def test_a_current_of_zero_that_flickers_by_one_code_is_held() -> None:
    current = np.zeros(1800)
    current[[700, 1300]] = 1e-4
    log = recording("log", 1e-3, {"displacement": sine(9, 200), "current": current})
    (segment,) = found(log, "displacement").segments
    assert (segment.cycles, segment.current) == (8, pytest.approx(0.0, abs=1e-6))


@pytest.mark.parametrize(
    "disturbance",
    [
        lambda t, rng: 0.01 * np.sin(2 * np.pi * 50.0 * t),
        lambda t, rng: 0.01 * np.sin(2 * np.pi * 10.0 * t),
        lambda t, rng: 0.002 * t + 0.003 * np.sin(t),
        lambda t, rng: rng.normal(0.0, 0.006, len(t)),
        lambda t, rng: np.maximum(rng.normal(0.0, 0.01, len(t)), 0.0),
    ],
    ids=["pickup", "ripple", "drift", "noise", "cut at zero"],
)
def test_no_current_is_held_whatever_disturbs_its_probe(disturbance: Callable[..., Array]) -> None:
    t = 1e-3 * np.arange(1800)
    current = disturbance(t, np.random.default_rng(4))
    log = recording("log", 1e-3, {"displacement": sine(9, 200), "current": current, "force": sine(9, 200)})
    (segment,) = found(log, "displacement").segments
    assert segment.current == pytest.approx(0.0, abs=0.01)


def test_a_small_current_that_is_switched_is_not_held() -> None:
    current = 0.05 * (np.arange(1800) // 50 % 2)
    log = recording("log", 1e-3, {"displacement": sine(9, 200), "current": current, "force": sine(9, 200)})
    assert all(np.isnan(s.current) for s in found(log, "displacement").segments)


def test_a_motion_whose_middle_drifts_is_said_to_be_cut() -> None:
    t = np.arange(12_000) / 12_000
    log = recording("log", 1e-3, {"displacement": 0.01 * sine(12, 1000) + 0.064 + 0.0018 * t})
    detection = found(log, "displacement")
    assert len(detection.segments) > 1
    (said,) = [f for f in detection.findings if "drifts" in f]
    assert said.startswith("log: the middle of displacement drifts from 0.06") and " m: cut into " in said
    # another amplitude is another test
    two = np.concatenate([0.01 * sine(6, 1000), 0.005 * sine(6, 1000) + 0.002])
    assert not any("drifts" in f for f in found(recording("log", 1e-3, {"displacement": two}), "displacement").findings)


def test_a_current_that_is_not_held_is_no_level() -> None:
    log = recording("log", 1e-3, {"displacement": sine(9, 200), "current": np.sin(np.arange(1800) / 37.0)})
    segments = found(log, "displacement").segments
    assert all(np.isnan(s.current) for s in segments)


def test_random_excitation_is_one_segment_with_a_lead_in() -> None:
    white = np.random.default_rng(3).standard_normal(20_000)
    values = np.convolve(white, np.hanning(150), mode="valid")
    (segment,) = found(recording("log", 1e-3, {"current": values})).segments
    assert (segment.waveform, segment.frequency, segment.cycles) == ("random", 0.0, 0)
    assert (segment.start - segment.warm_up, segment.stop) == (0, len(values))
    assert segment.warm_up == pytest.approx(0.1 * len(values), abs=1)


def test_random_excitation_after_sines_is_found_too() -> None:
    white = np.random.default_rng(4).standard_normal(12_149)
    tail = np.convolve(white, np.hanning(150) / 20, mode="valid")
    segments = found(recording("log", 1e-3, {"current": np.concatenate([sine(10, 500), tail])})).segments
    assert [s.waveform for s in segments] == ["sine", "random"]


def test_rest_before_a_test_is_no_segment() -> None:
    values = np.concatenate([np.zeros(5000), sine(8, 500), np.zeros(5000)])
    detection = found(
        recording("log", 1e-3, {"current": values + 0.002 * np.random.default_rng(5).standard_normal(14_000)})
    )
    (segment,) = detection.segments
    assert segment.start - segment.warm_up >= 4950 and segment.stop <= 9050
    assert any("cut as transients or rest" in f for f in detection.findings)


def test_a_stated_value_that_the_data_contradict_is_said() -> None:
    stated = {"frequency": 5.0, "amplitude": 2.0}
    detection = found(recording("log", 1e-3, {"current": sine(9, 200, 1.65)}, stated))
    assert any("amplitude is stated as 2, the data say 1.65" in f for f in detection.findings)
    assert not any("frequency" in f for f in detection.findings)


def test_a_rig_that_wanders_is_accepted_with_a_word() -> None:
    rng = np.random.default_rng(6)
    n = np.arange(8000)
    wander = np.interp(n, np.arange(0, 8001, 500), rng.uniform(-0.13, 0.13, 17))
    detection = found(recording("log", 1e-3, {"displacement": sine(16, 500) + wander}), "displacement")
    assert any("unsteady" in f for f in detection.findings)
    assert sum(s.cycles for s in detection.segments) >= 6
    assert {s.waveform for s in detection.segments} == {"sine"}


def test_cycles_too_few_are_said_with_what_became_of_them() -> None:
    log = recording("log", 1e-3, {"current": sine(8.0, 500)})
    made = detect(log, "current", 10, 1, 0.02)
    assert [s.waveform for s in made.segments] == ["random"]
    assert made.findings == (
        "log: 8 cycles of 2 Hz, fewer than --min-cycles 10: treated as one stretch without a frequency, 'random'; "
        "give --min-cycles 8 to have them as cycles",
    )
    made = detect(log, "current", 8, 1, 0.02)
    assert [s.cycles for s in made.segments] == [7] and not made.findings


@pytest.mark.parametrize("begin", [0, 130, 300])
def test_a_single_cycle_of_a_sine_is_said(begin: int) -> None:
    values = sine(2.5, 500, noise=0.005)[begin : begin + 700]
    (said,) = found(recording("log", 1e-3, {"current": values})).findings
    assert said.startswith("log: 1 cycle of 2 Hz") and "one stretch without a frequency, 'quasi-static'" in said


def test_a_slow_ramp_is_no_sine() -> None:
    ramps = np.interp(np.arange(1500), [0, 250, 750, 1250, 1500], [0, 1, -1, 1, 0])
    made = found(recording("log", 1e-3, {"current": ramps}))
    assert [s.waveform for s in made.segments] == ["quasi-static"] and not made.findings


def test_a_part_with_too_few_cycles_beside_others_is_said() -> None:
    values = np.concatenate([sine(20, 100), np.zeros(300), sine(5, 200)])
    made = detect(recording("log", 1e-3, {"current": values}), "current", 10, 1, 0.02)
    assert [round(s.frequency) for s in made.segments] == [10]
    assert any("4 cycles of 5 Hz, fewer than --min-cycles 10: left out" in f for f in made.findings), made.findings


@pytest.mark.parametrize(("cycles", "tests"), [(3, ["random"]), (60, ["random", "sine"])])
def test_cycles_that_end_within_one_of_the_motion_about_them_are_no_test(cycles: int, tests: list[str]) -> None:
    rng, time = np.random.default_rng(4), np.arange(1200) * 0.005
    motion = np.convolve(rng.standard_normal(1200), np.hanning(60), "same") * np.minimum(1.0, time)
    tremble = 0.03 * np.ptp(motion) * np.sin(2.0 * np.pi * 40.0 * 0.005 * np.arange(5 * cycles + 1))
    seen = found(
        recording("log", 0.005, {"current": np.concatenate([motion, motion[-1] + tremble, np.full(10, motion[-1])])})
    )
    assert [s.waveform for s in seen.segments] == tests
    assert ("no test of their own" in " ".join(seen.findings)) is (cycles == 3)
