"""What benchmarks have in common: the command, run as a user does, and where a page goes."""

import subprocess
import sys
from pathlib import Path

COIL = Path(__file__).parent.parent / "datasets" / "coil"


def run_mrfit(work: Path, *command: str) -> str:
    """Run a command in a workspace and return what it prints.

    Raises
    ------
    subprocess.CalledProcessError
        If it fails.
    """
    return run_anywhere(*command, "--work", str(work))


def run_anywhere(*command: str) -> str:
    """Run a command that needs no workspace and return what it prints.

    Raises
    ------
    subprocess.CalledProcessError
        If it fails.
    """
    whole = [sys.executable, "-m", "mrfit.cli", *command]
    return subprocess.run(whole, check=True, capture_output=True, text=True).stdout


def deliver(text: str, out: Path | None) -> None:
    """Write a page to a file, or to standard output where none is named."""
    if out:
        out.write_text(text, encoding="utf-8")
    else:
        sys.stdout.write(text)
