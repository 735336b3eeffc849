"""A log that grows is read from where the last reading ended, and gives what one reading of it gives."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mrfit.ingest.stage
from mrfit.core.recording import Recording
from mrfit.errors import DataError
from mrfit.ingest.growing import GrowingLog
from mrfit.settings.ingest import Settings

HEAD = "Rig 7\nTime (s),Displacement (mm),Force (N)\n"
ROWS = [f"{k * 0.01:.2f},{np.sin(0.3 * k):.6f},{200 * np.cos(0.3 * k):.5f}\n" for k in range(400)]


def _whole(path: Path) -> Recording:
    return mrfit.ingest.stage.read([path], Settings()).recordings[0]


def _same(one: Recording | None, other: Recording) -> None:
    assert one is not None and (one.dt, one.start, one.units) == (other.dt, other.start, other.units)
    assert one.rows_kept == other.rows_kept
    for name, values in other.channels.items():
        np.testing.assert_array_equal(one.channels[name], values)


@settings(max_examples=8, deadline=None)
@given(cuts=st.lists(st.integers(len(HEAD) + 1800, len(HEAD + "".join(ROWS))), max_size=5).map(sorted))
def test_pieces_give_what_the_whole_gives(cuts: list[int], tmp_path_factory: pytest.TempPathFactory) -> None:
    path, text = tmp_path_factory.mktemp("growing") / "log.csv", (HEAD + "".join(ROWS)).encode()
    log, written = GrowingLog(path, Settings()), 0
    for stop in (*cuts, len(text)):
        with path.open("ab") as file:
            file.write(text[written:stop])
        written = stop
        log.grow()
    _same(log.record, _whole(path))
    assert not log.grow()


def test_only_what_was_added_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log.csv"
    path.write_text(HEAD + "".join(ROWS[:300]))
    log = GrowingLog(path, Settings())
    assert log.grow()
    with path.open("a") as file:
        file.writelines(ROWS[300:])
    monkeypatch.setattr(log, "_read_all", lambda: pytest.fail("it was read from its beginning"))
    assert log.grow() and log.record is not None and log.record.samples == 400


def test_a_line_that_is_half_written_waits(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(HEAD + "".join(ROWS[:300]) + ROWS[300][:6])
    log = GrowingLog(path, Settings())
    assert log.grow() and log.record is not None and log.record.samples == 300
    assert not log.grow()
    with path.open("a") as file:
        file.write(ROWS[300][6:] + "".join(ROWS[301:]))
    assert log.grow()
    _same(log.record, _whole(path))


def test_rows_on_another_clock_are_read_with_all_before_them(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(HEAD + "".join(ROWS[:300]))
    log = GrowingLog(path, Settings())
    log.grow()
    late = [f"{k * 0.01 + 0.004:.3f},{np.sin(0.3 * k):.6f},{200 * np.cos(0.3 * k):.5f}\n" for k in range(300, 400)]
    with path.open("a") as file:
        file.writelines(late)
    log.grow()
    _same(log.record, _whole(path))


def test_a_log_that_cannot_be_read_yet_is_read_later(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(HEAD)
    log = GrowingLog(path, Settings())
    assert not log.grow() and log.record is None
    with path.open("a") as file:
        file.writelines(ROWS)
    assert log.grow()
    _same(log.record, _whole(path))


def test_the_channel_map_beside_the_log_holds(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("a,b,c\n" + "".join(ROWS[:300]))
    (tmp_path / "mrfit.toml").write_text(
        'time = 0\n[channels]\ndisplacement = {column = 1, unit = "mm"}\nforce = {column = 2, unit = "N"}\n'
    )
    log = GrowingLog(path, Settings())
    assert log.grow()
    with path.open("a") as file:
        file.writelines(ROWS[300:])
    assert log.grow()
    _same(log.record, _whole(path))
    assert log.record is not None and set(log.record.channels) == {"displacement", "force"}


def test_a_log_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"gone\.csv: cannot be read"):
        GrowingLog(tmp_path / "gone.csv", Settings()).grow()
