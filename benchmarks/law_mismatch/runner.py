"""Run cases, one after another or several at a time, and keep what came of each."""

import hashlib
import json
import multiprocessing
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

from benchmarks.law_mismatch import realsets
from benchmarks.law_mismatch.methods import Asked, ask
from benchmarks.law_mismatch.protocol import Case
from benchmarks.law_mismatch.said import Said
from benchmarks.law_mismatch.specimen import logs, specimen
from mrfit.io.keys import code_version
from mrfit.io.workspace import write_text


@dataclass(frozen=True)
class Chosen:
    """The method that is judged, the file of the prototype, and the folder of finished cases."""

    method: str
    prototype: Path | None = None
    keep: Path | None = None


@dataclass(frozen=True)
class Result:
    """What came of a case: the truth by effect, what the tests were, and what the method said."""

    case: str
    truth: dict[str, dict[str, Any]]
    tests: dict[str, Any]
    said: Said


def asked_of(case: Case) -> tuple[Asked, dict[str, dict[str, Any]], dict[str, Any]]:
    """Return the records of a case, the truth, and what the tests were."""
    if case.records:
        asked, truth = realsets.asked_of(case)
        return asked, truth, {"kind": case.records, "conditions": len(asked.channels)}
    made, truth = specimen(case.split, case.family, case.hidden, case.seed, case.memory, case.conditions)
    recorded = logs(made)
    channels = [
        {"displacement": r.displacement, "force": r.force, "current": r.current, "temperature": r.temperature}
        for r in recorded
    ]
    tests = {
        "kind": made.kind, "current": made.switching, "rate": made.rate, "conditions": len(recorded),
        "samples": sum(len(r.force) for r in recorded), "stroke": made.drive.stroke,
        "frequency": made.drive.frequency, "noise": made.sensors.white, "law": asdict(made.law),
    }  # fmt: skip
    return Asked(channels, [r.dt for r in recorded], case.base), truth, tests


@cache
def version(chosen: Chosen) -> str:
    """Return what stands for the code that is judged and for this benchmark's own."""
    digest = hashlib.sha256(code_version().encode())
    files = [*Path(__file__).parent.glob("*.py"), *filter(None, [chosen.prototype])]
    for file in sorted(f for f in files if f.name not in ("report.py", "score.py", "__main__.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def run(case: Case, chosen: Chosen) -> Result:
    """Run a case, or return what an earlier run of the same code kept of it; failures are not kept."""
    kept = chosen.keep / f"{chosen.method}-{version(chosen)}" / f"{case.name}.json" if chosen.keep else None
    if kept and kept.exists():
        read = json.loads(kept.read_text(encoding="utf-8"))
        return Result(**{**read, "said": Said.of(read["said"])})
    asked, truth, tests = asked_of(case)
    result = Result(case.name, truth, tests, ask(chosen.method, asked, chosen.prototype))
    if kept and result.said.verdict != "error":
        write_text(kept, json.dumps(asdict(result), indent=1, sort_keys=True) + "\n")
    return result


def run_all(cases: list[Case], chosen: Chosen, jobs: int) -> Iterator[Result]:
    """Yield the results in the order of the cases, ``jobs`` processes at a time."""
    one = partial(run, chosen=chosen)
    if jobs == 1:
        yield from map(one, cases)
        return
    with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn")) as pool:
        yield from pool.map(one, cases)
