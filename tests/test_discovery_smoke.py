"""The smoke set of the discovery benchmark: a few hidden effects, and nothing hidden, through the command line.

Quick tests of the same: test_discover_cli.py has hidden effects and too few data, discover/test_stage.py none hidden.
"""

import subprocess
import sys

import pytest

from tests.conftest import ROOT


@pytest.mark.slow
def test_every_smoke_case_is_judged_right() -> None:
    command = [sys.executable, "-m", "benchmarks.discovery", "--smoke"]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=900)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "smoke set" in result.stdout
    assert "4/4 " in result.stderr
