"""Processor time that a command takes besides its work: fit of one condition, help, status, list, compare.

    python -m benchmarks.command_start [--old CHECKOUT] [--runs 10] [--out FILE.md]

One log of the coil is ingested, then each command runs again and again, by turns with the code of another checkout if
one is given. What counts is user and system time of the command and its processes, which other work on the machine
changes less than seconds on the clock. The first run, which may compile, does not count. A fit has a seed of its own
each time, so that it is made anew. ``parts`` times the pieces of one fit, each without the others that run inside it.
"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from benchmarks.command import COIL

Measured = TypeVar("Measured")
Places = Sequence[tuple[Path, Path]]
HERE = Path(__file__).parent.parent
HEAD = ("# The start of a command", "", "`python -m benchmarks.command_start --old CHECKOUT --out FILE.md`", "")
LOG = COIL / "coil_01Hz_1A.csv"
FIT = ["fit", "--model", "boucwen-flux", "--name", "a"]
COMMANDS = {
    "--help": ["--help"],
    "status": ["status"],
    "list models": ["list", "models"],
    "fit of one condition": FIT,
    "compare of one model": ["compare", "--models", "boucwen-flux"],
}
SEEDED, WITHOUT_WORK = ("fit", "compare"), ("--help", "list")
PARTS = ("imports", "kernels", "reading", "preparing", "search", "intervals", "writing", "rest")
# Runs one command and prints the seconds of each part; an import inside of a part is counted as an import
TIMED = """
import builtins, sys, time
spent, open_parts, last = {}, ["rest"], 0.0

def charge():
    global last
    now = time.process_time()
    spent[open_parts[-1]] = spent.get(open_parts[-1], 0.0) + now - last
    last = now

def timed(holder, name, part):
    function = getattr(holder, name)
    def call(*arguments, **options):
        charge()
        open_parts.append(part)
        try:
            return function(*arguments, **options)
        finally:
            charge()
            open_parts.pop()
    setattr(holder, name, call)

timed(builtins, "__import__", "imports")
import mrfit.cli.main, mrfit.cli.output, mrfit.cli.pipeline, mrfit.fit.stage, mrfit.kernels.jit
from numba.core.caching import FunctionCache
stage = mrfit.fit.stage
timed(FunctionCache, "load_overload", "kernels")
timed(mrfit.cli.pipeline, "_segments_as_before", "reading")
timed(stage, "read_dataset", "reading")
timed(stage, "build_group", "preparing")
timed(stage._Runner, "_search", "search")
timed(stage, "trust", "intervals")
timed(stage, "write_fit", "writing")
timed(mrfit.cli.output, "fit", "writing")
try:
    mrfit.cli.main.main()
except SystemExit as end:
    charge()
    print("PARTS", end.code, *(f"{part}={seconds}" for part, seconds in spent.items()))
"""


def run(checkout: Path, command: Sequence[str]) -> float:
    """Return the processor seconds of a command under the code of a checkout."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    whole = [sys.executable, "-m", "mrfit.cli", *command]
    subprocess.run(whole, check=True, env=environment, cwd=checkout, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def parts(checkout: Path, command: Sequence[str]) -> dict[str, float]:
    """Return the processor seconds of each part of a fit; the start of Python counts among the imports."""
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    whole = [sys.executable, "-c", TIMED, *command]
    done = subprocess.run(whole, check=True, env=environment, cwd=checkout, capture_output=True, text=True)
    _, code, *found = done.stdout.splitlines()[-1].split()
    if code != "0":
        raise SystemExit(done.stderr)
    seconds = {name: float(value) for name, _, value in (item.partition("=") for item in found)}
    return {part: seconds.get(part, 0.0) for part in PARTS}


def given(options: Sequence[str], work: Path, seed: int) -> list[str]:
    """Return a command with its workspace and, where it fits, a seed."""
    seeded = ["--seed", str(seed)] if options[0] in SEEDED else []
    return [*options, *seeded, *([] if options[0] in WITHOUT_WORK else ["--work", str(work)])]


def by_turns(
    measure: Callable[[Path, Sequence[str]], Measured], options: Sequence[str], places: Places, runs: int
) -> list[list[Measured]]:
    """Return what is measured of a command in every run but the first, by checkout."""
    taken = [[measure(code, given(options, work, seed)) for code, work in places] for seed in range(runs + 1)]
    return [list(times) for times in zip(*taken[1:], strict=True)]


def row(name: str, times: Sequence[Sequence[float]]) -> str:
    """Return a line: least and median seconds by code, old first, and how many times the median of the old is."""
    cells = [f"{min(t):.3f} | {statistics.median(t):.3f}" for t in times]
    ratio = [f"{statistics.median(times[0]) / max(statistics.median(times[-1]), 1e-9):.2f}"] * (len(times) > 1)
    return f"| {' | '.join([name, *cells, *ratio])} |"


def main(old: Path | None = None, runs: int = 10, out: Path | None = None) -> None:
    """Print one line for each command and for each part of a fit."""
    checkouts = [old.resolve(), HERE] if old else [HERE]
    names = ["before", "after"] if old else ["now"]
    head = ["", *(f"{n}, {what} (s)" for n in names for what in ("least", "median")), *["before / after"] * bool(old)]
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    with tempfile.TemporaryDirectory() as folder:
        works = [Path(folder) / str(k) for k in range(len(checkouts))]
        for checkout, work in zip(checkouts, works, strict=True):
            run(checkout, ["ingest", str(LOG), "--work", str(work)])
        places = list(zip(checkouts, works, strict=True))
        for name, options in COMMANDS.items():
            lines.append(row(name, by_turns(run, options, places, runs)))
            print(lines[-1], flush=True)
        found = by_turns(parts, FIT, places, runs)
        for part in PARTS:
            lines.append(row(f"fit: {part}", [[p[part] for p in times] for times in found]))
            print(lines[-1], flush=True)
    lines += [
        "",
        f"Processor time (user and system), {runs} runs each by turns; the fit is of one condition, 2500 rows.",
    ]
    if out:
        out.write_text("\n".join([*HEAD, *lines]) + "\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--old", type=Path)
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--out", type=Path)
    main(**vars(parser.parse_args()))
