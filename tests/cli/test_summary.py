"""The line that ends a command, the names a shell completes, the project file and the log of commands."""

import re
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from mrfit.cli import logbook, names, project, summary
from mrfit.errors import ConfigError
from mrfit.settings.forms import CONSTANTS

WORK = Path("w")


def metric(role: str, nrmse: float | None, condition: str = "all") -> dict[str, Any]:
    return {"role": role, "condition": condition, "nrmse": nrmse}


def fitted(*results: dict[str, Any], warnings: tuple[dict[str, str], ...] = (), **given: Any) -> dict[str, Any]:
    metrics = [metric("train", 0.02), metric("holdout", 0.0312)]
    told = {"results": [*results], "metrics": metrics, "warnings": [*warnings]}
    return {"name": "f", "per": "all", **told, **given}


def parameter(determined: str, fixed: bool = False) -> dict[str, Any]:
    return {"fixed": fixed, "determined": determined}


def result(*parameters: dict[str, Any], warnings: tuple[dict[str, str], ...] = ()) -> dict[str, Any]:
    return {"parameters": [*parameters], "warnings": [*warnings]}


def test_ingest_counts_recordings_logs_and_what_was_refused() -> None:
    rows = [{"source": "a.csv"}, {"source": "a.csv"}, {"source": "b.csv"}]
    assert summary.ingest({"recordings": rows, "refused": []}, WORK) == "3 recordings of 2 logs in w"
    assert summary.ingest({"recordings": rows[:1], "refused": [{}, {}]}, WORK) == (
        "1 recording of 1 log in w, 2 files refused"
    )


def test_flux_counts_recordings_by_what_was_done() -> None:
    rows = [{"action": "integrated"}, {"action": "passed through"}, {"action": "integrated"}]
    assert summary.flux({"recordings": rows}, WORK) == "Flux linkage in w: 2 integrated, 1 passed through"
    assert summary.flux({"recordings": []}, WORK) == "Flux linkage in w: no recordings"


def test_segments_of_a_condition_count_once_among_conditions() -> None:
    rows = [{"condition": c, "role": r} for c, r in (("a", "train"), ("b", "holdout"), ("b", "holdout"))]
    assert summary.segment({"segments": rows}, WORK) == "3 segments of 2 conditions in w, 1 held out"


def test_a_fit_has_its_errors_held_out_first_and_its_parameters() -> None:
    one = result(parameter("well"), parameter("poorly"), parameter("well", fixed=True))
    assert summary.fit(fitted(one), WORK) == (
        "Fit f: NRMSE 3.12 % held out, NRMSE 2 % in training, 1 of 2 parameters well determined; w/fits/f"
    )
    assert "2 sets of parameters" in summary.fit(fitted(one, one), WORK)
    own = summary.fit(fitted(one, one, per="condition"), WORK)
    assert "NRMSE 3.12 % in the held-out part of each test, NRMSE 2 % in training" in own


def test_warnings_are_counted_and_those_that_change_the_physics_are_named() -> None:
    drift, sign = {"kind": "drift", "text": "a: b"}, {"kind": "sign", "text": "log 1: turned round"}
    plain = summary.fit(fitted(result(warnings=(drift,)), warnings=(drift,)), WORK)
    assert ", 2 warnings; " in plain
    assert "1 warning (log 1)" in summary.fit(fitted(result(), warnings=(sign,)), WORK)
    assert "warning" not in summary.fit(fitted(result()), WORK)


def test_a_prediction_without_a_measured_output_has_nothing_to_compare_with() -> None:
    about = {"fit": "f", "used": {"a": "c", "b": "c"}}
    assert summary.predict({**about, "metrics": [metric("predict", 0.05), metric("predict", 0.1, "c")]}) == (
        "Prediction by f: NRMSE 5 % on 2 segments"
    )
    for none in ([], [metric("predict", None)]):
        assert "nothing to compare with on 2 segments" in summary.predict({**about, "metrics": none})


def test_the_best_model_of_every_output_is_its_first() -> None:
    rows = [{"model": "tanh", "output": "force", "holdout_nrmse": 0.02}, {"model": "dahl", "output": "force"}]
    asked = {"settings": {"per": "all"}}
    assert summary.compare_models({**asked, "models": rows}) == "Best of 2 models: tanh for force, NRMSE 2 % held out"
    own = summary.compare_models({"settings": {"per": "condition"}, "models": rows})
    assert own.endswith("NRMSE 2 % in the held-out part of each test")
    some = summary.compare_models(
        {**asked, "models": rows, "left_out": [{"model": "boucwen-flux", "reason": "no flux"}]}
    )
    assert some == "Best of 2 models, 1 left out: tanh for force, NRMSE 2 % held out"
    rows = [{"model": "b", "output": "flux", "holdout_nrmse": float("nan")}, *rows]
    assert summary.compare_models({**asked, "models": rows}).startswith(
        "Best of 3 models: b for flux; tanh for force, NRMSE"
    )


def test_a_workspace_says_how_much_of_it_is_out_of_date() -> None:
    steps = [{"outdated": ""}, {"outdated": "changed"}]
    assert summary.status({"steps": steps, "work": "w"}) == "2 steps in w, 1 out of date"
    assert summary.status({"steps": steps[:1], "work": "w"}) == "1 step in w, none out of date"


def test_models_are_completed_and_effects_behind_a_plus() -> None:
    assert names.model("tan") == ["tanh"] and "tanh+delay" in names.model("tanh+de")
    assert names.model("tanh+delay+iner") == ["tanh+delay+inertia"] and names.model("zzz") == []


def test_optimizers_are_completed_and_searches_that_are_none_only_at_the_beginning() -> None:
    assert names.optimizer("au") == ["auto"] and names.optimizer("pso-fm") == ["pso-fmin"]
    assert names.optimizer("pso-au") == [] and "staged" in names.item("st")


def test_fits_are_completed_of_the_workspace_that_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("one", "other"):
        (tmp_path / "w" / "fits" / name).mkdir(parents=True)
    (tmp_path / "w" / "fits" / "one" / "fit.json").write_text("{}")
    told: Any = SimpleNamespace(params={"work": tmp_path / "w"})
    assert names.fit(told, "o") == ["one"]
    told = SimpleNamespace(params={})
    monkeypatch.setenv("MRFIT_WORK", str(tmp_path / "w"))
    assert names.fit(told, "") == ["one"]
    monkeypatch.delenv("MRFIT_WORK")
    monkeypatch.chdir(tmp_path)
    assert names.fit(told, "") == []


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path / "mrfit.toml"


def test_a_project_file_gives_commands_their_defaults(here: Path) -> None:
    assert project.defaults(["fit", "flux"], {}) == {"fit": {}, "flux": {}}
    here.write_text(
        'work = "results"\n[fit]\nmodel = "tanh"\nbounds = {fy = [1, 500]}\nseed = 3\n[flux]\nresistance = 2.1\n'
    )
    found = project.defaults(["fit", "flux", "report", "apply"], {"apply": ["invert"]})
    assert found["apply"] == {"invert": {"work": "results"}}
    assert found["report"] == {"work": "results"}
    assert found["fit"] == {"work": "results", "model": "tanh", "bounds": ["fy=1.0:500.0"], "seed": 3}
    assert found["flux"] == {"work": "results", "resistance": 2.1}
    assert project.settings_of("flux").resistance == 2.1
    assert project.settings_of("segment").holdout == "auto"


def test_constants_of_one_optimizer_are_a_table_in_a_table_as_in_a_pipeline_file(here: Path) -> None:
    here.write_text("[fit]\nopt_set = {F = 0.7, mwoa.b = 1.2}\nstart = {c = 2}\n")
    found = project.defaults(["flux", "segment", "fit", "discover"], {})["fit"]
    assert CONSTANTS.parse("--opt-set", found["opt_set"]) == (("F", 0.7), ("mwoa.b", 1.2))
    assert found["start"] == ["c=2.0"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("work = 3", "work takes the name of a folder, not 3"),
        ('[fit]\nmodle = "tanh"', "[fit] modle is no key mrfit knows; did you mean 'model'?"),
        ('[flux]\nrule = "euler"', "[flux] rule takes 'trapezoid' or 'simpson', not 'euler'"),
        ("fit = 3", "[fit] the file takes a table, not 3"),
        ('[fit]\nmodel = "tanh\n', "mrfit.toml: is not valid TOML: Illegal character '\\n' (at line 2, column 14)"),
        ("work = results", "mrfit.toml: is not valid TOML: Invalid value (at line 1, column 8)"),
        ('wrok = "results"', "mrfit.toml: unknown key 'wrok'; did you mean 'work'?"),
        ("[fitt]", "mrfit.toml: unknown key 'fitt'; did you mean 'fit'?"),
    ],
)
def test_a_wrong_project_file_ends_in_one_line(text: str, said: str, here: Path) -> None:
    here.write_text(text)
    with pytest.raises(ConfigError, match=re.escape(said)):
        project.defaults(["fit", "flux", "segment", "discover"], {})


def test_the_keys_of_a_channel_map_are_none_of_its_own(here: Path) -> None:
    here.write_text('rate = 200\n[channels]\nforce = {column = 1, unit = "N"}\n')
    assert project.defaults(["fit"], {}) == {"fit": {}}


def test_a_channel_map_is_noted_where_no_log_lies_beside_it(here: Path, tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    assert project.unused_map([Path("logs/a.csv")]) == ""
    here.write_text("[channels]\nforce = {column = 1}\n")
    assert "holds for logs beside it only" in project.unused_map([Path("logs/a.csv")])
    assert "holds for logs beside it only" in project.unused_map([Path("logs")])
    assert project.unused_map([Path("a.csv")]) == "" == project.unused_map([Path("."), Path("logs/a.csv")])


def test_a_command_adds_its_line_to_a_workspace_that_is_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["mrfit", "fit", "--only", "a b\x1b"])
    logbook.append(tmp_path / "none", 1.0)
    assert not (tmp_path / "none").exists()
    for _ in range(2):
        logbook.append(tmp_path, 1.25)
    lines = (tmp_path / logbook.LOGBOOK_NAME).read_text().splitlines()
    assert len(lines) == 2 and all(line.endswith("# 1.2 s") and "'a b\\x1b'" in line for line in lines)


def test_a_log_of_commands_that_is_a_link_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "other").write_text("mine")
    (tmp_path / logbook.LOGBOOK_NAME).symlink_to(tmp_path / "other")
    logbook.append(tmp_path, 1.0)
    assert (tmp_path / "other").read_text() == "mine"
