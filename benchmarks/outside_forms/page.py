"""The page of formulas, from results of campaigns: `python -m benchmarks.outside_forms.page FILE… --out FILE.md`.

The files are those of `benchmarks.outside_forms`, with any of its options, and of `benchmarks.formula`.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.law_mismatch.report import share

from .forms import FORMS, LIBRARY, NULLS, PAIRS
from .plugged import EXACT
from .score import CLOSED, table

Rows = list[dict[str, Any]]
WITHIN = ("right", "in-set")
BASELINES = {
    "beside_static_law": "the same search beside a law of the speed and the current alone",
    "sindy": "pysindy beside a plain base",
    "sindy_beside_any_law": "pysindy beside any law",
}
HEAD = """# Formulas for forms outside the library

Made by `python -m benchmarks.outside_forms.page FILES --out docs/benchmarks/formula.md` from the results of
`python -m benchmarks.outside_forms --search-alone`, which searches in one process: no base, no effect and no verdict
comes before the formula.

Specimens have laws, motions and sensors of their own. Hidden terms are 1 to 8 % of the range of the law's force. Only
the part that no law makes can be known; *closed* is its share taken on four held-out tests, of root mean squares.
*Factors* are right if all planted ones are there and no other; the stated set holds readings that the data do not tell
apart. Intervals of shares are Wilson's.

Thresholds and rules were set on seeds 20 to 29. These results are of seeds from 40 on, the first and only run of these
cases."""


def of_kinds(rows: Rows, kinds: Sequence[str]) -> Rows:
    """Return the rows of some kinds."""
    return [r for r in rows if r.get("kind") in kinds]


def figures(rows: Rows) -> str:
    """Return the table of figures beside what they must reach."""
    alone = [r for r in rows if "outcome" in r]
    forms, pairs, nulls, library = (of_kinds(alone, k) for k in ((*FORMS,), (*PAIRS,), NULLS, (*LIBRARY,)))
    holds = [h for r in (*forms, *pairs) for h in r.get("holds", ())]
    used = [r["plugged"] for r in rows if r.get("plugged")]
    lines = [
        ("one form hidden: proposed", "≥ 90 %", share(bool(r["proposed"]) for r in forms)),
        (
            f"– {CLOSED:.0%} of the outside-law part closed",
            "≥ 85 %",
            share(r.get("closed", 0) >= CLOSED for r in forms),
        ),
        ("– factors right or in the stated set", "≥ 80 %", share(r["outcome"] in WITHIN for r in forms)),
        ("– factors right", "", share(r["outcome"] == "right" for r in forms)),
        ("two forms hidden: both factors", "≥ 50 %", share(r["outcome"] in WITHIN for r in pairs)),
        ("nothing hidden: proposes anything", "≤ 1 % of ≥ 600", share(bool(r["proposed"]) for r in nulls)),
        ("coefficient's 95 % interval holds the truth", "≥ 90 %", share(holds)),
        ("effects of the library, library off: factors", "≥ 85 %", share(r["outcome"] in WITHIN for r in library)),
        ("plug-in: contracts, joint fit and export", "all of ≥ 40", share("stopped" not in u for u in used)),
        (
            f"– C equals Python to {EXACT:g} of the range",
            "all of ≥ 40",
            share(u.get("differs", 1) <= EXACT for u in used),
        ),
    ]
    table_ = ["| figure | must reach | reached (95 % interval) |", "|---|---|---|"]
    table_ += [f"| {name} | {least} | {reached} |" for name, least, reached in lines]
    seconds = median(r["processor_time"] for r in alone) if alone else 0.0
    return "\n".join([*table_, "", f"Processor time of one search, preparation included: {seconds:.1f} s, median."])


def against(rows: Rows) -> str:
    """Return the table of the baselines on the cases that they were run on."""
    lines = ["| method | group | proposed | 80 % closed | factors right or in set |", "|---|---|---|---|---|"]
    for group, kinds in (("one or two forms", (*FORMS, *PAIRS)), ("nothing hidden", NULLS)):
        own = [r for r in of_kinds(rows, kinds) if any(r.get(b) for b in BASELINES)]
        for name, text in {"": "mrfit", **BASELINES}.items():
            said = [r[name] if name else r for r in own if not name or r.get(name)]
            closed = share(s.get("closed", 0) >= CLOSED for s in said) if kinds != NULLS else ""
            right = share(s["outcome"] in WITHIN for s in said) if kinds != NULLS else ""
            lines.append(f"| {text} | {group} | {share(bool(s['proposed']) for s in said)} | {closed} | {right} |")
    return "\n".join(lines)


def missed(rows: Rows) -> str:
    """Return the table of the cases with forms that were not right."""
    lines = ["| case | law | hidden, share of range | outcome | closed | said |", "|---|---|---|---|---|---|"]
    for r in of_kinds(rows, (*FORMS, *PAIRS, *LIBRARY, *NULLS)):
        if r["outcome"] in WITHIN and r.get("closed", 1.0) >= CLOSED and all(r.get("holds", ())):
            continue
        said = (r["said"]["text"] or r["said"].get("reason", "")).replace("|", "\\|")
        size = ", ".join(f"{100 * s:.1f} %" for s in r["size"])
        lines.append(f"| {r['case']} | {r['law']} | {size} | {r['outcome']} | {r.get('closed', 0):.2f} | {said} |")
    return "\n".join(lines)


def page(rows: Rows) -> str:
    """Return the page."""
    parts = [HEAD, figures(rows), "By kind.", table(rows), "**Baselines**, on the same cases.", against(rows)]
    parts += ["**Missed:** not right, less closed, or an interval that does not hold.", missed(rows)]
    return "\n\n".join(parts) + "\n"


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="+", type=Path, help="results, lines of JSON")
    parser.add_argument("--out", type=Path, required=True, help="the page")
    given = parser.parse_args()
    given.out.write_text(page([json.loads(line) for file in given.files for line in file.read_text().splitlines()]))


if __name__ == "__main__":
    main()
