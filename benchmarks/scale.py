"""Thousands of logs, several workers, long logs, large workspaces: seconds by log, and what grows with what.

    python -m benchmarks.scale [--parts batch,dask,long,workspace] [--old CHECKOUT] [--logs 40] [--by-hand 8] …

``batch``: logs of a coil by one command, against ingest, fit and report as three commands for every log, as
`make batch` did (with the code of ``--old``), and against the bare fit of the same logs.
``dask``: the same batch in one process and by the workers of a scheduler on this machine, in the end one is killed.
``long``: long logs of several sizes through ingest, flux, segment and fit. ``workspace``: many logs in one workspace.
What counts is user and system time of the command and all that works for it, in one run: other work on the machine
changes it less than seconds on the clock. Work that two processes share takes each of them half of it.
"""

import argparse
import ctypes
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from benchmarks import scale_logs, scale_long
from benchmarks.command import deliver

HERE = Path(__file__).parent.parent
MODEL = ["--model", "boucwen-flux", "--opt", "pso-fmin"]
PORT = 38786
# Seconds in which a worker ends when asked to
PATIENCE = 10.0
# Option of prctl on Linux
SUBREAPER = 36
# Commands of one workspace, and logs of the run whose cost is that of their start: a kernel may be compiled there
STAGES, FIRST = ("ingest", "flux", "segment", "fit", "status"), 12
# Workers of a scheduler, and whether each is kept by a nanny
CLUSTERS = ((1, False), (2, True), (2, False), (4, False))
# What the paper estimate is for
FLEET, WORKERS = 50_000, 64


@dataclass(frozen=True)
class Spent:
    """Seconds that work took.

    Attributes
    ----------
    processor
        User and system time of all processes that had a part in it.
    clock
        On the clock.
    """

    processor: float
    clock: float


@contextmanager
def adopting() -> Iterator[None]:
    """Have processes whose parent ends become children of this one, so that their time is known in the end."""
    ctypes.CDLL(None).prctl(SUBREAPER, 1)
    yield
    ctypes.CDLL(None).prctl(SUBREAPER, 0)


def timed(*words: object, checkout: Path = HERE, kill_at: Callable[[], bool] | None = None) -> Spent:
    """Run a command with the code of a checkout; return what it took. It is killed as soon as ``kill_at`` is true."""
    begin, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    others = children(os.getpid())
    command = [sys.executable, "-m", "mrfit.cli", *map(str, words)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(checkout), os.environ.get("PYTHONPATH", "")])}
    with adopting(), subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL) as process:
        while kill_at and process.poll() is None:
            if kill_at():
                process.kill()
            time.sleep(0.02)
        code = process.wait()
        clock = time.perf_counter() - begin
        # forked servers and their workers end just after the command
        while orphans := children(os.getpid()) - others:
            for orphan in orphans:
                os.waitpid(orphan, 0)
    if code and not kill_at:
        raise subprocess.CalledProcessError(code, command)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return Spent(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, clock)


def children(process: int) -> set[int]:
    """Return the processes that a process has begun or adopted."""
    found: set[int] = set()
    for tasks in Path(f"/proc/{process}/task").glob("*/children"):
        with suppress(OSError):
            found |= set(map(int, tasks.read_text().split()))
    return found


def mrfit(*words: object, checkout: Path = HERE) -> float:
    """Run a command with the code of a checkout; return its processor seconds."""
    return timed(*words, checkout=checkout).processor


def table(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    """Return a Markdown table."""
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    return [*lines, *(f"| {' | '.join(map(str, row))} |" for row in rows), ""]


def by_hand(logs: Sequence[Path], place: Path, checkout: Path) -> float:
    """Return the seconds of three commands for every log, each by one worker, but for the first log: it may compile."""
    spent: list[float] = []
    for log in [logs[0], *logs]:
        work = place / "by-hand" / f"{len(spent)}-{log.name}"
        ingest = mrfit("ingest", log, "--work", work, "--jobs", 1, checkout=checkout)
        fit = mrfit("fit", *MODEL, "--work", work, "--jobs", 1, checkout=checkout)
        spent.append(ingest + fit + mrfit("report", "--work", work, "--jobs", 1, checkout=checkout))
    return sum(spent[1:])


def bare(logs: Path) -> float:
    """Return the seconds of the fits alone, in a process that has read all logs before and loaded the kernels."""
    program = (
        "import sys, time, mrfit\n"
        "from pathlib import Path\n"
        "read = mrfit.read(Path(sys.argv[1]))\n"
        "fit = lambda r: mrfit.fit([r], model='boucwen-flux', optimizer='pso-fmin')\n"
        "fit(read[0])\n"
        "begin = time.process_time()\n"
        "for one in read: fit(one)\n"
        "print(time.process_time() - begin)\n"
    )
    done = subprocess.run([sys.executable, "-c", program, str(logs)], check=True, capture_output=True, text=True)
    return float(done.stdout)


def batch(place: Path, given: argparse.Namespace) -> list[str]:
    """Return the table of the batch."""
    logs = place / "logs"
    scale_logs.write_logs(logs, max(given.logs), given.samples)
    folders = {count: _first(logs, count, place / f"first{count}") for count in (given.by_hand, *sorted(given.logs))}
    few = folders[given.by_hand]
    each = by_hand(sorted(few.glob("*.csv")), place, given.old) / given.by_hand
    alone = bare(few) / given.by_hand
    rows: list[Sequence[object]] = [("ingest, fit and report for every log", given.by_hand, f"{each:.2f}", "", "1", "")]
    least, most = min(given.logs), max(given.logs)
    ways: list[tuple[str, int, list[object]]] = [
        ("`mrfit batch --report`, a workspace and a report each", given.by_hand, ["--report"]),
        ("`mrfit batch --table`, one table", least, ["--table", place / "fleet.parquet"]),
        *(("`mrfit batch`, a workspace each", count, []) for count in sorted(given.logs)),
        ("the same again, nothing changed", most, []),
    ]
    for name, count, options in ways:
        work = place / ("w" + "".join(map(str, options[:1])) + str(count))
        spent = timed("batch", folders[count], *MODEL, "--jobs", given.jobs, "--work", work, *options)
        seconds = spent.processor / count
        faster, more = f"{each / seconds:.1f}", f"{100 * (seconds / alone - 1):.0f} %"
        rows.append((name, count, f"{seconds:.3f}", f"{spent.clock / count:.3f}", faster, more))
        print(*rows[-1], file=sys.stderr, flush=True)
    if given.keep:
        shutil.copy(place / f"w{most}" / "batch.html", given.keep / "batch.html")
    heads = ("way", "logs", "processor seconds per log", "clock", "times faster", "over the bare fit")
    page = (place / f"w{most}" / "batch.html").stat().st_size / 1e6
    text = (
        f"Logs of {given.samples} samples, batches by {given.jobs} processes; the bare fit of a log takes "
        f"{alone:.3f} s. Factors are of processor seconds. The page of {most} logs has {page:.2f} MB."
    )
    return [*table(heads, rows), text, "", _resumed(place, folders[least], given), ""]


def _first(logs: Path, count: int, folder: Path) -> Path:
    """Return a folder with links to the first logs of another."""
    folder.mkdir(exist_ok=True)
    for path in [*sorted(logs.glob("*.csv"))[:count], logs / "mrfit.toml"]:
        (folder / path.name).unlink(missing_ok=True)
        os.link(path, folder / path.name)
    return folder


def _resumed(place: Path, logs: Path, given: argparse.Namespace) -> str:
    """Return what became of a batch that was killed when a half was done, and called again."""
    count, work = min(given.logs), place / "killed"
    journal, call = work / "batch.jsonl", ("batch", logs, *MODEL, "--jobs", given.jobs, "--work", work)
    timed(*call, kill_at=lambda: journal.exists() and journal.read_bytes().count(b"\n") >= count // 2)
    done = journal.read_bytes().count(b"\n")
    timed(*call)
    same = "are" if contents(work) == contents(place / f"w{count}") else "ARE NOT"
    return (
        f"Of {count} logs, {done} were done when the command was killed (SIGKILL); the same command did the rest, and "
        f"all its {len(contents(work))} files {same} those of a batch that was not killed, byte for byte."
    )


@contextmanager
def cluster(workers: int, nanny: bool) -> Iterator[tuple[str, list["subprocess.Popen[bytes]"]]]:
    """Give the address of a scheduler with so many workers; the scheduler's process, and theirs."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": "/"}
    address = f"tcp://127.0.0.1:{PORT}"
    names = ["--host", "127.0.0.1", "--port", str(PORT), "--no-dashboard"]
    made = [subprocess.Popen([sys.executable, "-m", "distributed.cli.dask_scheduler", *names], **quiet)]  # type: ignore[call-overload]
    command = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard"]
    command += ["--nanny" if nanny else "--no-nanny"]
    made += [subprocess.Popen(command, **quiet) for _ in range(workers)]  # type: ignore[call-overload]
    try:
        yield address, made
    finally:
        # workers first, a nanny ends its own; one without a scheduler may not end by itself
        for one in reversed(made):
            one.terminate()
            try:
                one.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                one.kill()
                one.wait()


def contents(folder: Path) -> dict[str, bytes]:
    """Return all files of a batch by their names."""
    found = {p.relative_to(folder).as_posix(): p for p in folder.rglob("*") if p.is_file() and p.name != ".lock"}
    return {name: path.read_bytes() for name, path in found.items() if name != "batch.json"}


def dask(place: Path, given: argparse.Namespace) -> list[str]:
    """Return the table of workers, and the estimate for a fleet; what a few logs cost does not count."""
    logs = place / "logs"
    scale_logs.write_logs(logs, max(given.logs), given.samples)
    few = _first(logs, given.few, place / "few")

    def each(name: str, options: Sequence[object], processes: Sequence["subprocess.Popen[bytes]"] = ()) -> float:
        """Return the processor seconds that each further log takes, of the command and of others that work for it."""
        spent: list[float] = []
        for folder in (few, logs):
            before = sum(_spent(p.pid) for p in processes)
            seconds = mrfit("batch", folder, *MODEL, *options, "--work", place / f"{name}-{folder.name}")
            spent.append(seconds + sum(_spent(p.pid) for p in processes) - before)
        print(name, *spent, file=sys.stderr, flush=True)
        return (spent[1] - spent[0]) / float(max(given.logs) - given.few)

    rows: list[Sequence[object]] = []
    alone: dict[int, float] = {}
    for count in sorted({w for w, _ in CLUSTERS}):
        alone[count] = each(f"processes{count}", ["--jobs", count])
        rows.append((f"{count} process{'es' * (count > 1)}", f"{alone[count]:.3f}", "", ""))
    truth = contents(place / "processes1-logs")
    for workers, nanny in CLUSTERS:
        with cluster(workers, nanny) as (address, made):
            # workers live on: what they load once does not count
            mrfit("batch", few, *MODEL, "--on", address, "--work", place / f"warm{workers}{nanny}")
            seconds = each(f"dask{workers}{nanny}", ["--on", address], made)
        same = "yes" if contents(place / f"dask{workers}{nanny}-logs") == truth else "NO"
        name = f"{workers} Dask worker{'s' * (workers > 1)}, {'with a nanny each' if nanny else 'no nanny'}"
        rows.append((name, f"{seconds:.3f}", f"{100 * (seconds / alone[workers] - 1):+.0f} %", same))
    with cluster(3, False) as (address, made):
        killer = ThreadPoolExecutor(1).submit(
            _kill_in_the_middle, made[1], place / "killed" / "batch.jsonl", max(given.logs)
        )
        mrfit("batch", logs, *MODEL, "--on", address, "--work", place / "killed")
        killer.result()
    same = "yes" if contents(place / "killed") == truth else "NO"
    rows.append(("3 Dask workers, one killed in the middle", "", "", same))
    heads = ("workers", "processor seconds per further log", "over as many processes", "same bytes")
    text = (
        f"Logs of {given.samples} samples beyond the first {given.few}, up to {max(given.logs)}. Seconds of the "
        "command, of workers, their nannies and the scheduler together."
    )
    paper = _estimate(place, alone[1], seconds, max(given.logs))
    return [*table(heads, rows), text, "", paper, ""]


def _spent(process: int) -> float:
    """Return the processor seconds of a process, and of those it began, so far."""
    words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK") + sum(map(_spent, children(process)))


def _kill_in_the_middle(worker: "subprocess.Popen[bytes]", journal: Path, logs: int) -> None:
    while not journal.exists() or journal.read_bytes().count(b"\n") < logs // 3:
        time.sleep(0.05)
    worker.send_signal(signal.SIGKILL)


def _estimate(place: Path, alone: float, each: float, logs: int) -> str:
    """Return what so many logs would take on so many workers, from the cost and the bytes of one."""
    there = sum(p.stat().st_size for p in (place / "logs").glob("*.csv")) / logs / 1e6
    files = contents(place / "processes1-logs")
    back = sum(len(c) for n, c in files.items() if not n.startswith("batch.")) / logs / 1e6
    hours = FLEET * each / WORKERS / 3600.0
    rate = (there + back) * WORKERS / each
    return (
        f"On paper: a log takes {each:.2f} s of a worker's processor ({alone:.2f} s in a process here), {there:.2f} MB "
        f"go there and {back:.2f} MB come back. {FLEET} logs on {WORKERS} workers take {hours:.2f} hours and move "
        f"{FLEET * (there + back) / 1e3:.0f} GB, {rate:.0f} MB/s through the command's machine; with `--shared` none "
        "of it, and with `--table` nothing comes back but parameters."
    )


def long(place: Path, given: argparse.Namespace) -> list[str]:
    """Return the table of long logs of several sizes."""
    rows = []
    for number, size in enumerate(given.gigabytes):
        rows.append(scale_long.row_of(place / str(number), size))
        shutil.rmtree(place / str(number))
    text = (
        "Peak resident memory and processor seconds of each command, minutes on the clock of all four, and the "
        "greatest relative error of slope, amplitude, turnover, sharpness and rho, which one amplitude determines."
    )
    heads = ("log", "rows", *scale_long.STAGES, "clock", "error")
    return [*table(heads, rows), text, ""]


def workspace(place: Path, given: argparse.Namespace) -> list[str]:
    """Return the table of many logs in one workspace, and of the report of the most."""
    start, rows = sum(_stages(place, FIRST, given.short)), []
    for count in sorted(given.counts):
        spent = _stages(place, count, given.short)
        each = (sum(spent) - start) / (count - FIRST)
        rows.append((count, *(f"{1e3 * s / count:.1f}" for s in (*spent, sum(spent))), f"{1e3 * each:.1f}"))
        print(rows[-1], file=sys.stderr, flush=True)
    work = place / f"work{max(given.counts)}"
    seconds, page = mrfit("report", "--work", work, "--jobs", 1), work / "report" / "index.html"
    if given.keep:
        shutil.copy(page, given.keep / "workspace.html")
    heads = ("logs", *STAGES, "all", "each further log")
    text = (
        f"Milliseconds of processor time per log of {given.short} samples, one worker, the start of each command "
        f"included; the last column is of the logs beyond the first {FIRST}. The report of {max(given.counts)} logs "
        f"takes {seconds:.1f} s, its page {page.stat().st_size / 1e6:.2f} MB."
    )
    return [*table(heads, rows), text, ""]


def _stages(place: Path, count: int, samples: int) -> list[float]:
    """Return the seconds of all stages of so many logs in one workspace."""
    logs, work = place / f"w{count}", place / f"work{count}"
    scale_logs.write_logs(logs, count, samples)
    options = {"ingest": [logs, "--jobs", 1], "fit": ["--model", "boucwen-flux", "--jobs", 1]}
    return [mrfit(stage, *options.get(stage, []), "--work", work) for stage in STAGES]


TITLES = {
    "batch": "Batch",
    "dask": "Workers of a scheduler",
    "long": "Long logs",
    "workspace": "Many logs in one workspace",
}
HEAD = """# Thousands of logs, long logs, several workers

`python -m benchmarks.scale --parts batch,dask,long,workspace --out FILE.md`

What counts is user and system time of all processes that had a part in the work, in one run for each table. The
machine has two cores and was busy with other work, so that times on the clock are upper bounds."""
PARTS = {"batch": batch, "dask": dask, "long": long, "workspace": workspace}


def merged(page: str, made: str) -> str:
    """Return a page whose sections are those made now, and those of an earlier run that were not."""
    sections = {part.partition("\n")[0]: part.strip() for part in [*_sections(page), *_sections(made)]}
    ordered = [sections[title] for title in TITLES.values() if title in sections]
    return "\n\n".join([HEAD, *(f"## {section}" for section in ordered)]) + "\n"


def _sections(text: str) -> list[str]:
    return re.split(r"^## ", text, flags=re.MULTILINE)[1:]


def main(given: argparse.Namespace) -> None:
    """Print the tables, or put them into a page beside those of other parts."""
    lines: list[str] = []
    for name in given.parts.split(","):
        with tempfile.TemporaryDirectory(dir=given.folder) as place:
            lines += ["## " + TITLES[name], "", *PARTS[name](Path(place), given)]
    made = "\n".join(lines).rstrip() + "\n"
    if given.out:
        earlier = given.out.read_text(encoding="utf-8") if given.out.is_file() else ""
        made = merged(earlier, made)
    deliver(made, given.out)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", default="batch,long,workspace")
    parser.add_argument("--old", type=Path, default=HERE, help="checkout whose code does three commands for every log")
    parser.add_argument("--logs", type=lambda t: [int(n) for n in t.split(",")], default=[20, 60])
    parser.add_argument("--jobs", type=int, default=2, help="processes of a batch")
    parser.add_argument("--few", type=int, default=4, help="logs of the run whose cost does not count")
    parser.add_argument("--by-hand", type=int, default=8)
    parser.add_argument("--samples", type=int, default=20_000)
    parser.add_argument("--gigabytes", type=lambda t: [float(n) for n in t.split(",")], default=[0.5, 2.0])
    parser.add_argument("--counts", type=lambda t: [int(n) for n in t.split(",")], default=[30, 100])
    parser.add_argument("--short", type=int, default=4000, help="samples of the logs of one workspace")
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--keep", type=Path, help="folder into which pages of the largest runs are copied")
    parser.add_argument("--out", type=Path, help="write the tables into a Markdown file")
    main(parser.parse_args())
