"""What a command must not import: libraries that cost each start more than its work does."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import Run

COMMAND = """
import sys
sys.argv = ["mrfit", *sys.argv[1:]]
import mrfit.cli.main
try:
    mrfit.cli.main.main()
except SystemExit as end:
    print("code", end.code)
print("loaded", *sorted(sys.modules))
"""
TABLES_AND_FIGURES = {"pandas", "matplotlib", "jinja2", "pint"}
UNUSED_OF_SCIPY = ("signal", "stats", "interpolate", "optimize", "sparse", "spatial", "ndimage", "integrate")
WHOLE_OF_SCIPY = {f"scipy.{part}" for part in UNUSED_OF_SCIPY}
READERS = {"mrfit.ingest.reading", "mrfit.ingest.dispatch", "mrfit.ingest.stage"}
NUMBERS = {"numpy", "pyarrow", "numba", "scipy"}


def loaded(*command: str, **environment: str) -> set[str]:
    call = [sys.executable, "-c", COMMAND, *command]
    done = subprocess.run(call, capture_output=True, text=True, env=os.environ | environment)
    code, modules = done.stdout.splitlines()[-2:]
    assert code == "code 0", done.stderr
    return set(modules.split()[1:])


@pytest.fixture
def work(mrfit: Run, datasets: Path, tmp_path: Path) -> str:
    folder = tmp_path / "w"
    assert mrfit("ingest", datasets / "coil" / "coil_01Hz_1A.csv", "--work", folder).returncode == 0
    return str(folder)


@pytest.mark.parametrize("command", [("--help",), ("fit", "--help"), ("status", "--help")])
def test_help_loads_no_numbers(command: tuple[str, ...]) -> None:
    modules = loaded(*command)
    assert not modules & (NUMBERS | TABLES_AND_FIGURES)
    # by which values are checked: help of all commands has none
    assert "pydantic" not in modules or command != ("--help",)


@pytest.mark.parametrize("words", ["mrfit ba", "mrfit fit --mod", "mrfit fit --model bing"])
def test_completion_loads_no_numbers(words: str) -> None:
    place = str(len(words.split()) - 1)
    modules = loaded(_MRFIT_COMPLETE="complete_bash", COMP_WORDS=words, COMP_CWORD=place)
    assert not modules & (NUMBERS | TABLES_AND_FIGURES)


@pytest.mark.slow
def test_a_fit_of_one_condition_loads_no_part_of_scipy_that_it_does_not_use_and_no_worker(work: str) -> None:
    command = ("fit", "--model", "boucwen-flux", "--work", work)
    # the first reconstructs the flux linkage too
    loaded(*command)
    modules = loaded(*command, "--seed", "1")
    assert not modules & (TABLES_AND_FIGURES | READERS | WHOLE_OF_SCIPY | {"multiprocessing.forkserver"})
    assert {"numba", "scipy.special", "mrfit.fit.stage"} <= modules


def test_status_of_a_log_that_has_changed_loads_what_reads_it(mrfit: Run, datasets: Path, tmp_path: Path) -> None:
    log = tmp_path / "coil_01Hz_1A.csv"
    log.write_bytes((datasets / "coil" / log.name).read_bytes())
    (tmp_path / "mrfit.toml").write_bytes((datasets / "coil" / "mrfit.toml").read_bytes())
    assert mrfit("ingest", log, "--work", tmp_path / "w").returncode == 0
    with log.open("a") as handle:
        handle.write("\n")
    assert loaded("status", "--work", str(tmp_path / "w")) >= {"mrfit.ingest.dispatch"}
    assert f"changed since read: {log}" in mrfit("status", "--work", tmp_path / "w", "--json").stdout
