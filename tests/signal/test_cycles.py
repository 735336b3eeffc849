import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.signal.cycles import gaps, steady_stretches, turning_points

DT = 1 / 5000


@settings(max_examples=60, deadline=None)
@given(
    per_cycle=st.floats(12.0, 900.0),
    cycles=st.floats(2.3, 15.0),
    amplitude=st.floats(1e-3, 1e3),
    offset=st.floats(-3.0, 3.0),
    phase=st.floats(0.0, 6.28),
    noise=st.sampled_from([0.0, 1e-4, 1e-2]),
)
def test_a_planted_sine_is_found_whole(
    per_cycle: float, cycles: float, amplitude: float, offset: float, phase: float, noise: float
) -> None:
    rng = np.random.default_rng(0)
    n = np.arange(int(per_cycle * cycles))
    values = amplitude * (np.sin(2 * np.pi * n / per_cycle + phase) + offset + noise * rng.standard_normal(len(n)))
    (stretch,) = steady_stretches(values, DT)
    # where half a sample more makes a cycle whole, either count is right
    whole = (len(n) + 0.5) / per_cycle
    assert int(whole - 1e-3) <= stretch.cycles <= int(whole + 1e-3)
    assert stretch.fit.frequency * DT == pytest.approx(1 / per_cycle, rel=1e-9 + 6 * noise / np.sqrt(len(n)) / cycles)
    assert stretch.fit.amplitude == pytest.approx(amplitude, rel=1e-3 + 3 * noise)


@pytest.mark.parametrize("rest", [0, 700])
def test_one_long_log_is_split_by_frequency_and_amplitude(rest: int) -> None:
    rng = np.random.default_rng(1)
    planted, parts, at = [], [], 0
    for frequency in (1.0, 5.0, 10.0):
        for amplitude in (0.2, 1.0, 5.0):
            count = round(8 / frequency / DT)
            parts += [amplitude * np.sin(2 * np.pi * frequency * np.arange(count) * DT), np.zeros(rest)]
            planted.append((frequency, amplitude, at, at + count))
            at += count + rest
    values = np.concatenate(parts)
    stretches = steady_stretches(values + 0.01 * rng.standard_normal(len(values)), DT)
    assert len(stretches) == 9
    for stretch, (frequency, amplitude, begin, end) in zip(stretches, planted, strict=True):
        period = 1 / (frequency * DT)
        assert stretch.fit.frequency == pytest.approx(frequency, rel=1e-3)
        assert stretch.fit.amplitude == pytest.approx(amplitude, rel=0.02)
        assert stretch.cycles >= 7
        assert begin - 0.01 * period <= stretch.start and stretch.stop <= end + 0.01 * period


def test_a_level_that_changes_splits_a_steady_stroke() -> None:
    n = np.arange(50_000)
    stroke = np.sin(2 * np.pi * n / 1000)
    current = np.repeat([0.0, 0.25, 0.5, 0.75, 1.0], 10_000)
    stretches = steady_stretches(stroke, DT, [current])
    assert len(stretches) == 5
    for k, stretch in enumerate(stretches):
        assert stretch.cycles >= 8
        assert np.ptp(current[stretch.start + 1000 : stretch.stop - 1000]) == 0.0, k


def test_a_transient_is_cut() -> None:
    n = np.arange(20_000)
    settled = 0.02 ** (n / 4000)  # falls to 2 % in four cycles
    (stretch,) = steady_stretches(np.sin(2 * np.pi * n / 1000) * (1 - settled), DT)
    assert 2500 < stretch.start < 6000
    assert stretch.stop == 20_000


def test_a_pattern_of_several_reversals_is_one_cycle() -> None:
    n = np.arange(20_000) / 300
    values = np.sin(n) + 0.9 * np.sin(3 * n + 0.3) + 0.7 * np.sin(5 * n + 0.8)
    (stretch,) = steady_stretches(values, DT)
    assert stretch.fit.frequency * DT == pytest.approx(1 / (600 * np.pi), rel=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_random_signals_have_no_steady_cycles(seed: int) -> None:
    rng = np.random.default_rng(seed)
    low_passed = np.convolve(rng.standard_normal(60_000), np.hanning(200), mode="valid")
    bits = np.repeat(rng.integers(0, 2, 400) * 2.0 - 1.0, 100) + 0.01 * rng.standard_normal(40_000)
    assert steady_stretches(low_passed, DT) == []
    assert steady_stretches(bits, DT) == []
    assert steady_stretches(rng.standard_normal(20_000), DT) == []


def test_nothing_is_found_at_rest() -> None:
    assert steady_stretches(np.zeros(500), DT) == []
    assert steady_stretches(np.random.default_rng(2).normal(1.0, 0.01, 5000), DT) == []


def test_boundaries_are_whole_cycles_apart() -> None:
    n = np.arange(5000)
    (stretch,) = steady_stretches(np.sin(2 * np.pi * n / 333.3), DT)
    boundaries = stretch.boundaries(DT)
    assert len(boundaries) == stretch.cycles + 1 == 16
    assert np.diff(boundaries) == pytest.approx(333.3, rel=1e-6)


def test_turning_points_ignore_small_swings() -> None:
    rng = np.random.default_rng(3)
    n = np.arange(10_000)
    points = turning_points(np.sin(2 * np.pi * n / 1000) + 0.05 * rng.standard_normal(10_000), 0.8)
    extremes = points[1:-1]
    assert len(extremes) == 20
    assert np.abs(extremes - (250 + 500 * np.arange(20))).max() < 100


def test_gaps_are_what_no_stretch_covers() -> None:
    rest = np.zeros(2000)
    sine = np.sin(2 * np.pi * np.arange(5000) / 500)
    values = np.concatenate([rest, sine, rest])
    stretches = steady_stretches(values, DT)
    (first, last) = gaps(stretches, len(values))
    assert first == (0, stretches[0].start) and last == (stretches[-1].stop, 9000)
