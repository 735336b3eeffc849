"""The command: what it prints and writes, and one clear line with the right exit code where it cannot."""

import json
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import mrfit
from mrfit.api.preparing import as_asked, prepared
from mrfit.cli import console
from mrfit.cli.main import app
from mrfit.core.progress import silent
from mrfit.io.workspace import Workspace, write_json
from tests.advise.lab import MASS, MODEL, one_frequency

Run = Callable[..., int]
PRESS = 'seconds = 6\nstroke = "30 mm"\nspeed = 0.3\nacceleration = 10\n'


@pytest.fixture(scope="module")
def found() -> mrfit.Discovery:
    return mrfit.discover(one_frequency({"inertia": MASS}, np.random.default_rng(8)), model=MODEL)


@pytest.fixture
def work(tmp_path: Path, found: mrfit.Discovery, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A workspace with a discovery that cannot tell a mass from a spring, and the folder to work in."""
    monkeypatch.chdir(tmp_path)
    workspace = Workspace(tmp_path / "w")
    made = prepared(one_frequency({"inertia": MASS}, np.random.default_rng(8)), as_asked({}), silent)
    for recording in made.dataset.recordings.values():
        workspace.write_recording(recording)
    workspace.write_segments(made.dataset.segments, {})
    (workspace.root / "discover").mkdir()
    write_json(workspace.root / "discover" / "discovery.json", found.to_json())
    return tmp_path


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Iterator[Run]:
    """Run the command line in this process; returns the exit code."""
    before = signal.getsignal(signal.SIGTERM)

    def command(*words: str) -> int:
        monkeypatch.setattr("sys.argv", ["mrfit", *words])
        with pytest.raises(SystemExit) as ended:
            console.run(app)
        return int(str(ended.value.code))

    yield command
    signal.signal(signal.SIGTERM, before)


def rig(folder: Path, text: str) -> str:
    path = folder / "press.toml"
    path.write_text(text)
    return str(path)


def test_words_table_and_files(work: Path, run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    # the rig's limits beside the command are taken
    (work / "mrfit.toml").write_text(f"[rig]\n{PRESS}")
    assert run("advise", "--work", "w") == 0
    said = capsys.readouterr().out
    assert said.startswith("Run a ") and "puts gas-spring and inertia at least" in said.replace("\n", " ")
    assert "test-1.csv" in said and "so that a test of this kind can be held out" in said.replace("\n", " ")
    written = {p.name for p in (work / "w" / "advise").iterdir()}
    assert written >= {"advise.json", "test-1.csv", "companion.csv", "loops.svg", "loops.png"}
    stored = json.loads((work / "w" / "advise" / "advise.json").read_text())
    assert stored["schema"] == "mrfit/advice/1" and stored["rig"]["stroke"] == pytest.approx(0.03)


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        ("rate = 5\n", 2, "no table [rig]"),
        (f"[rig]\n{PRESS}strok = 5\n", 2, "strok"),
        ("[rig]\nseconds = 6\n", 2, "stroke"),
        ('[rig]\nseconds = 0.1\nstroke = "30 mm"\nspeed = 0.3\n', 2, "leaves no test"),
        (f"[rig]\n{PRESS}force = 0.1\n", 2, "takes more than its force, 0.1"),
    ],
)
def test_a_wrong_rig_is_one_line(work, run, capsys, text, code, said) -> None:
    assert run("advise", "--work", "w", "--rig", rig(work, text)) == code
    told = capsys.readouterr()
    assert told.out == "" and told.err.startswith("mrfit: ") and told.err.count("\n") == 1
    assert said in told.err
    assert not (work / "w" / "advise").exists()


def test_a_rival_whose_input_the_rig_cannot_move_is_one_line(work, run, capsys) -> None:
    path = work / "w" / "discover" / "discovery.json"
    stored = json.loads(path.read_text())
    stored["ambiguous_set"] = ["current-lag", "inertia"]
    path.write_text(json.dumps(stored))
    assert run("advise", "--work", "w", "--rig", rig(work, f"[rig]\n{PRESS}")) == 2
    assert "current-lag needs current to move, which [rig] does not state: add current" in capsys.readouterr().err


def test_a_hidden_rival_that_was_never_recorded_is_left_aside(work, run, capsys) -> None:
    path = work / "w" / "discover" / "discovery.json"
    stored = json.loads(path.read_text()) | {"verdict": "none", "ambiguous_set": [], "suspects": [], "effects": []}
    hidden = {"name": "temperature", "screen": 0.0, "holdout_gain": None, "accepted": False}
    stored |= {"candidates": [hidden | {"reason": "cannot be judged: no temperature"}], "augmented_model": MODEL}
    path.write_text(json.dumps(stored))
    assert run("advise", "--work", "w", "--rig", rig(work, f"[rig]\n{PRESS}temperature = [20, 50]\n")) == 1
    told = capsys.readouterr().err
    assert "no rival is left that the rig can show" in told and told.count("\n") == 1


def test_rivals_that_no_test_separates_are_named_and_no_drive_is_written(work, run, capsys) -> None:
    advice = work / "w" / "advise"
    (work / "mrfit.toml").write_text(f"[rig]\n{PRESS}")
    assert run("advise", "--work", "w") == 0 and (advice / "test-1.csv").is_file()
    path = work / "w" / "discover" / "discovery.json"
    stored = json.loads(path.read_text()) | {"verdict": "none", "ambiguous_set": [], "suspects": [], "effects": []}
    same = {"name": "force-offset", "screen": 0.0, "holdout_gain": None, "accepted": False}
    stored |= {"candidates": [same | {"reason": "absorbed by what the model has"}], "augmented_model": MODEL}
    path.write_text(json.dumps(stored))
    capsys.readouterr()
    assert run("advise", "--work", "w") == 0
    said = capsys.readouterr().out.replace("\n", " ")
    assert "separates the rivals, the model as found and force-offset: the best one puts none" in said
    assert "keep one of them" in said and "gain (1/s)" not in said and "Drives" not in said
    assert {p.name for p in advice.iterdir()} == {"advise.json"}
    assert json.loads((advice / "advise.json").read_text())["tests"] == []


def test_no_rivals_and_no_fit_are_one_line(work, run, capsys) -> None:
    path = work / "w" / "discover" / "discovery.json"
    stored = json.loads(path.read_text()) | {"verdict": "none", "ambiguous_set": [], "suspects": [], "candidates": []}
    path.write_text(json.dumps(stored))
    press = rig(work, f"[rig]\n{PRESS}")
    for words, code, said in (
        ((), 1, "left no rivals"),
        (("--goal", "parameters"), 2, "needs --fit NAME"),
        (("--goal", "parameters", "--fit", "none-such"), 1, "no fit named 'none-such'"),
        (("--fit", "f"), 2, "--fit needs --goal parameters"),
    ):
        assert run("advise", "--work", "w", "--rig", press, *words) == code
        told = capsys.readouterr().err
        assert said in told and told.count("\n") == 1


def test_without_a_rig_it_is_the_discoverys_own_advice(work, run, capsys) -> None:
    assert run("advise", "--work", "w") == 0
    told = capsys.readouterr().out
    assert told.startswith("To tell gas-spring, inertia apart:") and "mrfit advise --rig FILE --work w" in told
    assert "`mrfit advise` computes" not in told
    # the lines that it prints, copied into a file, are taken
    lines = [line.strip() for line in told[told.index("  [rig]") :].splitlines()]
    assert {line.partition(" ")[0] for line in lines} == {"[rig]", "seconds", "stroke", "speed"}
    assert run("advise", "--work", "w", "--rig", rig(work, "\n".join(lines))) == 0
    assert capsys.readouterr().out.startswith("Run a ")
    assert run("advise", "--work", "w", "--goal", "parameters", "--fit", "f") == 2
    assert "no rig" in capsys.readouterr().err
