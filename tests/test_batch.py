"""`make batch` is one call of `mrfit batch`, with the variables of the make command as its options."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.conftest import ROOT

# keeps its arguments, one a line, and ends as it is told
STAND_IN = """#!/bin/sh
for one in "$@"; do printf '%s\\n' "$one" >> calls; done
exit ${ENDS_WITH:-0}
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project's folder with a stand-in for mrfit."""
    project = tmp_path / "project"
    (project / "v" / "bin").mkdir(parents=True)
    for name in ("Makefile", "pyproject.toml", "constraints.txt"):
        shutil.copy(ROOT / name, project)
    command = project / "v" / "bin" / "mrfit"
    command.write_text(STAND_IN)
    command.chmod(0o755)
    (project / "v" / "installed").touch()
    return project


def batch(project: Path, *options: str, ends_with: int = 0) -> "tuple[int, list[str]]":
    """Run the target; return how it ended and the arguments mrfit was given."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("MAKE", "MFLAGS"))}
    environment["ENDS_WITH"] = str(ends_with)
    done = subprocess.run(["make", "batch", "VENV=v", *options], cwd=project, capture_output=True, env=environment)
    calls = project / "calls"
    return done.returncode, calls.read_text().splitlines() if calls.exists() else []


def test_defaults(project: Path) -> None:
    code, words = batch(project)
    assert code == 0 and words[:2] == ["batch", "datasets/coil"]
    assert "--report" in words
    assert _options(words) == {
        "like": "*.csv",
        "model": "boucwen-flux",
        "opt": "pso-fmin",
        "work": "batch-work",
        "jobs": "2",
    }


def _options(words: list[str]) -> dict[str, str]:
    """Return the options with a value; every workspace gets a report."""
    words = [w for w in words[2:] if w != "--report"]
    return {name.removeprefix("--"): value for name, value in zip(words[::2], words[1::2], strict=True)}


def test_variables_are_options_whatever_signs_are_in_a_folders_name(project: Path) -> None:
    variables = ("LOGS=../my logs & more", "MODEL=tanh", "OPT=auto", "PATTERN=*.txt", "BATCH=out", "JOBS=7")
    code, words = batch(project, *variables)
    assert code == 0 and words[1] == "../my logs & more"
    assert _options(words) == {"like": "*.txt", "model": "tanh", "opt": "auto", "work": "out", "jobs": "7"}


def test_a_batch_that_fails_fails_make(project: Path) -> None:
    assert batch(project, ends_with=1)[0] != 0
