"""The benchmark's report in Markdown: figures against their targets, then by effect, law, base and drive."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from math import sqrt
from statistics import median

from benchmarks.discovery.report import table
from benchmarks.law_mismatch.protocol import BASES, GROUPS
from benchmarks.law_mismatch.realsets import PLANTS, SHARES
from benchmarks.law_mismatch.said import Name
from benchmarks.law_mismatch.score import CLOSE, Outcome

COUNTED = PLANTS[:5]
Of = Callable[[Outcome], bool]


def wilson(hits: int, count: int, z: float = 1.96) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a share."""
    if count == 0:
        return 0.0, 1.0
    share, spread = hits / count, z * z / count
    middle = (share + spread / 2) / (1 + spread)
    half = z * sqrt(share * (1 - share) / count + spread / (4 * count)) / (1 + spread)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def share(met: Iterable[bool]) -> str:
    """Return a share with its counts and Wilson's interval."""
    asked = [bool(q) for q in met]
    if not asked:
        return "not run"
    low, high = wilson(sum(asked), len(asked))
    return f"{100 * sum(asked) / len(asked):.1f} % ({sum(asked)}/{len(asked)}; {100 * low:.1f}–{100 * high:.1f})"


def figures(outcomes: list[Outcome]) -> str:
    """Return the table of figures beside what they must reach."""

    def of(group: str) -> list[Outcome]:
        return [o for o in outcomes if o.case.group == group]

    null, single, pair, long, out = (of(g) for g in ("null", "single", "pair", "long-memory", "outside"))
    clear, pair = [o for o in single if o.clear], [o for o in pair if o.clear]
    planted = [o for o in of("planted") if o.case.hidden[0] in COUNTED]
    some = [bool(o.names & o.case.inside) and not o.wrong for o in pair]
    holds = [f.holds for o in (*single, *of("pair")) for f in o.found if f.holds is not None]
    plant = {s: share(o.right and o.close for o in planted if o.case.share == s) for s in SHARES}
    seconds = [o.result.said.seconds for o in outcomes if o.result.said.verdict != "error"]
    cpu = [o.result.said.cpu for o in outcomes if o.result.said.verdict != "error"]
    errors = [o for o in outcomes if o.result.said.verdict == "error"]
    rows = [
        ("nothing hidden: names something", "≤ 1 % of ≥ 600", share(bool(o.names) for o in null)),
        ("one clear effect of 2–20 % of the range: named, alone", "≥ 90 %", share(o.right for o in clear)),
        ("– named, or its stated set holds it", "", share(o.right or o.stated for o in clear)),
        ("– also those buried in noise: named, alone", "", share(o.right for o in single)),
        ("– wrong name", "≤ 1 % of ≥ 200", share(bool(o.wrong) for o in single)),
        (f"– value within {CLOSE:.0%}, of those named", "", share(o.close for o in single if o.right)),
        ("two clear effects: both", "≥ 75 %", share(o.right for o in pair)),
        ("two clear effects: at least one and none wrong", "≥ 95 %", share(some)),
        ("– also those buried in noise: both", "", share(o.right for o in of("pair"))),
        ("– wrong name", "", share(bool(o.wrong) for o in of("pair"))),
        ("95 % interval holds the truth", "≥ 90 %", share(bool(h) for h in holds)),
        *((f"planted in real records, {s:.0%} of range: named, value within 25 %", must, plant[s])
          for s, must in zip(SHARES, ("reported", "≥ 80 %", "≥ 90 %"), strict=True)),
        ("planted in real records: wrong name", "≤ 2 %", share(bool(o.wrong) for o in planted)),
        ("law remembers longer than assumed: names something", "≤ 2 % of ≥ 100", share(bool(o.names) for o in long)),
        ("outside the library: `unexplained`, nothing named", "≥ 90 %", share(o.right for o in out)),
        ("outside the library: nothing named", "", share(not o.names for o in out)),
        ("time, median / longest", "≤ 60 s", _times(seconds)),
        ("processor time, median / longest", "", _times(cpu)),
        ("failed", "0", f"{len(errors)} of {len(outcomes)}"),
    ]  # fmt: skip
    return table(("figure", "must reach", "reached (95 % interval)"), [r for r in rows if r[2] != "not run"])


def _times(seconds: list[float]) -> str:
    return f"{median(seconds):.1f} s / {max(seconds):.1f} s" if seconds else "not run"


def _of_group(outcomes: list[Outcome], key: Callable[[Outcome], str], keys: Iterable[str] = ()) -> str:
    """Return by some key: nulls that name something; effects named, with wrong names; both of pairs."""
    generated = [o for o in outcomes if o.case.family]
    found = {key(o) for o in generated}
    rows = []
    for k in [*(q for q in keys if q in found), *sorted(found - set(keys))]:
        mine = [o for o in generated if key(o) == k]
        cells = [_counts([o for o in mine if o.case.group in g], met) for g, met in _COLUMNS.values()]
        rows.append((k, *cells))
    return table(("", *_COLUMNS), rows) if rows else "not run"


def _counts(outcomes: Sequence[Outcome], met: Of) -> str:
    return f"{sum(met(o) for o in outcomes)}/{len(outcomes)}" if outcomes else ""


_COLUMNS: dict[str, tuple[tuple[str, ...], Of]] = {
    "nulls that name something": (("null",), lambda o: bool(o.names)),
    "one effect: named": (("single",), lambda o: o.right),
    "two effects: both": (("pair",), lambda o: o.right),
    "wrong name": (("single", "pair"), lambda o: bool(o.wrong)),
    "long memory: names something": (("long-memory",), lambda o: bool(o.names)),
    "outside: right": (("outside",), lambda o: o.right),
}


def effects(outcomes: list[Outcome]) -> str:
    """Return for each effect alone how often it was named by size, its error, and how often its interval held."""
    single = [o for o in outcomes if o.case.group == "single"]
    rows = []
    for name in dict.fromkeys(o.case.hidden[0] for o in single):
        mine = [o for o in single if o.case.hidden[0] == name]
        found = [f for o in mine for f in o.found if f.holds is not None]
        sizes = [(0.0, 0.035), (0.035, 0.07), (0.07, 9.0)]
        by_size = [_counts([o for o in mine if a <= o.size < b], lambda o: o.right) for a, b in sizes]
        error = f"{100 * median(f.error for f in found):.1f} %" if found else ""
        verdicts = Counter(o.result.said.verdict for o in mine if not o.right)
        missed = ", ".join(f"{v} {n}" for v, n in verdicts.items())
        held = f"{sum(bool(f.holds) for f in found)}/{len(found)}" if found else ""
        close = f"{sum(f.error <= CLOSE for f in found)}/{len(found)}" if found else ""
        rows.append((name, _counts(mine, lambda o: o.right), *by_size, close, error, held, missed))
    head = (
        "effect", "named", "below 3.5 %", "3.5–7 %", "above 7 %",
        "within 25 %", "median error", "interval holds", "else",
    )  # fmt: skip
    return table(head, rows) if rows else "not run"


def planted(outcomes: list[Outcome]) -> str:
    """Return for real records how often what was planted is named with its value, by set, effect and size."""
    mine = [o for o in outcomes if o.case.group == "planted"]
    rows: list[tuple[object, ...]] = []
    for key in dict.fromkeys((o.case.records, o.case.hidden[0]) for o in mine):
        these = [o for o in mine if (o.case.records, o.case.hidden[0]) == key]
        cells = [_counts([o for o in these if o.case.share == s], lambda o: o.right and o.close) for s in SHARES]
        wrong = ", ".join(sorted({n for o in these for n in o.wrong}))
        rows.append((*key, *cells, wrong))
    head = ("records", "planted", *(f"{s:.0%}" for s in SHARES), "wrong names")
    return table(head, rows) if rows else "not run"


def real(outcomes: list[Outcome]) -> str:
    """Return what is named of real records as they are, its value, and from how many bases."""
    mine = [o for o in outcomes if o.case.group == "real"]
    rows: list[tuple[object, ...]] = []
    for records in dict.fromkeys(o.case.records for o in mine):
        these = [o for o in mine if o.case.records == records]
        bases = ", ".join(o.case.base for o in these)
        names = sorted({n for o in these for n in o.names})
        verdicts = "; ".join(f"{o.case.base}: {o.result.said.verdict}" for o in these)
        if not names:
            rows.append((records, "nothing", "", f"0 of {len(these)} ({bases})", verdicts))
        for name in names:
            said = [n for o in these for n in o.result.said.names if n.name == name]
            values = "; ".join(_values(n) for n in said)
            rows.append((records, name, values, f"{len(said)} of {len(these)} ({bases})", verdicts))
    return table(("records", "named", "values (95 %)", "from bases", "verdicts"), rows) if rows else "not run"


def _values(name: Name) -> str:
    numbers = name.numbers.items()
    parts = [
        f"{k} {n.value:.4g}" + (f" ({n.low:.4g} to {n.high:.4g})" if n.low is not None and n.high is not None else "")
        for k, n in numbers
    ]
    together = name.together
    return ", ".join(parts) + (f" [or {', '.join(together)}]" if together else "")


def failures(outcomes: list[Outcome]) -> str:
    """Return every case whose demand was not met, and what was said."""
    lines = []
    for o in outcomes:
        if o.right:
            continue
        said, hidden = (
            o.result.said,
            " + ".join(
                f"{h} {100 * t['size']:.1f} % contrast {t.get('contrast', 0):.1f}" for h, t in o.result.truth.items()
            ),
        )
        named = ", ".join(sorted(o.names)) or "nothing named"
        why = "; ".join(f"{k}: {v}" for k, v in said.why.items() if k in o.case.inside or k == "error")
        lines.append(
            f"- `{o.case.name}` ({o.case.family or o.case.records}, {o.result.tests['kind']}, "
            f"{o.result.tests.get('current', '')}{'; ' + hidden if hidden else ''}): {said.verdict}, {named}"
            + (f" ({why})" if why else "")
        )
    return "\n".join(lines) or "none"


def document(outcomes: list[Outcome], title: str, head: str) -> str:
    """Return the whole report; ``head`` is what explains it."""
    groups = Counter(o.case.group for o in outcomes)
    counts = ", ".join(f"{groups[g]} {g}" for g in GROUPS if groups[g])
    return "\n\n".join(
        (
            f"# Discovery under a wrong law: {title}",
            head,
            f"{len(outcomes)} cases: {counts}.",
            figures(outcomes),
            "## By effect, one hidden",
            effects(outcomes),
            "## By law",
            _of_group(outcomes, lambda o: o.case.family),
            "## By base",
            _of_group(outcomes, lambda o: o.case.base, BASES),
            "## By motion",
            _of_group(outcomes, lambda o: str(o.result.tests["kind"])),
            "## By current",
            _of_group(outcomes, lambda o: str(o.result.tests.get("current", ""))),
            "## Planted in real records: named, value within 25 %",
            planted(outcomes),
            "## Real records as they are",
            real(outcomes),
            "## Demands not met",
            failures(outcomes) + "\n",
        )
    )
