"""Kills at random moments of every stage: the same command must then succeed and give what it gives undisturbed.

python -m tests.kills [--count 200] [--seed 0] [--stages batch,discover,…] [--record FILE.jsonl] [--out FILE.md]

Standard error tells of every kill. With ``--record`` the same command goes on after an interruption.
"""

import argparse
import json
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
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


MOST_TRIES = 3
"""Tries for each kill that is wanted: a moment may come after a command's end."""


@dataclass(frozen=True)
class Kill:
    """One try: the stage, the moments in s, how many came before the command's end, and what was other afterwards."""

    stage: str
    moments: tuple[float, ...]
    in_time: int
    broken: str = ""

    def line(self) -> str:
        """Return one line on this try."""
        shown = ", ".join(f"{m:.2f} s" for m in self.moments)
        came = f"{self.in_time} of {len(self.moments)} before its end"
        return f"{self.stage} killed after {shown}: {came}, {self.broken or 'same bytes'}"


@dataclass
class Campaign:
    """Kills in turn over some stages, ``count`` of them in time; ``record`` keeps them over interruptions."""

    count: int
    seed: int
    stages: Sequence[str] = tuple(STAGES)
    record: Path | None = None
    kills: list[Kill] = field(default_factory=list)

    def __post_init__(self) -> None:
        if self.record and self.record.exists():
            lines = self.record.read_text().splitlines()
            self.kills = [Kill(**{**line, "moments": tuple(line["moments"])}) for line in map(json.loads, lines)]
            turns = [self.stages[number % len(self.stages)] for number in range(len(self.kills))]
            assert [k.stage for k in self.kills] == turns, f"{self.record} is of other stages"

    @property
    def killed(self) -> int:
        """Number of tries of which a kill came before the command's end."""
        return sum(k.in_time > 0 for k in self.kills)

    @property
    def broken(self) -> list[str]:
        """Return the tries after which the result was another."""
        return [k.line() for k in self.kills if k.broken]

    def run(self) -> None:
        """Kill until ``count`` tries came in time, or so many as are allowed are made."""
        with undisturbed(self.stages) as (folder, seconds):
            while self.killed < self.count and len(self.kills) < MOST_TRIES * self.count:
                number = len(self.kills)
                name = self.stages[number % len(self.stages)]
                kill = disturb(folder, name, seconds[name], random.Random(f"{self.seed} {number}"))
                self.kills.append(kill)
                if self.record:
                    with self.record.open("a") as file:
                        file.write(json.dumps(asdict(kill)) + "\n")
                print(f"{self.killed}/{self.count} {kill.line()}", file=sys.stderr, flush=True)

    def table(self) -> str:
        """Return a row for each stage, as Markdown."""
        rows = ["| stage | tries | killed before its end | other result afterwards |", "|---" * 4 + "|"]
        for name in self.stages:
            own = [k for k in self.kills if k.stage == name]
            rows.append(
                f"| {name} | {len(own)} | {sum(k.in_time > 0 for k in own)} | {sum(bool(k.broken) for k in own)} |"
            )
        return "\n".join(rows) + "\n"


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
    """Kill the process of a stage after so many seconds; return whether it had not ended by then."""
    process = subprocess.Popen(command(stage), cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(after)
    process.send_signal(signal.SIGKILL)
    return process.wait() == -signal.SIGKILL


@contextmanager
def undisturbed(wanted: Sequence[str]) -> Iterator[tuple[Path, dict[str, float]]]:
    """Give a folder with the workspaces as they are before and after each wanted stage, and the seconds each takes."""
    turn = list(STAGES).index
    needed = {name for stage in wanted for name in PREPARING[STAGES[stage][0]] if turn(name) < turn(stage)} | {*wanted}
    with tempfile.TemporaryDirectory() as place:
        folder, seconds = Path(place) / "logs", {}
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
            seconds[name] = time.perf_counter() - begin
            shutil.copytree(work, folder.parent / "after" / name)
        yield folder, seconds


def disturb(folder: Path, stage: str, seconds: float, rng: random.Random) -> Kill:
    """Kill a stage once or a few times, run it to its end, and compare."""
    work, before = folder / STAGES[stage][0], folder.parent / "before" / stage
    shutil.rmtree(work, ignore_errors=True)
    if before.exists():
        shutil.copytree(before, work)
    # most of a short command is the start of Python: moments are even over all of it but its first tenth
    moments = tuple(rng.uniform(0.1, 1.0) * seconds for _ in range(rng.choice([1, 1, 1, 2, 3])))
    in_time, broken = sum([killed(stage, folder, moment) for moment in moments]), ""
    try:
        finished(stage, folder)
        now, then = content(work), content(folder.parent / "after" / stage)
        assert sorted(now) == sorted(then), f"other files: {sorted(set(now) ^ set(then))}"
        differing = [name for name in now if now[name] != then[name]]
        assert not differing, f"other bytes: {differing}"
    except AssertionError as error:
        broken = str(error)
    return Kill(stage, moments, in_time, broken)


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--stages", default=",".join(STAGES))
    parser.add_argument("--record", type=Path)
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    campaign = Campaign(arguments.count, arguments.seed, arguments.stages.split(","), arguments.record)
    campaign.run()
    print(campaign.table(), *campaign.broken, sep="\n")
    if arguments.out:
        arguments.out.write_text(campaign.table())
    raise SystemExit(1 if campaign.broken or campaign.killed < campaign.count else 0)


if __name__ == "__main__":
    main()
