"""Kills at random moments of every stage: the same command must then succeed and give what it gives undisturbed.

python -m tests.kills [--count 200] [--seed 0] [--stages batch,discover,…] [--out FILE.md]
"""

import argparse
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tests.beside_logs import write_log

ROOT = Path(__file__).resolve().parent.parent
LOGS = [str(ROOT / "datasets" / "coil" / f"coil_{f}Hz_{a}A.csv") for f in ("01", "05") for a in (1, 3, 5)]
DAMPER = ["zero.csv", "half.csv", "one.csv", "two.csv"]
PIPELINE = """
work = "run"
[ingest]
logs = ["zero.csv", "one.csv"]
[[fit]]
model = "bingham"
[[fit]]
model = "tanh"
per = "all"
"""
FITTED = ["--fit", "tanh.auto.all"]
STAGES: dict[str, tuple[str, list[str]]] = {
    "ingest": ("coil", ["ingest", *LOGS]),
    "flux": ("coil", ["flux"]),
    "segment": ("coil", ["segment"]),
    "fit": ("coil", ["fit", "--model", "boucwen-flux", "--opt", "pso-lsq", "--budget", "3000"]),
    "report": ("coil", ["report", "--jobs", "2"]),
    "ingest-damper": ("damper", ["ingest", *DAMPER]),
    "fit-damper": ("damper", ["fit", "--model", "tanh", "--per", "all"]),
    "discover": ("damper", ["discover", "--model", "tanh"]),
    "export": ("damper", ["export", *FITTED, "--to", "c", "--to", "fmu", "--to", "json"]),
    "apply": ("damper", ["apply", "invert", *FITTED, "--sine", "1:0.01", "--dt", "0.01", "--law", "c=2e3"]),
    "predict": ("damper", ["predict", "two.csv", *FITTED, "--save", "again"]),
    "batch": ("batch", ["batch", ".", "--like", "*.csv", "--model", "bingham", "--jobs", "2"]),
    "run": ("run", ["run", "pipeline.toml"]),
}
"""Stage -> its workspace, and the words of its command."""
PREPARING = {
    "coil": ("ingest", "flux", "segment", "fit"),
    "damper": ("ingest-damper", "fit-damper"),
    "batch": (),
    "run": (),
}
"""Workspace -> the stages that others in it need."""


@dataclass
class Stage:
    """What became of the kills of one stage: how many came in time, and which of them left something else."""

    name: str
    seconds: float
    tried: int = 0
    killed: int = 0
    broken: list[str] = field(default_factory=list)


def command(stage: str) -> list[str]:
    """Return the command of a stage."""
    work, words = STAGES[stage]
    return [sys.executable, "-m", "mrfit.cli", *words, *([] if stage == "run" else ["--work", work])]


def content(work: Path) -> dict[str, bytes]:
    """Return every file of a workspace but the log of commands, which says when they were given."""
    files = [p for p in sorted(work.rglob("*")) if p.is_file() and p.name != "commands.log"]
    return {str(p.relative_to(work)): p.read_bytes() for p in files}


def finished(stage: str, folder: Path) -> None:
    """Run a stage to its end.

    Raises
    ------
    AssertionError
        If it fails.
    """
    done = subprocess.run(command(stage), cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, f"{stage} ended with {done.returncode}: {done.stderr[-300:]}"


def killed(stage: str, folder: Path, after: float) -> bool:
    """Kill a stage and all its processes after so many seconds; return whether it had not ended by then."""
    process = subprocess.Popen(command(stage), cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(after)
    process.send_signal(signal.SIGKILL)
    return process.wait() == -signal.SIGKILL


@contextmanager
def undisturbed(wanted: Sequence[str]) -> Iterator[tuple[Path, dict[str, Stage]]]:
    """Give a folder with the workspaces as they are before and after each wanted stage, and how long each takes."""
    needed = {name for stage in wanted for name in (*PREPARING[STAGES[stage][0]], stage)}
    with tempfile.TemporaryDirectory() as place:
        folder, stages = Path(place) / "logs", {}
        folder.mkdir()
        for name, current in zip(DAMPER, (0.0, 0.5, 1.0, 2.0), strict=True):
            write_log(folder / name, current)
        (folder / "pipeline.toml").write_text(PIPELINE)
        for name in [n for n in STAGES if n in needed]:
            work = folder / STAGES[name][0]
            if work.exists():
                shutil.copytree(work, folder.parent / "before" / name)
            begin = time.perf_counter()
            finished(name, folder)
            stages[name] = Stage(name, time.perf_counter() - begin)
            shutil.copytree(work, folder.parent / "after" / name)
        yield folder, {name: stages[name] for name in wanted}


def disturb(folder: Path, stage: Stage, rng: random.Random) -> None:
    """Kill a stage once or a few times, run it to its end, and compare."""
    work, before = folder / STAGES[stage.name][0], folder.parent / "before" / stage.name
    shutil.rmtree(work, ignore_errors=True)
    if before.exists():
        shutil.copytree(before, work)
    # most of a short command is the start of Python: moments are even over all of it but its first tenth
    moments = [rng.uniform(0.1, 1.0) * stage.seconds for _ in range(rng.choice([1, 1, 1, 2, 3]))]
    stage.tried += 1
    stage.killed += any([killed(stage.name, folder, moment) for moment in moments])
    try:
        finished(stage.name, folder)
        now, then = content(work), content(folder.parent / "after" / stage.name)
        assert sorted(now) == sorted(then), f"other files: {sorted(set(now) ^ set(then))}"
        differing = [name for name in now if now[name] != then[name]]
        assert not differing, f"other bytes: {differing}"
    except AssertionError as error:
        shown = ", ".join(f"{m:.2f} s" for m in moments)
        stage.broken.append(f"{stage.name} killed after {shown}: {error}")


def campaign(count: int, seed: int, wanted: Sequence[str] = tuple(STAGES)) -> list[Stage]:
    """Kill the wanted stages in turn, ``count`` times together."""
    rng = random.Random(seed)
    with undisturbed(wanted) as (folder, stages):
        for number in range(count):
            disturb(folder, stages[wanted[number % len(wanted)]], rng)
    return list(stages.values())


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--stages", default=",".join(STAGES))
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    stages = campaign(arguments.count, arguments.seed, arguments.stages.split(","))
    rows = ["| stage | tries | killed before its end | other result afterwards |", "|---" * 4 + "|"]
    rows += [f"| {s.name} | {s.tried} | {s.killed} | {len(s.broken)} |" for s in stages]
    text = "\n".join(rows) + "\n"
    print(text, *(b for s in stages for b in s.broken), sep="\n")
    if arguments.out:
        arguments.out.write_text(text)
    raise SystemExit(1 if any(s.broken for s in stages) else 0)


if __name__ == "__main__":
    main()
