"""What a workspace holds and what is out of date and why; taking fits out of it."""

import json
import os
import shutil
from contextlib import chdir
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrfit.compare.stage
import mrfit.discover.stage
import mrfit.fit.stage
import mrfit.flux.stage
import mrfit.ingest.stage
import mrfit.report.stage
import mrfit.segment.stage
from mrfit.cli import output, pipeline
from mrfit.cli.status import Step, status
from mrfit.core.progress import silent
from mrfit.errors import ConfigError, DataError
from mrfit.io.keys import code_version
from mrfit.io.workspace import Workspace, read_json, write_json
from mrfit.settings.compare import OfOptimizers, Settings
from tests.cli.test_start import NUMBERS, READERS, TABLES_AND_FIGURES, loaded
from tests.conftest import Run

FIT = mrfit.fit.stage.Settings("polynomial", "lsq", per="all")
NAME = "polynomial.lsq.all"
RATE, CYCLES, FREQUENCY = 200, 8, 2.0


def log(path: Path, level: float, factor: float = 1.0) -> None:
    """A damper whose force goes with velocity, at one of several strokes."""
    time = np.arange(RATE * CYCLES) / (RATE * FREQUENCY)
    turn = 2 * np.pi * FREQUENCY * time
    noise = np.random.default_rng(int(10 * level)).standard_normal(len(time))
    stroke = 0.01 * level
    force = factor * 100.0 * stroke * 2 * np.pi * FREQUENCY * np.cos(turn) + 0.01 * noise
    columns = np.stack([time, stroke * np.sin(turn), force], axis=1)
    head = "time [s],displacement [m],force [N]"
    np.savetxt(path, columns, "%.9g", ",", header=head, comments="")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with logs and a workspace in which every step has run."""
    folder = tmp_path_factory.mktemp("status")
    (folder / "logs").mkdir()
    for k in range(1, 5):
        log(folder / "logs" / f"test-{k}.csv", float(k))
    work = folder / "w"
    with chdir(folder):  # sources are relative, so that a copy has logs of its own
        pipeline.ingest(Path("w"), [Path("logs")], mrfit.ingest.stage.Settings(), silent)
    pipeline.segment(work, mrfit.segment.stage.Settings(), silent)
    pipeline.fit(work, FIT, None, silent)
    pipeline.compare_models(work, Settings(("polynomial", "bingham"), "lsq"), silent)
    pipeline.compare_optimizers(work, OfOptimizers(("lsq",), replace(FIT, optimizer="auto"), 1), silent)
    pipeline.discover(work, mrfit.discover.stage.Settings("polynomial"), None, silent)
    pipeline.report(work, mrfit.report.stage.Settings(), silent)
    return folder


def test_status_of_every_step_loads_no_numbers_and_not_what_reads_logs(whole: Path) -> None:
    modules = loaded("status", "--work", str(whole / "w"))
    assert not modules & (NUMBERS | TABLES_AND_FIGURES | READERS)
    assert not [name for name in modules if name.startswith(("mrfit.fit.", "mrfit.kernels."))]
    assert {"mrfit.cli.status", "mrfit.io.schemas.fit", "mrfit.io.schemas.discovery"} <= modules


@pytest.fixture
def study(whole: Path, tmp_path: Path) -> Path:
    """A copy of it that may be changed."""
    return Path(shutil.copytree(whole, tmp_path / "study"))


def steps(study: Path) -> dict[str, Step]:
    return {" ".join(filter(None, (s.step, s.name))): s for s in status(Workspace(study / "w"))}


def reasons(study: Path) -> dict[str, str]:
    """Why steps are out of date, of those that are."""
    return {name: step.outdated for name, step in steps(study).items() if step.outdated}


@pytest.mark.slow
def test_a_workspace_that_is_up_to_date_says_what_it_holds_and_what_each_step_used(study: Path) -> None:
    before = {p: p.stat().st_mtime_ns for p in study.rglob("*")}
    found = steps(study)
    assert list(found) == [
        "recordings",
        "flux",
        "segments",
        "fit bingham.lsq.all",
        f"fit {NAME}",
        "discovery",
        "models compared",
        "optimizers compared",
        "report",
    ]
    assert reasons(study) == {}
    assert found["recordings"].holds == "4 recordings of 4 logs"
    assert found["flux"].holds == "4 passed through"
    conditions = [
        s["condition"] for s in pipeline.segment(study / "w", mrfit.segment.stage.Settings(), silent)["segments"]
    ]
    assert found["segments"].names == list(dict.fromkeys(conditions))
    fit = found[f"fit {NAME}"]
    assert fit.holds.startswith("polynomial by lsq: 1 set of parameters, NRMSE ")
    assert (fit.settings["per"], fit.settings["seed"]) == ("all", 0)
    stages = {
        "recordings": "ingest",
        "flux": "flux",
        "segments": "segment",
        f"fit {NAME}": "fit",
        "discovery": "discover",
    }
    for step, stage in stages.items():
        assert found[step].code == code_version(stage)
    assert found["report"].names == ["bingham.lsq.all", NAME] and found["report"].code == code_version()
    assert {p: p.stat().st_mtime_ns for p in study.rglob("*")} == before


def test_a_changed_log_is_seen_before_it_is_read_again_and_everything_after_that(study: Path) -> None:
    log(study / "logs" / "test-2.csv", 2.0, 1.5)
    assert set(reasons(study)) == {"recordings"}
    assert "test-2.csv" in reasons(study)["recordings"]
    pipeline.ingest(study / "w", [study / "logs"], mrfit.ingest.stage.Settings(), silent)
    found = reasons(study)
    assert "recordings" not in found
    assert found["flux"] == "the recordings have changed since"
    assert found["segments"] == f"the flux linkage is out of date: {found['flux']}" == found[f"fit {NAME}"]
    assert set(found) == {s for s in steps(study) if s != "recordings"}
    pipeline.segment(study / "w", mrfit.segment.stage.Settings(), silent)
    found = reasons(study)
    assert "flux" not in found and "segments" not in found
    assert found[f"fit {NAME}"] == "its recordings, or their flux linkage, have changed since" == found["discovery"]


def test_a_log_that_is_gone_makes_nothing_out_of_date(study: Path) -> None:
    (study / "logs" / "test-2.csv").unlink()
    assert reasons(study) == {}


def test_a_new_recording_is_named(study: Path) -> None:
    log(study / "logs" / "test-9.csv", 9.0)
    pipeline.ingest(study / "w", [study / "logs"], mrfit.ingest.stage.Settings(), silent)
    assert reasons(study)["flux"] == "the recordings have changed since: test-9 new"


def test_segments_cut_otherwise_are_told_from_other_recordings(study: Path) -> None:
    pipeline.segment(study / "w", mrfit.segment.stage.Settings(holdout="none"), silent)
    found = reasons(study)
    assert (
        found[f"fit {NAME}"] == found["discovery"] == found["optimizers compared"] == "the segments have changed since"
    )
    assert found["models compared"].endswith(": the segments have changed since")
    assert "report" in found and not {"recordings", "flux", "segments"} & set(found)


@pytest.mark.parametrize(
    ("file", "step"),
    [
        ("flux.json", "flux"),
        (f"fits/{NAME}/fit.json", f"fit {NAME}"),
        ("discover/discovery.json", "discovery"),
        ("report/report.json", "report"),
    ],
)
def test_other_code_is_told_from_other_data(file: str, step: str, study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The key of what other code made, and that code's version."""
    stage = {"flux": "flux", "discovery": "discover", "report": ""}.get(step, "fit")
    real = code_version

    def other(which: str = "") -> str:
        return "0123456789abcdef" if which == stage else real(which)

    path = study / "w" / file
    with monkeypatch.context() as patched:
        patched.setattr("mrfit.io.keys.code_version", other)
        patched.setattr("mrfit.report.stage.code_version", other)
        write_json(path, {**read_json(path), "code": other(stage), "key": _key(study / "w", step)})
    assert reasons(study)[step] == f"made by other code (01234567) than this ({real(stage)[:8]})"


def _key(work: Path, step: str) -> str:
    from mrfit.io.keys import discovery_key, fit_key, flux_key

    workspace = Workspace(work)
    if step == "flux":
        return flux_key(asdict(workspace.flux_file().settings), workspace.contents(workspace.identifiers))
    if step == "report":
        return mrfit.report.stage.report_key(workspace, ["bingham.lsq.all", NAME], {})
    here = workspace.made_from(workspace.read_segments())
    file = "discover/discovery.json" if step == "discovery" else f"fits/{NAME}/fit.json"
    key = discovery_key if step == "discovery" else fit_key
    return key(read_json(work / file)["settings"], *here)


def test_a_fit_made_anew_makes_the_comparison_and_the_report_out_of_date(study: Path) -> None:
    pipeline.fit(
        study / "w", mrfit.fit.stage.Settings("polynomial", "lsq", per="all", fixed=(("a0", 1.0),)), None, silent
    )
    found = reasons(study)
    assert found["models compared"] == f"the fit {NAME} has been made again since"
    assert set(found) == {"models compared", "report"}


def test_a_prediction_saved_later_is_the_reason_why_a_report_is_out_of_date(study: Path) -> None:
    made = study / "w" / "report" / "report.json"
    (study / "w" / "predict").mkdir(exist_ok=True)
    later = study / "w" / "predict" / "other.json"
    later.write_text("{}")
    os.utime(later, (made.stat().st_mtime + 10.0,) * 2)
    assert reasons(study) == {"report": "predictions were saved since: other"}


def test_a_damaged_file_is_a_reason_and_the_rest_is_told(study: Path) -> None:
    (study / "w" / "fits" / NAME / "fit.json").write_text("{")
    (study / "w" / "compare" / "optimizers.json").write_text('{"rows": 3}')
    found = steps(study)
    assert "fit.json: damaged" in found[f"fit {NAME}"].outdated
    assert found["optimizers compared"].outdated.split("/w/")[1].startswith("compare/optimizers.json: damaged")
    assert found["recordings"].outdated == ""


def test_an_unfinished_fit_is_told(study: Path) -> None:
    folder = study / "w" / "fits" / "begun"
    (folder / ".partial").mkdir(parents=True)
    (folder / ".partial" / "a.json").write_text("{}")
    assert steps(study)["fit begun"].holds == "unfinished, 1 search kept"


def test_an_empty_folder_is_no_workspace(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no workspace, or an empty one; run `mrfit ingest"):
        status(Workspace(tmp_path / "none"))
    assert not (tmp_path / "none").exists()


def test_what_is_printed_names_every_step_and_reason(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log(study / "logs" / "test-2.csv", 2.0, 1.5)
    summary: dict[str, Any] = json.loads(json.dumps(pipeline.status(study / "w", silent)))
    output.status(summary)
    printed = capsys.readouterr().out
    assert NAME in printed and "min_cycles 2" in printed
    assert "out of date: recordings: changed since read: " in printed


def test_settings_are_told_as_they_are_written() -> None:
    settings = {"model": "m", "bounds": [["A", 1.0, 1.5]], "start": [["n", 2.0]], "budget": None, "drift": "cycle"}
    assert output.settings_text(settings) == "bounds A=1:1.5, start n=2, drift cycle"


def test_a_removed_fit_is_gone_and_what_showed_it_says_so(study: Path) -> None:
    work = study / "w"
    assert pipeline.remove(work, [NAME, NAME]) == {
        "work": str(work),
        "removed": [NAME],
        "left": ["bingham.lsq.all"],
        "dry_run": False,
    }
    assert sorted(p.name for p in (work / "fits").iterdir()) == ["bingham.lsq.all"]
    assert not [p for p in work.iterdir() if "removed" in p.name]
    found = reasons(study)
    assert found == {
        "models compared": f"the fit {NAME} is gone",
        "report": f"a fit it shows is gone: {NAME}",
    }
    assert mrfit.report.stage.run(Workspace(work), mrfit.report.stage.Settings()).fits == ["bingham.lsq.all"]


def test_several_fits_are_removed_all_or_none(study: Path) -> None:
    work = study / "w"
    with pytest.raises(DataError, match=f"no fit named 'other'; choose from bingham.lsq.all, {NAME}$"):
        pipeline.remove(work, [NAME, "other"])
    with pytest.raises(ConfigError, match="is no name for a file"):
        pipeline.remove(work, [NAME, "../w"])
    assert Workspace(work).fit_names() == ["bingham.lsq.all", NAME]
    assert pipeline.remove(work, [NAME, "bingham.lsq.all"])["left"] == []
    with pytest.raises(DataError, match=f"no fit named '{NAME}'; there is none$"):
        pipeline.remove(work, [NAME])


def test_a_fit_that_cannot_be_moved_keeps_the_others(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    work, replaced = study / "w", Path.replace
    before = sorted(p for p in work.rglob("*"))

    def refused(self: Path, target: Path) -> Path:
        if self.name == NAME and self.parent.name == "fits":
            raise PermissionError(13, "Permission denied")
        return replaced(self, target)

    monkeypatch.setattr(Path, "replace", refused)
    with pytest.raises(DataError, match="Permission denied"):
        pipeline.remove(work, ["bingham.lsq.all", NAME])
    assert sorted(p for p in work.rglob("*")) == before


def test_what_a_killed_removal_left_is_taken_away_by_the_next_command(
    study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    work = study / "w"
    with monkeypatch.context() as killed:
        killed.setattr("mrfit.io.removal.shutil.rmtree", lambda *arguments, **options: None)
        pipeline.remove(work, [NAME])
    assert [p for p in work.iterdir() if "removed" in p.name]
    assert NAME not in Workspace(work).fit_names()
    with Workspace(work).locked():
        assert not [p for p in work.iterdir() if "removed" in p.name]


@pytest.mark.parametrize("name", ["../../w", "", ".", "-x", "a/b", "x" * 300])
def test_what_cannot_name_a_fit_is_refused(name: str, study: Path) -> None:
    before = sorted(study.rglob("*"))
    with pytest.raises(ConfigError, match="is no name for a file"):
        pipeline.remove(study / "w", [name])
    assert sorted(study.rglob("*")) == before


def test_the_commands_print_json_alone(study: Path, mrfit: Run) -> None:
    work = study / "w"
    told = json.loads(mrfit("status", "--work", work, "--json").stdout)
    assert [s["outdated"] for s in told["steps"]] == [""] * 9
    dry = mrfit("remove", "--dry-run", NAME, "--work", work)
    assert dry.returncode == 0 and f"Would be removed from {work}: {NAME}" in dry.stdout.replace(os.linesep, "\n")
    assert NAME in Workspace(work).fit_names()
    removed = mrfit("remove", NAME, "--work", work)
    assert removed.returncode == 0 and f"Removed from {work}: {NAME}" in removed.stdout.replace(os.linesep, "\n")
    unknown = mrfit("remove", NAME, "--work", work)
    assert unknown.returncode == 1
    assert unknown.stderr == f"mrfit: {work}: no fit named '{NAME}'; choose from bingham.lsq.all\n"
    assert mrfit("status", "--work", study / "none").returncode == 1
