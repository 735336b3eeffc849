"""What --on makes elsewhere is what is made here, byte for byte, also where a worker is killed in the middle."""

import os
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from mrfit.cli.main import app
from mrfit.core.executors import order
from tests.batch.logs import write_log

distributed = pytest.importorskip("distributed", reason="not run: needs the extra mrfit[dask]")
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]
# seconds that something took, or when it was
TIMED = ("compare.csv", "optimizers.csv", "commands.log")


@pytest.fixture
def cluster() -> "Iterator[distributed.LocalCluster]":
    """Three workers that see none of this process's folders as their own."""
    made = distributed.LocalCluster(n_workers=3, threads_per_worker=1, dashboard_address=None)
    yield made
    order.use("")
    made.close()


def kill_one_after(cluster: "distributed.LocalCluster", seconds: float) -> threading.Thread:
    victim = next(iter(cluster.workers.values())).pid

    def kill() -> None:
        time.sleep(seconds)
        os.kill(victim, signal.SIGKILL)

    thread = threading.Thread(target=kill)
    thread.start()
    return thread


def files_of(folder: Path) -> dict[str, bytes]:
    found = {p.relative_to(folder).as_posix(): p for p in sorted(folder.rglob("*")) if p.is_file()}
    return {n: p.read_bytes() for n, p in found.items() if p.name not in (".lock", *TIMED)}


def call(*arguments: str) -> None:
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, (arguments, done.output, done.exception)


def everything(folder: Path, on: list[str], monkeypatch: pytest.MonkeyPatch) -> dict[str, bytes]:
    """Run every command that takes --on in a folder with logs of its own; return all it wrote."""
    folder.mkdir()
    monkeypatch.chdir(folder)
    for seed in range(6):
        write_log(folder / "logs" / f"run {seed}.csv", seed, fy=400.0 + 50.0 * seed)
    (folder / "logs" / "note.csv").write_text("no numbers\n")
    (folder / "logs" / "mrfit.toml").write_text("[condition]\ntemperature = 25.0\n")
    call("ingest", "logs", "--work", "w", *on)
    call("fit", "--model", "bingham", "--opt", "auto", "--intervals", "bootstrap", "--work", "w", *on)
    call("compare", "--models", "bingham,tanh", "--work", "w", *on)
    call("compare", "--optimizers", "pso,fmin", "--model", "bingham", "--seeds", "2", "--work", "w", *on)
    call("batch", "logs", "--model", "tanh", "--work", "b", *on)
    call("batch", "logs", "--model", "tanh", "--work", "t", "--table", "fleet.parquet", *on)
    return files_of(folder)


def test_all_files_are_those_of_a_run_here(
    cluster: "distributed.LocalCluster", tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = everything(tmp_path / "here", ["--jobs", "1"], monkeypatch)
    assert any(n.startswith("b/logs/run 3.csv/fits/") for n in here) and "fleet.parquet" in here
    killed = kill_one_after(cluster, 2.0)
    there = everything(tmp_path / "there", ["--on", cluster.scheduler_address], monkeypatch)
    killed.join()
    assert there.keys() == here.keys()
    assert [n for n in here if there[n] != here[n]] == []
    shared = everything(tmp_path / "shared", ["--on", cluster.scheduler_address, "--shared"], monkeypatch)
    assert [n for n in here if shared[n] != here[n]] == [] and shared.keys() == here.keys()


def test_a_discovery_elsewhere_is_the_one_here(
    cluster: "distributed.LocalCluster", tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = []
    for name, on in (("here", ["--jobs", "1"]), ("there", ["--on", cluster.scheduler_address])):
        (tmp_path / name).mkdir()
        monkeypatch.chdir(tmp_path / name)
        for seed, damping in enumerate((900.0, 1200.0, 1500.0)):
            write_log(tmp_path / name / "logs" / f"run-{seed}.csv", seed, damping=damping)
        call("ingest", "logs", "--work", "w")
        call("discover", "--model", "bingham", "--work", "w", *on)
        found.append(files_of(tmp_path / name / "w"))
    assert found[0].keys() == found[1].keys() and [n for n in found[0] if found[0][n] != found[1][n]] == []
