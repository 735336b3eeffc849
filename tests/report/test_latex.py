"""Tables for LaTeX: digits of values with their uncertainty, and parts that fit a column or a page."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.report.latex import (
    COLUMN,
    EMPTY,
    GAP,
    LONGEST_CELL,
    PAGE,
    TEXT_WIDTHS,
    Cell,
    Table,
    number,
    tables_tex,
    with_uncertainty,
    words,
)

VALUE = re.compile(r"\\mrfitvalue\{(.*?)\}\{(.*?)\}\{(.*?)\}\{(.*?)\}")
APART = re.compile(r"\$(.*?)\^\{\+(.*?)\}_\{-(.*?)\}(?:\\times10\^\{(.*?)\})?\$")


def scaled(text: str, power: str | None) -> float:
    return float(text) * 10.0 ** int(power or 0)


@given(st.floats(1e-9, 1e9), st.floats(1e-4, 0.9), st.sampled_from([1.0, -1.0]))
def test_a_value_stands_with_half_of_its_interval_to_the_digit_at_which_that_has_two(
    size: float, share: float, sign: float
) -> None:
    value, half = sign * size, share * size
    match = VALUE.fullmatch(with_uncertainty(value, value - half, value + half).latex)
    assert match is not None
    mantissa, uncertain, plain, power = match.groups()
    last = scaled(f"1e-{len(mantissa.partition('.')[2])}", power)
    assert scaled(mantissa, power) == pytest.approx(value, abs=0.5001 * last)
    assert scaled(plain, power) == pytest.approx(half, abs=0.5001 * last)
    # siunitx counts the digits in brackets from the last one of the value
    assert int(uncertain) * last == pytest.approx(scaled(plain, power))
    assert half >= 9.4 * last


@pytest.mark.parametrize(
    ("value", "low", "high", "latex"),
    [
        (0.02006, 0.0199, 0.02022, r"\mrfitvalue{0.02006}{16}{0.00016}{}"),
        (1.2346e-7, 1.2e-7, 1.269e-7, r"\mrfitvalue{1.235}{35}{0.035}{-7}"),
        # halves of 0.9 and 1.1 are one, of 0.8 and 1.2 are not
        (10.0, 9.1, 11.1, r"\mrfitvalue{10.0}{10}{1.0}{}"),
        (10.0, 9.2, 11.2, r"$10.0^{+1.2}_{-0.8}$"),
        (10.0, None, 12.0, r"\mrfitnumber{10.00}{}"),
        (10.0, 10.0, 10.0, r"\mrfitnumber{10}{}"),
        (2.5e-9, float("-inf"), 1.0, r"\mrfitnumber{2.500}{-9}"),
    ],
)
def test_values_as_they_are_printed(value: float, low: float | None, high: float | None, latex: str) -> None:
    assert with_uncertainty(value, low, high).latex == latex


@pytest.mark.parametrize(
    ("value", "low", "high", "ends"),
    [
        (0.0, -0.3, 0.3, ("0.00", "0.30", "0.30")),
        (-6.4e-9, -381e-6, 381e-6, ("0.0", "3.8", "3.8")),
        (0.0, -2e-7, 3e-7, ("0.0", "3.0", "2.0")),
        (0.0, -400.0, 381.0, ("0", "390", "390")),
    ],
)
def test_a_value_next_to_nothing_is_zero_within_its_interval_and_not_exactly_zero(
    value: float, low: float, high: float, ends: tuple[str, str, str]
) -> None:
    latex = with_uncertainty(value, low, high).latex
    one, apart = VALUE.fullmatch(latex), APART.fullmatch(latex)
    found = (one[1], one[3], one[3]) if one else apart.groups()[:3] if apart else ()
    assert found == ends
    power = one[4] if one else apart[4] if apart else ""
    assert scaled(ends[1], power) == pytest.approx(high, rel=0.05)


def test_a_number_and_none() -> None:
    assert number(1.5e-8).latex == r"\mrfitnumber{1.50}{-8}" and number(None).latex == "--"
    assert words("tanh+delay a.tau").latex == r"tanh+\allowbreak{}delay a.\allowbreak{}tau"
    assert words("50 %_x").latex == r"50 \%\_x" and words("1.5-2").latex == r"1.5-\allowbreak{}2"


def plain(text: str) -> Cell:
    return Cell(text, text)


def table(columns: int, rows: int, width: int = 8, fixed: int = 1, align: str = "") -> Table:
    """A table whose cells say where they stand."""
    header = [[plain(f"h{c}".ljust(width, "x")) for c in range(columns)]]
    cells = [[plain(f"r{r}c{c}") for c in range(columns)] for r in range(rows)]
    return Table("About", "tab:about", header, cells, align or "l" + "r" * (columns - 1), fixed=fixed)


def parts_of(text: str) -> list[str]:
    return re.findall(r"\\begin\{table\*?\}.*?\\end\{table\*?\}", text, re.DOTALL)


def body(part: str) -> list[list[str]]:
    inside = part.partition("\\midrule\n")[2].partition("\\bottomrule")[0]
    return [line.removesuffix(r" \\").split(" & ") for line in inside.splitlines()]


@pytest.mark.parametrize(("columns", "rows"), [(3, 5), (3, LONGEST_CELL), (3, LONGEST_CELL + 1), (14, 5), (25, 80)])
def test_no_row_and_no_column_is_lost_and_no_part_is_larger_than_a_page(columns: int, rows: int) -> None:
    parts = parts_of(tables_tex(table(columns, rows)))
    seen: dict[str, int] = {}
    for part in parts:
        cells = body(part)
        assert len(cells) <= LONGEST_CELL
        for row in cells:
            for cell in row[1:]:
                seen[cell] = seen.get(cell, 0) + 1
            # what stands on the left stands there in every part
            assert row[0] == f"{row[1].partition('c')[0]}c0"
        heads = part.partition("\\toprule\n")[2].splitlines()[0].removesuffix(r" \\").split(" & ")
        wide = sum(plain(h).width for h in heads) + GAP * (len(heads) - 1)
        assert wide <= PAGE and ("table*" in part) is (wide > COLUMN)
    assert seen == {f"r{r}c{c}": 1 for r in range(rows) for c in range(1, columns)}
    captions = [re.findall(r"\\caption\{(.*)\}", p)[0] for p in parts]
    labels = [re.findall(r"\\label\{(.*)\}", p)[0] for p in parts]
    many = len(parts)
    assert captions == (["About"] if many == 1 else [f"About, part {k} of {many}" for k in range(1, many + 1)])
    assert labels == ["tab:about", *(f"tab:about:{k}" for k in range(2, many + 1))]


def test_a_long_table_is_split_evenly() -> None:
    lengths = [len(body(p)) for p in parts_of(tables_tex(table(2, LONGEST_CELL + 2)))]
    assert lengths == [19, 19]
    assert [len(body(p)) for p in parts_of(tables_tex(table(2, LONGEST_CELL)))] == [LONGEST_CELL]


def test_rows_that_say_nothing_in_a_part_are_left_out_of_it() -> None:
    wide = table(14, 3)
    wide.rows[1][1:] = [EMPTY] * 7 + wide.rows[1][8:]  # type: ignore[index]
    parts = [body(p) for p in parts_of(tables_tex(wide))]
    assert len(parts) > 1 and [row[0] for row in parts[0]] == ["r0c0", "r2c0"]
    assert [row[0] for row in parts[-1]] == ["r0c0", "r1c0", "r2c0"]


def test_text_is_broken_into_lines_of_the_widest_column_that_there_is_room_for() -> None:
    def written(others: int) -> str:
        text = plain("some words " * 20)
        rows = [[text, *(plain("12345678") for _ in range(others))]]
        header = [[plain("x")] * (others + 1)]
        return tables_tex(Table("A", "a", header, rows, "t" + "r" * others, note="\\dagger{} said below"))

    for others, width, star in ((1, TEXT_WIDTHS[2], ""), (3, TEXT_WIDTHS[0], ""), (5, TEXT_WIDTHS[1], "*")):
        text = written(others)
        assert rf"\begin{{tabular}}{{@{{}}p{{{width:.0f}pt}}{'r' * others}@{{}}}}" in text, others
        assert rf"\begin{{table{star}}}" in text and r"\raggedright\hspace{0pt}some words" in text
        assert rf"\parbox{{{PAGE if star else COLUMN:.0f}pt}}{{\raggedright \dagger{{}} said below}}" in text


def test_a_word_that_cannot_be_broken_is_given_its_width() -> None:
    long = "W" * 26
    (column,) = re.findall(r"p\{(\d+)pt\}", tables_tex(Table("A", "a", [[plain("x")]], [[plain(f"{long} a b")]], "t")))
    assert int(column) >= round(plain(long).width)
