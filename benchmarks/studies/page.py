"""A study's tables, published and reproduced side by side, as a file of results and as a page."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from statistics import median
from typing import Any

RESULTS = Path(__file__).parent / "results"
KINDS = {
    "ordering": "orderings and ratios",
    "number": "numbers",
    "recovered": "recovered",
    "": "without comparison",
}
# A check brings a row nearer where it leaves less than this share of its distance
NEARER = 0.8
Values = Sequence[float | None]


@dataclass(frozen=True)
class Rule:
    """What counts as agreement: its name on the page, and the rule on what is published and what is reproduced."""

    name: str
    holds: Callable[[Values, Values], bool]


def within(share: float, of: str = "") -> Rule:
    """Return the rule that every printed number is met within a share of it."""
    return Rule(
        f"within {100 * share:g} %{of}",
        lambda paper, own: all(
            p is None or (o is not None and abs(o - p) <= share * abs(p)) for p, o in zip(paper, own, strict=True)
        ),
    )


AT_MOST = Rule("one-sided: at most what is printed", lambda paper, own: (own[0] or 0.0) <= (paper[0] or 0.0))


@dataclass(frozen=True)
class Outcome:
    """What a check made of a row: the check's number from 1, and the row's numbers or words under it."""

    check: int
    reproduced: list[float | None]
    words: tuple[str, str] | None
    agrees: bool


@dataclass(frozen=True)
class Row:
    """One comparison.

    Attributes
    ----------
    of
        What is compared, as ``5 Hz, 3 A``.
    published, reproduced
        Numbers as printed and as computed; None where there is none.
    agrees
        Whether they agree by the rule; None where nothing is compared.
    kind
        ``ordering`` or ratio, ``number`` (the rig was not given it), ``recovered`` (it was); empty without comparison.
    rule
        Name of the rule.
    words
        What stands in the page in place of the numbers, for claims in words.
    rigs
        Whether it agrees on each other rig; None on one that does not run it.
    under
        What the checks made of it.
    """

    of: str
    published: list[float | None]
    reproduced: list[float | None]
    agrees: bool | None = None
    kind: str = ""
    rule: str = ""
    words: tuple[str, str] | None = None
    rigs: list[bool | None] = field(default_factory=list)
    under: list[Outcome] = field(default_factory=list)


@dataclass(frozen=True)
class Table:
    """A table of the paper beside its own.

    Attributes
    ----------
    title, source
        What it shows, and the table or figure of the paper.
    of
        Heading of the first column.
    columns
        Names of the numbers of a row.
    rows
        Its rows.
    note
        What else has to be said.
    """

    title: str
    source: str
    of: str
    columns: list[str]
    rows: list[Row]
    note: str = ""


@dataclass(frozen=True)
class Study:
    """A paper's study.

    Attributes
    ----------
    name, title
        Name, as in ``make studies``, and heading.
    paper
        Whom to cite.
    logs
        Where the logs are from.
    commands
        What was run.
    tables
        Published and reproduced, side by side.
    findings
        What the study found beyond the tables, in words.
    missing
        What of the paper was not reproduced, and why.
    figures
        File names under docs/studies and captions.
    rigs
        What each other rig draws of what the paper leaves open.
    checks
        What each check varied.
    """

    name: str
    title: str
    paper: str
    logs: str
    commands: list[str]
    tables: list[Table]
    findings: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    figures: list[tuple[str, str]] = field(default_factory=list)
    rigs: list[str] = field(default_factory=list)
    checks: list[str] = field(default_factory=list)

    def save(self, folder: Path = RESULTS) -> None:
        """Write the results, numbers in four digits."""
        folder.mkdir(parents=True, exist_ok=True)
        text = json.dumps(_rounded(asdict(self)), indent=1, ensure_ascii=False)
        (folder / f"{self.name}.json").write_text(text + "\n", encoding="utf-8")

    def table(self, source: str) -> Table:
        """Return the table of a source."""
        return next(t for t in self.tables if t.source == source)

    def compared(self, kind: str) -> list[Row]:
        """Return the rows of a kind."""
        return [r for t in self.tables for r in t.rows if r.kind == kind]

    def agreeing(self, kind: str) -> list[int]:
        """Return how many rows of a kind agree on each rig; a row that a rig does not run counts as on the first."""

        def on(rig: int, row: Row) -> bool:
            other = row.rigs[rig - 1] if rig and row.rigs else None
            return bool(row.agrees if other is None else other)

        return [sum(on(k, row) for row in self.compared(kind)) for k in range(1 + len(self.rigs))]

    def beside(self, rigs: Mapping[str, list[Table]], checks: Mapping[str, list[Table]]) -> "Study":
        """Return the study with what other rigs and checks made of its rows."""
        others = [_by_place(tables) for tables in rigs.values()]
        outcomes = [_by_place(tables) for tables in checks.values()]

        def joined(source: str, row: Row) -> Row:
            if row.agrees is None:
                return row
            at = (source, row.of)
            under = [
                Outcome(k, r.reproduced, r.words, bool(r.agrees))
                for k, o in enumerate(outcomes, 1)
                if not row.agrees and (r := o.get(at))
            ]
            return replace(row, rigs=[bool(o[at].agrees) if at in o else None for o in others], under=under)

        return self._joined(joined, list(rigs), list(checks))

    def with_outcomes_of(self, before: "Study") -> "Study":
        """Return the study with the rigs and checks of an earlier run of it."""
        known = _by_place(before.tables)

        def joined(source: str, row: Row) -> Row:
            old = known.get((source, row.of))
            return replace(row, rigs=old.rigs, under=old.under) if old and old.agrees == row.agrees else row

        return self._joined(joined, before.rigs, before.checks)

    def _joined(self, joined: Callable[[str, Row], Row], rigs: list[str], checks: list[str]) -> "Study":
        tables = [replace(t, rows=[joined(t.source, r) for r in t.rows]) for t in self.tables]
        return replace(self, tables=tables, rigs=rigs, checks=checks)


def _by_place(tables: Sequence[Table]) -> dict[tuple[str, str], Row]:
    return {(t.source, r.of): r for t in tables for r in t.rows}


def load(name: str, folder: Path = RESULTS) -> Study:
    """Return a study from its file of results."""
    raw = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
    tables = [Table(**{**t, "rows": [_row(r) for r in t["rows"]]}) for t in raw["tables"]]
    return Study(**{**raw, "tables": tables, "figures": [(a, b) for a, b in raw["figures"]]})


def _row(raw: dict[str, Any]) -> Row:
    under = [Outcome(**{**o, "words": o["words"] and tuple(o["words"])}) for o in raw["under"]]
    return Row(**{**raw, "words": raw["words"] and tuple(raw["words"]), "under": under})


def _rounded(value: object) -> object:
    if isinstance(value, float):
        return float(f"{value:.4g}") if math.isfinite(value) else None
    if isinstance(value, dict):
        return {k: _rounded(v) for k, v in value.items()}
    return [_rounded(v) for v in value] if isinstance(value, list | tuple) else value


def compare(of: str, published: list[float | None], reproduced: list[float | None], rule: Rule, kind: str) -> Row:
    """Return a row whose numbers are compared by a rule."""
    return Row(of, published, reproduced, bool(rule.holds(published, reproduced)), kind, rule.name)


def claim(of: str, published: str, reproduced: str, holds: bool, kind: str = "ordering", rule: str = "") -> Row:
    """Return a row that compares two statements in words."""
    return Row(of, [], [], bool(holds), kind, rule or "the same holds", (published, reproduced))


def number(value: float | None) -> str:
    """Return a number in four digits, a dash for none."""
    return "–" if value is None else f"{value:.4g}"


def distance(published: Values, reproduced: Values) -> float:
    """Return the greatest distance of two lists of numbers, each over the printed number; infinite for words."""
    pairs = [(p, o) for p, o in zip(published, reproduced, strict=True) if p is not None]
    apart = [abs(o - p) / abs(p or 1.0) if o is not None else math.inf for p, o in pairs]
    return max(apart, default=math.inf)


def reason(row: Row) -> str:
    """Return what the checks made of a row that differs: the one that brings it nearest, by number."""
    apart = distance(row.published, row.reproduced)
    gap = {id(o): distance(row.published, o.reproduced) for o in row.under}
    best = min(row.under, key=lambda o: (not o.agrees, gap[id(o)]), default=None)
    if best is None:
        return "no check"
    shown = best.words[1] if best.words else ", ".join(number(v) for v in best.reproduced)
    if best.agrees:
        return f"agrees under check {best.check}: {shown}"
    if gap[id(best)] < NEARER * apart:
        return f"nearer under check {best.check}: {shown}"
    return f"open: the nearest of {len(row.under)}, check {best.check}, gives {shown}"


def verdict(row: Row, study: Study) -> str:
    """Return the last cell of a row."""
    if row.agrees is None:
        return ""
    rigs = [bool(one) for one in (row.agrees, *row.rigs) if one is not None]
    on = f", on {sum(rigs)} of {len(rigs)} rigs" if row.rigs and sum(rigs) not in (0, len(rigs)) else ""
    return f"agrees{on}" if row.agrees else f"differs{on}; {reason(row)}"


def share(study: Study, kind: str) -> str:
    """Return how many rows of a kind agree, the median over the rigs."""
    return f"{median(study.agreeing(kind)):g} of {len(study.compared(kind))}"


def counts(studies: Sequence[Study], link: Callable[[Study], str]) -> list[str]:
    """Return the table of rows by kind, study by study, with their sums."""
    lines = ["| study | " + " | ".join(KINDS.values()) + " |", "|---" * (1 + len(KINDS)) + "|"]
    for study in studies:
        cells = [share(study, k) if k else f"{len(study.compared(k))}" for k in KINDS]
        lines.append(f"| {link(study)} | " + " | ".join(cells) + " |")
    return lines


def headline(studies: Sequence[Study]) -> str:
    """Return the rows of kind ordering and number that agree, on the median rig."""
    said = []
    for kind in ("ordering", "number"):
        agree = sum(median(s.agreeing(kind)) for s in studies)
        whole = sum(len(s.compared(kind)) for s in studies)
        said.append(f"{agree:g} of {whole} {KINDS[kind]}")
    return " and ".join(said)


def markdown(studies: Sequence[Study]) -> str:
    """Return the page."""
    lines = [
        "# The papers as studies",
        "",
        f"**{headline(studies)} agree.**",
        "",
        "`make studies` runs every study and writes this page; `make studies-long` adds what takes longer: Fig. 12 of "
        "the rotary-stiffness paper at all its points, and discovery on real dampers. The measurements of the "
        "papers are not public: the logs are made by rigs of this project's own (`datasets/studies`), built to each "
        "paper's set-up. Published numbers: `benchmarks/studies/published`. Reproduced numbers: the commands named.",
        "",
        "A row is an ordering or ratio, a number that the rig was not given, or a number that it was given and that is "
        "recovered; the headline counts the first two. Every table names the rule by which its rows agree. Counts are "
        "those of the median rig, where a study has several: they differ in what the paper leaves open. A row that "
        "differs names the check that brings it nearest. A check varies one thing and runs the study again "
        "(`make studies-checks`).",
        "",
        *counts(studies, lambda s: f"[{s.name}](#{s.name})"),
    ]
    for study in studies:
        lines += ["", *_section(study)]
    return "\n".join(lines) + "\n"


def _section(study: Study) -> list[str]:
    lines = [f"## {study.name}", "", f"{study.title}. {study.paper}.", "", study.logs, ""]
    lines += ["```", *study.commands, "```"]
    if study.rigs:
        lines += ["", "Other rigs: " + "; ".join(study.rigs) + "."]
    for table in sorted(study.tables, key=_first_kind):
        lines += ["", f"### {table.title} ({table.source})", ""]
        rules = dict.fromkeys(f"{r.rule} ({r.kind})" for r in table.rows if r.kind)
        lines += ["Agreement: " + "; ".join(rules) + ".", ""] if rules else []
        lines += [table.note, ""] if table.note else []
        lines += _rows(table, study)
    lines += _checks(study)
    for name, caption in study.figures:
        lines += ["", f"![{caption}](studies/{name})", "", caption]
    if study.findings:
        lines += ["", "Found:", "", *(f"- {f}" for f in study.findings)]
    if study.missing:
        lines += ["", "Not reproduced:", "", *(f"- {m}" for m in study.missing)]
    return lines


def _first_kind(table: Table) -> int:
    """Return the place of a table on the page: orderings lead, then numbers."""
    return min(list(KINDS).index(r.kind) for r in table.rows)


def _checks(study: Study) -> list[str]:
    if not study.checks:
        return []
    lines = ["", "### Checks", ""]
    lines += ["| check | varied | rows that differ | agree under it | come nearer |", "|---|---|---|---|---|"]
    rows = [r for t in study.tables for r in t.rows]
    for place, varied in enumerate(study.checks, 1):
        pairs = [(r, o) for r in rows for o in r.under if o.check == place]
        agree = sum(o.agrees for _, o in pairs)
        nearer = sum(
            distance(r.published, o.reproduced) < NEARER * distance(r.published, r.reproduced)
            for r, o in pairs
            if not o.agrees
        )
        lines.append(f"| {place} | {varied} | {len(pairs)} | {agree} | {nearer} |")
    return lines


def _rows(table: Table, study: Study) -> list[str]:
    worded = any(r.words for r in table.rows)
    names = [""] if worded else table.columns
    said = any(r.agrees is not None for r in table.rows)
    printed = worded or any(r.published for r in table.rows)
    sides = ("published ", "reproduced ") if printed else ("",)
    heads = [(side + n).strip() for side in sides for n in names]
    head = [table.of, *heads, *["agrees / differs"] * said]
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for row in table.rows:
        cells = list(row.words) if row.words else [number(v) for v in (*row.published, *row.reproduced)]
        lines.append("| " + " | ".join([row.of, *cells, *[verdict(row, study)] * said]) + " |")
    return lines
