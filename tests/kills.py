"""Kills at random moments of every stage: the same command must then succeed and give what it gives undisturbed.

python -m tests.kills [--count 200] [--seed 0] [--out FILE.md]
"""

import argparse
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LOGS = [str(ROOT / "datasets" / "coil" / f"coil_{f}Hz_{a}A.csv") for f in ("01", "05") for a in (1, 3, 5)]
STAGES: dict[str, list[str]] = {
    "ingest": ["ingest", *LOGS],
    "flux": ["flux"],
    "segment": ["segment"],
    "fit": ["fit", "--model", "boucwen-flux", "--opt", "pso-lsq", "--budget", "3000"],
    "report": ["report"],
}


@dataclass
class Stage:
    """What became of the kills of one stage: how many came in time, and which of them left something else."""

    name: str
    seconds: float
    tried: int = 0
    killed: int = 0
    broken: list[str] = field(default_factory=list)


def command(stage: str, work: Path) -> list[str]:
    """Return the command of a stage."""
    return [sys.executable, "-m", "mrfit.cli", *STAGES[stage], "--work", work.name]


def content(work: Path) -> dict[str, bytes]:
    """Return every file of a workspace but the log of commands, which says when they were given."""
    files = [p for p in sorted(work.rglob("*")) if p.is_file() and p.name != "commands.log"]
    return {str(p.relative_to(work)): p.read_bytes() for p in files}


def finished(stage: str, work: Path) -> None:
    """Run a stage to its end.

    Raises
    ------
    AssertionError
        If it fails.
    """
    done = subprocess.run(command(stage, work), cwd=work.parent, capture_output=True, text=True)
    assert done.returncode == 0, f"{stage} ended with {done.returncode}: {done.stderr[-300:]}"


def killed(stage: str, work: Path, after: float) -> bool:
    """Kill a stage and all its processes after so many seconds; return whether it had not ended by then."""
    process = subprocess.Popen(
        command(stage, work), cwd=work.parent, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    time.sleep(after)
    process.send_signal(signal.SIGKILL)
    return process.wait() == -signal.SIGKILL


@contextmanager
def undisturbed() -> Iterator[tuple[Path, dict[str, Stage]]]:
    """Give a folder with the workspace as it is after each stage, and how long each takes."""
    with tempfile.TemporaryDirectory() as place:
        folder, stages = Path(place), {}
        work = folder / "work"
        (folder / "before").mkdir()
        for name in STAGES:
            if work.exists():
                shutil.copytree(work, folder / "before" / name)
            begin = time.perf_counter()
            finished(name, work)
            stages[name] = Stage(name, time.perf_counter() - begin)
            shutil.copytree(work, folder / "after" / name)
        yield folder, stages


def disturb(folder: Path, stage: Stage, rng: random.Random) -> None:
    """Kill a stage once or a few times, run it to its end, and compare."""
    work, before = folder / "work", folder / "before" / stage.name
    shutil.rmtree(work, ignore_errors=True)
    if before.exists():
        shutil.copytree(before, work)
    # most of a short command is the start of Python: moments are even over all of it but its first tenth
    moments = [rng.uniform(0.1, 1.0) * stage.seconds for _ in range(rng.choice([1, 1, 1, 2, 3]))]
    stage.tried += 1
    stage.killed += any([killed(stage.name, work, moment) for moment in moments])
    try:
        finished(stage.name, work)
        now, then = content(work), content(folder / "after" / stage.name)
        assert sorted(now) == sorted(then), f"other files: {sorted(set(now) ^ set(then))}"
        differing = [name for name in now if now[name] != then[name]]
        assert not differing, f"other bytes: {differing}"
    except AssertionError as error:
        shown = ", ".join(f"{m:.2f} s" for m in moments)
        stage.broken.append(f"{stage.name} killed after {shown}: {error}")


def campaign(count: int, seed: int) -> list[Stage]:
    """Kill every stage in turn, ``count`` times together."""
    rng = random.Random(seed)
    with undisturbed() as (folder, stages):
        for number in range(count):
            disturb(folder, list(stages.values())[number % len(stages)], rng)
    return list(stages.values())


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    stages = campaign(arguments.count, arguments.seed)
    rows = ["| stage | tries | killed before its end | other result afterwards |", "|---" * 4 + "|"]
    rows += [f"| {s.name} | {s.tried} | {s.killed} | {len(s.broken)} |" for s in stages]
    text = "\n".join(rows) + "\n"
    print(text, *(b for s in stages for b in s.broken), sep="\n")
    if arguments.out:
        arguments.out.write_text(text)
    raise SystemExit(1 if any(s.broken for s in stages) else 0)


if __name__ == "__main__":
    main()
