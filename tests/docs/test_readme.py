"""The README's commands are run and print what it shows; … stands for lines that it leaves out."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.docs.pages import blocks

README = ROOT / "README.md"


NUMBER = re.compile(r"-?\d+\.\d+(?:e[+-]\d+)?")
DIGIT = 2e-3
"""Machines differ in the last of the four digits that are printed."""


def alike(shown: str, printed: str) -> bool:
    """Return whether two lines say the same, numbers to the digits that every machine prints."""
    if NUMBER.sub("#", shown) != NUMBER.sub("#", printed):
        return False
    pairs = zip(map(float, NUMBER.findall(shown)), map(float, NUMBER.findall(printed)), strict=True)
    return all(abs(a - b) <= DIGIT * abs(a) for a, b in pairs)


def left_out(shown: list[str], printed: list[str]) -> str:
    """Return the first shown line that does not follow, empty if all do; … stands for any lines."""
    place, free = 0, False
    for line in shown:
        if line == "…":
            free = True
            continue
        found = next((k for k in range(place, len(printed)) if alike(line, printed[k])), None)
        if found is None or (found > place and not free):
            return line
        place, free = found + 1, False
    return "" if free or place == len(printed) else printed[place]


@pytest.mark.parametrize(
    ("shown", "fault"),
    [
        (["a", "b", "c"], ""),
        (["a", "…", "c"], ""),
        (["…", "c"], ""),
        (["a", "…"], ""),
        (["a", "c"], "c"),
        (["a", "b"], "c"),
        (["…", "d"], "d"),
        (["b", "…"], "b"),
    ],
)
def test_lines_may_be_left_out_only_where_it_says_so(shown: list[str], fault: str) -> None:
    assert left_out(shown, ["a", "b", "c"]) == fault


@pytest.mark.parametrize(
    ("printed", "same"),
    [("G 0.03064 S", True), ("G 0.0308 S", False), ("G 0.03065 H", False), ("G -0.03065 S", False)],
)
def test_lines_are_alike_if_only_the_last_digit_differs(printed: str, same: bool) -> None:
    assert alike("G 0.03065 S", printed) is same


def environment() -> dict[str, str]:
    return {
        **{k: v for k, v in os.environ.items() if k != "MRFIT_COLUMNS"},
        "PYTHONPATH": str(ROOT),
        "LC_ALL": "C.UTF-8",
    }


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the logs in it, as a clone has them, and the command ``mrfit``."""
    folder = tmp_path_factory.mktemp("clone")
    (folder / "datasets").symlink_to(ROOT / "datasets")
    command = folder / "bin" / "mrfit"
    command.parent.mkdir()
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m mrfit.cli "$@"\n')
    command.chmod(0o755)
    return folder


def six_digits(line: str) -> str:
    """Return a number as the README writes it, other lines as they are."""
    try:
        return f"{float(line):.6g}"
    except ValueError:
        return line


@pytest.mark.slow
def test_the_commands_print_what_the_readme_shows(clone: Path) -> None:
    path = f"{clone / 'bin'}{os.pathsep}{os.environ['PATH']}"
    sessions = list(blocks(README, "console"))
    assert len(sessions) == 7
    for session in sessions:
        command, *shown = session.rstrip("\n").split("\n")
        assert command.startswith("$ mrfit ")
        done = subprocess.run(
            ["sh", "-c", command[2:]], cwd=clone, env={**environment(), "PATH": path}, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        printed = [line.rstrip() for line in done.stdout.rstrip("\n").split("\n")]
        fault = left_out(shown, printed)
        assert not fault, f"{command}: the README's line\n{fault}\nis not where it should be in\n{done.stdout}"


@pytest.mark.slow
def test_the_python_prints_what_the_readme_shows(clone: Path) -> None:
    (block,) = blocks(README, "python")
    done = subprocess.run([sys.executable, "-c", block], cwd=clone, env=environment(), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    printed = done.stdout.split("\n")
    # the fit prints tables, of which the comment says what is in them
    said = [m for m in re.findall(r"^print\((.+)\)  # (.+)$", block, re.MULTILINE) if m[0] != "fit"]
    assert len(said) == 3
    for _, comment in said:
        assert any(comment in (line, six_digits(line)) for line in printed), comment
    assert (clone / "loops.png").stat().st_size > 10_000 and (clone / "damper.json").is_file()
