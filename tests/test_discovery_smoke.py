"""The smoke set of the discovery benchmark: a few hidden effects, and nothing hidden, through the command line."""

import subprocess
import sys

from tests.conftest import ROOT


def test_every_smoke_case_is_judged_right() -> None:
    command = [sys.executable, "-m", "benchmarks.discovery", "--smoke"]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=900)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "smoke set" in result.stdout
