"""Run `mrfit discover --formulas` on specimens with hidden forms outside the library, and score what it proposes.

`python -m benchmarks.outside_forms --seed 1 --cases 31 --out results.jsonl --resume --keep FOLDER`
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
import warnings
from contextlib import nullcontext
from pathlib import Path

from benchmarks.second_rig.__main__ import MOST_PROCESSOR_TIME, run_command

from . import sindy
from .forms import GROUPS, KINDS, LIBRARY
from .reading import FormulaError
from .score import read_proposed, score, sizes, table
from .specimen import Specimen, make_specimen

LIBRARY_OFF = "benchmarks.outside_forms.library_off"
BASELINES = {"sindy": False, "sindy_beside_any_law": True}


def run_case(folder: Path, specimen: Specimen) -> dict[str, object]:
    """Have a specimen discovered by the documented commands; return what was said and its score."""
    specimen.write(folder)
    work, log = folder / "work", folder / "said.txt"
    code, _ = run_command(["ingest", str(folder / "logs"), "--work", str(work)], log, MOST_PROCESSOR_TIME)
    arguments = ["discover", "--model", specimen.base, "--formulas", "--jobs", "1", "--work", str(work)]
    module = LIBRARY_OFF if specimen.kind in LIBRARY else "mrfit.cli"
    code, seconds = run_command(arguments, log, MOST_PROCESSOR_TIME, module) if code == 0 else (code, 0.0)
    row: dict[str, object] = {"processor_time": round(seconds, 2), "exit": code}
    if code != 0:
        text = log.read_text().strip().splitlines() or [""]
        return row | {"outcome": "failed", "reason": text[-1]}
    content = json.loads((work / "discover" / "discovery.json").read_text())
    proposed = content.get("proposed") or {}
    named = [effect["name"] for effect in content.get("effects", [])]
    row |= {"verdict": content["verdict"], "named": named, "proposed": proposed.get("text", ""), "said": proposed}
    try:
        return row | score(specimen, *read_proposed(specimen, proposed))
    except FormulaError as error:
        return row | {"outcome": "failed", "reason": str(error)}


def baselines(specimen: Specimen) -> dict[str, object]:
    """Return the scores of pysindy on the same logs, where it is installed."""
    found: dict[str, object] = {}
    for name, beside_any_law in BASELINES.items() if sindy.available() else ():
        proposals = sindy.propose(specimen, beside_any_law)
        found[name] = {"proposed": [sorted(p.name) for p in proposals], **score(specimen, proposals)}
    return found


def main() -> None:
    """Run the cases that are asked for and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--cases", type=int, default=len(KINDS), help="spread evenly over the kinds")
    parser.add_argument("--first", type=int, default=0, help="index of the first case of each kind")
    parser.add_argument("--kinds", nargs="+", choices=[*KINDS, *GROUPS], default=list(KINDS))
    parser.add_argument("--base", default="", help="model given to the command; drawn where it is left out")
    parser.add_argument("--out", type=Path, required=True, help="results, one line of JSON a case")
    parser.add_argument("--resume", action="store_true", help="leave out the cases that are in the results")
    parser.add_argument("--keep", type=Path, help="keep logs, truth and workspace of each case in this folder")
    parser.add_argument("--only-baselines", action="store_true", help="run no command of mrfit")
    parser.add_argument("--only-table", action="store_true", help="print the tables of the results that are there")
    given = parser.parse_args()
    warnings.filterwarnings("ignore", module="pysindy")
    rows = []
    if given.out.exists():
        if not (given.resume or given.only_table):
            parser.error(f"{given.out} exists: continue it with --resume or name another file")
        rows = [json.loads(line) for line in given.out.read_text().splitlines()]
    done = {row["case"] for row in rows}
    kinds = [kind for name in given.kinds for kind in GROUPS.get(name, (name,))]
    for number in range(0 if given.only_table else given.cases):
        kind, index = kinds[number % len(kinds)], given.first + number // len(kinds)
        case = f"seed{given.seed}-{kind}-{index:03d}"
        if case in done:
            continue
        specimen = make_specimen(given.seed, kind, index, given.base)
        row = {"case": case, "kind": kind, "base": specimen.base, "law": specimen.damper.law.name}
        row |= {"waves": specimen.waves, "terms": [t.described() for t in specimen.terms], **sizes(specimen)}
        if given.keep:
            shutil.rmtree(given.keep / case, ignore_errors=True)
        kept = nullcontext(given.keep / case) if given.keep else tempfile.TemporaryDirectory()
        with kept as folder:
            said = {} if given.only_baselines else run_case(Path(folder), specimen)
        row |= {"outcome": "none", **said, **baselines(specimen)}
        rows.append(row)
        with given.out.open("a") as file:
            file.write(json.dumps(row) + "\n")
        said = f"{row.get('verdict', '')} {row.get('proposed', '')}{row.get('reason', '')}"
        print(f"{case} ({row['base']}, {row['law']}): {row['outcome']}: {said}", flush=True)
    for name in ("", *BASELINES):
        print(f"\n{name or 'mrfit discover --formulas'}\n\n{table(rows, name)}")


if __name__ == "__main__":
    main()
