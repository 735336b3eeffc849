import json
import stat
import sys

import pytest

from benchmarks.discovery import runner
from benchmarks.discovery.protocol import full

CASES = {c.name: c for c in full()}
LITTLE = CASES["little_delay_visible_one-log_0"]
STAND_IN = """\
#!{python}
import json, pathlib, sys
calls = pathlib.Path({calls!r})
calls.write_text((calls.read_text() if calls.exists() else "") + json.dumps(sys.argv[1:]) + "\\n")
if sys.argv[1] == "show":
    print(json.dumps({{"params": [{{"name": "fy", "start": 500.0, "low": 1.0, "high": 600.0}}]}}))
if sys.argv[1] == "discover":
    {discover}
"""


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    def install(discover):
        calls = tmp_path / "calls"
        script = tmp_path / "mrfit"
        script.write_text(STAND_IN.format(python=sys.executable, calls=str(calls), discover=discover))
        script.chmod(script.stat().st_mode | stat.S_IXUSR)
        monkeypatch.setattr(runner, "MRFIT", script)
        return lambda: [json.loads(line) for line in calls.read_text().splitlines()]

    return install


def test_a_case_is_run_as_a_user_would_and_never_shows_the_truth(stand_in, tmp_path):
    calls = stand_in("print(json.dumps({'verdict': 'insufficient-data', 'effects': []}))")
    result = runner.run(LITTLE, tmp_path / "case")
    assert result.discovery["verdict"] == "insufficient-data"
    assert result.truth["effects"] == {"delay": 0.00105}
    ingest, discover = calls()
    assert ingest[0] == "ingest"
    assert discover[:1] == ["discover"]
    assert discover[-3:] == ["--model", "tanh", "--json"]
    assert not any("truth" in word or "delay" in word for word in (*ingest[1:], *discover[1:]))


def test_a_failure_is_kept_as_one_line(stand_in, tmp_path):
    stand_in("sys.exit('mrfit: no segment found')")
    result = runner.run(LITTLE, tmp_path / "case")
    assert result.error == "mrfit discover ended with 1: mrfit: no segment found"


def test_start_values_are_moved_within_their_bounds(stand_in):
    stand_in("pass")
    assert runner.starts("tanh", 1.3) == ["--start", "fy=600"]
    assert runner.starts("tanh", 0.7) == ["--start", "fy=350"]
    assert runner.starts("tanh", 1.0) == []


def test_what_is_finished_is_not_run_again(stand_in, tmp_path):
    calls = stand_in("print(json.dumps({'verdict': 'none'}))")
    first = list(runner.run_all([LITTLE], 1, tmp_path / "kept"))
    second = list(runner.run_all([LITTLE], 1, tmp_path / "kept"))
    assert first == second
    assert len([c for c in calls() if c[0] == "discover"]) == 1
