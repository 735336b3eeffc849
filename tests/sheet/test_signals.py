"""`mrfit plot`: series, cuts and warnings at their time, loops, hostile names, logs without a motion."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np

import mrfit
from mrfit.core.recording import Finding
from mrfit.sheet.signals import signals_of, write
from tests.conftest import Run


def two_tests(name: str = "a") -> mrfit.Recording:
    time = np.arange(12000) / 1000.0
    phase = 2 * np.pi * np.cumsum(np.where(time < 6.0, 1.0, 3.0)) / 1000.0
    moved = 0.01 * np.sin(phase)
    return mrfit.Recording.from_arrays(dt=1e-3, displacement=moved, force=2e4 * np.gradient(moved, 1e-3), name=name)


def test_a_page_has_every_channel_the_cuts_and_the_warnings_at_their_time(tmp_path: Path) -> None:
    finding = Finding("odd", "force", 3.0, "a spike of <9 kN>")
    record = replace(two_tests(), findings=(finding, Finding("odd", "", None, "no unit given")))
    [page, picture], [one] = write([record], 1, tmp_path, png=True)
    text = page.read_text()
    assert picture.read_bytes().startswith(b"\x89PNG") and text.count('class="trace"') == 2
    assert len(one.segments) == 2 and text.count('class="cuts"><rect') == 2
    # at a quarter of the log's time, on the channel that it is about, and in the table
    assert re.findall(r'class="warned" d="M(\d+) ', text) == ["5000"]
    assert "a spike of &lt;9 kN&gt;" in text and "<9 kN>" not in text and "no unit given" in text
    begins = [float(x) for x in re.findall(r'<rect x="(\d+)" width="\d+" y="0"', text)[:2]]
    assert begins[0] < 1000 and abs(begins[1] - 10000) < 1000
    # no peak is lost: the path touches both ends of the picture
    steps = re.search(r'class="line" d="M0 (\d+)l([^"]+)"', text)
    assert steps is not None
    level = int(steps[1]) + np.cumsum([int(s) for s in steps[2].split()[1::2]])
    assert level.min() == 0 and level.max() == 1000


def test_a_log_that_is_not_cut_says_why() -> None:
    still = mrfit.Recording.from_arrays(dt=1e-3, displacement=np.zeros(2000), force=np.zeros(2000), name="still")
    one = signals_of(still)
    assert not one.segments and "moves" in one.said[0]
    assert still.plot().get_size_inches()[0] == 10.0


def test_the_command_line_writes_it_for_logs_and_for_what_was_ingested(tmp_path: Path, mrfit: Run) -> None:
    time, path = np.arange(4000) / 200.0, tmp_path / "x & <b>.csv"
    table = np.stack([time, 10.0 * np.sin(2 * np.pi * time), 300.0 * np.cos(2 * np.pi * time)], axis=1)
    np.savetxt(path, table, "%.6g", ",", header="t (s),x (mm),F (N)", comments="")
    found = json.loads(mrfit("plot", str(path), "--out", str(tmp_path / "o"), "--png", "--json").stdout)
    assert found["logs"][0]["cuts"] == 1 and all(Path(file).exists() for file in found["files"])
    page = (tmp_path / "o" / "signals.html").read_text()
    assert "x &amp; &lt;b&gt;.csv" in page and len(page) < 300_000
    run = mrfit("ingest", str(path), "--plot", "--work", str(tmp_path / "w"))
    assert "Signals: " in run.stdout and (tmp_path / "w" / "plot" / "signals.html").exists()
    run = mrfit("plot", str(tmp_path / "none.csv"))
    assert run.returncode == 1 and len([line for line in run.stderr.splitlines() if line]) == 1
