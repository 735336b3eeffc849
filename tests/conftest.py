"""Shared by all tests: where the logs lie, and the command line as a user runs it."""

import gc
import os
import signal
import subprocess
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from tests import commands

ROOT = Path(__file__).resolve().parent.parent
# where a test does not say how many; the machine may be busy
settings.register_profile("quick", max_examples=30, deadline=None)
settings.load_profile("quick")
Run = Callable[..., "subprocess.CompletedProcess[str]"]
# As the commands do, before numpy is loaded: matrices are small, and threads of BLAS wait for each other
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Commands keep what Python compiles of mrfit, as a user's do, also where this process is told to keep none
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN and threading.current_thread() is threading.main_thread():
    # a shell starts jobs in the background deaf to Ctrl-C, and so would be the commands that tests interrupt
    signal.signal(signal.SIGINT, signal.default_int_handler)


LONGEST = (
    *("cli/test_pipeline.py", "test_bad_input.py", "ingest/test_hostile_containers.py", "ingest/test_blocks.py"),
    *("test_discover_cli.py", "test_plugin_commands.py", "test_public_api.py", "test_upstream.py"),
    *("batch/test_stage.py", "compare/test_stage.py"),
)
"""Files that start many commands: they come first, so that no process is left with one of them at the end.

The first compiles the kernels of a fit. The next three need none, lest a second process compile them meanwhile.
"""


def pytest_sessionstart() -> None:
    """Keep the environment of all tests, in which mrfit names the folder of its kernels as it is imported.

    Not as this file is imported: processes of tests, whose memory is measured, import it too.
    """
    import mrfit.kernels.jit  # noqa: F401

    commands.AROUND.update(os.environ)
    gc.disable()  # nothing of what is collected here is let go of before the end


def pytest_collection_finish() -> None:
    """Leave the tests themselves out of every later search for garbage: there are more than ten thousand."""
    gc.freeze()
    gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the files that take longest first, and let ``-k`` find items with hyphens by their file's name."""
    for item in items:
        if "-" in item.name:
            item.extra_keyword_matches.add(item.name.replace("-", "_"))
    first = {ROOT / "tests" / name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: first.get(item.path, len(first)))


@pytest.fixture(scope="session")
def datasets() -> Path:
    """The logs the project ships."""
    return ROOT / "datasets"


@pytest.fixture(scope="session")
def real_logs() -> Path:
    """Real instrument files; without MRFIT_REAL_LOGS the test says in one line that it was not run."""
    folder = os.environ.get("MRFIT_REAL_LOGS", "")
    if not Path(folder).is_dir() or not folder:
        pytest.skip("not run: MRFIT_REAL_LOGS does not name a folder of real logs")
    return Path(folder)


@pytest.fixture
def mrfit(tmp_path: Path) -> Run:
    """Run the mrfit command in an empty folder, as a user would, and return what it printed and its exit code."""

    def run(*arguments: object, **how: Any) -> "subprocess.CompletedProcess[str]":
        return commands.text(tmp_path, *arguments, **how)

    return run
