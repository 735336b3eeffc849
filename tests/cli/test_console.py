"""Tables that fit a terminal, lines of quiet and verbose commands, and the one line with which an error ends."""

import sys
from collections.abc import Iterator
from types import SimpleNamespace

import pytest
import typer
from hypothesis import given
from hypothesis import strategies as st

from mrfit.cli import console
from mrfit.cli.console import INTERRUPTED, WrittenNumber, _broken, _tables_below, cell, explain
from mrfit.errors import ConfigError, DataError


@pytest.fixture
def verbosity(monkeypatch: pytest.MonkeyPatch) -> Iterator[console.Verbosity]:
    """A verbosity of its own."""
    own = console.Verbosity()
    monkeypatch.setattr(console, "VERBOSITY", own)
    yield own


@given(st.lists(st.integers(1, 40), min_size=1, max_size=12), st.integers(10, 120))
def test_every_column_stands_in_one_table_with_the_first_beside_it_and_within_the_room(
    least: list[int], room: int
) -> None:
    parts = _tables_below(least, room)
    assert [part[0] for part in parts] == [0] * len(parts)
    # none has the first alone
    assert len(least) == 1 or all(len(part) > 1 for part in parts)
    assert [k for part in parts for k in part[1:]] == list(range(1, len(least)))
    for part, behind in zip(parts, [*parts[1:], [0]], strict=True):
        # one beside the first is always shown; a further table begins only where its column had no room
        assert sum(least[k] for k in part) < room or len(part) <= 2
        if len(behind) > 1 and len(part) > 1:
            assert sum(least[k] for k in [*part, behind[1]]) >= room


@pytest.mark.parametrize(
    ("name", "cells", "lines"),
    [
        ("rms", ["0.123456789"], ["rms"]),
        ("noise_floor (N)", ["5.868"], ["noise", "floor", "(N)"]),
        ("noise_floor (N)", ["123456789012"], ["noise_floor", "(N)"]),
        ("share of error", ["12.5 %"], ["share", "of", "error"]),
        ("parameter", [], ["parameter"]),
        # a short word is not broken at its underscores
        ("fit_perc", ["1"], ["fit_perc"]),
    ],
)
def test_a_heading_is_no_wider_than_its_cells_or_its_longest_word(
    name: str, cells: list[str], lines: list[str]
) -> None:
    assert _broken(name, cells) == lines


@pytest.mark.parametrize(
    ("value", "text"),
    [
        *((None, "–"), (True, "yes"), (False, "no"), (float("nan"), "–"), (0.123456, "0.1235"), (1e-9, "1e-09")),
        *((3, "3"), (WrittenNumber("1.50"), "1.50"), (float("inf"), "inf"), ("a", "a")),
    ],
)
def test_values_as_they_stand_in_a_table(value: object, text: str) -> None:
    assert cell(value) == text


def printed(capsys: pytest.CaptureFixture[str], *table: object) -> list[str]:
    console.print_table(*table)  # type: ignore[arg-type]
    return capsys.readouterr().out.splitlines()


def test_a_table_in_a_pipe_has_the_width_that_is_asked_for_and_no_frame_in_a_narrow_one(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], verbosity: console.Verbosity
) -> None:
    names = [f"column{k}" for k in range(12)]
    rows = [["sine-1Hz-10mm-1A", *(1.23456 * 10.0**k for k in range(11))]]
    for given_width, width, framed in (("", console.WIDE_COLUMNS, True), ("99", 99, False), ("wide", 150, True)):
        monkeypatch.setenv("MRFIT_COLUMNS", given_width)
        lines = printed(capsys, "Title", names, rows)
        assert lines[0] == "Title" and max(map(len, lines)) <= width
        assert ("┏" in lines[1]) is framed
        # what has no room goes on below, beside the first column again; no number is broken
        text = "\n".join(lines)
        assert text.count("sine-1Hz-10mm-1A") == text.count("column0") >= (1 if framed else 2)
        assert all(cell(v) in text for v in rows[0])


def test_numbers_stand_at_the_right_and_words_at_the_left(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], verbosity: console.Verbosity
) -> None:
    monkeypatch.setenv("MRFIT_COLUMNS", "60")
    lines = printed(capsys, "T", ["name", "yes", "value"], [["a", True, 1.0], ["longer", False, 12345.0]])
    assert lines[-1].split() == ["longer", "no", "1.234e+04"]
    first = next(line for line in lines if line.startswith("a"))
    assert first.rstrip().endswith(" 1") and first.index("yes") == lines[-1].index("no")


def test_text_from_files_cannot_move_the_cursor(
    capsys: pytest.CaptureFixture[str], verbosity: console.Verbosity
) -> None:
    text = "\n".join(printed(capsys, "a\x1b[2J", ["b\x1b[1m"], [["c\x07"]]))
    assert "\x1b" not in text and "\x07" not in text
    console.say("d\x1b[0m [bold]e[/bold] :warning:")
    assert capsys.readouterr().out == "d\\x1b[0m [bold]e[/bold] :warning:\n"


def test_a_quiet_command_keeps_its_last_line_unless_it_has_a_summary(
    capsys: pytest.CaptureFixture[str], verbosity: console.Verbosity
) -> None:
    verbosity.quiet = True
    console.say_each(["first", "last"])
    console.print_table("T", ["a"], [[1]])
    assert capsys.readouterr().out == ""
    console.finish()
    assert capsys.readouterr().out == "last\n"
    console.conclude("summary")
    console.finish()
    assert capsys.readouterr().out == "summary\n"


def test_a_loud_command_has_said_its_last_line_already(
    capsys: pytest.CaptureFixture[str], verbosity: console.Verbosity
) -> None:
    console.say_each(["one"])
    console.finish()
    assert capsys.readouterr().out == "  one\n"


def test_every_step_of_a_verbose_command_ends_with_its_time(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], verbosity: console.Verbosity
) -> None:
    verbosity.verbose, clock = True, [5.0]
    monkeypatch.setattr(console.time, "monotonic", lambda: clock[0])
    with console.progress_bar() as told:
        told("all  best 3 N", 1, 9)
        clock[0] = 7.5
        told("all  best 2 N", 9, 9)
        told("other", 4, 4)
    assert capsys.readouterr().err == "all: 9 in 2.5 s\nother: 4 in 0.0 s\n"


def test_compilation_is_noted_once_and_not_to_who_wants_little(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], verbosity: console.Verbosity
) -> None:
    noted: list[str] = []
    monkeypatch.setattr(console, "_note_once", noted.append)
    console._note_compilation("compiling", 0, 1)
    console._note_compilation("compiling", 1, 1)
    verbosity.quiet = True
    console._note_compilation("compiling", 0, 1)
    assert noted == ["compiling"]


class Usage(Exception):
    """As the errors of a command line are that typer raises."""

    def __init__(self, text: str, ctx: object = None) -> None:
        super().__init__(text)
        self.text, self.ctx = text, ctx

    def format_message(self) -> str:
        return self.text


def context() -> SimpleNamespace:
    inner = {"lag": object(), "quasi-static": object()}
    root = SimpleNamespace(commands={"measure": SimpleNamespace(commands=inner), "fit": object()})
    return SimpleNamespace(command_path="mrfit apply", find_root=lambda: SimpleNamespace(command=root))


def interrupted(depth: int) -> BaseException:
    error: BaseException = KeyboardInterrupt()
    for _ in range(depth):
        outer = SystemError("returned a result with an exception set")
        outer.__cause__ = error
        error = outer
    return error


@pytest.mark.parametrize(
    ("error", "text", "code"),
    [
        (DataError("a.csv: no force"), "a.csv: no force", 1),
        (ConfigError("--dt"), "--dt", 2),
        (typer.Abort(), "", INTERRUPTED),
        (interrupted(3), "", INTERRUPTED),
        (OSError("disk full"), "disk full", 1),
        (MemoryError("no room"), "no room", 1),
        (ZeroDivisionError("x"), "unexpected ZeroDivisionError: x (--debug shows where)", 1),
        (SystemError("own"), "unexpected SystemError: own (--debug shows where)", 1),
        (Usage("Missing option", context()), "Missing option (`mrfit apply --help` shows how)", 2),
        (Usage("Missing option"), "Missing option (`mrfit --help` shows how)", 2),
        (Usage(""), "", 2),
        (
            Usage("No such option: --debug", context()),
            "--debug stands before the command, as in `mrfit --debug fit …`",
            2,
        ),
    ],
)
def test_an_error_is_one_line_and_a_code(error: Exception, text: str, code: int) -> None:
    assert explain(error) == (text, code)


@pytest.mark.parametrize(
    ("word", "known"),
    [("lag", "`mrfit measure lag`"), ("quasi", "`mrfit measure quasi-static`"), ("fit", "`mrfit fit`")],
)
def test_a_command_of_a_group_is_found_by_its_name_or_its_beginning(word: str, known: str) -> None:
    text, code = explain(Usage(f"No such command '{word}'.", context()))
    assert text == f"No such command '{word}': it may be {known} (`mrfit apply --help` shows how)" and code == 2
    assert explain(Usage("No such command 'la'.", context()))[0].startswith("No such command 'la'. (")


def ended(monkeypatch: pytest.MonkeyPatch, error: BaseException, *arguments: str) -> int:
    """Return the exit code of a command line that ends with an error."""

    def app(standalone_mode: bool) -> None:
        raise error

    monkeypatch.setattr(sys, "argv", ["mrfit", *arguments])
    monkeypatch.setattr(console.signal, "signal", lambda *_: None)
    monkeypatch.setattr(console.gc, "set_threshold", lambda *_: None)
    monkeypatch.setattr(console, "on_need", lambda *_: None)
    with pytest.raises(SystemExit) as end:
        console.run(app)  # type: ignore[arg-type]
    return int(str(end.value.code))


def test_a_traceback_is_shown_where_it_is_asked_for_and_not_of_a_wrong_command_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert ended(monkeypatch, DataError("a.csv\x1b: no force")) == 1
    assert capsys.readouterr().err == "mrfit: a.csv\\x1b: no force\n"
    assert ended(monkeypatch, DataError("no force"), "--debug") == 1
    *trace, last = capsys.readouterr().err.splitlines()
    assert last == "mrfit: no force" and len(trace) > 2 and all(line.startswith("  ") for line in trace)
    assert ended(monkeypatch, Usage("Missing option"), "--debug") == 2
    assert capsys.readouterr().err == "mrfit: Missing option (`mrfit --help` shows how)\n"


@pytest.mark.parametrize("error", [KeyboardInterrupt(), typer.Abort(), interrupted(1)])
def test_an_interrupt_says_that_the_same_command_goes_on(
    error: BaseException, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert ended(monkeypatch, error, "--debug", "--json") == INTERRUPTED
    shown = capsys.readouterr()
    assert shown.err == "mrfit: stopped; the same command goes on where this one was\n" and shown.out == ""
