"""Command line: python -m benchmarks.discovery --smoke | --full [--scale 0.3] [--part 1/4] [--keep DIR] --out FILE.md.

Parts may be run on their own into one ``--keep`` folder; the same command without ``--part`` then writes the report.
"""

import argparse
import sys
from pathlib import Path

from benchmarks.command import deliver
from benchmarks.discovery.protocol import STRATA, full, smoke
from benchmarks.discovery.report import document
from benchmarks.discovery.runner import run_all
from benchmarks.discovery.score import judge_all


def main() -> int:
    """Run the chosen cases; return 1 if a smoke case failed."""
    parser = argparse.ArgumentParser(
        prog="benchmarks.discovery", description="Score `mrfit discover` on hidden effects."
    )
    size = parser.add_mutually_exclusive_group(required=True)
    size.add_argument("--smoke", action="store_true", help="four cases")
    size.add_argument("--full", action="store_true", help="the whole protocol")
    parser.add_argument("--scale", type=float, default=1.0, help="multiplies the repeats of the full protocol")
    parser.add_argument("--stratum", choices=[*STRATA, "absorbed"], action="append", help="only these strata")
    parser.add_argument("--match", default="", help="only cases whose name holds this text")
    parser.add_argument("--part", default="1/1", help="K/N: every N-th case from the K-th on")
    parser.add_argument("--jobs", type=int, default=1, help="cases at a time")
    parser.add_argument("--keep", type=Path, help="folder of finished cases: a later run goes on from there")
    parser.add_argument("--out", type=Path, help="Markdown file to write; default: standard output")
    options = parser.parse_args()
    cases = smoke() if options.smoke else full(options.scale)
    cases = [c for c in cases if not options.stratum or c.stratum in options.stratum]
    cases = [c for c in cases if options.match in c.name]
    first, parts = (int(word) for word in options.part.split("/"))
    cases = cases[first - 1 :: parts]
    results = []
    for result in run_all(cases, options.jobs, options.keep):
        results.append(result)
        verdict = result.error or result.discovery.get("verdict")
        sys.stderr.write(f"{len(results)}/{len(cases)} {result.name}: {verdict} ({result.seconds:.0f} s)\n")
    outcomes = judge_all(cases, results)
    text = document(outcomes, "smoke set" if options.smoke else "full protocol")
    deliver(text, options.out)
    return int(options.smoke and not all(o.right for o in outcomes))


if __name__ == "__main__":
    sys.exit(main())
