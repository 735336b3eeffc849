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
    commands = dict(typer.main.get_command(app).commands)  # type: ignore[attr-defined]
    commands |= commands.pop("apply").commands
    without = {n for n, c in commands.items() if "--plugin" not in {o for p in c.params for o in p.opts}}
    alone = {"flux", "segment", "datasets", "remove", "measure", "plot"}
    assert without == alone, f"give plug-ins to these commands, or list them here: {sorted(without ^ alone)}"


def pipeline_file(folder: Path, plugins: str) -> Path:
    """Write a pipeline file that fits with plug-ins, in a folder beside theirs, and return it."""
    acme_log(folder / "logs" / "run1.log")
    stages = '[ingest]\nlogs = ["../logs/*.log"]\n[[fit]]\nmodel = "cubic-damper+hardening-spring"\nopt = "hooke-lsq"\n'
    path = folder / "study" / "p.toml"
    path.write_text(f"plugins = {plugins}\n{stages}")
    return path


@pytest.mark.slow
def test_a_pipeline_file_names_its_plugins_from_its_own_folder(tmp_path: Path) -> None:
    for name in ("logs", "study/own", "elsewhere"):
        (tmp_path / name).mkdir(parents=True)
    for file in FILES:
        (tmp_path / "study" / "own" / file.name).write_bytes(file.read_bytes())
    path = pipeline_file(tmp_path, str([f"own/{f.name}" for f in FILES]))
    done = json.loads(cli(tmp_path / "elsewhere", "run", path, "--json"))
    assert [f["model"] for f in done["fits"]] == ["cubic-damper+hardening-spring"] and done["report"]["fits"]
    assert json.loads(cli(tmp_path, "run", path, "--work", "elsewhere/mrfit-work", "--json"))["fits"][0]["skipped"]
    # what merely lies beside the file or the logs is not run
    for plugins in ("[]", '["own/cubic_damper.py"]'):
        refused = run_python(tmp_path, "mrfit.cli", "run", pipeline_file(tmp_path, plugins), "--work", "w")
        assert refused.returncode == 2 and "unknown " in refused.stderr and not (tmp_path / "w").exists()


@pytest.mark.parametrize(
    ("plugins", "message"),
    [
        ('["nosuch.py"]', "nosuch.py: cannot be read (No such file or directory); give the path of a plug-in file"),
        pytest.param('["p.toml"]', "p.toml: ", marks=pytest.mark.slow),
        ('"own.py"', "p.toml: plugins takes a list, not 'own.py'"),
        pytest.param("[3]", "p.toml: plugins.0 takes text, not 3", marks=pytest.mark.slow),
    ],
)
def test_a_wrong_plugin_of_a_pipeline_file_is_one_line(plugins: str, message: str, tmp_path: Path) -> None:
    for name in ("logs", "study"):
        (tmp_path / name).mkdir()
    path = pipeline_file(tmp_path, plugins)
    done = run_python(tmp_path, "mrfit.cli", "run", path, "--work", "w")
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith(f"mrfit: {tmp_path / 'study'}/") and message in done.stderr
    assert not (tmp_path / "w").exists()


@pytest.mark.slow
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
    again = json.loads(cli(tmp_path, "ingest", "run1.log", "--json", site=site))
    assert again["replaced"] == ["run1.log"] and "its reader" in again["reasons"]["run1.log"]
    assert json.loads(cli(tmp_path, "ingest", "run1.log", "--json", site=site))["skipped"]


@pytest.mark.slow
def test_files_are_named_as_options_or_in_the_environment(tmp_path: Path) -> None:
    acme_log(tmp_path / "run1.log")
    options = [part for file in FILES for part in ("--plugin", file)]
    cli(tmp_path, "ingest", "run1.log", *options)
    fit = json.loads(cli(tmp_path, *FIT, *options))
    paths = ":".join(map(str, FILES))
    assert json.loads(cli(tmp_path, *FIT, MRFIT_PLUGINS=paths))["skipped"]
    unknown = run_python(tmp_path, "mrfit.cli", *FIT)
    assert unknown.returncode == 2 and unknown.stderr.startswith("mrfit: unknown model 'cubic-damper'")
    assert fit["warnings"] == []


@pytest.mark.slow
def test_discovery_names_the_effect_of_a_plugin_that_a_plugins_model_lacks(tmp_path: Path) -> None:
    for frequency in (0.5, 1.0, 2.0, 3.0):
        for stroke in (5, 10, 20):
            path = tmp_path / f"{frequency}Hz-{stroke}mm.log"
            acme_log(path, 200.0, 8.0 / frequency, frequency, 1e-3 * stroke)
    around = {"MRFIT_PLUGINS": ":".join(map(str, FILES))}
    cli(tmp_path, "ingest", *sorted(tmp_path.glob("*.log")), **around)
    found = json.loads(cli(tmp_path, "discover", "--model", "cubic-damper", "--json", "--jobs", 2, **around))
    (effect,) = found["effects"]
    assert effect["name"] == "hardening-spring"
    (parameter,) = effect["parameters"]
    assert parameter["value"] == pytest.approx(TRUTH["k3"], rel=0.01)


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_in_a_plugin_names_its_file_and_line(jobs: int, tmp_path: Path) -> None:
    spec = 'OptimizerSpec(name="crasher", title="Crash", reference="", kind="global", budget=lambda n, o: 9 * n)'
    lines = ("from mrfit.core.specs import OptimizerSpec", f"SPEC = {spec}", "def minimise(objective, rng, options):")
    (tmp_path / "crasher.py").write_text("\n".join([*lines, "    raise ValueError('boom')", ""]))
    for name in ("a.log", "b.log"):
        acme_log(tmp_path / name)
    cli(tmp_path, "ingest", "a.log", "b.log", "--plugin", FILES[3])
    asked = ("fit", "--model", "bingham", "--opt", "crasher", "--plugin", "crasher.py", "--jobs", jobs)
    done = run_python(tmp_path, "mrfit.cli", *asked)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith(
        "crasher.py, line 4: ValueError: boom; mend the plug-in (--debug shows more)"
    )


def test_code_that_lies_beside_logs_is_never_run(tmp_path: Path) -> None:
    acme_log(tmp_path / "run1.log")
    for name in ("plugin.py", "mrfit_plugins.py", "conftest.py", "sitecustomize.py", "mrfit.py"):
        (tmp_path / "logs").mkdir(exist_ok=True)
        (tmp_path / "logs" / name).write_text("from pathlib import Path\nPath('was_run').touch()\n")
    (tmp_path / "run1.log").rename(tmp_path / "logs" / "run1.log")
    cli(tmp_path, "ingest", "logs", "--plugin", FILES[3])
    assert not (tmp_path / "was_run").exists()
