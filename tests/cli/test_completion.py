"""The shell completes commands and options."""

import os
import subprocess
import sys

import pytest


@pytest.mark.parametrize(("words", "found"), [("mrfit ba", ["batch"]), ("mrfit batch --tab", ["--table"])])
def test_the_shell_completes_commands_and_options(words: str, found: list[str]) -> None:
    asked = {"_MRFIT_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(len(words.split()) - 1)}
    program = "import sys; sys.argv = ['mrfit']; from mrfit.cli.main import main; main()"
    done = subprocess.run([sys.executable, "-c", program], env=os.environ | asked, capture_output=True, text=True)
    assert done.stdout.split() == found and not done.stderr
