"""Plug-ins through the command line, as a user has them: installed, or named with --plugin and MRFIT_PLUGINS."""

import json
from pathlib import Path

import pytest
import typer

from mrfit.cli.main import app
from tests.plugin_files import EXAMPLE, TRUTH, acme_log, install, run_python

FILES = [EXAMPLE / "mrfit_example" / f"{n}.py" for n in ("cubic_damper", "hardening_spring", "hooke", "acme")]
FIT = ("fit", "--model", "cubic-damper+hardening-spring", "--opt", "hooke-lsq", "--json")


def cli(folder: Path, *arguments: object, **environment: str) -> str:
    done = run_python(folder, "mrfit.cli", *arguments, **environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_command_that_finds_items_by_name_takes_plugins() -> None:
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    without = {n for n, c in commands.items() if "--plugin" not in {o for p in c.params for o in p.opts}}
    assert without == {"flux", "segment", "datasets"}


def test_an_installed_package_is_read_with_fitted_with_and_reported(tmp_path: Path) -> None:
    site = str(install(tmp_path / "site"))
    acme_log(tmp_path / "run1.log")
    acme_log(tmp_path / "run2.log", seconds=6.0)
    read = json.loads(cli(tmp_path, "ingest", "run1.log", "run2.log", "--json", site=site))
    assert [r["reader"] for r in read["recordings"]] == ["acme", "acme"]
    fit = json.loads(cli(tmp_path, *FIT, "--jobs", 2, site=site))
    found = {p["name"].removeprefix("hardening-spring."): p["value"] for p in fit["results"][0]["parameters"]}
    assert found == pytest.approx(TRUTH, rel=2e-3)
    assert fit["versions"]["mrfit"] and not fit["skipped"]
    assert json.loads(cli(tmp_path, *FIT, "--jobs", 1, site=site))["skipped"]
    assert "Cubic damper" in cli(tmp_path, "show", "cubic-damper", site=site)
    assert json.loads(cli(tmp_path, "report", "--json", site=site))["fits"]
    # any source of the package may change what its model does
    other = Path(site) / "mrfit_example" / "cubic_damper.py"
    other.write_text(other.read_text() + "\n")
    assert not json.loads(cli(tmp_path, *FIT, site=site))["skipped"]


def test_files_are_named_as_options_or_in_the_environment(tmp_path: Path) -> None:
    acme_log(tmp_path / "run1.log")
    options = [part for file in FILES for part in ("--plugin", file)]
    cli(tmp_path, "ingest", "run1.log", *options)
    fit = json.loads(cli(tmp_path, *FIT, *options))
    paths = ":".join(map(str, FILES))
    assert json.loads(cli(tmp_path, *FIT, MRFIT_PLUGINS=paths))["skipped"]
    assert json.loads(cli(tmp_path, "report", "--json", MRFIT_PLUGINS=paths))["fits"]
    unknown = run_python(tmp_path, "mrfit.cli", *FIT)
    assert unknown.returncode == 2 and unknown.stderr.startswith("mrfit: unknown model 'cubic-damper'")
    assert fit["warnings"] == []


def test_code_that_lies_beside_logs_is_never_run(tmp_path: Path) -> None:
    acme_log(tmp_path / "run1.log")
    for name in ("plugin.py", "mrfit_plugins.py", "conftest.py", "sitecustomize.py", "mrfit.py"):
        (tmp_path / "logs").mkdir(exist_ok=True)
        (tmp_path / "logs" / name).write_text("from pathlib import Path\nPath('was_run').touch()\n")
    (tmp_path / "run1.log").rename(tmp_path / "logs" / "run1.log")
    cli(tmp_path, "ingest", "logs", "--plugin", FILES[3])
    assert not (tmp_path / "was_run").exists()


RIVAL = """
from mrfit.core.specs import ReaderSpec
SPEC = ReaderSpec("rival", "Claims what begins with a mark")
def sniff(head):
    {sniff}
def read(source):
    return 1 / 0
"""


def test_two_readers_that_claim_a_file_are_both_named(tmp_path: Path) -> None:
    acme_log(tmp_path / "run1.log")
    rival = tmp_path / "rival.py"
    rival.write_text(RIVAL.format(sniff="return head.lines[0].startswith('ACME')"))
    done = run_python(tmp_path, "mrfit.cli", "ingest", "run1.log", "--plugin", rival, "--plugin", FILES[3])
    names = f"(acme of {FILES[3]} and rival of {rival})"
    assert done.returncode == 1
    assert f"run1.log: it has the marks of more than one format {names}; let the plug-in's sniff ask" in done.stderr
    rival.write_text(RIVAL.format(sniff="return head.lines[0].startswith('OTHER')"))
    cli(tmp_path, "ingest", "run1.log", "--plugin", rival, "--plugin", FILES[3])


@pytest.mark.parametrize(
    ("sniff", "told"),
    [
        ("return 1 / 0", "the plug-in reader rival ({}) failed to tell whether it is its own (ZeroDivisionError"),
        ("return True", "a fault in the plug-in reader rival ({}) (ZeroDivisionError: division by zero); mend the"),
    ],
)
def test_a_reader_that_fails_is_named_with_the_log(tmp_path: Path, sniff: str, told: str) -> None:
    (tmp_path / "log.csv").write_text("time (s),force (N)\n" + "".join(f"{k / 1000},{k % 7}\n" for k in range(500)))
    rival = tmp_path / "rival.py"
    rival.write_text(RIVAL.format(sniff=sniff))
    done = run_python(tmp_path, "mrfit.cli", "ingest", "log.csv", "--plugin", rival)
    assert done.returncode == 1 and f"log.csv: {told.format(rival)}" in done.stderr
    assert done.stderr.count("\n") <= 2
