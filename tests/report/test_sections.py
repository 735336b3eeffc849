"""A page of sections: what is left out, folded and unfolded, which columns are numbers, and that text stays text."""

from typing import Any

import pytest
from markupsafe import Markup

from mrfit.report.sections import Section, SectionFigure, Table, cell, exact, render
from tests.report.test_page import Page

HOSTILE = '<script>alert("x")</script> & <b>'


def table(caption: str, heads: tuple[str, ...], rows: Any, **given: Any) -> Table:
    return Table(caption, heads, rows, **{"name": "t", **given})


def page(*sections: Section, **given: Any) -> str:
    text = render("Title", "Lead", given.pop("facts", ()), sections, "all.json", **given)
    parsed = Page(text)
    assert not parsed.open and not parsed.unbalanced
    return text


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (None, "–"),
        (True, "yes"),
        (False, "no"),
        (12345, "12345"),
        (0.012345, "0.0123"),
        (1.5e-7, "1.50×10⁻⁷"),
        (-2.0, "−2.00"),
        (float("nan"), "–"),
        ("text", "text"),
        (("a", 1), "('a', 1)"),
    ],
)
def test_a_cell(value: object, shown: str) -> None:
    assert cell(value) == shown


def test_a_cell_has_as_many_digits_as_its_table() -> None:
    assert table("", ("a",), [[0.0123456]], digits=5).cells == [["0.012346"]]


def test_a_column_is_of_numbers_where_one_stands_in_it_as_such_or_as_text() -> None:
    rows = [
        ["a", 1, "1.5 kN", "−3×10⁻⁵", True, exact(0.5, "0.5"), "1 of 2 tests", ""],
        ["b", None, "–", "", 1, "", "", ""],
    ]
    found = Table("", ("name", "n", "force", "small", "flag", "exact", "words", "none"), rows)
    assert found.numeric == [False, True, True, True, True, True, False, False]


def test_what_is_exact_stands_in_the_source_and_what_is_not_known_is_its_text() -> None:
    assert exact(0.123456789, "1.2e-1") == Markup('<data value="0.123456789">1.2×10⁻¹</data>')
    assert exact(None, "<a>") == "&lt;a&gt;"


def test_a_section_with_nothing_in_it_is_left_out_and_so_is_a_table_without_rows() -> None:
    empty = Table("empty table", ("a",), [])
    text = page(Section("Bare"), Section("Hollow", tables=[empty]), Section("Said", ["words"], [empty]))
    assert "Bare" not in text and "Hollow" not in text and "empty table" not in text
    assert text.count("<section") == 1 and 'href="#s1">Said' in text and "<p>words</p>" in text


def test_long_tables_unfold_and_short_ones_do_not() -> None:
    rows = [[f"r{k}", k] for k in range(5)]
    text = page(Section("A", tables=[table("Rows", ("name", "n"), rows, first=3, best=(4,))]))
    assert "<summary>2 more rows</summary>" in text and "Rows, continued" in text
    assert text.index("r2") < text.index("<summary>") < text.index("r3")
    assert text.count('<tr class="best">') == 1 and text.index('<tr class="best">') > text.index("r3")
    assert "<details>" not in page(Section("A", tables=[table("Rows", ("name", "n"), rows, first=5)]))


def test_a_folded_section_shows_its_tables_on_demand() -> None:
    text = page(Section("A", tables=[table("Rows", ("n",), [[1]], name="own")], folded=True))
    assert "<details><summary>Rows</summary>" in text and '<table class="own">' in text


def test_verdicts_have_their_class_and_points_their_list() -> None:
    rows = [["a", "pass"], ["b", "fail"], ["c", "cannot be judged"], ["d", "other"]]
    text = page(Section("A", tables=[table("", ("unit", "verdict"), rows)], points=["one", "two"]))
    for name in ("pass", "fail", "open"):
        assert text.count(f'<td class="{name}"') == 1
    assert "<ul><li>one</li><li>two</li></ul>" in text


def test_text_is_text_and_a_drawing_is_a_drawing() -> None:
    drawn = SectionFigure(HOSTILE, HOSTILE, "<svg></svg>", narrow=True)
    cells = table(HOSTILE, (HOSTILE,), [[HOSTILE]])
    text = page(Section(HOSTILE, [HOSTILE], [cells], [drawn], points=[HOSTILE]), facts=[(HOSTILE, HOSTILE)])
    assert "<script>" not in text and "<b>" not in text and '<div class="wide"><svg></svg></div>' in text
    assert '<figure class="narrow">' in text and "<script>" in page(Section("A", ["x"]), script="let a = 1;")


def test_the_file_with_all_numbers_is_named() -> None:
    assert "numbers: all.json</footer>" in page(Section("A", ["x"]))
