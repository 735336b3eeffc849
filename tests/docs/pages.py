"""What is written in the project's pages: links, commands and blocks of code."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

from tests.conftest import ROOT

PAGES = sorted(
    p
    for p in [*ROOT.glob("*.md"), ROOT / "datasets" / "README.md", *(ROOT / "docs").rglob("*.md")]
    if not {"generated", "build"} & {*p.relative_to(ROOT).parts}
)
FENCE = re.compile(r"^(```+)(.*?)\n(.*?)^\1\s*$", re.MULTILINE | re.DOTALL)


def text_of(page: Path) -> str:
    """Return a page's text."""
    return page.read_text(encoding="utf-8")


def prose(page: Path) -> str:
    """Return a page without its blocks of code."""
    return FENCE.sub("", text_of(page))


def blocks(page: Path, *languages: str) -> Iterator[str]:
    """Yield the fenced blocks in one of some languages; cells of notebooks are ``{code-cell}``."""
    for _, head, body in FENCE.findall(text_of(page)):
        if head.split(" ")[0].strip() in languages:
            yield re.sub(r"^:\w+:.*\n", "", body, flags=re.MULTILINE)


def commands(page: Path) -> Iterator[list[str]]:
    """Yield the mrfit commands that a page shows, split into words, without the name of the program."""
    shown = "\n".join(body for _, _, body in FENCE.findall(text_of(page)))
    indented = "\n".join(re.findall(r"^    (.*)$", prose(page), re.MULTILINE))
    lines = [line.strip().removeprefix("$ ") for line in re.sub(r"\\\n\s*", " ", f"{shown}\n{indented}").split("\n")]
    for line in [*lines, *re.findall(r"`(mrfit [^`]+)`", prose(page))]:
        if line.startswith("mrfit "):
            yield shlex.split(re.split(r"\s+#\s|\s[|>]\s", line)[0])[1:]


def anchors(page: Path) -> set[str]:
    """Return the anchors of a page's headings, as Markdown makes them."""
    heads = re.findall(r"^#+ (.+)$", prose(page), re.MULTILINE)
    slugs = {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in heads}
    return slugs | set(re.findall(r"^\(([\w-]+)\)=$", text_of(page), re.MULTILINE))
