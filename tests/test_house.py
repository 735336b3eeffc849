"""Names and sentences of the code are what they are said to be: each count of ``house.py`` has a ceiling."""

import ast

import pytest

from tests import house

CEILINGS = {
    "repeated classes": 5,
    "participles": 0,
    "ambiguous constants": 2,
    "relative clauses": 133,
    "climbing imports": 0,
    "cycles": 0,
    "many arguments": 5,
}


@pytest.mark.parametrize("figure", house.LISTS)
def test_no_figure_rises_above_its_ceiling(figure: str) -> None:
    places = house.LISTS[figure]()
    told = "\n".join(f"{p}:{line}: {text}" for p, line, text in places)
    assert len(places) <= CEILINGS[figure], f"what is new among these breaks 'Rules' of CONTRIBUTING.md:\n{told}"


@pytest.mark.parametrize(
    ("sentence", "clause"),
    [
        ("What a fit is.", True),
        ("Return what a fit is.", True),
        ("Where it lies.", True),
        ("Return whether it converged.", False),
        ("Whether it converged.", False),
        ("Return the cost of a point.", False),
        ("Whatever it is, it is refused.", True),
    ],
)
def test_a_docstring_that_opens_with_a_clause_is_seen(sentence: str, clause: bool) -> None:
    tree = ast.parse(f'def f():\n    """{sentence}"""\n')
    assert [text for _, text in house.relative_clauses(tree)] == [sentence] * clause


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("Told", True),
        ("_Tried", True),
        ("Recording", False),
        ("Straightened", True),
        ("Setting", False),
        ("FittedRival", False),
        ("Cube", False),
    ],
)
def test_a_bare_participle_is_seen(name: str, expected: bool) -> None:
    assert house.is_participle(name) is expected


def test_constants_are_read_from_tuples_and_annotations() -> None:
    tree = ast.parse("A, B = 1, 2\nC: int = 3\n_D = 4\ne = 5\n")
    assert [(name, value) for _, name, value in house.constants(tree)] == [("A", "1"), ("B", "2"), ("C", "3")]


def test_code_lines_leave_out_comments_blank_lines_and_docstrings() -> None:
    text = (
        '"""Of it."""\n\n# a comment\nx = (\n    1,\n)  # why\n\n\ndef f():\n    """Return 1.\n\n    More.\n    """\n'
    )
    assert house.code_lines(text) == 4
