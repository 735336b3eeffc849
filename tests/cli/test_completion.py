"""The shell completes commands and options, and the names of models, effects, optimizers and fits."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from mrfit.cli import names
from mrfit.search import strategies


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("mrfit ba", ["batch"]),
        ("mrfit batch --tab", ["--table"]),
        ("mrfit fit --model boucwen-fl", ["boucwen-flux", "boucwen-flux-n1n2"]),
        ("mrfit remove --work w a", ["a", "a2"]),
    ],
)
def test_the_shell_completes_commands_options_and_names(words: str, found: list[str], tmp_path: Path) -> None:
    for name in ("a", "a2", "b"):
        (tmp_path / "w" / "fits" / name).mkdir(parents=True)
        (tmp_path / "w" / "fits" / name / "fit.json").touch()
    (tmp_path / "w" / "fits" / "a3").mkdir()
    asked = {"_MRFIT_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(len(words.split()) - 1)}
    program = "import sys; sys.argv = ['mrfit']; from mrfit.cli.main import main; main()"
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, env=os.environ | asked, cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.split() == found and not done.stderr


def test_what_may_follow_a_name_is_completed() -> None:
    assert names.model("boucwen-flux+eddy") == ["boucwen-flux+eddy-current"]
    assert names.optimizer("pso-fm") == ["pso-fmin"] and names.optimizer("pso-au") == []
    assert names.item("current-l") == ["current-lag"] and names.model("nosuch") == []


def test_all_that_can_be_an_optimizer_is_completed() -> None:
    assert names.optimizer("") == list(strategies.specs())
