"""Run `mrfit discover --formulas` on specimens with hidden forms outside the library, and score what it proposes.

`python -m benchmarks.outside_forms --seed 1 --cases 31 --out results.jsonl --resume --keep FOLDER`
"""

from __future__ import annotations

import json
import warnings
from pathlib import Path

from benchmarks.campaign import campaign_parser, case_folder, cases_left, earlier_rows, store_row
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
    parser = campaign_parser(__doc__, KINDS, [*KINDS, *GROUPS])
    parser.add_argument("--base", default="", help="model given to the command; drawn where it is left out")
    parser.add_argument("--only-baselines", action="store_true", help="run no command of mrfit")
    given = parser.parse_args()
    warnings.filterwarnings("ignore", module="pysindy")
    rows = earlier_rows(parser, given)
    kinds = [kind for name in given.kinds for kind in GROUPS.get(name, (name,))]
    for kind, index, case in cases_left(given, kinds, rows):
        specimen = make_specimen(given.seed, kind, index, given.base)
        row = {"case": case, "kind": kind, "base": specimen.base, "law": specimen.damper.law.name}
        row |= {"waves": specimen.waves, "terms": [t.described() for t in specimen.terms], **sizes(specimen)}
        with case_folder(given, case) as folder:
            said = {} if given.only_baselines else run_case(Path(folder), specimen)
        row |= {"outcome": "none", **said, **baselines(specimen)}
        rows.append(row)
        store_row(given, row)
        words = f"{row.get('verdict', '')} {row.get('proposed', '')}{row.get('reason', '')}"
        print(f"{case} ({row['base']}, {row['law']}): {row['outcome']}: {words}", flush=True)
    for name in ("", *BASELINES):
        print(f"\n{name or 'mrfit discover --formulas'}\n\n{table(rows, name)}")


if __name__ == "__main__":
    main()
