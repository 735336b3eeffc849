"""Long segments: pieces that cover them, and a fit in pieces that is the fit of the whole."""

import contextlib
import io
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.cli import main
from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array
from mrfit.fit import identify
from mrfit.io import columns
from mrfit.io.schemas.fit import Fit
from mrfit.io.schemas.reading import of_json
from mrfit.signal import long_segments, noise, thinning
from mrfit.signal.long_segments import FITTED_CYCLES, LEAD_CYCLES, PIECE, middle_piece, pieces
from mrfit.signal.noise import LONG_SEGMENT, noise_level, quantisation

DT = 1e-4
NAN = float("nan")


def a_segment(samples: int, cycles: int, start: int = 0, warm_up: int = 0) -> Segment:
    frequency = cycles / (samples * DT)
    return Segment(
        "a#1", "sine", "a", start, start + samples, warm_up, "sine", "displacement", frequency, 1.0, 0.0, cycles, NAN,
        NAN, "train",
    )  # fmt: skip


@given(st.integers(LONG_SEGMENT + 1, 4 * 10**7), st.one_of(st.just(0), st.integers(4, 100_000)), st.integers(0, 10_000))
def test_pieces_cover_a_long_segment_once_by_whole_cycles(samples: int, cycles: int, start: int) -> None:
    whole = a_segment(samples, cycles, start, warm_up=min(start, 500))
    found = pieces(whole, DT)
    assert found[0].start == whole.start and found[-1].stop == whole.stop
    assert all(a.stop == b.start for a, b in zip(found, found[1:], strict=False))
    assert sum(p.cycles for p in found) == cycles
    period = samples / cycles if cycles else 0.0
    for piece in found:
        assert abs(piece.samples - piece.cycles * period) <= 1.0 or not cycles
        assert piece.cycles >= FITTED_CYCLES or not cycles
        assert piece.start - piece.warm_up >= 0
    # half a sample is rounded either way, as the period of a frequency is
    lead = LEAD_CYCLES * period if cycles else PIECE // 10
    assert all(abs(p.warm_up - lead) <= 0.5 + 1e-6 for p in found[1:])
    # a piece is no longer than twice what it is to be, but where few slow cycles are
    assert all(p.samples <= 2 * max(PIECE, 2 * FITTED_CYCLES * period) for p in found)
    assert middle_piece(whole, DT) in found


def test_a_segment_that_is_not_long_is_its_only_piece() -> None:
    whole = a_segment(LONG_SEGMENT, 100)
    assert pieces(whole, DT) == [whole]


def test_the_noise_of_a_long_channel_is_that_of_windows_spread_over_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(noise, "LONG_SEGMENT", 50_000)
    monkeypatch.setattr(noise, "NOISE_WINDOW", 2000)
    t = np.arange(200_000) * DT
    values = np.sin(2 * np.pi * 3 * t) + 0.02 * np.random.default_rng(1).standard_normal(len(t))
    assert noise_level(values) == pytest.approx(0.02, rel=0.05)
    assert quantisation(np.round(values, 1)) == pytest.approx(0.1)
    assert sum(map(len, noise.windows(values))) == 16 * 2000


def made(rate: float, frequency: float, seconds: float) -> Recording:
    """A damper under a sine: F = 800·tanh(80 v + 20 x) + 1500 v + 20, with noise."""
    t = np.arange(round(seconds * rate)) / rate
    rng = np.random.default_rng(3)
    x, v = 0.01 * np.sin(2 * np.pi * frequency * t), 0.02 * np.pi * frequency * np.cos(2 * np.pi * frequency * t)
    force = 800 * np.tanh(80 * v + 20 * x) + 1500 * v + 20
    channels = {
        "displacement": x + 1e-7 * rng.standard_normal(len(t)),
        "force": force + 8.0 * rng.standard_normal(len(t)),
    }
    return Recording("a", "a.csv", "0", "none", 1 / rate, 0.0, channels, {"displacement": "m", "force": "N"})


def test_a_slow_drive_is_thinned_and_a_fast_one_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(thinning, "LONG_SEGMENT", 10_000)
    slow, step = thinning.thinned(made(1000.0, 1.0, 60.0), "displacement")
    assert step == 8 and slow.dt == 0.008 and slow.samples == 7500
    assert slow.channels["force"][7] == pytest.approx(np.mean(made(1000.0, 1.0, 60.0).channels["force"][56:64]))
    fast = made(1000.0, 60.0, 60.0)
    assert thinning.thinned(fast, "displacement") == (fast, 1)
    short = made(1000.0, 1.0, 10.0)
    assert thinning.thinned(short, "displacement") == (short, 1)


def studied(folder: Path, recording: Recording) -> Fit:
    """Ingest and fit a recording, and return fit.json."""
    folder.mkdir()
    time = np.arange(recording.samples) * recording.dt
    columns = {"time (s)": time, "displacement (m)": recording.channels["displacement"]}
    pq.write_table(pa.table(columns | {"force (N)": recording.channels["force"]}), folder / "log.parquet")
    work = str(folder / "work")
    for command in (["ingest", str(folder / "log.parquet")], ["fit", "--model", "tanh"]):
        with contextlib.redirect_stdout(io.StringIO()):
            main.app([*command, "--work", work], standalone_mode=False)
    return of_json(Fit, (folder / "work" / "fits" / "tanh.auto" / "fit.json").read_text())


def test_a_long_segment_is_fitted_in_pieces_as_the_whole_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recording = made(1000.0, 2.0, 60.0)
    whole = studied(tmp_path / "whole", recording)
    for module in (noise, long_segments, thinning):
        monkeypatch.setattr(module, "LONG_SEGMENT", 10_000)
    monkeypatch.setattr(noise, "NOISE_WINDOW", 1000)
    monkeypatch.setattr(long_segments, "PIECE", 4000)
    cut = studied(tmp_path / "cut", recording)
    assert len(whole.results[0].segments) == 2
    assert len(cut.results[0].segments) == 14
    values = [{p.name: p for p in f.results[0].parameters} for f in (whole, cut)]
    for name, one in values[0].items():
        other = values[1][name]
        # both have seen the same samples but for those about the segment's ends
        assert abs(one.value - other.value) < 0.25 * (one.high - one.low), name
        assert other.high - other.low == pytest.approx(one.high - one.low, rel=0.3), name
    for one, other in zip(whole.metrics, cut.metrics, strict=True):
        assert (one.condition, one.role) == (other.condition, other.role)
        assert abs(one.samples - other.samples) <= 8
        assert other.rmse == pytest.approx(one.rmse, rel=0.01)
        assert other.noise_floor == pytest.approx(one.noise_floor, rel=0.05)
    table = pq.read_table(tmp_path / "cut" / "work" / "fits" / "tanh.auto" / "residuals.parquet")
    train = table.filter(table.column("role").to_numpy(zero_copy_only=False) == "train")
    assert np.allclose(np.diff(train.column("time").to_numpy()), 0.001)
    assert cut.results[0].warnings == whole.results[0].warnings


def test_a_fit_searched_on_some_pieces_ends_where_one_on_all_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (noise, long_segments, thinning, columns):
        monkeypatch.setattr(module, "LONG_SEGMENT", 10_000)
    monkeypatch.setattr(noise, "NOISE_WINDOW", 1000)
    monkeypatch.setattr(long_segments, "PIECE", 4000)
    monkeypatch.setattr(columns, "COLUMN_CHUNK", 4096)
    read, most = columns.FileColumn._read, [0]

    def counted(column: columns.FileColumn, begin: int, end: int) -> Array:
        most[0] = max(most[0], end - begin)
        return read(column, begin, end)

    monkeypatch.setattr(columns.FileColumn, "_read", counted)
    recording = made(1000.0, 2.0, 60.0)
    every = studied(tmp_path / "every", recording)
    # a piece and the longest lead-in, whatever the length of the recording
    assert 4096 <= most[0] <= 10_000 + 2 * 4000
    monkeypatch.setattr(identify, "FOLDED_PIECES", 3)
    some = studied(tmp_path / "some", recording)
    values = [{p.name: p for p in f.results[0].parameters} for f in (every, some)]
    for name, one in values[0].items():
        other, width = values[1][name], one.high - one.low
        # three of ten pieces alone would be twice as far from the truth, and with intervals twice as wide
        assert abs(one.value - other.value) < 0.03 * width, name
        assert other.high - other.low == pytest.approx(width, rel=0.35), name
    assert some.results[0].cost == pytest.approx(every.results[0].cost, rel=1e-3)
    assert [m.samples for m in some.metrics] == [m.samples for m in every.metrics]
    assert [m.rmse for m in some.metrics] == pytest.approx([m.rmse for m in every.metrics], rel=1e-4)
    assert not (tmp_path / "some" / "work" / ".mrfit-scratch").exists()


def test_a_random_drive_that_stays_on_disk_is_fitted_as_in_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    t = np.arange(60_000) * 1e-3
    rng = np.random.default_rng(5)
    tones = [(f, rng.uniform(0, 2 * np.pi)) for f in rng.uniform(0.3, 3.0, 12)]
    x = sum(3e-3 * np.sin(2 * np.pi * f * t + p) for f, p in tones)
    v = np.gradient(x, 1e-3)
    force = 800 * np.tanh(80 * v + 20 * x) + 1500 * v + 20 + 8.0 * rng.standard_normal(len(t))
    channels = {"displacement": x + 1e-7 * rng.standard_normal(len(t)), "force": force}
    recording = Recording("a", "a.csv", "0", "none", 1e-3, 0.0, channels, {"displacement": "m", "force": "N"})
    whole = studied(tmp_path / "whole", recording)
    for module in (noise, long_segments, thinning, columns):
        monkeypatch.setattr(module, "LONG_SEGMENT", 10_000)
    monkeypatch.setattr(noise, "NOISE_WINDOW", 1000)
    monkeypatch.setattr(long_segments, "PIECE", 4000)
    cut = studied(tmp_path / "cut", recording)
    assert len(cut.results[0].segments) > 2 * long_segments.OTHER_PIECES
    values = [{p.name: p for p in f.results[0].parameters} for f in (whole, cut)]
    for name, one in values[0].items():
        assert abs(one.value - values[1][name].value) < 0.5 * (one.high - one.low), name
    assert [m.rmse for m in cut.metrics] == pytest.approx([m.rmse for m in whole.metrics], rel=0.01)
