"""The page of results, of the files that benchmarks and studies leave: ``python -m docs.reference.results``.

Of every page in ``docs/benchmarks`` it has the title, what stands before the first table, and that table's first rows.
Nothing on it is typed by hand; a test compares the page with what is made of the files.
"""

import ast
from pathlib import Path

from benchmarks.studies.page import counts, headline, load

DOCS = Path(__file__).parents[1]
BENCHMARKS = DOCS.parent / "benchmarks"
PAGE = DOCS / "results.md"
ROWS = 12
"""Rows of a table that are shown; its page has the others."""
SHARED = {"__main__", "campaign", "command", "current_laws", "noise_floor_cases", "planted", "scale_logs"}
"""Modules of benchmarks that measure nothing by themselves."""


def page() -> str:
    """Return the page."""
    written = sorted(p for p in (DOCS / "benchmarks").glob("*.md") if p.stem != "index")
    parts = [
        "# Results",
        "Every number on this page comes from a file that a program wrote: `python -m docs.reference.results` makes "
        "the page of the [benchmarks](benchmarks/index.md) and the results of the [studies](studies.md). Times were "
        "measured on two cores.",
        studies(),
        *(section(path) for path in written),
        others([path.stem for path in written]),
    ]
    return "\n\n".join(parts) + "\n"


def section(path: Path) -> str:
    """Return a benchmark's title, its words and the beginning of its first table."""
    lines = path.read_text(encoding="utf-8").splitlines()
    begin = next(k for k, line in enumerate(lines) if line.startswith("|"))
    end = next((k for k in range(begin, len(lines)) if not lines[k].startswith("|")), len(lines))
    words = [line for line in lines[1:begin] if not line.startswith("#")]
    table = lines[begin:end]
    left = len(table) - 2 - ROWS
    more = f"{left} more rows, and what else was measured" if left > 0 else "What else was measured"
    head = f"## {lines[0].removeprefix('# ')}"
    link = f"{more}: [benchmarks/{path.name}](benchmarks/{path.name})."
    # a link of the benchmark's folder is seen from that above
    said = "\n".join(words).strip().replace("](../", "](")
    return "\n\n".join([head, said, "\n".join(table[: ROWS + 2]), link])


def studies() -> str:
    """Return how many orderings and numbers agree with those published, study by study."""
    paths = sorted((BENCHMARKS / "studies" / "results").glob("*.json"))
    found = [load(path.stem) for path in paths]
    table = counts(found, lambda study: f"[{study.title}](studies.md#{study.name})")
    return "\n\n".join(["## The papers as studies", f"{headline(found)} agree.", "\n".join(table)])


def others(written: list[str]) -> str:
    """Return the programs whose tables are printed and not kept, with the first sentence of each."""
    lines = []
    for path in sorted(BENCHMARKS.glob("*.py")):
        said = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
        if path.stem not in (*written, *SHARED):
            first = said.splitlines()[0].partition(": ``")[0].rstrip(".")
            lines.append(f"- `python -m benchmarks.{path.stem}`: {first}.")
    return "\n\n".join(["## Programs that print their tables", "\n".join(lines)])


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
