"""Every command line that a page, a help text or a message shows is run, or stands in a list with the reason."""

import ast
import fnmatch
import glob
import shlex
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests import commands
from tests.docs import labs
from tests.docs.command_lines import (
    RULES,
    CommandLine,
    command_lines,
    counted,
    filled,
    lacks,
    messages,
    shown,
    written_in,
)
from tests.docs.test_pages import fault_of

Lab = Callable[[str], Path]
LINES = command_lines()
LIMIT = 1800.0
"""Seconds after which a command hangs: it is no measure of speed, as other work slows all of them."""


def of_kind(kind: str) -> "pytest.MarkDecorator":
    return pytest.mark.parametrize("line", [one for one in LINES if one.kind == kind], ids=lambda one: one.text)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Lab:
    folders: dict[str, Path] = {}

    def lab(name: str) -> Path:
        if name not in folders:
            folders[name] = tmp_path_factory.mktemp(name) / "lab"
            labs.prepare(name, folders[name])
        return folders[name]

    return lab


@pytest.fixture
def lab(made: Lab, tmp_path: Path) -> Lab:
    """Give a copy of a lab, for one command line alone."""

    def copied(name: str) -> Path:
        return Path(shutil.copytree(made(name), tmp_path / name, symlinks=True))

    return copied


def ended_well(line: CommandLine, folder: Path) -> None:
    words = [found for word in shlex.split(line.text) for found in expanded(word, folder)]
    # what a command forgets to import is missed here
    done = commands.text(folder, *words, timeout=LIMIT, fresh=True)
    assert done.returncode == 0, f"mrfit {line.text}, shown in {', '.join(line.places)}:\n{done.stderr}"
    # a line that stands on a page of its own words is no command
    for told in map(filled, printed_lines(done.stdout + done.stderr)):
        assert not fault_of(shlex.split(told)), f"mrfit {line.text} says: mrfit {told}"


def expanded(word: str, folder: Path) -> list[str]:
    """Return the files that a shell puts in the place of a pattern."""
    found = sorted(glob.glob(word, root_dir=folder)) if "*" in word and "/" in word else []
    return found or [word]


def printed_lines(text: str) -> Iterator[str]:
    for line in text.split("\n"):
        yield from written_in(line)


@of_kind("quick")
def test_a_command_line_works(line: CommandLine, lab: Lab) -> None:
    ended_well(line, lab(line.lab))


@pytest.mark.slow
@of_kind("slow")
def test_a_command_line_that_takes_long_works(line: CommandLine, lab: Lab) -> None:
    ended_well(line, lab(line.lab))


@of_kind("mention")
def test_what_only_speaks_of_a_command_stands_in_a_sentence(line: CommandLine) -> None:
    assert not [place for place in line.places if place.endswith("--help") and not lacks(shlex.split(line.text))]
    assert not fault_of(shlex.split(line.text))


def test_every_reason_and_value_belongs_to_a_line_that_is_shown() -> None:
    written = {text for text, _ in shown()}
    for value in RULES["values"]:
        assert any(value in text for text in written), value
    for rule in RULES["lines"]:
        assert any(fnmatch.fnmatchcase(one.text, rule["like"]) for one in LINES), rule["like"]
        assert {*rule} <= {"like", "lab", "slow", "reason"} and len(rule) > 1
    assert all(len(one.reason) > 10 for one in LINES if one.kind == "excused")


def test_there_are_as_many_as_it_says(capsys: pytest.CaptureFixture[str]) -> None:
    assert len(LINES) > 100 and str(len(LINES)) in counted()
    with capsys.disabled():
        print(f"\n{counted()}")


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ('raise E("none yet; run `mrfit fit --model tanh` first")', ["fit --model tanh"]),
        ('raise E(f"{a}: run `mrfit fit --work {b.root}` first")', ["fit --work {b.root}"]),
        ('say(f"Go on with: mrfit report --work {b}")', ["report --work {b}"]),
        ('def f():\n    """As `mrfit fit` does."""', []),
        ('"Channel map for mrfit alone"', []),
    ],
)
def test_command_lines_of_messages_are_found(source: str, found: list[str]) -> None:
    assert [line for text in messages(ast.parse(source)) for line in written_in(text)] == found


@pytest.mark.parametrize(
    ("line", "missing"),
    [
        ("fit", ["model"]),
        ("fit --model tanh", []),
        ("batch --report", ["folder", "model"]),
        ("ingest --max-memory 2GB", ["logs"]),
        ("ingest --max-memory 2GB logs", []),
        ("apply", ["a command"]),
        ("report", []),
        ("fit --help", []),
    ],
)
def test_what_a_line_lacks_is_known(line: str, missing: list[str]) -> None:
    assert lacks(shlex.split(line)) == missing
