"""Run one case as a user would: the bench writes logs, the ``mrfit`` command line reads them and gives a verdict."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.discovery.protocol import Case
from datasets.rig.case import make
from mrfit.io.keys import code_version
from mrfit.io.workspace import write_text

TIME_LIMIT = 1800
MRFIT = Path(sys.executable).with_name("mrfit")


@dataclass(frozen=True, slots=True)
class Result:
    """What came of a case: the truth's measures, the discovery as mrfit wrote it, the time in s, or an error."""

    name: str
    truth: dict[str, Any]
    discovery: dict[str, Any] = field(default_factory=dict)
    seconds: float = 0.0
    error: str = ""


def command(*words: str) -> str:
    """Run mrfit on one thread a library; return its standard output.

    Raises
    ------
    RuntimeError
        If it fails; the message is its last line.
    """
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [str(MRFIT), *words], capture_output=True, text=True, env=environment, timeout=TIME_LIMIT, check=False
    )
    if done.returncode:
        lines = done.stderr.strip().splitlines() or ["no message"]
        raise RuntimeError(f"mrfit {words[0]} ended with {done.returncode}: {lines[-1]}")
    return done.stdout


def starts(model: str, factor: float) -> list[str]:
    """Return options that multiply a model's start values, held within its bounds."""
    if factor == 1.0:
        return []
    options = []
    for p in json.loads(command("show", model, "--json"))["params"]:
        options += ["--start", f"{p['name']}={min(max(p['start'] * factor, p['low']), p['high']):.10g}"]
    return options


def run(case: Case, folder: Path) -> Result:
    """Make a case's logs under ``folder`` and let mrfit judge them; only the truth's measures are kept of the truth."""
    truth = make(case.hidden, folder)
    work = str(folder / "work")
    logs = [str(p) for p in sorted((folder / "logs").iterdir()) if p.suffix in (".csv", ".txt")]
    began = time.perf_counter()
    try:
        command("ingest", *logs, "--work", work)
        began = time.perf_counter()
        text = command(
            "discover", "--work", work, "--model", case.model, "--json", *starts(case.model, case.start_factor)
        )
        return Result(case.name, truth, json.loads(text), time.perf_counter() - began)
    except (RuntimeError, json.JSONDecodeError, subprocess.TimeoutExpired) as error:
        return Result(case.name, truth, seconds=time.perf_counter() - began, error=str(error)[:300])


def run_kept(case: Case, keep: Path | None) -> Result:
    """Run a case, or return what an earlier run of the same code left in ``keep``; failures are not kept."""
    if keep is None:
        with TemporaryDirectory() as folder:
            return run(case, Path(folder) / case.name)
    kept = keep / code_version() / f"{case.name}.json"
    if kept.exists():
        return Result(**json.loads(kept.read_text(encoding="utf-8")))
    with TemporaryDirectory() as folder:
        result = run(case, Path(folder) / case.name)
    if result.error:
        return result
    write_text(kept, json.dumps(asdict(result), indent=1) + "\n")
    return result


def run_all(cases: list[Case], jobs: int, keep: Path | None) -> Iterator[Result]:
    """Yield the results in the order of the cases, ``jobs`` at a time."""
    with ThreadPoolExecutor(jobs) as pool:
        yield from pool.map(lambda c: run_kept(c, keep), cases)
