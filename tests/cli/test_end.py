"""How a command's process ends: with its exit code and all it printed, after everyone who asked for it was told."""

import subprocess
import sys
from pathlib import Path

import pytest

PLUGIN = '''
import atexit, threading, time
from mrfit.core.plugins import model
from mrfit.core.specs import Param

@model("dashpot", ["velocity"], "force", [Param("c", "N*s/m", 1.0, 1e4, 100.0)])
def law(drive, theta, dt):
    """A dashpot."""
    return theta[:, :1] * drive[0]

atexit.register(print, "told at the end")
threading.Thread(target=lambda: (time.sleep(0.2), print("a thread has ended"))).start()
'''


@pytest.mark.parametrize(("work", "code", "said"), [("there", 0, "1 step in"), ("gone", 1, "no workspace")])
def test_a_command_ends_with_its_code_once_everyone_was_told(work: str, code: int, said: str, tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(PLUGIN)
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "ingest.json").write_text('{"recordings": [], "refused": []}')
    command = ["status", "--plugin", "own.py", "--work", work]
    done = subprocess.run([sys.executable, "-m", "mrfit.cli", *command], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, said in done.stdout + done.stderr) == (code, True)
    *before, last = done.stdout.splitlines()
    assert last == "told at the end" and "a thread has ended" in before


def test_what_cannot_be_written_at_the_end_is_said(tmp_path: Path) -> None:
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "mrfit.cli", "status", "--help"]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode != 0 and "No space left" in done.stderr
