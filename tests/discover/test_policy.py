"""Every number that decides in a discovery stands in one table, which says what it means and what set it."""

import ast
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import mrfit.discover
from mrfit.discover.policy import SECTIONS, Policy

ROOM = Path(mrfit.discover.__path__[0])
FORMS = {0, 1, 2, 3, 0.5, 100, 1000}
"""Numbers that are part of an equation, a form or a unit."""
LEVELS = "TRAVEL, TIME, FULL = (2, 3, 4)"
ROUNDING = 1e-8
"""Smaller ones only keep a division from zero."""


def modules() -> Iterator[tuple[str, ast.Module]]:
    for path in sorted(ROOM.rglob("*.py")):
        yield path.name, ast.parse(path.read_text(encoding="utf-8"))


def loose_numbers(tree: ast.AST) -> Iterator[float]:
    """Yield the numbers of a module that are no form and no guard against a division by zero."""
    levels = {c for n in ast.walk(tree) if isinstance(n, ast.Assign) and ast.unparse(n) == LEVELS for c in ast.walk(n)}
    for node in set(ast.walk(tree)) - levels:
        if isinstance(node, ast.Constant) and type(node.value) in (int, float):
            if node.value not in FORMS and not 0 < node.value < ROUNDING:
                yield node.value


def thresholds_read(tree: ast.AST, of: tuple[str, ...] = ("policy", "STANDARD")) -> Iterator[str]:
    """Yield the names of the thresholds that a module reads."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and ast.unparse(node.value).split(".")[-1].strip("_") in of:
            yield node.attr


def test_no_number_that_decides_stands_outside_of_the_table() -> None:
    assert {name: found for name, tree in modules() if (found := list(loose_numbers(tree)))} == {}
    assert set(loose_numbers(ast.parse("FEWEST = 5\nfar = x > 0.02 * y + 1e-300"))) == {5, 0.02}


def test_what_is_read_is_in_the_table_and_what_is_in_the_table_is_read() -> None:
    read = {attribute for _, tree in modules() for attribute in thresholds_read(tree)}
    assert read == {f.name for f in fields(Policy)}


def test_one_name_has_one_meaning_and_says_what_set_it() -> None:
    rows = [(name, own) for section in SECTIONS.values() for name, own in section.items()]
    assert len({name for name, _ in rows}) == len(rows) == len({own.meaning for _, own in rows})
    assert all(own.meaning and own.what_set_it for _, own in rows)
