"""Run `mrfit discover --formulas` on specimens with hidden forms outside the library, and score what it proposes.

`python -m benchmarks.outside_forms --seed 1 --cases 31 --out results.jsonl --resume --keep FOLDER`
"""

from __future__ import annotations

import json
import time
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mrfit
from benchmarks.campaign import campaign_parser, case_folder, cases_left, earlier_rows, store_row
from benchmarks.formula import searched
from benchmarks.second_rig.__main__ import MOST_PROCESSOR_TIME, run_command
from mrfit.discover.formula.proposal import Proposal
from mrfit.discover.formula.wording import proposed

from . import sindy
from .forms import GROUPS, KINDS, LIBRARY
from .plugged import plugged
from .reading import FormulaError
from .score import read_proposed, score, sizes, table
from .specimen import Specimen, make_specimen
from .static_law import searched_beside_a_static_law

LIBRARY_OFF = "benchmarks.outside_forms.library_off"
STATIC = "beside_static_law"
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
    return row | scored(specimen, proposed)


def recordings_of(specimen: Specimen) -> list[mrfit.Recording]:
    """Return the logs of a specimen as recordings."""
    dt = 1.0 / specimen.sensors.rate
    return [
        mrfit.Recording.from_arrays(dt=dt, name=f"test {k:02d}", **{n: f[n].to_numpy() for n in f if n != "time"})
        for k, f in enumerate(specimen.frames)
    ]


def search_alone(specimen: Specimen, folder: Path | None) -> dict[str, object]:
    """Search a specimen for a formula in this process; return what was said and its score.

    No base and no verdict comes before it, and no effect takes part. In a folder its plug-in is written and used.
    """
    start = time.process_time()
    found = searched(recordings_of(specimen))
    row = {"processor_time": round(time.process_time() - start, 2), **said_of(specimen, found)}
    return row | ({"plugged": plugged(folder, specimen, found)} if folder and row["proposed"] else {})


def said_of(specimen: Specimen, found: Proposal) -> dict[str, object]:
    """Return what a search said, and its score."""
    said = proposed(found).model_dump(mode="json")
    return {"proposed": said["text"], "said": said, **scored(specimen, said)}


def scored(specimen: Specimen, said: Mapping[str, Any]) -> dict[str, object]:
    """Return the score of what was said, or that it cannot be read."""
    try:
        return score(specimen, *read_proposed(specimen, said))
    except FormulaError as error:
        return {"outcome": "failed", "reason": str(error)}


def baselines(specimen: Specimen) -> dict[str, object]:
    """Return the scores of the search beside a static law, and of pysindy where it is installed."""
    found: dict[str, object] = {}
    for name, beside_any_law in BASELINES.items() if sindy.available() else ():
        proposals = sindy.propose(specimen, beside_any_law)
        found[name] = {"proposed": [sorted(p.name) for p in proposals], **score(specimen, proposals)}
    return found | {STATIC: said_of(specimen, searched_beside_a_static_law(recordings_of(specimen)))}


def main() -> None:
    """Run the cases that are asked for and print the tables."""
    parser = campaign_parser(__doc__, KINDS, [*KINDS, *GROUPS])
    parser.add_argument("--base", default="", help="model given to the command; drawn where it is left out")
    parser.add_argument("--search-alone", action="store_true", help="search in this process, library and base left out")
    parser.add_argument("--plugged", action="store_true", help="with --search-alone: use the plug-in of each formula")
    parser.add_argument("--baselines", action="store_true", help="run the baselines too")
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
            if given.search_alone:
                said = search_alone(specimen, Path(folder) if given.plugged else None)
            else:
                said = {} if given.only_baselines else run_case(Path(folder), specimen)
        compared = given.baselines or given.only_baselines
        row |= {"outcome": "none", **said, **(baselines(specimen) if compared else {})}
        rows.append(row)
        store_row(given, row)
        why = row.get("reason") or row.get("said", {}).get("reason", "")
        words = f"{row.get('verdict', '')} {row.get('proposed', '')}{why}"
        print(f"{case} ({row['base']}, {row['law']}): {row['outcome']}: {words}", flush=True)
    for name in ("", STATIC, *BASELINES):
        print(f"\n{name or 'mrfit discover --formulas'}\n\n{table(rows, name)}")


if __name__ == "__main__":
    main()
