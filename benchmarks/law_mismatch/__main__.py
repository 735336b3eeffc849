"""Command line: python -m benchmarks.law_mismatch --method discover --split development [--group single] --out FILE.md.

Parts may be run on their own into one ``--keep`` folder; the same command without ``--part`` then writes the report.
"""

import argparse
import os
import sys
from dataclasses import replace
from pathlib import Path

# cases run beside each other, each on one thread
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from benchmarks.command import deliver
from benchmarks.law_mismatch import realsets
from benchmarks.law_mismatch.head import explanation
from benchmarks.law_mismatch.methods import METHODS
from benchmarks.law_mismatch.protocol import BASES, COUNTS, GROUPS, SPLITS, Case, generated
from benchmarks.law_mismatch.report import document
from benchmarks.law_mismatch.runner import Chosen, run_all
from benchmarks.law_mismatch.score import judge_all


def arguments() -> argparse.ArgumentParser:
    """Return what the command takes."""
    parser = argparse.ArgumentParser(
        prog="benchmarks.law_mismatch", description="Score discovery on specimens whose law is not the base."
    )
    parser.add_argument("--method", choices=sorted(METHODS), default="discover", help="what is judged")
    parser.add_argument("--prototype", type=Path, help="Python file with discover(records, base), for that method")
    parser.add_argument("--split", choices=SPLITS, default="development", help="seeds, laws and drives")
    parser.add_argument("--group", choices=GROUPS, action="append", help="only these groups")
    parser.add_argument("--count", type=int, help="specimens a group; default: the protocol's")
    parser.add_argument("--first", type=int, default=0, help="number of the first specimen: others are fresh ones")
    parser.add_argument("--bases", default="1", help="how many drawn for each specimen, or a list: bingham,tanh")
    parser.add_argument("--conditions", type=int, default=0, help="how many each specimen has; default: 6 to 20, drawn")
    parser.add_argument("--match", default="", help="only cases whose name holds this text")
    parser.add_argument("--part", default="1/1", help="K/N: every N-th case from the K-th on")
    parser.add_argument("--jobs", type=int, default=1, help="cases at a time")
    parser.add_argument("--keep", type=Path, help="folder of finished cases: a later run goes on from there")
    parser.add_argument("--list", action="store_true", help="print the cases and run nothing")
    parser.add_argument("--out", type=Path, help="Markdown file to write; default: standard output")
    return parser


def chosen_cases(options: argparse.Namespace) -> list[Case]:
    """Return the cases that are asked for; planted ones bring the records as they are with them."""
    groups = [g for g in GROUPS if not options.group or g in options.group]
    listed = not options.bases.isdigit()
    bases = tuple(options.bases.split(",")) if listed else BASES
    unknown = [b for b in bases if b not in BASES]
    if unknown:
        raise SystemExit(f"--bases: {', '.join(unknown)} is none of {', '.join(BASES)}")
    each = len(bases) if listed else int(options.bases)
    cases: list[Case] = []
    for group in groups:
        if group in COUNTS:
            count = COUNTS[group] if options.count is None else options.count
            drawn = generated(options.split, group, count, bases, each, options.first)
            cases += [_of_conditions(case, options.conditions) for case in drawn]
    wanted = [g for g in ("real", "planted") if g in groups or (g == "real" and "planted" in groups)]
    if wanted and not realsets.available():
        sys.stderr.write("MRFIT_REAL_LOGS does not name the folder of real logs: real records are left out\n")
        wanted = []
    for group in wanted:
        cases += realsets.cases(options.split, group, bases if listed else realsets.REAL_BASES[options.split])
    cases = [c for c in cases if options.match in c.name]
    first, parts = (int(word) for word in options.part.split("/"))
    return cases[first - 1 :: parts]


def _of_conditions(case: Case, count: int) -> Case:
    """Return a case with as many conditions, under a name of its own; as it is for 0."""
    return replace(case, name=f"{case.name}-of-{count}", conditions=count) if count else case


def main() -> int:
    """Run the chosen cases and write the report."""
    options = arguments().parse_args()
    cases = chosen_cases(options)
    if options.list:
        for case in cases:
            sys.stdout.write(f"{case.name} {case.family or case.records} {'+'.join(case.hidden) or 'nothing'}\n")
        return 0
    chosen = Chosen(options.method, options.prototype, options.keep)
    results = []
    for case, result in zip(cases, run_all(cases, chosen, options.jobs), strict=True):
        results.append(result)
        said = result.said
        named = ", ".join(n.name for n in said.names) or said.why.get("error", "–")
        sys.stderr.write(
            f"{len(results)}/{len(cases)} {case.name}: {'+'.join(case.hidden) or 'nothing'} → {said.verdict}: {named} "
            f"({said.seconds:.1f} s)\n"
        )
    title = f"{options.method}, {options.split}"
    text = document(judge_all(cases, results), title, explanation(options.split))
    deliver(text, options.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
