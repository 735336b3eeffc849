"""The smoke set of the discovery benchmark: a few hidden effects, and nothing hidden, through the command line."""

import subprocess
import sys

import pytest

from tests.conftest import ROOT

SMALL = ("null_damper-white",)
"""The case of the smoke set with nothing hidden; test_discover_cli.py has hidden effects and too few data."""


@pytest.mark.parametrize(
    ("match", "cases"), [*((m, 1) for m in SMALL), pytest.param("", 4, marks=pytest.mark.slow, id="all")]
)
def test_every_smoke_case_is_judged_right(match: str, cases: int) -> None:
    command = [sys.executable, "-m", "benchmarks.discovery", "--smoke", "--match", match]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=900)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "smoke set" in result.stdout
    assert f"{cases}/{cases} " in result.stderr
