"""A log read block by block gives what it gives when read as a whole: recordings, findings and counts, to the byte."""

import random
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mrfit.core import plugins, registry
from mrfit.errors import DataError
from mrfit.ingest import hashes, series
from mrfit.ingest.containers import memory
from mrfit.ingest.hashes import hash_of
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.reading import BlockReading, LogItem, read_item
from mrfit.ingest.stage import Settings, preview, run
from mrfit.io.memory import free_memory
from mrfit.io.tables import write_table
from mrfit.io.workspace import Workspace
from tests.ingest.samples import RS_SETTINGS, WRITERS, sample
from tests.ingest.test_fuzz import TEXT, WHOLE_LINES
from tests.plugin_files import EXAMPLE, acme_log

WHOLE = 1 << 30
IN_BLOCKS = sorted(set(registry.names("reader")) - {"matlab", "hdf5", "tdms", "mdf"})
DATA = {name: WRITERS[name]() for name in IN_BLOCKS}


def ingested(name: str, data: bytes, block: int) -> dict[str, bytes] | str:
    """Everything in the workspace after one ingest, or the error's text."""
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        path = Path(DATA[name].name)
        path.write_bytes(data)
        if name == "rohde-schwarz":
            Path("RefCurve.csv").write_text(RS_SETTINGS)
        workspace = Workspace(Path("work"))
        try:
            run([path], Settings(jobs=1, block=block), workspace)
        except DataError as error:
            return str(error)
        return {str(p): p.read_bytes() for p in sorted(workspace.root.rglob("*")) if p.is_file()}


def assert_same(name: str, data: bytes, block: int, chunk: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(series, "SERIES_CHUNK", chunk)
        parts, whole = ingested(name, data, block), ingested(name, data, WHOLE)
    if isinstance(parts, str) and isinstance(whole, str):
        return  # refused both ways; of several reasons another may be met first
    assert parts == whole


def damaged(name: str, picks: list[int], seed: int) -> bytes:
    """The sample with whole lines lost, doubled or changed, or (odd seeds) any bytes."""
    rng, data = random.Random(seed), DATA[name].data
    mutations = TEXT if seed % 2 else WHOLE_LINES
    for pick in picks if name != "parquet" else ():
        data = mutations[pick % len(mutations)](data, rng)
    return data


HOW = {
    "block": st.integers(200, 700),
    "chunk": st.sampled_from([37, 64, 1 << 20]),
    "picks": st.lists(st.integers(0, 1000), max_size=3),
    "seed": st.integers(0, 2**32),
}
quick = settings(max_examples=3, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)
long = settings(max_examples=100, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True)


@pytest.mark.parametrize("name", IN_BLOCKS)
@quick
@given(**HOW)
def test_blocks_give_what_the_whole_gives(name: str, block: int, chunk: int, picks: list[int], seed: int) -> None:
    assert_same(name, damaged(name, picks, seed), block, chunk)


@pytest.mark.slow
@pytest.mark.parametrize("name", IN_BLOCKS)
@long
@given(**HOW)
def test_blocks_give_what_the_whole_gives_a_hundred_times(
    name: str, block: int, chunk: int, picks: list[int], seed: int
) -> None:
    assert_same(name, damaged(name, picks, seed), block, chunk)


def test_one_line_at_a_time() -> None:
    assert_same("delimited", DATA["delimited"].data, 1, 16)


LONG = "time (s),displacement (mm),coil current (A)\n"


def long_log(path: Path, rows: int = 3000, pause: int = 0) -> Path:
    """A log with lost rows, rows that hold no number, and a clock that pauses."""
    time = np.arange(rows) * 1e-3 + np.where(np.arange(rows) >= pause, 2.0, 0.0)
    lines = [f"{t:.3f},{np.sin(9 * t):.4f},{1.0 + 0.1 * np.sin(9 * t):.5f}\n" for t in time]
    lines[100] = lines[101] = ""
    lines[700] = lines[700].replace(",1.", ",nan") if ",1." in lines[700] else "0.7,x,1\n"
    path.write_text(LONG + "".join(lines))
    return path


@pytest.mark.parametrize("jitter", [False, True])
def test_gaps_missing_rows_and_jitter_are_the_same_in_blocks(
    tmp_path: Path, jitter: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(series, "SERIES_CHUNK", 250)
    path = long_log(tmp_path / "log.csv", pause=1800)
    if jitter:
        rng = np.random.default_rng(0)
        head, *rows = path.read_text().splitlines()
        shaken = [f"{float(r.partition(',')[0]) + rng.uniform(0, 4e-4):.6f},{r.partition(',')[2]}" for r in rows]
        path.write_text("\n".join([head, *shaken]) + "\n")
    whole, parts = Workspace(tmp_path / "whole"), Workspace(tmp_path / "parts")
    summary = run([path], Settings(block=WHOLE), whole)
    assert summary.recordings == run([path], Settings(block=2000), parts).recordings
    kinds = {f.kind for r in summary.recordings for f in r.findings}
    assert kinds >= {"gap", "refused-rows", "resampled" if jitter else "dropped-samples"}
    assert len(summary.recordings) == 2
    for row in summary.recordings:
        files = [w.recording_file(row.id).read_bytes() for w in (whole, parts)]
        assert files[0] == files[1]


def test_progress_moves_while_a_long_log_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hashes, "BLOCK", 2_000_000)
    path, heard = tmp_path / "log.csv", list[tuple[str, int, int]]()
    row = "".join(f"0.00{k},1.2345678901234567890\n" for k in range(10))
    path.write_text("time (s),force (N)\n" + row * 60_000)
    with pytest.raises(DataError):  # its clock stands still
        run([path], Settings(block=2_000_000), Workspace(tmp_path / "w"), lambda *said: heard.append(said))
    looked = [done for what, done, _ in heard if what == "looking at log.csv (MB)"]
    read = [done for what, done, total in heard if what == "reading log.csv (MB)"]
    assert len(looked) > 8 and len(read) > 8
    assert read == sorted(read) and read[-1] == path.stat().st_size // 1_000_000


def test_a_log_that_grows_while_it_is_read_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = long_log(tmp_path / "log.csv")
    item = LogItem(((path, "the hash of what it was"),), "delimited", Rules())
    outcome = read_item(item, BlockReading(tmp_path / "numbers", 2000))
    assert [r.reason for r in outcome.refusals] == ["it changed while it was read"]
    assert not outcome.recordings


KILLED = """
import os, signal, sys
from pathlib import Path
from mrfit.ingest import hashes
from mrfit.ingest.stage import Settings, run
from mrfit.io.workspace import Workspace

def listen(what, done, total):
    calls.append(what)
    if calls.count("reading log.csv (MB)") == 30:
        os.kill(os.getpid(), signal.SIGKILL)

calls, hashes.BLOCK, folder = [], 1000, Path(sys.argv[1])
run([folder / "log.csv"], Settings(block=1000), Workspace(folder / "work"), listen)
"""


def test_killed_while_a_long_log_is_read(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path / "work")
    run([long_log(tmp_path / "short.csv", 1000)], Settings(), workspace)
    before = {p: p.read_bytes() for p in workspace.root.rglob("*") if p.is_file()}

    long_log(tmp_path / "log.csv")
    child = subprocess.run([sys.executable, "-c", KILLED, str(tmp_path)], check=False)
    assert child.returncode == -signal.SIGKILL
    assert len(list(workspace.root.glob(".ingest-*/numbers/*/*"))) > 0
    assert {p: p.read_bytes() for p in workspace.root.rglob("*") if p.is_file() and ".ingest-" not in str(p)} == before
    assert len(run([tmp_path / "log.csv"], Settings(block=1000), workspace).recordings) == 2
    assert not list(workspace.root.glob(".ingest-*"))


def test_preview_of_a_long_log_reads_its_first_block_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = long_log(tmp_path / "log.csv")
    size = path.stat().st_size

    def never(_: Path) -> str:
        raise AssertionError("the whole log was read")

    monkeypatch.setattr("mrfit.ingest.stage.hash_of", never)
    (row,) = preview([path], Settings(block=size // 20))
    assert float(row.rows.removeprefix("about ")) == pytest.approx(3000, rel=0.05)
    assert row.channels == "displacement (m), current (A)" and row.rate == "1000 Hz"
    assert "rows were looked at" in row.oddities
    (all_of_it,) = preview([path], Settings())
    assert isinstance(all_of_it.rows, int)


def test_preview_of_a_long_table(tmp_path: Path) -> None:
    path = tmp_path / "log.parquet"
    write_table(path, {"time": np.arange(5000) * 1e-3, "force [N]": np.sin(np.arange(5000.0))})
    (row,) = preview([path], Settings(block=4000))
    assert row.rows == "about 5e3"


def test_what_cannot_be_read_in_blocks_and_would_not_fit_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    truth, _ = sample("tektronix-tds", tmp_path)
    paths = [truth.write(tmp_path, f"F0004CH{k}.CSV") for k in (1, 2)]
    size = len(truth.data)
    monkeypatch.setattr(memory, "free_memory", lambda: 11.0 * size)  # a half of it may be taken
    with pytest.raises(DataError, match=r"are read as a whole: about .* MB of memory are needed, and it may take"):
        run(paths, Settings(), Workspace(tmp_path / "w"))
    monkeypatch.setattr(memory, "free_memory", lambda: 13.0 * size)
    assert run(paths, Settings(), Workspace(tmp_path / "w")).added


def test_free_memory_is_that_of_this_machine() -> None:
    assert 1e7 < free_memory() < 1e15


def test_a_text_without_line_ends_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(b"time (s),force (N)\n0.0,1\n0.1,2\n0.2,3\n" + b"1,2," * (5 << 20))
    with pytest.raises(DataError, match="no line end in 1[67] MB"):
        run([path], Settings(block=1 << 18), Workspace(tmp_path / "w"))


def test_a_recording_longer_than_memory_is_one_line_in_later_stages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    workspace = Workspace(tmp_path / "w")
    run([long_log(tmp_path / "log.csv")], Settings(), workspace)
    monkeypatch.setattr("mrfit.io.memory.free_memory", lambda: 1e5)
    with pytest.raises(DataError, match=r"log.parquet: its 3000 samples in 2 columns need about .* decimate = 2 or"):
        workspace.read_recording(workspace.ingest_summary().recordings[0].id)


def test_a_damaged_time_stamp_among_the_few_rows_of_a_block_is_one_row_refused() -> None:
    assert_same("daq-text", damaged("daq-text", [0], 33), 200, 37)


def test_a_plugin_reader_that_reads_no_blocks_is_given_long_logs_as_a_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plugins, "_store", plugins.Store())
    monkeypatch.setenv(plugins.VARIABLE, "")
    plugins.use(EXAMPLE / "mrfit_example" / "acme.py")
    path = acme_log(tmp_path / "run.log", seconds=2.0)
    digest = hash_of(path)
    outcome = read_item(LogItem(((path, digest),), "acme", Rules()), BlockReading(tmp_path / "pieces", block=500))
    assert outcome.recordings[0].rows_kept == 1000
