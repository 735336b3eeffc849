"""Run `mrfit discover` on specimens of the second rig, one after the other, and score what it says.

`python -m benchmarks.second_rig --seed 1 --cases 60 --out results.jsonl --resume --keep FOLDER`
"""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import threading
from pathlib import Path

from benchmarks.campaign import campaign_parser, case_folder, cases_left, earlier_rows, store_row

from .score import describe, read_discovery, score, table
from .specimen import KINDS, make_specimen

MOST_PROCESSOR_TIME = 180  # s of a discovery
MOST_TIME = 3600  # s by the clock, on a machine that does other work


def run_command(arguments: list[str], log: Path, seconds: float, module: str = "mrfit.cli") -> tuple[int, float]:
    """Run a command of mrfit; return its exit code and its processor time (s), its own workers' included."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + 5))

    with log.open("a") as file:
        process = subprocess.Popen(
            [sys.executable, "-m", module, *arguments],
            stdout=file,
            stderr=subprocess.STDOUT,
            preexec_fn=limit,
            start_new_session=True,
        )
        watch = threading.Timer(MOST_TIME, os.killpg, (process.pid, signal.SIGKILL))
        watch.start()
        _, status, usage = os.wait4(process.pid, 0)
        watch.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, usage.ru_utime + usage.ru_stime


def run_case(folder: Path, seed: int, kind: str, index: int) -> dict[str, object]:
    """Make a specimen, have it discovered by the documented commands, and return the case's line of the results."""
    specimen = make_specimen(seed, kind, index)
    truth = specimen.truth
    specimen.write(folder)
    work, log = folder / "work", folder / "said.txt"
    plan: dict[str, object] = truth["plan"]  # type: ignore[assignment]
    row: dict[str, object] = {
        "case": truth["case"],
        "kind": kind,
        "seed": seed,
        "index": index,
        "base": truth["base"],
        "hidden": truth["hidden"],
        "accepted": truth["accepted"],
        "accepted_verdicts": truth["accepted_verdicts"],
        "harmless": truth["harmless"],
        "waves": plan["waves"],
        "commands": plan["commands"],
        "fault": plan["fault"],
        "noise": truth["noise"],
        "errors": truth["errors"],
    }
    code, first = run_command(["ingest", str(folder / "logs"), "--work", str(work)], log, MOST_PROCESSOR_TIME)
    arguments = ["discover", "--model", str(truth["base"]), "--jobs", "1", "--work", str(work)]
    code, second = run_command(arguments, log, MOST_PROCESSOR_TIME) if code == 0 else (code, 0.0)
    row |= {"processor_time": round(second, 2), "ingest_time": round(first, 2), "exit": code}
    if code != 0:
        text = log.read_text().strip().splitlines() or [""]
        return row | {"outcome": "failed", "reason": f"exit {code}: {text[-1]}"}
    said = read_discovery(json.loads((work / "discover" / "discovery.json").read_text()))
    return row | said | {"outcome": score(truth, said)}


def main() -> None:
    """Run the cases that are asked for and print the table by kind."""
    parser = campaign_parser(__doc__, KINDS, KINDS)
    given = parser.parse_args()
    rows = earlier_rows(parser, given)
    for kind, index, case in cases_left(given, given.kinds, rows):
        with case_folder(given, case) as folder:
            row = run_case(Path(folder), given.seed, kind, index)
        rows.append(row)
        store_row(given, row)
        print(describe(row, given.keep), flush=True)
    print(table(rows, KINDS))
    print("\n".join(describe(row, given.keep) for row in rows if row["outcome"] != "right"))


if __name__ == "__main__":
    main()
