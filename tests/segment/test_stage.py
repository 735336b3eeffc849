import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mrfit.flux.stage
from mrfit.core.recording import Recording
from mrfit.errors import ConfigError, DataError
from mrfit.segment.stage import Settings, last_settings, run
from mrfit.signal.noise import noise_floor
from mrfit.signal.smoothing import smooth
from tests.flux.records import coil, files_under, recording, workspace


def logs() -> list[Recording]:
    made = []
    for frequency in (1.0, 5.0, 10.0):
        for amplitude in (1.0, 3.0, 5.0):
            channels = {n: v for n, v in coil(frequency, amplitude).items() if n != "truth"}
            made.append(
                recording(f"log-{frequency:g}-{amplitude:g}", 1 / (500 * frequency), channels, {"resistance": 2.0})
            )
    return made


def test_every_log_of_a_grid_becomes_its_condition(tmp_path: Path) -> None:
    made = workspace(tmp_path, logs())
    summary = run(made, Settings())
    segments = made.read_segments()
    assert {s.condition for s in segments} == {f"sine-{f}Hz-{a}A" for f in (1, 5, 10) for a in (1, 3, 5)}
    assert sum(c.role == "holdout" for c in summary.conditions) == 2
    assert [s.id for s in summary.segments] == [s.id for s in segments]
    assert all(r.kept + r.cut == 4000 for r in summary.recordings)


def test_hold_out_may_begin_in_time(tmp_path: Path) -> None:
    made = workspace(tmp_path, logs()[:1])
    summary = run(made, Settings(holdout="after=4"))
    train, held = made.read_segments()
    assert (train.role, held.role) == ("train", "holdout")
    assert train.stop == held.start == pytest.approx(2000, abs=250) and train.cycles + held.cycles == 7
    assert [(c.role, c.samples) for c in summary.conditions] == [
        ("holdout", held.samples),
        ("train", train.samples),
    ]


def test_flux_is_used_where_it_was_made(tmp_path: Path) -> None:
    made = workspace(tmp_path, logs())
    mrfit.flux.stage.run(made, mrfit.flux.stage.Settings())
    assert run(made, Settings()).skipped is False
    assert run(made, Settings()).skipped is True
    mrfit.flux.stage.run(made, mrfit.flux.stage.Settings(resistance=2.1))
    assert run(made, Settings()).skipped is False


def test_nothing_is_done_twice(tmp_path: Path) -> None:
    made = workspace(tmp_path, logs())
    first = run(made, Settings())
    before = files_under(tmp_path)
    again = run(made, Settings())
    assert (first.skipped, again.skipped) == (False, True)
    assert replace(again, skipped=False) == first
    assert files_under(tmp_path) == before


def test_the_order_of_the_files_changes_nothing(tmp_path: Path) -> None:
    tables = []
    for name, recordings in (("a", logs()), ("b", logs()[::-1])):
        made = workspace(tmp_path / name, recordings)
        run(made, Settings())
        tables.append([repr(s) for s in made.read_segments()])
    assert tables[0] == tables[1]


def test_no_segment_anywhere_says_what_was_looked_for(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    flat = recording("flat", 1e-3, {"current": rng.normal(0, 1e-3, 3000), "flux": rng.normal(0, 1e-3, 3000)})
    made = workspace(tmp_path, [flat])
    before = files_under(tmp_path)
    with pytest.raises(DataError, match="flat.csv: no current, displacement, velocity or angle that moves.*--drive"):
        run(made, Settings())
    short = recording("short", 1e-3, {"displacement": np.sin(np.arange(30) / 20), "force": np.arange(30.0)})
    with pytest.raises(DataError, match="short.csv: no segment .*2 steady cycles.*log more cycles"):
        run(workspace(tmp_path / "short", [short]), Settings())
    assert {k: v for k, v in files_under(tmp_path).items() if not k.startswith("short")} == before


def test_a_log_without_a_segment_is_said_beside_others(tmp_path: Path) -> None:
    still = recording("still", 1e-3, {"current": np.zeros(2000), "voltage": np.zeros(2000)})
    summary = run(workspace(tmp_path, [*logs(), still]), Settings())
    assert any(f.startswith("still: ") for f in summary.findings)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (Settings(drive="angle"), "--drive 'angle'.*current, voltage"),
        (Settings(min_cycles=0), "--min-cycles"),
        (Settings(settle=-1), "settle"),
        (Settings(tolerance=2.0), "tolerance"),
        (Settings(holdout="sine-7Hz-1A"), "matches no condition"),
    ],
)
def test_wrong_settings_are_refused(settings: Settings, words: str, tmp_path: Path) -> None:
    made = workspace(tmp_path, logs())
    with pytest.raises(ConfigError, match=words):
        run(made, settings)
    assert not made.segments_file.exists()


def test_the_last_settings_are_remembered(tmp_path: Path) -> None:
    made = workspace(tmp_path, logs())
    assert last_settings(made) == Settings()
    run(made, Settings(holdout="none", settle=2))
    assert last_settings(made) == Settings(holdout="none", settle=2)


def test_a_damaged_table_is_made_again(tmp_path: Path) -> None:
    made = workspace(tmp_path, logs())
    run(made, Settings())
    made.segments_file.write_bytes(b"half")
    assert run(made, Settings()).skipped is False


def test_progress_is_told_of_every_recording(tmp_path: Path) -> None:
    told = []
    run(workspace(tmp_path, logs()), Settings(), lambda *event: told.append(event))
    assert told[-1] == ("segment", 9, 9) and len(told) == 9


def utfsm(folder: Path) -> list[Recording]:
    """Return the logs of the MR damper on an MTS press: time s, stroke mm, velocity mm/s, force N."""
    made = []
    for path in sorted((folder / "mr_damper_utfsm" / "preprocessed").glob("*.txt")):
        table = np.loadtxt(path)
        found = re.fullmatch(r"([\d.]+)mm([\d.]+)Hz([\d.]+)A", path.stem.replace("x", "."))
        assert found
        amplitude, frequency, current = map(float, found.groups())
        condition = {"amplitude": amplitude / 1e3, "frequency": frequency, "current": current}
        channels = {"displacement": table[:, 1] / 1e3, "velocity": table[:, 2] / 1e3, "force": table[:, 3]}
        made.append(recording(path.stem, float(np.mean(np.diff(table[:, 0]))), channels, condition))
    return made


def test_a_real_damper_is_segmented_by_the_conditions_of_its_file_names(real_logs: Path, tmp_path: Path) -> None:
    recordings = utfsm(real_logs)
    made = workspace(tmp_path, recordings)
    run(made, Settings())
    segments = made.read_segments()
    assert len(segments) == len(recordings) == 10
    assert "sine-5Hz-2mm-0.25A" in {s.condition for s in segments}
    for segment, log in zip(segments, sorted(recordings, key=lambda r: r.id), strict=True):
        assert segment.frequency == pytest.approx(log.condition["frequency"], rel=0.03)
        assert segment.current == log.condition["current"]
        assert segment.cycles >= 6
        drive = smooth(log, segment, ("displacement", "velocity"))
        assert drive.fits is not None, drive.method
        assert drive.noise["displacement"] < 0.002 * segment.amplitude


def test_a_real_transformer_loop_is_one_segment(real_logs: Path, tmp_path: Path) -> None:
    path = real_logs / "rigol_bh_loop" / "histerese_osciloscopio_80.csv"
    table = np.genfromtxt(path, delimiter=",", skip_header=2)
    log = recording("bh", 1e-4, {"current": table[:, 1], "flux": table[:, 2]})
    made = workspace(tmp_path, [log])
    run(made, Settings())
    (segment,) = made.read_segments()
    assert segment.frequency == pytest.approx(60.0, rel=1e-3)
    assert segment.cycles == 6
    flux = table[segment.start : segment.stop, 2]
    floor = noise_floor(flux, 1e-4, segment.frequency, segment.cycles) / np.ptp(flux)
    assert 0.01 < floor < 0.025
    drive = smooth(log, segment, ("current",))
    assert int(np.sum(np.diff(np.sign(np.diff(drive.values[0]))) != 0)) <= 2 * 8


def test_settings_that_cannot_be_read_are_not_replaced_by_defaults(tmp_path: Path) -> None:
    made = workspace(tmp_path, logs()[:1])
    assert last_settings(made) == Settings()
    run(made, Settings(holdout="none"))
    assert last_settings(made) == Settings(holdout="none")
    made.write_segments(made.read_segments(), {"mrfit": '{"key": "k", "settings": {"holdout": "none", "window": 3}}'})
    for _ in range(2):
        with pytest.raises(
            DataError, match=r"segments\.parquet: .*`mrfit segment --work .*` with the settings you want"
        ):
            last_settings(made)
        made.segments_file.write_bytes(b"damaged")
    assert run(made, Settings(holdout="none")).skipped is False


def test_blocks_are_conditions_in_whole_cycles(tmp_path: Path) -> None:
    made = workspace(tmp_path, logs()[:1])
    whole = run(made, Settings()).segments[0]
    assert (whole.condition, whole.cycles) == ("sine-1Hz-1A", 7)
    cut = run(made, Settings(blocks=3))
    (said,) = (f for f in cut.findings if "block" in f)
    assert said.endswith(": of 7 cycles the last 1 fill no block of 3: left out")
    first, second = made.read_segments()
    assert (first.condition, second.condition) == ("sine-1Hz-1A-cycles1to3", "sine-1Hz-1A-cycles4to6")
    assert first.start == whole.start and first.stop == second.start and first.cycles == second.cycles == 3
    assert (second.stop - whole.start) / (whole.stop - whole.start) == pytest.approx(6 / 7, abs=1e-3)
    cut = run(made, Settings(blocks=4))
    assert any(f.endswith("of 7 cycles no two blocks of 4 can be cut: the stretch stays whole") for f in cut.findings)
    assert [s.condition for s in made.read_segments()] == ["sine-1Hz-1A"]
    with pytest.raises(ConfigError, match="at least 2 cycles"):
        run(made, Settings(blocks=1))
