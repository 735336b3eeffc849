"""What a person and a program see at the terminal: one line, steps, JSON, the project file, the log of commands."""

import json
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from mrfit.cli import console, logbook, project
from mrfit.cli.main import app
from mrfit.cli.options import set_verbosity
from mrfit.errors import ConfigError, DataError, near
from mrfit.settings import flux, segment

Command = Callable[..., tuple[int, str, str]]


@pytest.fixture(autouse=True)
def own_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MRFIT_WORK", raising=False)


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Iterator[Command]:
    """Run a command in this process, in an empty folder; its exit code and what it printed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(console.signal, "signal", lambda *_: None)

    def run(*words: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["mrfit", *map(str, words)])
        with pytest.raises(SystemExit) as end:
            console.run(app)
        printed = capsys.readouterr()
        return int(end.value.code or 0), printed.out, printed.err

    yield run
    set_verbosity(False, False)


def test_a_quiet_command_prints_one_line_and_a_verbose_one_every_step(command: Command, datasets: Path) -> None:
    log = datasets / "coil" / "coil_01Hz_1A.csv"
    assert command("ingest", log, "-q") == (0, "1 recording of 1 log in mrfit-work\n", "")
    code, out, _ = command("segment", "-q")
    assert (code, out) == (0, "1 segment of 1 condition in mrfit-work, 0 held out\n")
    code, out, err = command("fit", "--model", "boucwen-flux", "-v")
    assert code == 0 and out.count("\n") > 10
    assert re.search(r"^sine-1Hz-1A: \d+ in \d+\.\d s$", err, re.MULTILINE) and re.search(
        r"^\d+\.\d s$", err, re.MULTILINE
    )
    assert re.fullmatch(
        r"Fit boucwen-flux\.auto: NRMSE .+ in the held-out part of each test, .+ determined.*; .+", out.splitlines()[-1]
    )
    # made already
    line = command("fit", "--model", "boucwen-flux", "--quiet")[1]
    assert line == out.splitlines()[-1] + "\n"
    # other settings, the same name
    assert "replaced the fit" not in out
    out = command("fit", "--model", "boucwen-flux", "--seed", "3", "--weight", "floor")[1]
    assert "replaced the fit boucwen-flux.auto, made with other settings: seed 0 -> 3, weight none -> floor" in out
    lines = Path("mrfit-work", logbook.LOGBOOK_NAME).read_text().splitlines()
    assert [re.sub(r"^\S+Z (.*)  # \d+\.\d s$", r"\1", line) for line in lines] == [
        f"mrfit ingest {log} -q",
        "mrfit segment -q",
        "mrfit fit --model boucwen-flux -v",
        "mrfit fit --model boucwen-flux --quiet",
        "mrfit fit --model boucwen-flux --seed 3 --weight floor",
    ]
    assert command("status", "-q")[1] == "4 steps in mrfit-work, none out of date\n"
    # what only reads is not noted
    assert len(Path("mrfit-work", logbook.LOGBOOK_NAME).read_text().splitlines()) == 5


def test_the_line_of_a_quiet_command_is_its_result(command: Command, datasets: Path) -> None:
    log, fit, out = datasets / "damper" / "sine_1Hz_12mm.csv", "bingham.auto.all", "mrfit-work/export/bingham.auto.all"
    lines = {
        ("ingest", log, "--preview"): "1 recording would be read",
        ("ingest", log): "1 recording of 1 log in mrfit-work",
        ("fit", "--model", "bingham", "--per", "all"): r"Fit bingham\.auto\.all: NRMSE .*",
        ("export", "--fit", fit, "--to", "json"): f"Export of {fit}: json; {out}",
        ("compare", "--model", "bingham", "--optimizers", "lsq", "--seeds", "1", "--budget", "50"): (
            r"Best of 1 optimizer for bingham: lsq on all, median .* N"
        ),
        ("figure", "predicted", "--fit", fit): r"Figure of predicted, .* wide: .*",
        ("measure", "quasi-static", log): r"Quasi-static test of 1 log: stiffness .* N/m, friction .* N",
        ("batch", log.parent, "--model", "bingham"): r"3 logs: 3 fitted, 0 failed .*page mrfit-batch.batch\.html",
        ("show", "tanh"): r"tanh \(model\): Hyperbolic tangent",
        ("remove", fit): f"Removed from mrfit-work: {fit}",
    }
    for words, line in lines.items():
        code, printed, _ = command(*words, "-q")
        assert code == 0 and re.fullmatch(f"{line}\n", printed.replace("\\", "/")), (words, printed)


def test_names_alone_are_listed_where_little_is_wanted(command: Command) -> None:
    names = command("list", "models", "-q")[1].split()
    assert {"tanh", "bingham"} <= {*names} and not {"name", "title"} & {*names}


def test_little_and_much_are_not_wanted_together(command: Command) -> None:
    assert command("list", "-q", "-v")[::2] == (2, "mrfit: give --quiet or --verbose, not both\n")


@pytest.mark.parametrize(
    ("words", "kind", "code"),
    [
        (("fit", "--model", "tahn"), "config", 2),
        (("fit", "--modle", "tanh"), "config", 2),
        (("fit", "--model", "tanh"), "data", 1),
    ],
)
def test_an_error_is_json_where_json_is_asked_for(
    words: tuple[str, ...], kind: str, code: int, command: Command
) -> None:
    assert command(*words)[:2] == (code, "")
    found, out, err = command(*words, "--json")
    error = json.loads(out)["error"]
    assert (found, error["kind"], error["exit_code"]) == (code, kind, code)
    assert err == f"mrfit: {error['message']}\n"


@pytest.mark.parametrize(
    ("error", "kind"),
    [
        (OSError("full"), "system"),
        (DataError("bad"), "data"),
        (ConfigError("bad"), "config"),
        (ValueError(), "internal"),
    ],
)
def test_errors_have_kinds(error: Exception, kind: str) -> None:
    assert console._kind(error) == kind


def test_a_log_of_commands_is_not_written_through_a_link(tmp_path: Path) -> None:
    work, other = tmp_path / "w", tmp_path / "other"
    work.mkdir()
    (work / logbook.LOGBOOK_NAME).symlink_to(other)
    logbook.append(work, 1.0)
    assert not other.exists()
    logbook.append(tmp_path / "none", 1.0)
    assert not (tmp_path / "none").exists()


def test_control_characters_of_a_command_are_shown_in_its_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["mrfit", "fit", "--name", "a\nb\x1b[2J"])
    logbook.append(tmp_path, 1.0)
    text = (tmp_path / logbook.LOGBOOK_NAME).read_text()
    assert text.count("\n") == 1 and "\x1b" not in text


PROJECT = """
work = "results"
[fit]
model = "tanh"
per = "all"
bounds = {fy = [1, 500], c = [0, 1e4]}
fixed = {k = 0.0}
opt-set = {population = 40}
current-order = 2
[discover]
model = "bingham"
[flux]
resistance = 2.5
drift = "none"
[segment]
holdout = "sine-*-3A"
"""


def test_a_project_file_gives_defaults_in_the_form_of_options(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert project.defaults(["fit", "status"], {}) == {"fit": {}, "status": {}}
    Path("mrfit.toml").write_text(PROJECT.replace("opt-set", "opt_set").replace("current-order", "current_order"))
    found = project.defaults(["flux", "segment", "fit", "discover", "status", "apply"], {"apply": ["track"]})
    assert found["fit"] == {
        "work": "results",
        "model": "tanh",
        "per": "all",
        "bounds": ["fy=1.0:500.0", "c=0.0:10000.0"],
        "fix": ["k=0.0"],
        "opt_set": ["population=40.0"],
        "current_order": 2,
    }
    assert found["discover"] == {"work": "results", "model": "bingham"}
    assert found["flux"] == {"work": "results", "resistance": 2.5, "drift": "none"}
    assert found["segment"] == {"work": "results", "holdout": "sine-*-3A"}
    # what a fit runs before itself in a new workspace
    assert project.settings_of("flux") == flux.Settings(resistance=2.5, drift="none")
    assert project.settings_of("segment") == segment.Settings(holdout="sine-*-3A")
    assert found["status"] == {"work": "results"} and found["apply"] == {"track": {"work": "results"}}


def test_the_command_line_and_the_environment_go_before_the_project_file(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    def asked(*words: str) -> str:
        return command(*words)[2]

    Path("mrfit.toml").write_text('work = "results"\n[fit]\nmodel = "tahn"\nbounds = {fz = [1, 2]}\n')
    assert "unknown model 'tahn'" in asked("fit")
    assert "model 'tanh' has no parameter 'fz'" in asked("fit", "--model", "tanh")
    assert "'fq'" in asked("fit", "--model", "tanh", "--bounds", "fq=1:2")
    assert "results: no workspace" in asked("status")
    assert "other: no workspace" in asked("status", "--work", "other")
    monkeypatch.setenv("MRFIT_WORK", "third")
    assert "third: no workspace" in asked("status")


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ('[fit]\nmodle = "tanh"', r"mrfit.toml: \[fit\] modle is no key mrfit knows; did you mean 'model'"),
        ("[fit]\nseed = 'a'", r"mrfit.toml: \[fit\] seed"),
        ("fit = 3", r"mrfit.toml: \[fit\]"),
        (
            "[segment]\nhold_out = 'x'",
            r"mrfit.toml: \[segment\] hold_out is no key mrfit knows; did you mean 'holdout'",
        ),
        ("[flux]\nrule = 'simson'", r"mrfit.toml: \[flux\] rule"),
        ("work = 3", "mrfit.toml: work takes the name of a folder, not 3"),
        ("no toml [", "mrfit.toml: is not valid TOML: .*line 1"),
    ],
)
def test_a_fault_of_a_project_file_is_named(
    text: str, fault: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mrfit.toml").write_text(text)
    with pytest.raises(ConfigError, match=fault):
        project.defaults(["flux", "segment", "fit", "discover"], {})


@pytest.mark.parametrize("text", ["[channels]\nforce = {column = 1}", '[rig]\nstroke = "50 mm"'], ids=["map", "rig"])
def test_another_file_of_that_name_gives_none(text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mrfit.toml").write_text(text)
    assert project.defaults(["fit"], {}) == {"fit": {}}


def test_a_table_of_errors_fits_80_columns(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("MRFIT_COLUMNS", "80")
    columns = ("condition", "role", "samples", "rmse (N)", "nrmse (%)", "noise_floor (N)", "esr (%)", "fit (%)")
    row = ("sine-1Hz-10mm-0.5A", "holdout", 4500, 5.9674, 0.0070561, 5.9621, 0.027332, 98.351)
    console.print_table("Fit", columns, [row])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    # nothing is broken over lines but the names of the columns
    assert lines[-1].split() == ["sine-1Hz-10mm-0.5A", "holdout", "4500", *"5.967 0.007056 5.962 0.02733 98.35".split()]
    assert {"noise", "floor", "(N)"} <= {word for line in lines[:-2] for word in line.split()}


@pytest.mark.parametrize(("name", "end"), [("tanh.atuo", "; did you mean tanh.auto?"), ("zzz", "")])
def test_a_near_name_is_offered(name: str, end: str) -> None:
    assert near(name, ["tanh.auto", "bingham.auto"]) == end


def test_in_a_pipe_an_estimate_comes_first_and_a_line_every_ten_seconds(capsys: pytest.CaptureFixture[str]) -> None:
    now = [0.0]
    lines = console.Lines(lambda: now[0])
    for done in range(0, 101, 5):
        lines("ride of tanh", done, 100)
        now[0] += 1.5
    said = capsys.readouterr().err.splitlines()
    assert said[0] == "ride of tanh: up to 30 s"
    assert len(said) == 3 and all("of 100, up to" in line for line in said[1:])
    now[0] = 0.0
    short = console.Lines(lambda: now[0])
    for done in range(11):
        short("short", done, 10)
        now[0] += 0.5
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(("seconds", "noted"), [(40.0, False), (1.0, True)])
def test_a_fast_test_is_not_taken_as_a_slow_one_without_a_word(command: Command, seconds: float, noted: bool) -> None:
    phase = 6.0 * np.pi * np.arange(2000) / 2000
    rows = zip(seconds * 3 / 2000 * np.arange(2000), 0.01 * np.sin(phase), 50.0 * np.sign(np.cos(phase)), strict=True)
    Path("log.csv").write_text(
        "time (s),displacement (m),force (N)\n" + "\n".join(f"{t:.6g},{x:.6g},{f:.6g}" for t, x, f in rows)
    )
    code, _, err = command("measure", "quasi-static", "log.csv")
    assert code == 0 and ("is no slow test (above 5 mm/s)" in err) is noted
