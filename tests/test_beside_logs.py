"""Code and settings that lie beside logs are never run or read, whatever is called in that folder."""

import ast
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.main import get_command

from mrfit.cli.main import app
from mrfit.core import children, current_folder
from tests.beside_logs import COMMANDS, MODULES, Beside
from tests.test_layers import modules

QUICK = (
    *(("ingest", "sample-matlab", "--work", "work-matlab"), ("ingest", "zero.csv", "one.csv")),
    *(("fit", "--model", "bingham", "--per", "all", "--jobs", "2"), ("figure", "loops")),
    ("export", "--fit", "bingham.auto.all", "--to", "c"),
)
PLACE = "core/children.py"
STARTING_MODULES = {"subprocess", "multiprocessing", "pty", "popen2", "commands"}
STARTING_NAMES = {"ProcessPoolExecutor", "Popen", "create_subprocess_exec", "create_subprocess_shell"}
STARTING_IN_OS = ("system", "popen", "fork", "exec", "spawn", "posix_spawn", "startfile")


@pytest.fixture
def beside(tmp_path: Path) -> Beside:
    return Beside(tmp_path)


def run(beside: Beside, commands: tuple[tuple[str, ...], ...]) -> None:
    for words in commands:
        done = beside.command(*words)
        assert done.returncode == 0, f"{words}: {done.stderr[-2000:]}"
        assert not beside.run(), f"{words}: what lies beside the logs was run"
        # a library says so where it reads its settings there
        assert "matplotlibrc" not in done.stderr and "umba" not in done.stderr, done.stderr


def test_commands_that_start_processes_run_nothing_that_lies_beside_logs(beside: Beside) -> None:
    run(beside, QUICK)


@pytest.mark.slow
def test_no_command_runs_what_lies_beside_logs(beside: Beside) -> None:
    assert len(MODULES) > 40
    run(beside, COMMANDS)


@pytest.mark.slow
def test_no_call_from_python_runs_what_lies_beside_logs(beside: Beside) -> None:
    done = beside.calls()
    assert done.returncode == 0, done.stderr[-2000:]
    assert not beside.run()


def test_every_command_is_among_them() -> None:
    def leaves(command: object, name: str = "") -> Iterator[str]:
        inner = getattr(command, "commands", None)
        if inner is None:
            yield name.strip()
        for word, one in (inner or {}).items():
            yield from leaves(one, f"{name} {word}")

    called = [" ".join(words) for words in COMMANDS]
    missing = [name for name in leaves(get_command(app)) if not any(c.startswith(name) for c in called)]
    assert not missing, f"add to COMMANDS in tests/beside_logs.py: {missing}"


def test_what_is_laid_beside_logs_would_leave_a_mark(beside: Beside, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(beside.logs)
    for start in (["-m", "mrfit"], ["-c", "import pickle, h5py"]):
        children.run([sys.executable, *start], beside.logs)
    assert not beside.run()
    # without what `children` gives each process
    monkeypatch.setattr(children, "_changes", dict)
    for name in MODULES:
        children.run(
            [sys.executable, "-S", "-c", f"import sys; sys.modules.pop({name!r}, None); import {name}"], beside.logs
        )
    assert set(beside.run()) >= set(MODULES) - {"site", "runpy", "os"}


def starts(tree: ast.Module) -> Iterator[str]:
    """Yield what in a module starts a process, or could."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (a.name for a in node.names if a.name.split(".")[0] in STARTING_MODULES)
        elif isinstance(node, ast.ImportFrom) and node.module:
            # which receives what a process sends
            named = node.module.split(".")[0] in STARTING_MODULES and node.module != "multiprocessing.connection"
            yield from (f"{node.module}.{a.name}" for a in node.names if named or a.name in STARTING_NAMES)
            if node.module in ("os", "posix"):
                yield from (f"os.{a.name}" for a in node.names if a.name.startswith(STARTING_IN_OS))
        elif isinstance(node, ast.Attribute):
            of_os = isinstance(node.value, ast.Name) and node.value.id in ("os", "posix")
            if node.attr in STARTING_NAMES or (of_os and node.attr.startswith(STARTING_IN_OS)):
                yield node.attr


def test_processes_begin_in_one_place() -> None:
    found = {name: sorted(set(starts(tree))) for name, tree in modules()}
    assert found.pop(PLACE), "the one place starts none"
    assert not {name: what for name, what in found.items() if what}


@pytest.mark.parametrize(
    "code",
    [
        *(
            "import subprocess",
            "import multiprocessing as m",
            "from subprocess import run",
            "import os\nos.system('a')",
        ),
        *(
            "from os import execv",
            "import asyncio\nasyncio.create_subprocess_exec('a')",
            "import os\nos.spawnl(0, 'a')",
        ),
        *(
            "from concurrent.futures import ProcessPoolExecutor",
            "import concurrent.futures as c\nc.ProcessPoolExecutor()",
        ),
    ],
)
def test_a_start_of_a_process_is_seen(code: str) -> None:
    assert list(starts(ast.parse(code)))


def test_only_folders_named_in_full_are_searched_for_code(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    named = str(tmp_path / "named")
    monkeypatch.setenv("PATH", os.pathsep.join(("", "/usr/bin", ".", "bin", "")))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join((named, "", "lib")))
    monkeypatch.setenv("LD_LIBRARY_PATH", os.pathsep)
    monkeypatch.setattr(sys, "path", ["", str(tmp_path), named, str(tmp_path / "lib"), "relative", *sys.path])
    monkeypatch.setattr(sys, "meta_path", list(sys.meta_path))
    rest = sys.path[5:]
    current_folder.leave_out()
    assert sys.path == [named, *rest]
    assert os.environ["PATH"] == "/usr/bin" and os.environ["LD_LIBRARY_PATH"] == ""
    assert os.environ["PYTHONPATH"] == named


@pytest.mark.parametrize(
    "words",
    [
        ("-P", "-c", "import mrfit.core.current_folder, matplotlib"),
        ("-c", "from mrfit.core import current_folder as place; place.leave_out(); import matplotlib"),
        # a command that a command began has two finders
        ("-P", "-c", "from mrfit.core import current_folder as place; place.leave_out(); import matplotlib"),
    ],
)
def test_settings_of_matplotlib_beside_logs_are_hidden(words: tuple[str, ...], tmp_path: Path) -> None:
    (tmp_path / "matplotlibrc").write_text("planted: 1\n")
    done = subprocess.run([sys.executable, *words], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stderr == ""


def test_a_folder_named_in_full_is_kept_though_it_is_the_current_one(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.setattr(sys, "meta_path", list(sys.meta_path))
    before = list(sys.path)
    current_folder.leave_out()
    assert sys.path == before


def test_programs_of_the_current_folder_are_not_found(beside: Beside, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(beside.logs)
    monkeypatch.setenv("PATH", os.pathsep.join(("", ".", str(beside.start))))
    assert children.program("gcc") is None
    (beside.start / "gcc").write_text("#!/bin/sh\n")
    (beside.start / "gcc").chmod(0o755)
    assert children.program("gcc") == str(beside.start / "gcc")
