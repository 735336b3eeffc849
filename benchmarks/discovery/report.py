"""The benchmark's report in Markdown: figures against their targets, confusion, power, time, and every failure."""

from collections import Counter
from statistics import median

from benchmarks.discovery.score import CLEAR, Outcome
from datasets.rig.effects import EFFECTS, STRENGTHS


def table(head: tuple[str, ...], rows: list[tuple[object, ...]]) -> str:
    """Return a Markdown table."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(str(c) for c in row) + " |" for row in rows])


def share(outcomes: list[Outcome], met: list[bool]) -> str:
    """Return a share with its counts."""
    return f"{100 * sum(met) / len(met):.1f} % ({sum(met)}/{len(met)})" if outcomes else "not run"


def figures(outcomes: list[Outcome]) -> str:
    """Return the table of figures beside what they must reach."""

    def of(*strata: str) -> list[Outcome]:
        return [o for o in outcomes if o.case.stratum in strata]

    null = of("null", "absorbed")
    clear = [o for o in of("single") if o.contrast >= CLEAR]
    pair, apart, outside = of("pair"), of("untellable"), of("outside")
    named = [o for o in clear + pair if o.verdict == "named" and o.names == o.case.inside]
    covered = [hit for o in outcomes for hit in o.covered.values()]
    mild = [bool(o.names) and not o.wrong for o in pair]
    rows = [
        ("null runs that name something", "≤ 1 %", share(null, [bool(o.names) for o in null])),
        ("one effect, clearly visible: exact name", "≥ 95 %", share(clear, [o.right for o in clear])),
        ("wrong name, any stratum", "≤ 2 %", share(outcomes, [bool(o.wrong) for o in outcomes])),
        ("two effects: both exact", "≥ 85 %", share(pair, [o.right for o in pair])),
        ("two effects: at least one right and none wrong", "≥ 97 %", share(pair, mild)),
        ("cannot be told apart: the stated set holds the truth", "≥ 95 %", share(apart, [o.right for o in apart])),
        ("outside the library: unexplained, right region", "≥ 90 %", share(outside, [o.right for o in outside])),
        ("gap closed on held-out conditions ≥ 90 %", "", share(named, [o.closed >= 0.9 for o in named])),
        ("gap closed, median", "≥ 90 %", f"{100 * median([o.closed for o in named]):.1f} %" if named else "not run"),
        (
            "parameter's 95 % interval holds the truth",
            "93–97 %",
            f"{100 * sum(covered) / len(covered):.1f} % ({sum(covered)}/{len(covered)})" if covered else "not run",
        ),
        ("too little data: said", "", share(of("little"), [o.right for o in of("little")])),
        ("channel missing: nothing guessed", "", share(of("missing"), [o.right for o in of("missing")])),
        ("rewritten logs: same verdict", "", share(of("metamorphic"), [o.right for o in of("metamorphic")])),
        ("time for one discovery, median / longest", "≤ 60 s", times(outcomes)),
    ]
    return table(("figure", "must reach", "reached"), [r for r in rows if r[2] != "not run"])


def times(outcomes: list[Outcome]) -> str:
    """Return median and longest time."""
    seconds = [o.result.seconds for o in outcomes if not o.result.error]
    return f"{median(seconds):.0f} s / {max(seconds):.0f} s" if seconds else "not run"


def label(outcome: Outcome) -> str:
    """Return the column of the confusion matrix into which an outcome falls."""
    if outcome.wrong:
        return "wrong name"
    if outcome.names:
        return "exact" if outcome.names == outcome.case.inside else "part"
    return outcome.verdict


def confusion(outcomes: list[Outcome]) -> str:
    """Return effects × verdicts, counts."""
    columns = ("exact", "part", "wrong name", "none", "ambiguous", "unexplained", "insufficient-data", "error")
    groups: dict[str, Counter[str]] = {}
    for o in outcomes:
        what = " + ".join(o.case.hidden.effects) or "nothing"
        groups.setdefault(f"{o.case.stratum}: {what}", Counter())[label(o)] += 1
    rows = [(name, *(count[c] or "" for c in columns)) for name, count in groups.items()]
    return table(("built in", *columns), rows)


def power(outcomes: list[Outcome]) -> str:
    """Return, for each effect alone, how often it is named exactly at each strength, and its contrast to the noise."""
    rows = []
    for name in EFFECTS:
        row: list[object] = [name]
        for strength in STRENGTHS:
            mine = [
                o
                for o in outcomes
                if o.case.stratum == "single" and set(o.case.hidden.effects) == {name} and o.case.strength == strength
            ]
            hits = sum(o.names == o.case.inside for o in mine)
            row.append(f"{hits}/{len(mine)} (at {median([o.contrast for o in mine]):.1f})" if mine else "")
        if any(row[1:]):
            rows.append(tuple(row))
    return table(("effect", *STRENGTHS), rows)


def intervals(outcomes: list[Outcome]) -> str:
    """Return how often the interval of each effect's comparable parameter holds the truth."""
    hits: dict[str, list[bool]] = {}
    for o in outcomes:
        for name, hit in o.covered.items():
            hits.setdefault(name, []).append(hit)
    return table(("effect", "holds the truth"), [(n, f"{sum(h)}/{len(h)}") for n, h in sorted(hits.items())])


def failures(outcomes: list[Outcome]) -> str:
    """Return every case whose demand was not met, and why."""
    lines = [
        f"- `{o.case.name}` (contrast {o.contrast:.1f}): {o.why}"
        for o in outcomes
        if not o.right and not (o.case.strength == "small" and not o.wrong and o.verdict != "error")
    ]
    return "\n".join(lines) or "none"


def document(outcomes: list[Outcome], title: str) -> str:
    """Return the whole report."""
    return "\n\n".join(
        (
            f"# Hidden effects: {title}",
            f"{len(outcomes)} cases. Contrast is what the base law cannot absorb over the noise (NRMSE over NRMSE); "
            f"clearly visible means {CLEAR} or more.",
            figures(outcomes),
            "## Built in × verdict",
            confusion(outcomes),
            "## Power: exact names by strength (median contrast)",
            power(outcomes),
            "## 95 % intervals by effect",
            intervals(outcomes),
            "## Failures (small effects that were merely missed are left out)",
            failures(outcomes) + "\n",
        )
    )
