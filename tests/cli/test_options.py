"""Options of the form NAME=VALUE say how they are written."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from mrfit.cli import console
from mrfit.cli.options import CommandAnswer
from mrfit.cli.project import unused_map
from mrfit.errors import ConfigError, DataError
from mrfit.settings.forms import limits, numbers
from tests.conftest import Run


def test_bounds_are_two_numbers() -> None:
    assert limits("--bounds", ["A=1:2.5", "fy@0A=0:3"]) == (("A", 1.0, 2.5), ("fy@0A", 0.0, 3.0))


def test_bounds_without_a_colon_are_shown_their_form() -> None:
    with pytest.raises(ConfigError, match="takes NAME=LOW:HIGH, not 'A=2'"):
        limits("--bounds", ["A=2"])


def test_constants_of_optimizers_stand_in_one_option_or_in_several() -> None:
    wanted = (("b", 1.2), ("population", 40.0), ("mwoa.N_d", 20.0))
    assert (
        numbers("--opt-set", ["b=1.2,population=40", "mwoa.N_d=20"])
        == numbers("--opt-set", ["b=1.2, population=40 ,mwoa.N_d=20"])
        == wanted
    )
    assert numbers("--opt-set", None) == ()
    for wrong in ("b", "b=", "b=1.2,"):
        with pytest.raises(ConfigError, match="--opt-set takes NAME=VALUE"):
            numbers("--opt-set", [wrong])
    with pytest.raises(ConfigError, match="--opt-set: 'x' is not a number"):
        numbers("--opt-set", ["b=x"])


@pytest.mark.parametrize("command", ["ingest", "predict"])
def test_examples_are_whole_in_a_narrow_terminal(command: str, mrfit: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    shown = mrfit(command, "--help").stdout
    assert "'{frequency:Hz}Hz-{current:A}A'" in shown and "…" not in shown


@pytest.mark.parametrize(("given", "used"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "3"}, "3")])
def test_blas_has_one_thread_unless_the_user_says_otherwise(given: dict[str, str], used: str) -> None:
    # read once, when numpy is loaded, which commands do
    code = "import sys, mrfit.cli.main, os; print('numpy' in sys.modules, os.environ['OPENBLAS_NUM_THREADS'])"
    rest = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}
    ended = subprocess.run([sys.executable, "-c", code], env=rest | given, capture_output=True, text=True, check=True)
    assert ended.stdout.split() == ["False", used]


def test_a_wrong_option_ends_before_any_data_are_touched(mrfit: Run) -> None:
    done = mrfit("fit", "--model", "bingham", "--opt", "mwoa-lsq", "--opt-set", "N_D=3")
    line = "mrfit: --opt-set N_D: no option of mwoa, lsq; they are b, population, iterations, N_d, M\n"
    assert (done.returncode, done.stderr) == (2, line)


def test_a_channel_map_away_from_the_logs_is_named(tmp_path, monkeypatch) -> None:
    (tmp_path / "logs").mkdir()
    monkeypatch.chdir(tmp_path)
    Path("mrfit.toml").write_text("[fit]\nper = 'all'\n")
    assert unused_map([Path("logs")]) == ""
    Path("mrfit.toml").write_text("[channels]\nforce = {column = 1}\n")
    assert "holds for logs beside it only" in unused_map([Path("logs")])
    assert unused_map([Path("a.csv")]) == unused_map([Path()]) == ""


def test_an_answer_is_json_alone_or_for_a_person_and_then_checked(monkeypatch, capsys) -> None:
    def fault(result: object) -> None:
        raise DataError(f"{result}")

    for as_json, said in ((True, "[\n  1\n]\n"), (False, "[1] of 2\n")):
        monkeypatch.setattr(console.VERBOSITY, "as_json", as_json)
        answer = CommandAnswer([1], lambda result, number: print(f"{result} of {number}"), 2, check=fault)
        with pytest.raises(DataError, match=r"\[1\]"):
            answer.give()
        assert capsys.readouterr().out == said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["track", "x.csv"], "'track': it may be `mrfit track-parameters` or `mrfit apply track` ("),
        (["watch", "x.csv"], "'watch': it may be `mrfit measure watch` ("),
        (["measure", "fit"], "'fit': it may be `mrfit fit` ("),
        (["fti"], "'fti'. Did you mean 'fit'? ("),
    ],
)
def test_a_command_of_a_group_is_hinted_at_and_a_misspelt_one_is_suggested(
    words: list[str], said: str, mrfit: Run
) -> None:
    ended = mrfit(*words)
    assert ended.returncode == 2
    assert ended.stderr.startswith(f"mrfit: No such command {said}")
