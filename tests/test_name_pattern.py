"""Conditions in file names, given on the command line or in a pipeline file, without a channel map."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrfit.cli.main import app
from tests.conftest import Run

Answer = Callable[..., Any]
PATTERN = "{amplitude:mm}mm{frequency:Hz}Hz{current:A}A"


def press_log(folder: Path, name: str) -> Path:
    time = np.arange(2000) * 1e-3
    x, v = 5.0 * np.sin(2 * np.pi * 4.0 * time), 5.0 * 2 * np.pi * 4.0 * np.cos(2 * np.pi * 4.0 * time)
    rows = "".join(f"{t:.3f},{a:.5f},{2.0 * b:.5f}\n" for t, a, b in zip(time, x, v, strict=True))
    path = folder / name
    path.write_text("time [s],displacement [mm],force [N]\n" + rows)
    return path


@pytest.fixture
def answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Answer:
    """Run a command in an empty folder, in this process, and return what its --json prints."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> Any:
        app([*arguments, "--json"], standalone_mode=False)
        return json.loads(capsys.readouterr().out)

    return run


def conditions(summary: Any) -> dict[str, dict[str, float]]:
    return {r["id"]: r["condition"] for r in summary["recordings"]}


def test_a_pattern_on_the_command_line_gives_conditions(answer: Answer, tmp_path: Path) -> None:
    press_log(tmp_path, "5mm4Hz0x75A.csv")
    press_log(tmp_path, "9mm4Hz1A.csv")
    summary = answer("ingest", "5mm4Hz0x75A.csv", "9mm4Hz1A.csv", "--pattern", PATTERN)
    found = conditions(summary)
    one = found["5mm4Hz0x75A"]
    assert (one["amplitude"], one["frequency"], one["current"]) == (pytest.approx(5e-3), 4.0, 0.75)
    assert found["9mm4Hz1A"]["measured_amplitude"] == pytest.approx(5e-3, rel=0.01)
    texts = [f["text"] for r in summary["recordings"] for f in r["findings"]]
    assert any("the stated amplitude is 9 mm but the data say 5" in t for t in texts)
    # the same log under another pattern is read again
    again = answer("ingest", "5mm4Hz0x75A.csv", "--pattern", "{amplitude:mm}mm*")
    assert set(conditions(again)["5mm4Hz0x75A"]) == {"amplitude", "measured_amplitude"}


def test_a_pattern_in_a_pipeline_file(answer: Answer, tmp_path: Path) -> None:
    press_log(tmp_path, "5mm4Hz0x75A.csv")
    text = f'[ingest]\nlogs = ["*.csv"]\npattern = "{PATTERN}"\n[[fit]]\nmodel = "bingham"\nbudget = 50\n'
    (tmp_path / "run.toml").write_text(text)
    assert conditions(answer("run", "run.toml")["ingest"])["5mm4Hz0x75A"]["current"] == 0.75


def test_a_bad_pattern_is_one_line(mrfit: Run, tmp_path: Path) -> None:
    press_log(tmp_path, "5mm4Hz0x75A.csv")
    result = mrfit("ingest", "5mm4Hz0x75A.csv", "--pattern", "{a:blurb}")
    assert result.returncode == 2 and result.stdout == ""
    assert result.stderr.count("\n") == 1 and "name pattern '{a:blurb}': unknown unit 'blurb'" in result.stderr
    assert not (tmp_path / "mrfit-work").exists()


def test_logs_that_differ_in_any_stated_quantity_are_conditions_of_their_own(answer: Answer, tmp_path: Path) -> None:
    for name in ("5bar-4Hz.csv", "7bar-4Hz.csv", "again-5bar-4Hz.csv"):
        press_log(tmp_path, name)
    with (tmp_path / "again-5bar-4Hz.csv").open("a") as log:
        log.write("2.000,0.00000,251.32741\n")
    answer("ingest", ".", "--pattern", "{pressure:bar}bar-{frequency:Hz}Hz")
    found = {s["recording"]: s["condition"] for s in answer("segment")["segments"]}
    low, high = "sine-4Hz-5mm-5bar", "sine-4Hz-5mm-7bar"
    assert found == {"5bar-4Hz": low, "7bar-4Hz": high, "again-5bar-4Hz": low}
