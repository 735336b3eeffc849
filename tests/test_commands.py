"""A fork of a process that has imported libraries, or mrfit too, does what a command that starts from nothing does."""

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests import commands


@pytest.mark.parametrize("fresh", [False, True])
@pytest.mark.parametrize("words", [["status", "--json"], ["fit", "--modl", "tanh"]])
def test_it_prints_and_ends_the_same(words: list[str], fresh: bool, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mrfit.cli", *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    forked = commands.text(tmp_path, *words, fresh=fresh)
    assert (forked.returncode, forked.stdout, forked.stderr) == (done.returncode, done.stdout, done.stderr)
    assert forked.returncode in (1, 2)


@pytest.mark.skipif(sys.platform != "linux", reason="forks elsewhere are no such")
def test_commands_are_forked_unless_python_starts_otherwise() -> None:
    """Else each takes 1 s longer, and no other test says so."""
    importlib.import_module("mrfit.cli")
    assert commands.is_forked(os.environ)
    assert commands.is_forked({**os.environ, "MRFIT_WORK": "elsewhere"})
    assert not commands.is_forked({**os.environ, "PYTHONHASHSEED": "1"})


def test_it_has_its_own_environment_and_ends_in_time(tmp_path: Path) -> None:
    with pytest.raises(subprocess.TimeoutExpired):
        commands.run(tmp_path, "status", timeout=0.001)
    done = commands.text(tmp_path, "status", env={**os.environ, "MRFIT_WORK": "elsewhere"})
    assert done.stderr.startswith("mrfit: elsewhere: no workspace")
    assert commands.text(tmp_path, "status").stderr.startswith("mrfit: mrfit-work: no workspace")
