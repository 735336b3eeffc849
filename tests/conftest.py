"""Shared by all tests: where the logs lie, and the command line as a user runs it."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
Run = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="session")
def datasets() -> Path:
    """The logs the project ships."""
    return ROOT / "datasets"


@pytest.fixture(scope="session")
def real_logs() -> Path:
    """Real instrument files; without MRFIT_REAL_LOGS the test says in one line that it was not run."""
    folder = os.environ.get("MRFIT_REAL_LOGS", "")
    if not Path(folder).is_dir() or not folder:
        pytest.skip("not run: MRFIT_REAL_LOGS does not name a folder of real logs")
    return Path(folder)


@pytest.fixture
def mrfit(tmp_path: Path) -> Run:
    """Run the mrfit command in an empty folder, as a user would, and return what it printed and its exit code."""

    def run(*arguments: object, timeout: float = 300.0) -> "subprocess.CompletedProcess[str]":
        command = [sys.executable, "-m", "mrfit.cli", *map(str, arguments)]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=timeout)

    return run
