"""What benchmarks run as a user does: the command itself."""

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
    whole = [sys.executable, "-m", "mrfit.cli", *command, "--work", str(work)]
    return subprocess.run(whole, check=True, capture_output=True, text=True).stdout
