"""A fit's parameters belong to the law that was fitted: every use of a stored fit after that law, or its data, changed.

The consumers are listed here by name. A module or a command that reads fits and is not listed fails the last tests.
"""

import ast
import json
import shutil
import signal
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import typer

import mrfit
import mrfit.effects.inertia
from mrfit.apply.damper import damper_of
from mrfit.cli import console
from mrfit.cli.main import app
from mrfit.core import plugins
from mrfit.errors import DataError
from mrfit.fit import predict as fit_predict
from mrfit.fit.select import read_dataset
from mrfit.io import keys
from mrfit.io.keys import law_code
from mrfit.io.workspace import Workspace, read_json, write_json
from tests.test_layers import modules

MODEL = "my-damper+my-spring+inertia"
NAME = f"{MODEL}.lsq.all"
FY, V0, C, K3, MASS, NOISE = 400.0, 0.02, 800.0, 4e7, 20.0, 1.0

DAMPER = """
import numpy as np

from mrfit.core.plugins import model
from mrfit.core.specs import Param
from mrfit.kernels.theta import columns


@model(
    "my-damper",
    inputs=["velocity"],
    output="force",
    params=[
        Param("fy", "N", 1.0, 1e4, 100.0, "log", "yield", "yield force"),
        Param("v0", "m/s", 1e-4, 1.0, 0.01, "log", text="speed at which it yields"),
        Param("c", "N*s/m", 1.0, 1e5, 500.0, "log", "viscous", "viscous damping"),
    ],
    equation="F = fy*(2/pi)*atan(v/v0) + c*v",
    linear=("fy", "c"),
)
def arctangent(drive, theta, dt):
    fy, v0, c = columns(theta)
    return fy * (2 / np.pi) * np.arctan(drive[0] / v0) + c * drive[0]
"""
SPRING = """
from mrfit.core.specs import EffectSpec, Param
from mrfit.kernels.theta import columns

SPEC = EffectSpec(
    name="my-spring",
    title="Spring that hardens",
    equation="F = F_base + k3*x^3",
    reference="none",
    slot="add",
    outputs=("force",),
    inputs=("displacement",),
    params=(Param("k3", "N/m^3", -1e9, 1e9, 0.0, text="cubic stiffness"),),
    neutral=(0.0,),
)


def term(channels, theta, dt):
    (k3,) = columns(theta)
    return k3 * channels["displacement"] ** 3
"""


def log(path: Path, frequency: float, amplitude: float, current: float) -> None:
    """A damper of this law at a current on a sine, with noise."""
    time = np.arange(round(1500 / frequency)) * 2e-3
    rate = 2 * np.pi * frequency
    x, v = amplitude * np.sin(rate * time), amplitude * rate * np.cos(rate * time)
    force = FY * current * 2 / np.pi * np.arctan(v / V0) + C * v + K3 * x**3 - MASS * rate**2 * x
    force += NOISE * np.random.default_rng(round(1e4 * amplitude)).standard_normal(len(time))
    columns = np.stack([time, x, v, -(rate**2) * x, force, np.full(len(time), current)], axis=1)
    head = "time [s],displacement [m],velocity [m/s],acceleration [m/s^2],force [N],current [A]"
    np.savetxt(path, columns, "%.9g", ",", header=head, comments="")


@dataclass(frozen=True)
class Ended:
    """The exit code of a command, and all that it printed."""

    code: int
    text: str


class Study:
    """A folder with plug-ins, logs and a workspace, and the commands run in it."""

    def __init__(
        self, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str] | None
    ) -> None:
        self.folder, self.monkeypatch, self.capsys = folder, monkeypatch, capsys
        monkeypatch.chdir(folder)
        monkeypatch.setenv(plugins.VARIABLE, "damper.py:spring.py")
        self.fresh()

    @property
    def workspace(self) -> Workspace:
        return Workspace(self.folder / "mrfit-work")

    def fresh(self) -> None:
        """Forget what this process knows of plug-ins, and how much it prints, as another one would."""
        self.monkeypatch.setattr(plugins, "_store", plugins.Store())
        vars(console.VERBOSITY).update(vars(console.Verbosity()))

    def run(self, *words: str) -> Ended:
        self.fresh()
        self.monkeypatch.setattr("sys.argv", ["mrfit", *words])
        with pytest.raises(SystemExit) as ended:
            console.run(app)
        told = self.capsys.readouterr() if self.capsys else None
        return Ended(int(str(ended.value.code)), " ".join((told.out + told.err).split()) if told else "")

    def loaded(self) -> mrfit.FitResult:
        self.fresh()
        found = mrfit.load(self.workspace.fit_folder(NAME) / "fit.json")
        assert isinstance(found, mrfit.FitResult)
        return found


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("law")
    (folder / "logs").mkdir()
    for frequency, amplitude in ((1.0, 0.01), (2.0, 0.01), (1.0, 0.02)):
        for current in (0.5, 1.0):
            log(
                folder / "logs" / f"t{frequency:g}Hz-{1e3 * amplitude:g}mm-{current:g}A.csv",
                frequency,
                amplitude,
                current,
            )
    (folder / "damper.py").write_text(DAMPER)
    (folder / "spring.py").write_text(SPRING)
    (folder / "rig.toml").write_text('[rig]\nseconds = 6\nstroke = "30 mm"\nspeed = 0.3\ncurrent = [0.5, 1]\n')
    with pytest.MonkeyPatch.context() as monkeypatch:
        study, before = Study(folder, monkeypatch, None), signal.getsignal(signal.SIGTERM)
        assert study.run("ingest", "logs", "-q").code == 0
        assert study.run(*AGAIN["fit"]).code == 0
        # a drift compares one fit with another
        shutil.copytree(study.workspace.root, folder / "again-work")
        signal.signal(signal.SIGTERM, before)
        study.fresh()
    yield folder


@pytest.fixture
def study(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Iterator[Study]:
    before = signal.getsignal(signal.SIGTERM)
    yield Study(Path(shutil.copytree(whole, tmp_path / "study")), monkeypatch, capsys)
    signal.signal(signal.SIGTERM, before)
    vars(console.VERBOSITY).update(vars(console.Verbosity()))
    keys._file_digest.cache_clear()
    keys.code_version.cache_clear()


def edit_model(study: Study) -> str:
    path = study.folder / "damper.py"
    path.write_text(path.read_text().replace("+ c * drive[0]", "+ 3 * c * drive[0]"))
    return "the plug-in model my-damper (damper.py, line 9) has changed since"


def edit_effect(study: Study) -> str:
    path = study.folder / "spring.py"
    path.write_text(path.read_text().replace("return k3", "return -k3"))
    return "the plug-in effect my-spring (spring.py) has changed since"


def edit_own_effect(study: Study) -> str:
    """Another code of one of mrfit's own effects: its source, and what it does."""
    term, source = mrfit.effects.inertia.term, keys._source
    edited = {"effects/inertia.py": b"\n# edited"}
    study.monkeypatch.setattr("mrfit.effects.inertia.term", lambda *given: 5.0 * term(*given))
    study.monkeypatch.setattr(keys, "_source", lambda name: source(name) + edited.get(name, b""))
    keys._file_digest.cache_clear()
    keys.code_version.cache_clear()
    return "mrfit/effects/inertia.py has changed since"


def cut_otherwise(study: Study) -> str:
    assert study.run("segment", "--holdout", "none").code == 0
    return "the segments have changed since"


def change_samples(study: Study) -> str:
    """Other samples of a recording under the metadata of those that were read, its hash of content among them."""
    path = study.workspace.recording_file("t1Hz-10mm-1A")
    table = pq.ParquetFile(path).read()
    place = table.column_names.index("force")
    values = 1.5 * table["force"].to_numpy()
    metadata = table.schema.metadata
    changed = table.set_column(place, "force", [values]).replace_schema_metadata(metadata)
    pq.write_table(changed, path)
    return "the recordings have changed since"


Edit = Callable[[Study], str]
LAW: list[Edit] = [edit_model, edit_effect, edit_own_effect]
DATA: list[Edit] = [cut_otherwise, change_samples]


def cases(consumers: Iterable[str], edits: Sequence[Edit], quick: Collection[str] = ()) -> pytest.MarkDecorator:
    """Every consumer by every edit; all but the first edit on those consumers that are quick are slow."""
    rows = [
        pytest.param(name, edit, id=f"{name}-{edit.__name__}", marks=[pytest.mark.slow] * (k > 0 or name not in quick))
        for name in consumers
        for k, edit in enumerate(edits)
    ]
    return pytest.mark.parametrize(("consumer", "edit"), rows)


SINE = ("--sine", "1:0.01:2")
SIMULATE: dict[str, Sequence[str]] = {
    "predict": ("predict", "--fit", NAME, "logs/t1Hz-10mm-1A.csv"),
    "export": ("export", "--fit", NAME, "--to", "json"),
    "invert": ("apply", "invert", "--fit", NAME, *SINE, "--law", "c=1000"),
    "track": ("apply", "track", "--fit", NAME, *SINE, "--law", "c=1000"),
    "quarter-car": (
        "apply",
        "quarter-car",
        "--fit",
        NAME,
        "--road",
        "bump",
        "--duration",
        "1",
        "--control",
        "passive-low",
    ),
    "current": ("apply", "current", "--fit", NAME, "logs/t1Hz-10mm-1A.csv"),
    "flux-command": ("apply", "flux-command", "--fit", NAME, "--sine", "1:0.01", "--resistance", "2"),
    "drift": ("drift", "mrfit-work", "again-work", "--fit", NAME),
    "track-parameters": ("track-parameters", "logs/t1Hz-10mm-1A.csv", "--fit", NAME, "--track", "fy"),
    "advise": ("advise", "--goal", "parameters", "--fit", NAME, "--rig", "rig.toml"),
}
"""Commands that simulate a stored fit: they refuse another law."""
OF_FORCE = [name for name in SIMULATE if name not in ("current", "flux-command")]
"""Those that take the fit of a damper; the others refuse it by another line."""
SHOW: dict[str, Sequence[str]] = {
    "figure": ("figure", "loops", "--fit", NAME, "--format", "svg"),
    "report": ("report",),
    "status": ("status",),
}
"""Commands that show what a fit left: they say that it is out of date."""
AGAIN: dict[str, Sequence[str]] = {
    "fit": ("fit", "--model", MODEL, "--opt", "lsq", "--per", "all", "--json"),
    "compare": ("compare", "--models", f"{MODEL},bingham", "--opt", "lsq", "--json"),
    "run": ("run", "p.toml", "--json"),
    "batch": ("batch", "logs", "--model", "my-damper", "--opt", "lsq", "--work", "fleet", "--json"),
}
"""Commands that fit: they fit again."""
NO_FIT = {"ingest", "flux", "segment", "discover", "remove", "datasets", "list", "show", "measure", "plot"}
"""Commands that take no parameters from a stored fit."""


@cases(SIMULATE, LAW, SIMULATE)
def test_what_simulates_a_fit_refuses_another_law(consumer: str, edit: Edit, study: Study) -> None:
    reason = edit(study)
    ended = study.run(*SIMULATE[consumer])
    assert ended.code == 1 and reason in ended.text, ended.text
    assert "simulates otherwise than the fit did" in ended.text
    assert f"fit again: `mrfit fit --model {MODEL} --opt lsq --per all`" in ended.text


@pytest.mark.slow
@pytest.mark.parametrize("consumer", OF_FORCE)
def test_what_simulates_a_fit_is_silent_where_nothing_changed(consumer: str, study: Study) -> None:
    ended = study.run(*SIMULATE[consumer])
    assert ended.code == 0 and "outdated" not in ended.text, ended.text


@cases(SHOW, [*LAW, *DATA], ["figure", "status"])
def test_what_shows_a_fit_says_that_it_is_out_of_date_and_why(consumer: str, edit: Edit, study: Study) -> None:
    before = study.run(*SHOW[consumer])
    assert before.code == 0 and "outdated" not in before.text and "out of date:" not in before.text
    reason = edit(study)
    ended = study.run(*SHOW[consumer])
    assert ended.code == 0 and reason in ended.text.replace(" │ ", " "), ended.text


@cases(OF_FORCE, DATA, ["export"])
def test_what_simulates_a_fit_says_that_its_data_have_changed(consumer: str, edit: Edit, study: Study) -> None:
    reason = edit(study)
    ended = study.run(*SIMULATE[consumer])
    assert ended.code == 0 and f"warning outdated: {NAME}: " in ended.text or consumer == "advise", ended.text
    assert reason in ended.text


@pytest.mark.slow
@pytest.mark.parametrize("consumer", AGAIN)
def test_what_fits_does_it_again_by_the_edited_law(consumer: str, study: Study) -> None:
    stages = f'[ingest]\nlogs = ["logs/*.csv"]\n[[fit]]\nmodel = "{MODEL}"\nopt = "lsq"\nper = "all"\n'
    (study.folder / "p.toml").write_text(stages)

    def made() -> dict[Path, bytes]:
        """Return what the command leaves of fits: none of it changes where nothing is fitted again."""
        assert study.run(*AGAIN[consumer]).code == 0
        kept = [*study.folder.glob("mrfit-work/fits/*/fit.json"), *study.folder.glob("fleet/batch.jsonl")]
        return {path: path.read_bytes() for path in kept}

    before = made()
    assert made() == before
    edit_model(study)
    after = made()
    changed = {path.parent.name for path in before if after[path] != before[path]}
    assert changed == ({"fleet"} if consumer == "batch" else {NAME, f"{MODEL}.lsq"} & {p.parent.name for p in before})


@pytest.mark.parametrize("edit", LAW)
def test_a_fit_read_in_python_refuses_another_law_and_says_so(edit: Edit, study: Study, tmp_path: Path) -> None:
    logs = mrfit.read("logs/t1Hz-10mm-1A.csv")
    assert study.loaded().predict(logs).nrmse < 0.02
    assert not [w for w in study.loaded().warnings if w.kind == "outdated"]
    reason = edit(study)
    found = study.loaded()
    assert [w.text for w in found.warnings if w.kind == "outdated"] == [f"{reason}: fit again"]
    uses: list[Callable[[], object]] = [
        lambda: found.predict(logs),
        lambda: mrfit.predict(found, logs),
        lambda: found.export(tmp_path / "out", to="json"),
        lambda: damper_of(found),
    ]
    for use in uses:
        with pytest.raises(DataError, match="fit again: `mrfit fit") as refused:
            use()
        assert reason in str(refused.value)


def test_a_fit_in_memory_refuses_a_function_that_no_longer_does_what_was_fitted(study: Study, tmp_path: Path) -> None:
    study.fresh()
    logs = mrfit.read(["logs/t1Hz-10mm-1A.csv", "logs/t2Hz-10mm-1A.csv"])
    found = mrfit.fit(logs, model="tanh+inertia", optimizer="lsq", per="all")
    assert found.predict(logs).nrmse < 0.1
    term = mrfit.effects.inertia.term
    # what no hash of a file sees
    study.monkeypatch.setattr("mrfit.effects.inertia.term", lambda *given: 2.0 * term(*given))
    for use in (lambda: found.predict(logs), lambda: found.export(tmp_path / "out", to="json")):
        with pytest.raises(DataError, match="simulates otherwise than the fit did"):
            use()


def test_the_edited_law_with_the_old_parameters_would_be_far_off(study: Study) -> None:
    study.fresh()
    data, fit = read_dataset(study.workspace), fit_predict.read_fit(study.workspace, NAME)
    assert fit_predict.predict(fit, data).metrics[-1].nrmse < 0.02  # type: ignore[operator]
    edit_model(study)
    study.fresh()
    unchecked = replace(fit, law=law_code(fit.model))
    assert fit_predict.predict(unchecked, data).metrics[-1].nrmse > 0.1  # type: ignore[operator]


def test_a_comment_changes_no_law(study: Study) -> None:
    path = study.folder / "damper.py"
    path.write_text(path.read_text() + "# a comment\n")
    ended = study.run(*SIMULATE["export"])
    assert ended.code == 0 and "has changed since; this code simulates the same as the fit did" in ended.text
    # the file that was written states the code that is here
    (written,) = (study.workspace.root / "export" / NAME).glob("*.json")
    study.fresh()
    assert mrfit.load(written).predict(mrfit.read("logs/t1Hz-10mm-1A.csv")).nrmse < 0.02  # type: ignore[union-attr]


def without_law(study: Study) -> None:
    path = study.workspace.fit_folder(NAME) / "fit.json"
    write_json(path, {k: v for k, v in read_json(path).items() if k not in ("law", "segments_sha256")})


@pytest.mark.slow
@pytest.mark.parametrize("consumer", ["predict", "export", "invert", "advise"])
def test_a_fit_of_an_older_mrfit_is_held_against_what_it_simulated(consumer: str, study: Study) -> None:
    without_law(study)
    same = study.run(*SIMULATE[consumer])
    assert same.code == 0 and "an older mrfit made it; this code simulates the same as the fit did" in same.text
    edit_own_effect(study)
    other = study.run(*SIMULATE[consumer])
    assert other.code == 1 and "simulates otherwise than the fit did" in other.text


def test_a_fit_of_an_older_mrfit_without_its_data_says_that_nothing_was_compared(study: Study) -> None:
    without_law(study)
    (study.workspace.fit_folder(NAME) / "residuals.parquet").unlink()
    ended = study.run(*SIMULATE["export"])
    assert ended.code == 0 and "does not state its code, and not compared with what it simulated" in ended.text
    assert "does not state the code of its law" in study.loaded().warnings[-1].text


@pytest.mark.parametrize("edit", LAW[:1])
def test_another_law_with_nothing_to_compare_with_is_refused(edit: Edit, study: Study) -> None:
    (study.workspace.fit_folder(NAME) / "residuals.parquet").unlink()
    reason = edit(study)
    ended = study.run(*SIMULATE["export"])
    assert (
        ended.code == 1
        and f"{reason}, and the data that it simulated are not here to compare with; fit again" in ended.text
    )


@pytest.mark.parametrize("consumer", SIMULATE)
def test_a_plugin_that_is_not_named_is_told_from_an_edited_one(consumer: str, study: Study) -> None:
    study.monkeypatch.setenv(plugins.VARIABLE, "spring.py")
    gone = "the plug-in model my-damper is not here, which --plugin names"
    assert gone in study.run("status").text
    ended = study.run(*SIMULATE[consumer])
    assert ended.code == 1 and f"the fit {NAME}: {gone}: name its file" in ended.text
    assert "unknown model" not in ended.text and "fit again" not in ended.text


@pytest.mark.slow
def test_code_that_a_plugin_calls_and_no_hash_covers_is_seen_by_what_it_simulates(study: Study) -> None:
    (study.folder / "helper.py").write_text("FACTOR = 1.0\n")
    path = study.folder / "damper.py"
    read = f"float(__import__('pathlib').Path({str(study.folder / 'helper.py')!r}).read_text()[9:])"
    path.write_text(path.read_text().replace("+ c * drive[0]", f"+ {read} * c * drive[0]"))
    assert study.run(*AGAIN["fit"]).code == 0
    assert study.run(*SIMULATE["predict"]).code == 0
    (study.folder / "helper.py").write_text("FACTOR = 2.0\n")
    ended = study.run(*SIMULATE["predict"])
    assert ended.code == 1 and "the code of its law has changed since: this code simulates otherwise" in ended.text


def test_samples_that_were_changed_are_read_again_of_their_log(study: Study) -> None:
    change_samples(study)
    assert "no longer what was read of the logs: t1Hz-10mm-1A" in study.run("status").text
    assert json.loads(study.run("ingest", "logs", "--json").text)["replaced"] == ["logs/t1Hz-10mm-1A.csv"]
    assert study.run("status", "-q").text.endswith("none out of date")


# Who reads the document of a fit, and how the rule is kept there
READERS = {
    "fit/predict.py": "read_fit_json",  # read_fit, by which all commands read that simulate; asks lawful
    "api/fitting.py": "read_fit_json",  # mrfit.load: its uses go through assembly_of
    "report/source.py": "stored_fit",  # shows, with workspace.outdated
    "cli/status.py": "stored_fit",  # shows, with Inputs
    "io/workspace.py": "load",  # stored_fit itself
    "fit/stage.py": "reusable",  # fits again by its key
    "compare/stage.py": "reusable",  # fits again by its key; Inputs for those it keeps
    "discover/evidence/plain_fit.py": "reusable",  # fits again by its key
    "cli/pipeline.py": "reusable",  # of the settings of a fit that is being replaced
}
SIMULATING = {
    "fit/predict.py",
    "export/json_file.py",
    "api/fitting.py",
    "advise/parameters.py",
    "cli/pipeline.py",
    "drift/source.py",
    "export/workspace.py",
}
"""Modules that make a model of a fit, by ``assembly_of``, which asks whether its law is the one here."""


@cache
def calls() -> list[tuple[str, str, ast.Call]]:
    """Every call in the package: module, name of the function, call."""
    found = []
    for module, tree in modules():
        for node in ast.walk(tree):
            if isinstance(node, ast.Call):
                name = getattr(node.func, "attr", getattr(node.func, "id", ""))
                found.append((module, name, node))
    return found


def test_every_module_that_reads_fits_keeps_the_rule() -> None:
    found: dict[str, set[str]] = {}
    for module, name, call in calls():
        documents = {a.id for a in call.args if isinstance(a, ast.Name)} & {"Fit", "SavedFit"}
        if name in ("stored_fit", "read_fit_json") or name in ("load", "reusable", "parsed", "of_json") and documents:
            found.setdefault(module, set()).add(name)
    # what export has just written is read again
    assert found.pop("export/json_file.py") == {"of_json"}
    assert {module: names.pop() for module, names in found.items()} == READERS


def test_no_module_makes_a_model_of_a_fit_without_asking_for_its_law() -> None:
    every = calls()
    unasked = {module for module, name, _ in every if name == "as_written"}
    assert unasked == {"simulate/current_levels.py", "fit/files.py", "fit/proof.py"}
    assert {module for module, name, _ in every if name == "assembly_of"} == SIMULATING
    fits = {"fit", "content", "found", "result"}
    written = [
        module
        for module, name, call in every
        if name in ("assemble", "base_of") and call.args and ast.unparse(call.args[0]) in {f"{f}.model" for f in fits}
    ]
    assert set(written) == {"simulate/current_levels.py", "compare/optimizers.py"}


def test_every_command_is_a_consumer_or_takes_nothing_of_a_fit() -> None:
    commands = dict(typer.main.get_command(app).commands)  # type: ignore[attr-defined]
    apply = set(commands.pop("apply").commands)
    listed, there = {*SIMULATE, *SHOW, *AGAIN} | NO_FIT, {*commands, *apply}
    assert there == listed, f"say in one of these lists what it does with a fit: {sorted(there ^ listed)}"
