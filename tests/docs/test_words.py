"""Pages, docstrings, comments and messages have the standard terms of the field, see ``words.toml``."""

import re
import tomllib
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.docs.pages import PAGES

WORDS: dict[str, str] = tomllib.loads((Path(__file__).parent / "words.toml").read_text(encoding="utf-8"))
# what benchmarks wrote is not rewritten by hand
CODE = sorted(p for p in (ROOT / "mrfit").rglob("*") if p.suffix in (".py", ".jinja"))
FILES = [*(p for p in PAGES if p.parent.name != "benchmarks"), *CODE, *(ROOT / "pipelines").glob("*.toml")]


def private_words(text: str) -> list[str]:
    """Return where a text has a private word, with the term for it."""
    one_line = re.sub(r"\s+(?:# )?", " ", text)
    return [
        f"'{found[0]}' -> {term}"
        for word, term in WORDS.items()
        for found in re.finditer(word, one_line, re.IGNORECASE)
    ]


def test_no_private_words() -> None:
    found = {str(p.relative_to(ROOT)): words for p in FILES if (words := private_words(p.read_text(encoding="utf-8")))}
    assert not found


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("of every so-manieth sample", 1),
        ("What a fit came\n    # to, in fit.json", 1),
        ("the residual Goes\nwith velocity", 1),
        ("the residual is correlated with velocity at every n-th sample", 0),
        ("a chair", 0),
    ],
)
def test_a_private_word_is_found_across_lines(text: str, count: int) -> None:
    assert len(private_words(text)) == count
