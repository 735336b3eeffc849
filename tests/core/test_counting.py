"""Numbers of things: one of them has no plural, wherever a message or page counts what may be one."""

import ast
import re
from pathlib import Path

import pytest

import mrfit
from mrfit.core.counting import number_of

PACKAGE = Path(mrfit.__path__[0])
ROOMS = ("api", "batch", "cli", "compare", "drift", "report", "segment", "sheet")
"""Rooms that count what a user gave."""
THINGS = (
    r" (more |held-out )?(conditions|cycles|drifts|files|fits|logs|outliers|recordings|rows|segments|tests|units)\b"
)
AMONG = re.compile(r"([Oo]f|all|least|first|worst|and) $")
"""Words before a number that is not one, as there are others beside those spoken of."""


def miscounted(tree: ast.AST) -> list[str]:
    """Return what stands between braces before a plural."""
    found = []
    for text in ast.walk(tree):
        if not isinstance(text, ast.JoinedStr):
            continue
        for place, (part, after) in enumerate(zip(text.values, text.values[1:], strict=False)):
            before = text.values[place - 1] if place else None
            among = isinstance(before, ast.Constant) and AMONG.search(str(before.value))
            plural = isinstance(after, ast.Constant) and re.match(THINGS, str(after.value))
            if isinstance(part, ast.FormattedValue) and plural and not among and not ast.unparse(part.value).isupper():
                found.append(ast.unparse(part.value))
    return found


def test_one_thing_is_no_several() -> None:
    assert (number_of("log", 1), number_of("log", 2), number_of("log", 0)) == ("1 log", "2 logs", "0 logs")


@pytest.mark.parametrize(
    ("source", "names"),
    [
        ('f"{n} conditions"', ["n"]),
        ('f"{left} more rows"', ["left"]),
        ('f"3 of {n} conditions"', []),
        ('f"{FEWEST} logs"', []),
    ],
)
def test_a_plural_after_any_number_is_seen(source: str, names: list[str]) -> None:
    assert miscounted(ast.parse(source)) == names


@pytest.mark.parametrize("room", ROOMS)
def test_no_message_counts_one_as_several(room: str) -> None:
    for path in sorted((PACKAGE / room).rglob("*.py")):
        assert not miscounted(ast.parse(path.read_text(encoding="utf-8"))), path.name
