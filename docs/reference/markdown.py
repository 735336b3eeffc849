"""Markdown from plain text: what means something to Markdown is shown and not obeyed."""

import inspect
import re
from collections.abc import Iterable, Sequence

SPECIAL = re.compile(r"([\\*_\[\]<>$^~|#])")


def plain(text: str) -> str:
    """Return a paragraph as it is written, with ``literal`` parts as code."""
    parts = re.split(r"``(.+?)``", text)
    return "".join(f"`{p}`" if k % 2 else SPECIAL.sub(r"\\\1", p) for k, p in enumerate(parts))


def table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of cells that are Markdown already."""
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def fenced(text: str, language: str = "text") -> str:
    """Return a block that is shown as it is."""
    return f"```{language}\n{text}\n```"


def documented(text: str) -> str:
    """Return a docstring as Markdown: paragraphs, and what is indented as blocks."""
    blocks = re.split(r"\n\s*\n", inspect.cleandoc(text))
    return "\n\n".join(fenced(inspect.cleandoc(b)) if b.startswith("    ") else _paragraph(b) for b in blocks)


def _paragraph(block: str) -> str:
    if block.startswith("- "):
        items = re.split(r"\n- ", "\n" + block)[1:]
        return "\n".join("- " + plain(" ".join(i.split())) for i in items)
    return plain(" ".join(block.split()))
