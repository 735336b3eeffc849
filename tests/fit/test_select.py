"""Segments chosen by peak velocity, in the bands of preyield paper, or by the name of their condition."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrfit.core.recording import Recording, Segment
from mrfit.errors import ConfigError, DataError
from mrfit.fit.select import peak_velocity, select, speed_class
from mrfit.simulate.assembly import assemble
from tests.fit.benches import Bench, write_workspace

# Peak velocities 2*pi*f*x of 9.4, 63 and 251 mm/s
SINES = ((0.5, 0.003), (1.0, 0.010), (2.0, 0.020))


@pytest.fixture
def logs(tmp_path: Path) -> tuple[list[Segment], dict[str, Recording]]:
    bench = Bench(assemble("bingham"), np.array([300.0, 900.0, 0.0]), 0.01, 1)
    workspace = write_workspace(tmp_path, bench, SINES, (0.5,))
    segments = workspace.read_segments()
    return segments, {s.recording: workspace.read_recording(s.recording) for s in segments}


def test_peak_velocity_of_a_sine_is_that_of_the_formula(
    logs: tuple[list[Segment], dict[str, Recording]],
) -> None:
    segments, recordings = logs
    found = {round(s.frequency, 3): peak_velocity(s, recordings[s.recording]) for s in segments}
    for frequency, amplitude in SINES:
        # the greatest sample of a cycle of 100 lies within 0.5 per mille of the peak
        assert found[frequency] == pytest.approx(2 * np.pi * frequency * amplitude, rel=1e-3)


def test_segments_fall_into_the_bands_of_paper_003(logs: tuple[list[Segment], dict[str, Recording]]) -> None:
    segments, recordings = logs
    classes = {round(s.frequency, 3): speed_class(s, recordings[s.recording]) for s in segments}
    assert classes == {0.5: "L", 1.0: "M", 2.0: "H"}


@pytest.mark.parametrize(
    ("frequency", "amplitude", "band"),
    [
        (0.5, 0.004, "L"),  # the three tests that preyield paper shows as low, medium and high: 12.6, 100.5, 201 mm/s
        (4.0, 0.004, "M"),
        (2.0, 0.016, "H"),
        (1.0, 0.016, "M"),  # 100.5 mm/s again
        (2.0, 0.012, "H"),  # the next of its grid: 150.8 mm/s
        (4.0, 0.0044, "H"),  # 110.6 mm/s
        (0.1, 0.0264, "M"),  # 16.6 mm/s
    ],
)
def test_the_tests_of_the_paper_fall_into_the_band_it_names(
    frequency: float, amplitude: float, band: str, tmp_path: Path
) -> None:
    bench = Bench(assemble("bingham"), np.array([300.0, 900.0, 0.0]), 0.01, 1)
    workspace = write_workspace(tmp_path, bench, ((frequency, amplitude),), (0.5,))
    segment = workspace.read_segments()[0]
    assert speed_class(segment, workspace.read_recording(segment.recording)) == band


@pytest.mark.parametrize(
    ("only", "count"), [("", 3), ("LMH", 3), ("MH", 2), ("L", 1), ("sine-1Hz*", 1), ("*2Hz*,*1Hz*", 2)]
)
def test_a_fit_is_limited_to_what_is_asked_for(
    only: str, count: int, logs: tuple[list[Segment], dict[str, Recording]]
) -> None:
    segments, recordings = logs
    assert len(select(segments, only, recordings)) == count


def test_a_choice_that_leaves_nothing_to_train_on_names_what_there_is(
    logs: tuple[list[Segment], dict[str, Recording]],
) -> None:
    segments, recordings = logs
    held_out = [replace(s, role="holdout") if s.frequency > 1.5 else s for s in segments]
    for only in ("nosuch*", "H"):
        with pytest.raises(ConfigError, match=f"--only {only.replace('*', '.')}.*leaves nothing.*sine-0.5Hz"):
            select(held_out, only, recordings)


def test_bands_of_velocity_need_a_velocity(logs: tuple[list[Segment], dict[str, Recording]]) -> None:
    segments, recordings = logs
    bare = {i: replace(r, channels={"force": r.channels["force"]}) for i, r in recordings.items()}
    with pytest.raises(DataError, match="needs velocity or displacement"):
        select(segments, "MH", bare)


def test_a_condition_by_itself_may_be_one_held_out_of_joint_fits(
    logs: tuple[list[Segment], dict[str, Recording]],
) -> None:
    segments, recordings = logs
    held_out = [replace(s, role="holdout") for s in segments]
    assert len(select(held_out, "H", recordings, ("train", "holdout"))) == 1


def test_of_many_conditions_it_is_said_how_many_are_not_listed(
    logs: tuple[list[Segment], dict[str, Recording]],
) -> None:
    segments, recordings = logs
    many = [replace(segments[0], condition=f"c{k:02d}") for k in range(15)]
    with pytest.raises(ConfigError, match="c11 and 3 more"):
        select(many, "nosuch", recordings)


@pytest.mark.parametrize(("only", "count"), [("MH,*-2Hz*", 1), ("*-1Hz*, *-2Hz*, MH", 2), ("LM,*-1Hz*", 1), ("M,H", 2)])
def test_bands_and_patterns_hold_together(
    only: str, count: int, logs: tuple[list[Segment], dict[str, Recording]]
) -> None:
    assert len(select(logs[0], only, logs[1])) == count


def test_a_band_that_no_pattern_names_leaves_nothing(logs: tuple[list[Segment], dict[str, Recording]]) -> None:
    with pytest.raises(ConfigError, match="leaves nothing"):
        select(logs[0], "L,*-2Hz*", logs[1])
