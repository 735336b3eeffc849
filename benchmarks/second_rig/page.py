"""Write the page of a campaign on the second rig from its results.

`python -m benchmarks.second_rig.page results.jsonl --commit COMMIT --remark TEXT --out docs/benchmarks/second_rig.md`
"""

import json
from argparse import ArgumentParser
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

from scipy.stats import binomtest

from .score import OUTCOMES, describe, table
from .specimen import KINDS

Row = dict[str, Any]
LONG = 60.0  # s of processor time
HEAD = """# Discovery on the second rig

Made by `python -m benchmarks.second_rig --seed {seeds} --cases {cases} --out results.jsonl` and
`python -m benchmarks.second_rig.page results.jsonl --commit COMMIT --remark TEXT --out FILE.md`. The rig
shares no code with the other generators: coils on a PWM under controllers, measured motions with drift and steps,
faults of logs, laws of current that saturate. Logs are ingested and discovered by the documented commands.
The code was that of commit
{commit}. {remark}"""

# Measured once, on code that is no longer run
DISTANCE = """## Distance between the benches

Shares of cases that are right, of two commits by three benches. The first two benches share their generators with the
cases on which rules of discovery were set; this rig does not. Its share in the first row is that of seed 950, on the
first commit that it judged.

| code | exact benchmark, one clear effect | law mismatch, one clear effect | this rig | distance |
|---|---|---|---|---|
| ad3bf7da | 100.0 % (130/130) | 96.0 % (96/100) | 54.8 % (23/42) | 41 points |
| 35e82ffc | 100.0 % (130/130) | 95.0 % (95/100) | 94.4 % (289/306) | 1 point |

The distance is that from law mismatch, specimens 1000 to 1107. On specimens 3000 to 3107, new to both, the two commits
name the same effects in each of the 108 cases: 98 of 102 clear ones rightly."""


def page(rows: Sequence[Row], commit: str, remark: str) -> str:
    """Return the page in Markdown; a remark says what cases of the seed were used for, and how they ran."""
    seeds = " ".join(sorted({str(r["seed"]) for r in rows}))
    times = [r["processor_time"] for r in rows]
    long = [r for r in rows if r["processor_time"] > LONG]
    silent = sum(not r.get("left_out") for r in long)
    of_kind = {kind: [r for r in rows if r["kind"] == kind] for kind in KINDS}
    right = {kind: _count(own, "right") / len(own) for kind, own in of_kind.items() if own}
    worst = min(right, key=right.__getitem__)
    figures = [
        ("right", "≥ 88 %", _told(rows, "right")),
        ("wrong name", "≤ 1 %", _told(rows, "wrong")),
        ("nulls called anything", "≤ 2 %", _told([r for r in rows if not r["hidden"]], "null-called")),
        ("least of a kind: right", "≥ 75 %", f"{100 * right[worst]:.0f} % ({worst})"),
        ("processor time, median / longest", "", f"{median(times):.0f} s / {max(times):.0f} s"),
        (f"above {LONG:.0f} s / of these nothing said to be left out", "– / none", f"{len(long)} / {silent}"),
    ]
    parts = [
        HEAD.format(seeds=seeds, cases=len(rows), commit=commit, remark=remark),
        "\n".join(["| figure | must reach | reached |", "|---|---|---|", *(f"| {' | '.join(f)} |" for f in figures)]),
        "## By kind",
        table(rows, KINDS),
        "## Not right",
        "\n".join(describe(r, None) for r in rows if r["outcome"] != OUTCOMES[0]) or "None.",
        DISTANCE,
    ]
    return "\n\n".join(parts) + "\n"


def _count(rows: Sequence[Row], outcome: str) -> int:
    return sum(r["outcome"] == outcome for r in rows)


def _told(rows: Sequence[Row], outcome: str) -> str:
    """Return a share with its interval of confidence."""
    count = _count(rows, outcome)
    interval = binomtest(count, len(rows)).proportion_ci()
    ends = f"{100 * interval.low:.1f} to {100 * interval.high:.1f}"
    return f"{100 * count / len(rows):.1f} % ({count}/{len(rows)}; 95 %: {ends})"


def main() -> None:
    """Write the page of the results that are named."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("results", type=Path, nargs="+", help="results, one line of JSON a case")
    parser.add_argument("--commit", required=True, help="commit of the code that was measured")
    parser.add_argument("--remark", required=True, help="what cases of the seed were used for, and how they ran")
    parser.add_argument("--out", type=Path, required=True, help="Markdown file to write")
    given = parser.parse_args()
    rows = [json.loads(line) for path in given.results for line in path.read_text().splitlines()]
    rows.sort(key=lambda r: (KINDS.index(r["kind"]), r["index"]))
    given.out.write_text(page(rows, given.commit, given.remark), encoding="utf-8")


if __name__ == "__main__":
    main()
