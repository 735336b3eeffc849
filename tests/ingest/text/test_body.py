import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mrfit.ingest.text import body
from mrfit.ingest.text.body import Layout, is_cut, read_body, split

COMMA = Layout(1, ",", ".", 3, (0, 1, 2))
FIELD = st.one_of(
    st.floats(-1e6, 1e6).map(lambda v: f"{v:.4f}"),
    st.floats(allow_nan=False, allow_infinity=False).map(repr),
    st.sampled_from(
        ["", " ", "NaN", "inf", "1e400", "-12.0mV", "1_0", "0x10", "∞", "+.5", "5.", "1e5", '"1.5"', "\0", "1d3", "١"]
    ),
)
ROW = st.lists(FIELD, min_size=0, max_size=5).map(",".join)


@settings(max_examples=80, deadline=None)
@given(rows=st.lists(ROW, max_size=30))
@example(rows=["", ",,"])
def test_bulk_and_line_by_line_agree_and_no_row_is_lost(rows: list[str]) -> None:
    """The fast parser and the slow one see the same rows; kept and refused are all rows there are."""
    data = ("t,a,b\n" + "\n".join(rows)).encode()
    whole = read_body(data, COMMA)
    alone = [read_body(("t,a,b\n" + row).encode(), COMMA) for row in rows]
    there = sum(bool(row.strip()) for row in rows)
    assert len(whole.lines) + len(whole.refused) == there
    assert len(whole.lines) == sum(len(a.lines) for a in alone)
    assert [r.kind for r in whole.refused] == [r.kind for a in alone for r in a.refused]
    for column in range(3):
        parts = np.concatenate([a.numbers[column] for a in alone] or [np.empty(0)])
        np.testing.assert_array_equal(whole.numbers[column], parts)


@settings(max_examples=60, deadline=None)
@given(values=st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=3, max_size=3))
def test_numbers_are_read_to_the_last_bit(values: list[float]) -> None:
    sound = "t,a,b\n" + ",".join(map(repr, values)) + "\n"
    for text in (sound, sound + "broken\n"):
        read = read_body(text.encode(), COMMA)
        assert [float(read.numbers[c][0]) for c in range(3)] == values


def test_line_numbers_of_refused_rows() -> None:
    text = "t,a,b\n0,1,2\n\n1,2\n2,3,x\n3,4,5,6\n,,\nt,a,b\n# note\n4,5,6\n"
    layout = Layout(1, ",", ".", 3, (0, 1, 2), header=frozenset({"t,a,b"}))
    read = read_body(text.encode(), layout)
    assert [(r.kind, r.line) for r in read.refused] == [
        ("short row", 4),
        ("not a number", 5),
        ("long row", 6),
        ("empty row", 7),
        ("repeated header", 8),
    ]
    assert read.lines.tolist() == [2, 10]


def test_damage_in_a_long_log_costs_only_its_own_rows() -> None:
    rows = [f"{k},{k * 2},{k * 3}" for k in range(20000)]
    rows[777], rows[15000] = "777,1554", "15000,x,1"
    read = read_body(("t,a,b\n" + "\n".join(rows) + "\n").encode(), COMMA)
    assert [(r.kind, r.line) for r in read.refused] == [("short row", 779), ("not a number", 15002)]
    assert len(read.lines) == 19998
    np.testing.assert_array_equal(read.numbers[2], 3.0 * (read.lines - 2))


@pytest.mark.parametrize(
    ("text", "layout"),
    [
        ("0,5;1,25;-2\n", Layout(0, ";", ",", 3, (0, 1, 2))),
        ("0,5\t1,25\t-2\n", Layout(0, "\t", ",", 3, (0, 1, 2))),
        ("   0.5   1.25  \t -2  \n", Layout(0, "", ".", 3, (0, 1, 2))),
        ('"0,5","1,25","-2"\n', Layout(0, ",", ",", 3, (0, 1, 2))),
        ("  0.5000000e+000 1.25 -2\r\n", Layout(0, "", ".", 3, (0, 1, 2))),
        ("+.5,+1.25E+00,-2.,\n", Layout(0, ",", ".", 4, (0, 1, 2), blank=(3,))),
    ],
)
def test_delimiters_and_decimal_marks(text: str, layout: Layout) -> None:
    for damage in ("", "broken\n"):
        read = read_body((text + damage).encode(), layout)
        assert [float(read.numbers[c][0]) for c in range(3)] == [0.5, 1.25, -2.0]


def test_empty_and_overflowing_fields_stay_for_later_judgement() -> None:
    read = read_body("t,a,b\n0,,NaN\n1,inf,∞\n".encode(), COMMA)
    assert math.isnan(read.numbers[1][0]) and math.isnan(read.numbers[2][0])
    assert read.numbers[1][1] == math.inf and read.numbers[2][1] == math.inf


def test_something_where_nothing_may_stand_makes_a_long_row() -> None:
    read = read_body(b"0,1,\n1,2,3\n", Layout(0, ",", ".", 3, (0, 1), blank=(2,)))
    assert [(r.kind, r.line) for r in read.refused] == [("long row", 2)]


def test_texts_and_optional_columns() -> None:
    layout = Layout(0, ",", ".", 3, (0,), texts=(1, 2), optional=(2,))
    read = read_body(b"1, noon\n2, night, Pause\n3\n", layout)
    assert read.texts == {1: ["noon", "night"], 2: ["", "Pause"]}
    assert [(r.kind, r.line) for r in read.refused] == [("short row", 3)]


def test_a_nul_byte_in_a_text_is_said_among_sound_rows_as_alone() -> None:
    layout = Layout(0, ",", ".", 2, (0,), texts=(1,))
    rows = [b"%d,12:00:%02d\n" % (k, k) for k in range(50)]
    rows[20] = b"20,12:\x00:20\n"
    whole, alone = read_body(b"".join(rows), layout), read_body(rows[20], layout, line=21)
    assert whole.refused == alone.refused and [r.kind for r in whole.refused] == ["NUL byte"]
    assert len(whole.lines) == 49


def test_a_sign_for_no_value_in_a_column_that_is_blank_is_no_value_among_sound_rows_as_alone() -> None:
    layout = Layout(0, ",", ".", 3, (0, 1), blank=(2,))
    rows = [b"%d,1.5,\n" % k for k in range(50)]
    rows[20], rows[30] = b"20,1.5,--\n", b"30,1.5,7\n"
    whole = read_body(b"".join(rows), layout)
    assert [(r.kind, r.line) for r in whole.refused] == [("long row", 31)] and len(whole.lines) == 49
    assert len(read_body(rows[20], layout).lines) == 1


def test_bulk_path_is_taken_for_a_sound_log(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object) -> None:
        raise AssertionError("a sound log went line by line")

    monkeypatch.setattr(body, "_line_by_line", never)
    assert len(read_body(b"t,a,b\r\n" + b"0.1,2,3\r\n" * 5000, COMMA).lines) == 5000


TWO = Layout(0, ",", ".", 2, (0, 1))


@pytest.mark.parametrize(
    ("data", "cut"),
    [
        ("1,2\n3,4\n", False),
        ("1,2.50\n3,4.25", False),  # all its decimals are there
        ("1,12.50\n3,4.25", False),  # and the line may be shorter than the one before
        ("1,2.50\n3,14.2", True),
        ("1,2.50\n3,14", True),
        ("1,-2.5E-03\n3,4.2E-03", False),
        ("1,-2.5E-03\n3,4.2E-0", True),
        ("1,-2.5E-03\n3,4.2", True),
        ("1,2.5\n3,4.25", False),  # decimals vary: as long as the longest
        ("1,2.125\n1,2.5\n3,4.25", True),
        ("1,2.1234567890123456\n3,0.412345678901234", False),  # the digits of a double
        ("1,2.1234567890123456e-05\n3,0.412345678901234", True),
        ("1,200\n3,14", True),
        ("1,200\n3,140", False),
        ("1,200\n3", False),  # a short row, refused as such
        ('1,"2.5"\n3,"2.5', True),
        ("", False),
    ],
)
def test_a_file_that_ends_inside_its_last_number(data: str, cut: bool) -> None:
    for end in ("\n", "\r\n"):
        assert is_cut(("t,a\n" + data).replace("\n", end).encode(), TWO) is cut


def test_a_last_line_by_itself_is_judged_by_those_before() -> None:
    assert is_cut(b"3,14.2", TWO, before=b"1,2.50\n2,3.25\n") and not is_cut(
        b"3,14.25", TWO, before=b"1,2.50\n2,3.25\n"
    )


def test_a_delimiter_behind_the_last_number_says_that_it_is_whole() -> None:
    layout = Layout(0, ",", ".", 3, (0, 1), blank=(2,))
    assert not is_cut(b"1,2.5,\n3,14.25,\n5,4.2,", layout) and is_cut(b"1,2.5,\n3,14.25,\n5,4.2", layout)
    assert not is_cut(b"1,2.50,\n3,4.25,", layout)
    assert is_cut(b"1,2.50,\n3,4,", layout)  # all others have two decimals: a decimal comma, and cut
    # a damaged row above, with a comma for the point, does not tell how numbers are printed
    assert is_cut(b"1,2.50,\n2,7,25,\n3,4.75,\n5,4,", layout)
    assert not is_cut(b"1,2.50,\n2,7,25,\n3,4.75,\n5,4.25,", layout)


def test_no_line_is_lost_uncounted() -> None:
    """A row whose first field is unreadable is no comment, whatever sign it begins with."""
    rows = ["0.0,1.5", "#REF!,1.5", "#DIV/0!,2.5", "%,1.5", "! 0.5,1.5", "#REF!,#REF!", "#N/A,1.5", "# pump on", "! 5"]
    read = read_body("\n".join([*rows, "%", "1.0,2.5"]).encode(), Layout(0, ",", ".", 2, (0, 1), comment="#%!"))
    assert read.lines.tolist() == [1, 7, 11]
    assert [(r.kind, r.line) for r in read.refused] == [("not a number", k) for k in (2, 3, 4, 5, 6)]
    assert read.comments == [8, 9, 10]


def test_split_survives_a_stray_quote() -> None:
    assert split('1,"2,3', ",") in ([["1", "2,3"], ["1", '"2', "3"]])
