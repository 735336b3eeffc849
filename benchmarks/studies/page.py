"""A study's tables, published and reproduced side by side, as a file of results and as a page."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

RESULTS = Path(__file__).parent / "results"
AGREES = "agrees"


@dataclass(frozen=True)
class Row:
    """One comparison.

    Attributes
    ----------
    of
        What is compared, as ``5 Hz, 3 A``.
    published, reproduced
        Numbers as printed and as computed; None where there is none.
    verdict
        ``agrees``, or ``differs:`` and why; empty where nothing can be compared.
    words
        What stands in the page in place of the numbers, for claims in words.
    """

    of: str
    published: list[float | None]
    reproduced: list[float | None]
    verdict: str = ""
    words: tuple[str, str] | None = None


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
        What counts as agreement, and what else has to be said.
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

    def save(self, folder: Path = RESULTS) -> None:
        """Write the results, numbers in four digits."""
        folder.mkdir(parents=True, exist_ok=True)
        text = json.dumps(_rounded(asdict(self)), indent=1, ensure_ascii=False)
        (folder / f"{self.name}.json").write_text(text + "\n", encoding="utf-8")

    def table(self, source: str) -> Table:
        """Return the table of a source."""
        return next(t for t in self.tables if t.source == source)


def load(name: str, folder: Path = RESULTS) -> Study:
    """Return a study from its file of results."""
    raw = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
    tables = [
        Table(**{**t, "rows": [Row(**{**r, "words": r["words"] and tuple(r["words"])}) for r in t["rows"]]})
        for t in raw["tables"]
    ]
    return Study(**{**raw, "tables": tables, "figures": [(a, b) for a, b in raw["figures"]]})


def _rounded(value: object) -> object:
    if isinstance(value, float):
        return float(f"{value:.4g}") if math.isfinite(value) else None
    if isinstance(value, dict):
        return {k: _rounded(v) for k, v in value.items()}
    return [_rounded(v) for v in value] if isinstance(value, list | tuple) else value


def near(published: float, reproduced: float, share: float, because: str) -> str:
    """Return ``agrees`` where two numbers differ by at most a share of the published one, else why they do not."""
    return AGREES if abs(reproduced - published) <= share * abs(published) else f"differs: {because}"


def claim(of: str, published: str, reproduced: str, holds: bool, because: str = "") -> Row:
    """Return a row that compares two statements in words."""
    return Row(of, [], [], AGREES if holds else f"differs: {because}", (published, reproduced))


def number(value: float | None) -> str:
    """Return a number in four digits, a dash for none."""
    return "–" if value is None else f"{value:.4g}"


def markdown(studies: Sequence[Study]) -> str:
    """Return the page."""
    lines = [
        "# The papers as studies",
        "",
        "`make studies` runs every study and writes this page; `make studies-long` adds what takes longer: Fig. 12 of "
        "the rotary-stiffness paper at all its points, and discovery on two real dampers. The measurements of the "
        "papers are not public: the logs are made by rigs of this project's own (`datasets/studies`), built to each "
        "paper's set-up. No rig is the authors' device, so orderings, ratios and findings can be compared; absolute "
        "numbers only where the rig was given them. Published numbers: `benchmarks/studies/published`. Reproduced "
        "numbers: the commands named.",
        "",
        "| study | paper | comparisons that agree |",
        "|---|---|---|",
    ]
    for study in studies:
        verdicts = [r.verdict for t in study.tables for r in t.rows if r.verdict]
        agree = sum(v == AGREES for v in verdicts)
        lines.append(f"| [{study.name}](#{study.name}) | {study.paper} | {agree} of {len(verdicts)} |")
    for study in studies:
        lines += ["", *_section(study)]
    return "\n".join(lines) + "\n"


def _section(study: Study) -> list[str]:
    lines = [f"## {study.name}", "", f"{study.title}. {study.paper}.", "", study.logs, ""]
    lines += ["```", *study.commands, "```"]
    for table in study.tables:
        lines += ["", f"### {table.title} ({table.source})", ""]
        lines += [table.note, ""] if table.note else []
        lines += _rows(table)
    for name, caption in study.figures:
        lines += ["", f"![{caption}](studies/{name})", "", caption]
    if study.findings:
        lines += ["", "Found:", "", *(f"- {f}" for f in study.findings)]
    if study.missing:
        lines += ["", "Not reproduced:", "", *(f"- {m}" for m in study.missing)]
    return lines


def _rows(table: Table) -> list[str]:
    worded = any(r.words for r in table.rows)
    names = [""] if worded else table.columns
    said = any(r.verdict for r in table.rows)
    printed = worded or any(r.published for r in table.rows)
    sides = ("published ", "reproduced ") if printed else ("",)
    head = [table.of, *((side + n).strip() for side in sides for n in names), *["agrees / differs because"] * said]
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for row in table.rows:
        cells = list(row.words) if row.words else [number(v) for v in (*row.published, *row.reproduced)]
        lines.append("| " + " | ".join([row.of, *cells, *[row.verdict] * said]) + " |")
    return lines
