"""Formulas on specimens of the law-mismatch benchmark: nothing hidden, or an effect of the library put out of use.

`python -m benchmarks.formula --split development --group null --count 40`

No base and no effect takes part: the search alone is judged, beside any law. A null is a case of which the law is all
there is. For an effect the formula must have the structure that its equation has in the grammar; effects that a law may
make, or that move the current, have none.
"""

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path

import mrfit
from benchmarks.law_mismatch.methods import Asked
from benchmarks.law_mismatch.protocol import Case, generated
from benchmarks.law_mismatch.report import wilson
from benchmarks.law_mismatch.runner import asked_of
from mrfit.api.preparing import as_asked, prepared
from mrfit.api.threads import one_blas_thread
from mrfit.core.progress import silent
from mrfit.discover.evidence.bench import build_bench, effects_for
from mrfit.discover.formula.proposal import Proposal, propose
from mrfit.discover.formula.wording import proposed
from mrfit.discover.invariance.records import from_block
from mrfit.discover.policy import STANDARD
from mrfit.simulate.assembly import assemble

# Structures that an effect has in the grammar, each a set of terms without constants
STRUCTURES = {
    "gas-spring": ("x line", "x gas-column", "x line+x square"),
    "end-stop": ("x dead-zone", "x over", "x under"),
    "inertia": ("a line",),
    "asymmetry": ("L line*v side",),
    "temperature": ("L line*T line", "L line*T thermal", "T line*v side", "T line*v line"),
    "gain-drift": ("L line*t line",),
}


def recordings_of(asked: Asked) -> list[mrfit.Recording]:
    """Return the records of a case as they are given to the search."""
    return [
        mrfit.Recording.from_arrays(dt=dt, name=f"test {k:02d}", **channels)
        for k, (dt, channels) in enumerate(zip(asked.dt, asked.channels, strict=True))
    ]


def searched(logs: Sequence[mrfit.Recording]) -> Proposal:
    """Return what a search beside any law ends with on some records; no base and no effect takes part."""
    with one_blas_thread():
        data = prepared(logs, as_asked({}), silent).dataset
        base = assemble("bingham")
        bench = build_bench(data.segments, data.recordings, base, effects_for(base.spec.output))
        learnt, held = (
            [from_block(s.block, s.names, base.spec.output) for s in bench.of_role(role)]
            for role in ("train", "holdout")
        )
        return propose(learnt, held, None, STANDARD)


def row_of(case: Case) -> dict[str, object]:
    """Return what a case gave."""
    asked, truth, tests = asked_of(case)
    start = time.process_time()
    found = searched(recordings_of(asked))
    row: dict[str, object] = {"case": case.name, "hidden": case.hidden, "law": case.family, "why": found.why}
    row["seconds"] = round(time.process_time() - start, 2)
    if found.formula and found.sure:
        terms = ["*".join(t.structure) for t in found.formula.terms]
        row |= {
            "terms": terms,
            "kept": round(found.formula.kept, 3),
            "clear": round(found.sure.clear(found.formula.theta), 1),
        }
        row["alike"] = ["+".join(sorted("*".join(t.structure) for t in a.terms)) for a in found.alike]
        row["text"] = proposed(found).text
    size = [own.get("size") for own in truth.values()]
    return row | {"size": size, "conditions": tests["conditions"]}


def main() -> None:
    """Run the cases that are asked for, and count."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--split", choices=("development", "evaluation"), required=True)
    parser.add_argument("--group", choices=("null", "single", "long-memory"), default="null")
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--out", type=Path, help="results, one line of JSON a case")
    given = parser.parse_args()
    rows = []
    for case in generated(given.split, given.group, given.count, ("bingham",), 1, given.first):
        row = row_of(case)
        rows.append(row)
        print(json.dumps(row), flush=True)
        if given.out:
            with given.out.open("a") as file:
                file.write(json.dumps(row) + "\n")
    told(rows)


def told(rows: list[dict[str, object]]) -> None:
    """Print how many cases have a formula, and how many the right one."""
    for name in sorted({"+".join(r["hidden"]) for r in rows}):
        own = [r for r in rows if "+".join(r["hidden"]) == name]
        hits = [r for r in own if not r["why"]]
        known = STRUCTURES.get(name, ())
        right = sum("+".join(sorted(r["terms"])) in known for r in hits)
        among = sum(bool({"+".join(sorted(r["terms"])), *r["alike"]} & set(known)) for r in hits)
        low, high = wilson(len(hits), len(own))
        of = f"proposed {len(hits)} of {len(own)} ({low:.1%} to {high:.1%})"
        print(f"{name or 'nothing'}: {of}, right {right}, in set {among}")
    print(f"processor time: {sorted(r['seconds'] for r in rows)[len(rows) // 2]} s a case, median")


if __name__ == "__main__":
    main()
