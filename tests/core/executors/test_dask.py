"""Work sent to a Dask scheduler comes back in order, whatever becomes of workers; a scheduler that is gone is told."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from mrfit.core.executors import order
from mrfit.core.executors.items import ItemEnd
from mrfit.core.executors.order import spread
from mrfit.core.progress import Progress, silent
from mrfit.errors import DataError, MrfitError, Unreachable

distributed = pytest.importorskip("distributed", reason="not run: needs the extra mrfit[dask]")
# it warns of its own resources, and of sockets it is about to close
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]


class Cluster:
    """A scheduler and three workers, each a process of its own that can be killed."""

    def __init__(self) -> None:
        self.cluster = distributed.LocalCluster(n_workers=3, threads_per_worker=1, dashboard_address=None)
        self.address: str = self.cluster.scheduler_address

    def workers(self) -> list[int]:
        return [w.pid for w in self.cluster.workers.values()]


@pytest.fixture(scope="module")
def cluster() -> Iterator[Cluster]:
    made = Cluster()
    order.use(made.address)
    yield made
    order.use("")
    made.cluster.close()


def squared(item: int, told: Progress) -> int:
    told(f"item {item}", 1, 1)
    time.sleep(0.01 * (item % 3 == 0))
    return item**2


def process(item: int, told: Progress) -> int:
    time.sleep(0.05)
    return os.getpid()


def killed_the_first_time(item: Path, told: Progress) -> str:
    if not item.exists():
        item.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return item.name


def killed_at_two(item: int, told: Progress) -> int:
    if item == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return item


def fails_at_two(item: int, told: Progress) -> int:
    if item == 2:
        raise DataError("item 2: no such column")
    return item


def test_results_come_in_order_from_other_processes_and_tell_their_progress(cluster: Cluster) -> None:
    heard: list[str] = []
    made = list(spread(squared, range(40), 1, lambda what, done, total: heard.append(what)))
    assert made == [k**2 for k in range(40)]
    assert set(heard) <= {f"item {k}" for k in range(40)} and len(heard) > 20
    assert os.getpid() not in set(spread(process, range(6), 1, silent))


def test_work_of_a_killed_worker_is_done_again(cluster: Cluster, tmp_path: Path) -> None:
    items = [tmp_path / f"{k}" for k in range(3)]
    items[0].touch()
    items[2].touch()
    assert list(spread(killed_the_first_time, items, 1, silent)) == ["0", "1", "2"]


def test_what_kills_every_worker_fails_alone(cluster: Cluster) -> None:
    ends: dict[int, ItemEnd[int]] = {e.place: e for e in order.executor(1).ends(killed_at_two, range(5), silent)}
    assert [ends[k].made for k in (0, 1, 3, 4)] == [0, 1, 3, 4]
    assert isinstance(ends[2].error, MrfitError) and "every worker that took this work was killed" in str(ends[2].error)


def test_an_error_is_raised_in_its_turn(cluster: Cluster) -> None:
    made = spread(fails_at_two, range(9), 1, silent)
    assert [next(made), next(made)] == [0, 1]
    with pytest.raises(DataError, match="item 2: no such column"):
        next(made)


def test_what_cannot_be_sent_is_made_here(cluster: Cluster) -> None:
    items = [lambda: os.getpid(), lambda: 1]
    assert list(spread(called, items, 1, silent)) == [os.getpid(), 1]


def called(item, told):  # type: ignore[no-untyped-def]
    return item()


def test_a_scheduler_that_is_gone_or_never_was_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    python = [sys.executable, "-m"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    address = "tcp://127.0.0.1:38917"
    scheduler = subprocess.Popen(
        [*python, "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "38917", "--no-dashboard"],
        **quiet,  # type: ignore[call-overload]
    )
    worker = subprocess.Popen(
        [*python, "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard"],
        **quiet,  # type: ignore[call-overload]
    )
    try:
        order.use(address)
        made = spread(squared, range(5000), 1, silent)
        assert [next(made) for _ in range(3)] == [0, 1, 4]
        scheduler.kill()
        scheduler.wait()
        with pytest.raises(Unreachable, match="the Dask scheduler is gone; the work done so far is kept") as raised:
            list(made)
        assert "\n" not in str(raised.value)
        monkeypatch.setattr("mrfit.core.executors.dask.SCHEDULER_PATIENCE", 1.0)
        with pytest.raises(Unreachable, match="no Dask scheduler answers"):
            order.use(address)
    finally:
        order.use("")
        for one in (scheduler, worker):
            one.kill()
            one.wait()
