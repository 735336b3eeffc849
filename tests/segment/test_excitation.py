"""Records with an excitation: whole cycles of a steady state, or a beginning at rest."""

from dataclasses import replace

import numpy as np
import pytest

from mrfit.core.recording import Recording
from mrfit.segment.detect import detect, drive_channel

PERIOD, CYCLES, DT = 240, 4, 0.01


def record(motion: np.ndarray, condition: dict[str, float] | None = None) -> Recording:
    phase = 2 * np.pi * np.arange(PERIOD) / PERIOD
    cycle = np.sin(3 * phase) + 0.5 * np.sin(7 * phase + 1.0) + 0.2 * np.cos(20 * phase)
    channels = {"excitation_force": np.resize(cycle, len(motion)), "displacement": motion}
    units = {"excitation_force": "N", "displacement": "m"}
    return Recording("r", "r.csv", "", "", DT, 0.0, channels, units, condition=condition or {})


def steady(noise: float) -> np.ndarray:
    cycle = np.cos(2 * np.pi * 3 * np.arange(PERIOD) / PERIOD)
    return np.resize(cycle, PERIOD * CYCLES) + noise * np.random.default_rng(1).standard_normal(PERIOD * CYCLES)


def test_whole_cycles_of_a_steady_state_are_found() -> None:
    found = record(steady(0.01))
    assert drive_channel(found, None) == "excitation_force"
    (segment,) = detect(found, "excitation_force", 3, 1, 0.1).segments
    assert (segment.start, segment.stop, segment.cycles) == (0, PERIOD * CYCLES, CYCLES)
    assert segment.frequency * PERIOD * DT == 1.0


def test_a_motion_that_still_settles_begins_at_rest() -> None:
    settling = steady(0.001) * (1.0 - np.exp(-np.arange(PERIOD * CYCLES) / PERIOD))
    (segment,) = detect(record(settling), "excitation_force", 3, 1, 0.1).segments
    assert (segment.cycles, segment.warm_up, segment.waveform) == (0, 0, "random")


@pytest.mark.parametrize(("time_constant", "cycles"), [(0.0, 2), (0.3, 0), (1.0, 0)])
def test_two_cycles_are_steady_where_they_differ_by_no_more_than_noise(time_constant: float, cycles: int) -> None:
    two = steady(0.001)[: 2 * PERIOD]
    if time_constant:
        two += np.exp(-np.arange(len(two)) / (time_constant * PERIOD))
    assert detect(record(two), "excitation_force", 3, 1, 0.1).segments[0].cycles == cycles


def test_one_cycle_is_steady_where_its_frequency_is_stated() -> None:
    one = record(steady(0.01)[:PERIOD])
    stated = replace(one, condition={"frequency": 1.0 / (PERIOD * DT)})
    assert [detect(r, "excitation_force", 3, 1, 0.1).segments[0].cycles for r in (one, stated)] == [0, 1]
