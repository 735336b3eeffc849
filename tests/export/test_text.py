"""Whatever a log or a parameter is called, the text of an export stays inside its comment, name or attribute."""

import keyword
import re
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.export.c_parts import prefix_of
from mrfit.export.text import (
    LINE_WIDTH,
    LONGEST_SYMBOL,
    RESERVED_WORDS,
    ascii_line,
    c_comment,
    field,
    identifier,
    in_comment,
    number,
    wrapped,
)
from mrfit.export.units import base_units, modelica_unit
from mrfit.export.xml import XmlElement, xml


@given(st.text())
def test_no_text_ends_or_begins_a_comment_of_c(text: str) -> None:
    inside = in_comment(text)
    assert not any(sign in inside for sign in ("*/", "/*", "??", "//", "\n"))
    assert inside.isascii() and not inside.endswith("\\")


def test_plain_text_stays_as_it_is_in_a_comment() -> None:
    assert in_comment("log 1, 5 Hz; a/b * c?") == "log 1, 5 Hz; a/b * c?"
    assert in_comment("a\\") == "a(backslash)" and in_comment("°C") == "\\xb0C"


def test_a_block_comment_has_one_end_whatever_its_lines() -> None:
    text = c_comment(["a */ int x; /*", "", "b" * 300])
    assert text.startswith("/*\n") and text.endswith("\n */") and text.count("*/") == 1
    assert all(len(line) <= LINE_WIDTH + 3 for line in text.splitlines()) and "\n *\n" in text


def test_long_lines_are_cut_and_what_follows_is_indented() -> None:
    lines = wrapped(["word " * 40, "short", ""])
    assert len(lines) == 4 and lines[1].startswith("    word") and lines[2:] == ["short", ""]
    assert wrapped(["sine-1Hz-" * 30])[0].startswith("sine-1Hz-")


@given(st.text())
def test_a_name_is_one_of_c_matlab_and_modelica(text: str) -> None:
    for name in (identifier(text), field(text)):
        assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name), name
        assert name not in RESERVED_WORDS
    assert len(identifier(text)) <= LONGEST_SYMBOL + len("fit_") + 1


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("tanh.auto", "tanh_auto"),
        ("1Hz", "fit_1Hz"),
        ("", "fit"),
        ("%%", "fit"),
        ("double", "double_"),
        ("K", "K_"),
    ],
)
def test_a_name_of_a_fit(text: str, name: str) -> None:
    assert identifier(text) == name


def test_long_names_that_begin_alike_stay_apart_and_short_ones_are_not_cut() -> None:
    one, other = identifier("a" * 40 + "1"), identifier("a" * 40 + "2")
    assert one != other and len(one) <= LONGEST_SYMBOL
    assert identifier("a" * LONGEST_SYMBOL) == "a" * LONGEST_SYMBOL


@pytest.mark.parametrize(
    ("text", "name"), [("fy", "fy"), ("C_inf", "C_inf"), ("2x", "p_2x"), ("", "p__"), ("if", "if_")]
)
def test_a_field_keeps_its_underscores(text: str, name: str) -> None:
    assert field(text) == name and not keyword.iskeyword(field("fy"))


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_keeps_all_its_digits(value: float) -> None:
    assert float(number(value)) == value and set(number(value)) & set(".e")


@pytest.mark.parametrize(
    ("unit", "powers"),
    [
        ("N", {"kg": 1, "m": 1, "s": -2}),
        ("N*s/m", {"kg": 1, "s": -1}),
        ("N*s^2/m^2", {"kg": 1, "m": -1}),
        ("V*s", {"kg": 1, "m": 2, "s": -2, "A": -1}),
        ("ohm/A^2/s", {"kg": 1, "m": 2, "s": -4, "A": -4}),
        ("1/K", {"K": -1}),
        ("1", {}),
        ("furlong", {}),
        ("N*furlong", {}),
    ],
)
def test_powers_of_base_units(unit: str, powers: dict[str, int]) -> None:
    assert {base: int(power) for base, power in base_units(unit)} == powers


def test_a_weber_per_second_is_a_volt_and_a_henry_ampere_a_weber() -> None:
    assert dict(base_units("Wb/s")) == dict(base_units("V"))
    assert dict(base_units("H*A")) == dict(base_units("Wb")) and base_units("S*ohm") == ()


def test_degrees_have_an_offset_and_their_rates_have_none() -> None:
    assert dict(base_units("degC")) == {"K": "1", "offset": "273.15"}
    assert "offset" not in dict(base_units("1/degC"))


@pytest.mark.parametrize(
    ("unit", "written"),
    [
        ("N", "N"),
        ("N*s^2/m^2", "N.s2/m2"),
        ("ohm/A^2/s", "Ohm/(A2.s)"),
        ("1/K", "1/K"),
        ("1", "1"),
        ("N*s/m", "N.s/m"),
    ],
)
def test_units_of_modelica(unit: str, written: str) -> None:
    assert modelica_unit(unit) == written


HOSTILE = ["--", "a---b", "-->", "<b> & 'c' \"d\"", "\x00\x1b[31m", "größe", "]]>"]


@pytest.mark.parametrize("text", HOSTILE)
def test_a_document_is_read_again_whatever_stands_in_it(text: str) -> None:
    root = XmlElement("a", {"name": text}, [XmlElement("b", text=text), XmlElement("c")])
    found = ElementTree.fromstring(xml(root, ["head", text]))
    assert found.get("name") == ascii_line(text)
    assert [child.tag for child in found] == ["b", "c"] and found[0].text == ascii_line(text)


def test_children_are_indented_and_an_empty_element_is_closed_at_once() -> None:
    root = XmlElement("a", children=[XmlElement("b", {"k": "1"}), XmlElement("c", text="x")])
    text = xml(root, []).decode()
    assert text.endswith('<a>\n  <b k="1"/>\n  <c>x</c>\n</a>\n')


@pytest.mark.parametrize("word", ["model", "within", "Real", "try", "rem", "tanh", "delay"])
def test_a_name_that_a_language_or_a_function_has_is_no_prefix(word: str) -> None:
    assert prefix_of(word) == f"{word}_fit" and prefix_of(f"front_{word}") == f"front_{word}"
