"""`make batch`: every log under a folder once, again when it, its map, the model or the optimizer changed."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.conftest import ROOT

# keeps the command lines and makes the file that stands for the workspace
STAND_IN = """#!/bin/sh
echo "$*" >> calls
while [ $# -gt 0 ]; do [ "$1" = --work ] && work=$2; shift; done
mkdir -p "$work/report"
"""


class Folder:
    """A project's folder with a stand-in for mrfit, and logs beside it."""

    def __init__(self, root: Path) -> None:
        self.project, self.logs = root / "project", root / "logs"
        for folder in (self.project / "v" / "bin", self.logs / "sub"):
            folder.mkdir(parents=True)
        for name in ("Makefile", "pyproject.toml", "constraints.txt"):
            shutil.copy(ROOT / name, self.project)
        command = self.project / "v" / "bin" / "mrfit"
        command.write_text(STAND_IN)
        command.chmod(0o755)
        (self.project / "v" / "installed").touch()

    def log(self, *names: str) -> None:
        for name in names:
            (self.logs / name).touch()

    def batch(self, *options: str) -> "subprocess.CompletedProcess[str]":
        command = ["make", "batch", "VENV=v", "LOGS=../logs", *options]
        environment = {k: v for k, v in os.environ.items() if not k.startswith(("MAKE", "MFLAGS"))}
        return subprocess.run(command, cwd=self.project, capture_output=True, text=True, env=environment)

    def done(self, *options: str) -> list[str]:
        """Run, and return the command lines of fits as MODEL WORKSPACE."""
        calls = self.project / "calls"
        calls.write_text("")
        result = self.batch(*options)
        assert result.returncode == 0, result.stderr
        fits = [line.split() for line in calls.read_text().splitlines() if line.startswith("fit ")]
        return sorted(f"{words[2]} {words[6]}" for words in fits)


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    return Folder(tmp_path)


def test_every_log_has_a_workspace_of_its_own_inside_the_batch(folder: Folder) -> None:
    folder.log("a.csv", "a.txt", "B.CSV", "sub/c.csv")
    work = "boucwen-flux batch-work/__/logs"
    assert folder.done("PATTERN=*.*") == [f"{work}/B.CSV", f"{work}/a.csv", f"{work}/a.txt", f"{work}/sub/c.csv"]
    assert sorted(p.name for p in folder.logs.parent.iterdir()) == ["logs", "project"]


def test_only_what_changed_is_done_again(folder: Folder) -> None:
    folder.log("a.csv", "b.csv")
    assert len(folder.done()) == 2
    assert folder.done() == []
    later = (folder.logs / "b.csv").stat().st_mtime + 5
    os.utime(folder.logs / "b.csv", (later, later))
    assert folder.done() == ["boucwen-flux batch-work/__/logs/b.csv"]


def test_another_model_or_optimizer_is_work_to_do(folder: Folder) -> None:
    folder.log("a.csv")
    assert len(folder.done()) == 1
    assert folder.done("MODEL=bingham") == ["bingham batch-work/__/logs/a.csv"]
    assert len(folder.done("MODEL=bingham", "OPT=lsq")) == 1
    assert folder.done("MODEL=bingham") == []


@pytest.mark.parametrize(
    ("names", "options", "words"),
    [
        ((), (), "no log like *.csv under '../logs'"),
        (("a.csv",), ("LOGS=nowhere",), "no log like *.csv under 'nowhere'"),
        (("a.csv", "my log.csv"), (), "rename '../logs/my log.csv'"),
        (("f=5Hz.csv",), (), "rename '../logs/f=5Hz.csv'"),
        (("a#1.csv",), (), "rename '../logs/a#1.csv'"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(
    names: tuple[str, ...], options: tuple[str, ...], words: str, folder: Folder
) -> None:
    folder.log(*names)
    result = folder.batch(*options)
    assert result.returncode != 0
    assert words in result.stderr and result.stderr.count("\n") == 1
    assert not (folder.project / "calls").exists()
