"""Time that a command takes besides its work: fit of one condition, help, completion, status, list, compare.

    python -m benchmarks.command_start [--old CHECKOUT] [--runs 10] [--out FILE.md]

One log of the coil is ingested, then each command runs again and again, by turns with the code of another checkout if
one is given. What counts is user and system time of the command and its processes, which other work on the machine
changes less than seconds on the clock, which stand beside it. The first run, which may compile, does not count. A fit
has a seed of its own each time, so that it is made anew. ``parts`` times the pieces of one fit, each without the others
that run inside it. ``FLOORS`` are what no change of mrfit's can go below: the libraries alone.
"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
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
# What the shell asks at a tabulator, by the words that are there
COMPLETIONS = {"completion of a command": "mrfit ba", "completion of an option": "mrfit fit --mod"}
SHELL = "import sys; sys.argv = ['mrfit']; from mrfit.cli.main import main; main()"
KERNEL = """
import numba

@numba.njit(cache=True)
def total(values):
    found = 0.0
    for value in values:
        found += value
    return found
"""
CALL = "import sys; sys.path.insert(0, {folder!r}); import floor_kernel, numpy; floor_kernel.total(numpy.ones(3))"
FLOORS = {
    "floor of any: Python and typer": "import typer.rich_utils",
    "floor of status: with pydantic": "import typer._adapters, rich.table",
    "floor of a fit: numpy, numba, one cached kernel": CALL,
    "floor of a fit: with pyarrow and scipy.special": f"{CALL}; import pyarrow.parquet, scipy.special",
    "floor of a fit: with typer, pydantic and rich": (
        f"{CALL}; import pyarrow.parquet, scipy.special, typer._adapters, rich.table"
    ),
}
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
timed(stage, "diagnose", "intervals")
timed(stage, "write_fit", "writing")
timed(mrfit.cli.output, "fit", "writing")
try:
    mrfit.cli.main.main()
except SystemExit as end:
    charge()
    print("PARTS", end.code, *(f"{part}={seconds}" for part, seconds in spent.items()))
"""


@dataclass(frozen=True)
class Seconds:
    """What a command took of the processor, its processes included, and on the clock."""

    processor: float
    clock: float


def around(checkout: Path) -> dict[str, str]:
    """Return the environment of a command under the code of a checkout, whose compiled modules are kept as a user's."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return {**kept, "PYTHONPATH": str(checkout)}


def python(checkout: Path, arguments: Sequence[str], more: Mapping[str, str] | None = None) -> Seconds:
    """Return what Python takes under the code of a checkout, with ``more`` in its environment."""
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    environment = around(checkout) | dict(more or {})
    subprocess.run([sys.executable, *arguments], check=True, env=environment, cwd=checkout, stdout=subprocess.DEVNULL)
    clock, after = time.perf_counter() - started, resource.getrusage(resource.RUSAGE_CHILDREN)
    return Seconds(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, clock)


def run(checkout: Path, command: Sequence[str]) -> Seconds:
    """Return what a command takes."""
    return python(checkout, ["-m", "mrfit.cli", *command])


def complete(checkout: Path, words: Sequence[str]) -> Seconds | None:
    """Return what it takes to complete the last of some words; None under code that cannot."""
    asked = {"_MRFIT_COMPLETE": "complete_bash", "COMP_WORDS": " ".join(words), "COMP_CWORD": str(len(words) - 1)}
    try:
        return python(checkout, ["-c", SHELL], asked)
    except subprocess.CalledProcessError:
        return None


def parts(checkout: Path, command: Sequence[str]) -> dict[str, float]:
    """Return the processor seconds of each part of a fit; the start of Python counts among the imports."""
    whole = [sys.executable, "-c", TIMED, *command]
    done = subprocess.run(whole, check=True, env=around(checkout), cwd=checkout, capture_output=True, text=True)
    _, code, *found = done.stdout.splitlines()[-1].split()
    if code != "0":
        raise SystemExit(done.stderr)
    seconds = {name: float(value) for name, _, value in (item.partition("=") for item in found)}
    return {part: seconds.get(part, 0.0) for part in PARTS}


def given(options: Sequence[str], work: Path, seed: int) -> list[str]:
    """Return a command with its workspace and, where it fits, a seed."""
    seeded = ["--seed", str(seed)] if options[0] in SEEDED else []
    return [*options, *seeded, *([] if options[0] in WITHOUT_WORK else ["--work", str(work)])]


def by_turns(measure: Callable[[Path, Path, int], Measured], places: Places, runs: int) -> list[list[Measured]]:
    """Return what is measured of a checkout, its workspace and a seed in every run but the first, by checkout."""
    taken = [[measure(code, work, seed) for code, work in places] for seed in range(runs + 1)]
    return [list(times) for times in zip(*taken[1:], strict=True)]


def row(name: str, processor: Sequence[Sequence[float]], clock: Sequence[Sequence[float]] = ()) -> str:
    """Return a line: seconds by code, old first, and how many times the least of the old is.

    The least and the median of the processor, the least of the clock where there is one; nothing where a code cannot.
    """
    cells = [f"{min(t):.3f} | {statistics.median(t):.3f}" if t else "– | –" for t in processor]
    cells = [f"{cell} | {min(clock[k]):.3f}" if clock and clock[k] else f"{cell} | –" for k, cell in enumerate(cells)]
    known = f"{min(processor[0]) / max(min(processor[-1]), 1e-9):.2f}" if processor[0] else "–"
    ratio = [known] * (len(processor) > 1)
    return f"| {' | '.join([name, *cells, *ratio])} |"


def row_of(name: str, found: Sequence[Sequence[Seconds]]) -> str:
    """Return the line of a command."""
    return row(name, [[s.processor for s in of] for of in found], [[s.clock for s in of] for of in found])


def main(old: Path | None = None, runs: int = 10, out: Path | None = None) -> None:
    """Print one line for each command, for each part of a fit, and for the libraries alone."""
    checkouts = [old.resolve(), HERE] if old else [HERE]
    names, shown = ["before", "after"] if old else ["now"], ("least", "median", "on the clock")
    head = ["", *(f"{n}, {what} (s)" for n in names for what in shown), *["before / after"] * bool(old)]
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    print("\n".join(lines), flush=True)
    with tempfile.TemporaryDirectory() as folder:
        works = [Path(folder) / str(k) for k in range(len(checkouts))]
        for checkout, work in zip(checkouts, works, strict=True):
            run(checkout, ["ingest", str(LOG), "--work", str(work)])
        for line in measured(list(zip(checkouts, works, strict=True)), runs):
            lines.append(line)
            print(line, flush=True)
    lines += [
        "",
        f"Processor time (user and system) and the least time on the clock, {runs} runs each by turns; the fit is of "
        "one condition, 2500 rows. The floors are the libraries alone: what a command takes where it imports them and "
        "does nothing. Python compiles no module anew.",
    ]
    if out:
        out.write_text("\n".join([*HEAD, *lines]) + "\n")


def measured(places: Places, runs: int) -> Iterator[str]:
    """Yield a line for each command, each part of a fit and each floor."""
    for name, options in COMMANDS.items():
        yield row_of(name, by_turns(lambda c, w, seed, o=options: run(c, given(o, w, seed)), places, runs))
    for name, words in COMPLETIONS.items():
        found = by_turns(lambda c, w, _, s=words: complete(c, s.split()), places, runs)
        yield row_of(name, [[one for one in of if one] for of in found])
    spent = by_turns(lambda c, w, seed: parts(c, given(FIT, w, runs + 1 + seed)), places, runs)
    for part in PARTS:
        yield row(f"fit: {part}", [[p[part] for p in times] for times in spent])
    for work in {work for _, work in places}:
        (work / "floor_kernel.py").write_text(KERNEL)
    for name, code in FLOORS.items():
        call = partial(floor, code)
        yield row_of(name, by_turns(call, places, runs))


def floor(code: str, checkout: Path, work: Path, seed: int) -> Seconds:
    """Return what Python takes to do no more than import."""
    return python(checkout, ["-c", code.format(folder=str(work))])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--old", type=Path)
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--out", type=Path)
    main(**vars(parser.parse_args()))
