"""Ctrl-C, or being asked to end, ends a command soon, with one line, and the same command goes on."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mrfit.cli.console import explain
from tests.conftest import Run


def computed(process: "subprocess.Popen[bytes]") -> float:
    """Return the seconds a process has computed, or, where the system does not tell, something like it."""
    try:
        fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        time.sleep(3.0)
        return 3.0
    return sum(map(float, fields[11:13])) / os.sysconf("SC_CLK_TCK")


def searching(process: "subprocess.Popen[bytes]", seconds: float) -> None:
    """Wait until a process has computed for so long, on a machine however busy."""
    while process.poll() is None and computed(process) < seconds:
        time.sleep(0.05)


@pytest.mark.parametrize("asked", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
def test_an_interrupted_search_stops_at_once_and_says_so(
    asked: signal.Signals, mrfit: Run, datasets: Path, tmp_path: Path
) -> None:
    assert mrfit("ingest", datasets / "coil" / "coil_05Hz_3A.csv").returncode == 0
    assert mrfit("segment").returncode == 0
    search = ["fit", "--model", "boucwen-flux", "--opt", "ga", "--budget", "100000000", "--stall", "1"]
    process = subprocess.Popen(
        [sys.executable, "-m", "mrfit.cli", *search], cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )
    searching(process, 3.0)
    assert process.poll() is None
    process.send_signal(asked)
    _, errors = process.communicate(timeout=120.0)
    assert process.returncode == 130
    assert errors.decode().strip().splitlines()[-1] == "mrfit: stopped; the same command goes on where this one was"
    assert not list((tmp_path / "mrfit-work" / "fits").rglob("fit.json"))


def test_what_compiled_code_makes_of_an_interrupt_is_one() -> None:
    error, inner = SystemError("a kernel returned a result with an exception set"), SystemError("so did another")
    error.__cause__, inner.__cause__ = inner, KeyboardInterrupt()
    assert explain(error) == ("", 130)
    assert explain(SystemError("anything else"))[1] == 1
