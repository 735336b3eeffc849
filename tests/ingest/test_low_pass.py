"""The filter of a record: what is slow stays where and when it was, what is fast goes, and the recording says so."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mrfit
from mrfit.core.recording import Recording
from mrfit.errors import ConfigError, DataError
from mrfit.ingest import series
from mrfit.ingest.low_pass import PASS_BAND, STOP_BAND_BEGIN, low_passed
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.refusal import Refusal
from tests.conftest import Run

DT = 1e-3


def recording(values: np.ndarray) -> Recording:
    channels = {"force": values, "velocity": values}
    return Recording("a", "a.csv", "", "csv", DT, 0.0, channels, {"force": "N", "velocity": "m/s"})


def passed(frequency: float, limit: float, phase: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A sine before and after the filter, without what lies nearer to the ends than the filter reaches."""
    sine = np.sin(2 * np.pi * frequency * np.arange(4000) * DT + phase)
    made = low_passed(recording(sine), Rules(low_pass={"force": limit})).channels["force"]
    return sine[1000:-1000], made[1000:-1000]


@settings(deadline=None, max_examples=15)
@given(st.floats(8.0, 100.0), st.floats(0.05, PASS_BAND), st.floats(0.0, 6.0))
def test_what_is_slow_keeps_its_size_and_is_not_late(limit: float, share: float, phase: float) -> None:
    before, after = passed(share * limit, limit, phase)
    assert np.max(np.abs(after - before)) < 3e-3


@settings(deadline=None, max_examples=15)
@given(st.floats(8.0, 100.0), st.floats(STOP_BAND_BEGIN, 3.0))
def test_what_is_fast_is_gone(limit: float, times: float) -> None:
    assert np.max(np.abs(passed(times * limit, limit)[1])) < 3e-3


def test_at_the_limit_half_is_left() -> None:
    before, after = passed(20.0, 20.0)
    assert np.std(after) / np.std(before) == pytest.approx(0.5, abs=0.01)


def test_a_channel_that_nobody_named_stays_and_a_star_names_all() -> None:
    noise = np.random.default_rng(0).standard_normal(3000)
    one = low_passed(recording(noise), Rules(low_pass={"force": 20.0}))
    assert one.channels["velocity"] is not one.channels["force"]
    np.testing.assert_array_equal(one.channels["velocity"], noise)
    both = low_passed(recording(noise), Rules(low_pass={"*": 20.0}))
    np.testing.assert_array_equal(both.channels["velocity"], both.channels["force"])
    assert one.history == ("force low-passed at 20 Hz (−6 dB), zero phase: kept up to 10 Hz, 60 dB down from 30 Hz",)
    bare = recording(noise)
    assert low_passed(bare, Rules()) is bare


def test_a_channel_on_disk_gives_what_one_in_memory_does(monkeypatch: pytest.MonkeyPatch) -> None:
    values = np.cumsum(np.random.default_rng(0).standard_normal(20_000))
    rules = Rules(low_pass={"force": 20.0})
    whole = low_passed(recording(values), rules).channels["force"]
    monkeypatch.setattr(series, "SERIES_CHUNK", 4096)
    on_disk = series.Series(len(values), lambda a, b: values[a:b])
    parts = low_passed(recording(on_disk), rules).channels["force"]  # type: ignore[arg-type]
    np.testing.assert_allclose(parts[:], whole, rtol=0.0, atol=1e-9 * np.max(np.abs(whole)))


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ({"force": 400.0}, "needs more than the 1000 samples a second"),
        ({"force": 0.1}, "reaches"),
        ({"load": 20.0}, "no channel 'load'"),
    ],
)
def test_what_cannot_be_done_is_refused(limits: dict[str, float], said: str) -> None:
    with pytest.raises(Refusal, match=said):
        low_passed(recording(np.zeros(2000)), Rules(low_pass=limits))


@pytest.fixture
def log(tmp_path: Path) -> Path:
    time = np.arange(3000) * DT
    slow, fast = np.sin(2 * np.pi * 2.0 * time), 0.5 * np.sin(2 * np.pi * 60.0 * time)
    columns = np.stack([time, 1e-2 * slow, 100.0 * (slow + fast)], axis=1)
    np.savetxt(tmp_path / "a.csv", columns, "%.9g", ",", header="time (s),displacement (m),force (N)", comments="")
    return tmp_path / "a.csv"


def force(records: list[mrfit.Recording]) -> np.ndarray:
    return records[0].to_frame()["force"].to_numpy()


def test_option_map_and_python_ask_for_the_same(log: Path, mrfit: Run) -> None:
    import mrfit as face

    plain = force(face.read(str(log)))
    asked = force(face.read(str(log), low_pass={"force": 20.0}))
    assert np.ptp(plain) > 250.0 and np.ptp(asked) == pytest.approx(200.0, rel=0.02)
    (log.parent / "mrfit.toml").write_text('[channels]\nforce = {column = "force", unit = "N", low_pass = 20}\n')
    np.testing.assert_array_equal(force(face.read(str(log))), asked)
    (log.parent / "mrfit.toml").write_text("low_pass = 20\n")
    np.testing.assert_array_equal(force(face.read(str(log))), asked)
    (log.parent / "mrfit.toml").unlink()
    work = str(log.parent / "w")
    assert mrfit("ingest", str(log), "--low-pass", "force=20", "--work", work).returncode == 0
    assert "low-passed at 20 Hz" in (log.parent / "w" / "ingest.json").read_text()


def test_a_wrong_limit_is_one_line(log: Path) -> None:
    with pytest.raises(ConfigError, match="above 0"):
        mrfit.read(str(log), low_pass={"force": -1.0})
    with pytest.raises(DataError, match="no channel 'load'"):
        mrfit.read(str(log), low_pass={"load": 20.0})
