"""Rows of sheet.csv, and the names of the files of a sheet."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from mrfit.io.schemas.sheet import AcrossRow, SheetFile, UnitRow
from mrfit.sheet import print_page
from mrfit.sheet.compute import SheetContent
from mrfit.sheet.write import SHEET_COLUMNS, Row, table_rows, written
from tests.sheet.test_compute import condition, quantity, sheet, unit
from tests.sheet.test_words import verdict

JUDGED = {"least": 90.0, "most": 110.0, "verdict": "pass"}


def judged(*names: str, verdicts: tuple[Any, ...] = (), across: tuple[AcrossRow, ...] = (), **given: Any) -> UnitRow:
    """A unit with one condition of these quantities."""
    one = replace(condition("a", *(quantity(n) for n in names), name="sine"), **given)
    return replace(unit("a", one), verdicts=[*verdicts], across=[*across])


def rows_of(*units: UnitRow, **given: Any) -> list[Row]:
    return table_rows(replace(sheet(*units), **given))


def test_a_verdict_stands_beside_the_quantity_and_condition_that_it_is_of() -> None:
    other = verdict(condition="tri", quantity="F0+", verdict="fail", least=1.0, most=2.0)
    own = verdict(condition="sine", quantity="F0-", **JUDGED)
    first, second = rows_of(judged("F0+", "F0-", verdicts=(other, own)))
    assert "verdict" not in first and {n: second[n] for n in JUDGED} == JUDGED
    assert (second["quantity"], second["value"], second["low"], second["si_unit"]) == ("F0-", 100.0, 99.9, "N")
    assert {*first, *second} <= {*SHEET_COLUMNS}


def test_a_verdict_that_cannot_be_judged_gives_its_reason_and_one_without_keeps_that_of_the_quantity() -> None:
    row = replace(quantity("F0+", None), reason="one cycle")
    plain = replace(unit("a", condition("a", row)), verdicts=[verdict(condition="sine", **JUDGED)])
    doubt = replace(plain, verdicts=[verdict(condition="sine", reason="the interval straddles a limit")])
    assert [one["reason"] for u in (plain, doubt) for one in rows_of(u)] == [
        "one cycle",
        "the interval straddles a limit",
    ]


def test_a_record_without_a_frequency_has_an_empty_cell() -> None:
    assert [rows_of(judged("E", frequency=f))[0]["frequency_Hz"] for f in (0.0, 2.0)] == [None, 2.0]


def test_verdicts_of_cycles_and_of_the_batch_have_rows_of_their_own_the_batch_once() -> None:
    cycle = verdict(level="cycle", condition="sine", quantity="F0+", value=3.0, low=2.0, high=4.0, most=10.0)
    batch = verdict(level="batch", unit="all units", condition="sine", quantity="F0+", value=101.0)
    rows = rows_of(judged("F0+", verdicts=(cycle,)), judged("F0+"), batch=[batch])
    assert [(r["unit"], r["quantity"]) for r in rows] == [
        ("a", "F0+"),
        ("u", "F0+ (cycle off the mean)"),
        ("a", "F0+"),
        ("all units", "F0+ (mean of all units)"),
    ]
    # a limit on each cycle is none of the quantity itself
    assert "verdict" not in rows[0] and (rows[1]["value"], rows[1]["most"]) == (3.0, 10.0)


def test_quantities_across_conditions_have_rows_with_their_verdict() -> None:
    own = AcrossRow(conditions="all speeds, 1 A", quantity=quantity("C+"))
    told = verdict(condition="all speeds, 1 A", quantity="C+", **JUDGED)
    [_, row] = rows_of(judged("E", verdicts=(told,), across=(own,)))
    assert (row["condition"], row["quantity"], row["verdict"]) == ("all speeds, 1 A", "C+", "pass")
    assert "frequency_Hz" not in row


def content(file: SheetFile) -> SheetContent:
    return SheetContent(file, [], [], [])


@pytest.fixture
def pages(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str]]:
    """Names of the files and units of which pages would be written."""
    made: list[tuple[str, str]] = []
    monkeypatch.setattr(print_page, "write", lambda path, _, one: made.append((path.name, one.unit)))
    return made


def test_one_unit_has_one_page_and_each_of_several_one_of_its_own(pages: list[tuple[str, str]], tmp_path: Path) -> None:
    one = unit("a/b", condition("a/b", quantity()))
    assert written(content(sheet(one)), tmp_path, pdf=True).files[-1] == str(tmp_path / "sheet.pdf")
    several = [replace(one, unit=name) for name in ("a/b", "7", "..")]
    written(content(sheet(*several)), tmp_path, pdf=True)
    assert pages[1:] == [("sheet-a_b.pdf", "a/b"), ("sheet-7.pdf", "7"), ("sheet-unit3.pdf", "..")]


def test_units_whose_names_differ_in_signs_alone_have_a_page_each(pages: list[tuple[str, str]], tmp_path: Path) -> None:
    one = unit("a b", condition("a b", quantity()))
    found = written(content(sheet(one, replace(one, unit="a_b"), replace(one, unit="A+b"))), tmp_path, pdf=True)
    # also where a disk tells no capital letters
    assert len({name.lower() for name, _ in pages}) == len(pages) == 3 and len({*found.files}) == 6


def test_without_pdf_no_page_is_written(pages: list[tuple[str, str]], tmp_path: Path) -> None:
    found = written(content(sheet(unit("a", condition("a", quantity())))), tmp_path)
    assert [Path(f).name for f in found.files] == ["sheet.html", "sheet.csv", "sheet.json"] and not pages
    assert all(Path(f).is_file() for f in found.files)
