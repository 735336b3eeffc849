"""Fewer samples of a log: what lies below the new rate's limit stays as it was, what lies above is gone."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mrfit
from mrfit.core.recording import Recording
from mrfit.errors import ConfigError, DataError
from mrfit.ingest import series
from mrfit.ingest.decimate import KEPT_BAND, decimated, filter_of
from mrfit.ingest.refusal import Refusal
from tests.batch.logs import write_log

DT = 1e-3


def recording(values: np.ndarray, dt: float = DT) -> Recording:
    return Recording("a", "a.csv", "", "csv", dt, 0.0, {"force": values}, {"force": "N"})


@settings(deadline=None, max_examples=20)
@given(st.integers(2, 40), st.floats(0.01, KEPT_BAND), st.floats(0.0, 6.0))
def test_what_is_slow_enough_stays_as_it_was_without_delay(factor: int, share: float, phase: float) -> None:
    frequency = share / (2.0 * DT * factor)
    time = np.arange(400 * factor) * DT
    made = decimated(recording(np.sin(2 * np.pi * frequency * time + phase)), factor)
    expected = np.sin(2 * np.pi * frequency * time[::factor] + phase)
    reach = len(filter_of(factor)) // (2 * factor)
    assert made.dt == pytest.approx(DT * factor) and len(made.channels["force"]) == len(expected)
    # 80 dB; nearer to the ends a mirrored sine is not the same sine
    assert np.max(np.abs(made.channels["force"] - expected)[reach:-reach]) < 2e-4


@settings(deadline=None, max_examples=40)
@given(st.integers(2, 40), st.floats(1.0, 1.9))
def test_what_the_new_rate_could_not_tell_from_slower_motion_is_gone(factor: int, share: float) -> None:
    frequency = min(share / (2.0 * DT * factor), 0.49 / DT)
    time = np.arange(400 * factor) * DT
    made = decimated(recording(np.sin(2 * np.pi * frequency * time)), factor).channels["force"]
    reach = len(filter_of(factor)) // (2 * factor)
    assert np.max(np.abs(made[reach:-reach])) < 2e-4


@pytest.mark.parametrize("factor", [2, 3, 10, 37])
def test_a_channel_on_disk_gives_what_one_in_memory_does(factor: int, monkeypatch: pytest.MonkeyPatch) -> None:
    values = np.cumsum(np.random.default_rng(0).standard_normal(20_000))
    whole = decimated(recording(values), factor).channels["force"]
    monkeypatch.setattr(series, "SERIES_CHUNK", 4096)
    on_disk = series.Series(len(values), lambda a, b: values[a:b])
    parts = decimated(recording(on_disk), factor).channels["force"]  # type: ignore[arg-type]
    assert not isinstance(parts, np.ndarray) and len(parts) == len(whole)
    np.testing.assert_allclose(parts[:], whole, rtol=0.0, atol=1e-9 * np.max(np.abs(whole)))
    np.testing.assert_array_equal(parts[5:9], parts[:][5:9])


def test_one_keeps_a_record_as_it_is_and_too_short_a_one_is_refused() -> None:
    record = recording(np.arange(100.0))
    assert decimated(record, 1) is record
    with pytest.raises(Refusal, match="its 100 samples are too few to keep every 20th"):
        decimated(record, 20)


def test_a_constant_and_a_ramp_stay_what_they_are_to_the_ends() -> None:
    """The record goes on beyond its ends as a ramp does."""
    ramp = np.arange(5000.0)
    np.testing.assert_allclose(decimated(recording(ramp), 7).channels["force"], ramp[::7], atol=1e-8 * 5000)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    write_log(tmp_path / "a.csv", 3, fy=600.0)
    return tmp_path / "a.csv"


def test_the_channel_map_says_it_and_a_recording_says_what_was_done(log: Path) -> None:
    (full,) = mrfit.read(log)
    (log.parent / "mrfit.toml").write_text("decimate = 4\n")
    (less,) = mrfit.read(log)
    assert (less.samples, less.dt, less.rows_kept) == (full.samples // 4, pytest.approx(4 * full.dt), full.rows_kept)
    assert less.history[-1] == "decimated by 4 to 100 Hz, low-passed above 40 Hz"
    np.testing.assert_allclose(less.channels["velocity"][20:-20], full.channels["velocity"][80:-80:4], atol=1e-5)
    for_others = '[[files]]\nmatch = "b*"\ndecimate = 4\n'
    (log.parent / "mrfit.toml").write_text(for_others)
    assert mrfit.read(log)[0].dt == full.dt


@pytest.mark.parametrize("text", ["decimate = 0", "decimate = 1.5", "decimate = 'x'"])
def test_what_is_no_whole_number_is_refused_by_name(text: str, log: Path) -> None:
    (log.parent / "mrfit.toml").write_text(text + "\n")
    with pytest.raises(ConfigError, match="decimate"):
        mrfit.read(log)


def test_what_does_not_fit_into_memory_is_said_before_it_is_read(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from mrfit.fit.select import read_dataset
    from mrfit.ingest import stage
    from mrfit.io import memory
    from mrfit.io.workspace import Workspace
    from mrfit.segment import stage as segment_stage
    from mrfit.settings.ingest import Settings

    shutil.copy(log, tmp_path / "b.csv")
    write_log(tmp_path / "b.csv", 4)
    workspace = Workspace(tmp_path / "w")
    stage.run([log, tmp_path / "b.csv"], Settings(), workspace)
    segment_stage.run(workspace, segment_stage.Settings())
    # 1200 samples of three channels each: one fits, both do not
    monkeypatch.setattr(memory, "free_memory", lambda: 1.5 * memory.SAMPLE_COPIES * 8.0 * 1200 * 3)
    assert workspace.read_recording("a").samples == 1200
    with pytest.raises(DataError, match=r"all samples of 2 recordings need about .* write decimate = 2 or more"):
        read_dataset(workspace)
