"""`mrfit discover` as a user runs it, on the shipped logs in which an effect is hidden."""

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests import commands
from tests.conftest import ROOT, Run

HIDDEN = {"discover-eddy": ("eddy-current", 0.2), "discover-current-lag": ("current-lag", 0.020)}


def command(folder: Path, *words: object) -> "subprocess.CompletedProcess[str]":
    return commands.text(folder, *words, timeout=600.0)


def answer(folder: Path, *words: object) -> dict[str, Any]:
    done = command(folder, *words, "--json")
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))


@pytest.fixture(scope="module", params=["discover-eddy", pytest.param("discover-current-lag", marks=pytest.mark.slow)])
def study(request, tmp_path_factory) -> tuple[str, Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp(request.param)
    return request.param, folder, answer(folder, "run", ROOT / "pipelines" / f"{request.param}.toml", "--work", "w")


def test_the_hidden_effect_and_no_other_is_named(study):
    name, _, summary = study
    found = summary["discovery"]
    effect, size = HIDDEN[name]
    assert (found["verdict"], [e["name"] for e in found["effects"]]) == ("named", [effect])
    assert found["effects"][0]["parameters"][0]["value"] == pytest.approx(size, rel=0.05)
    assert found["augmented_model"] == f"{found['base_model']}+{effect}"


def test_the_error_on_held_out_conditions_falls_to_the_noise(study):
    gap = study[2]["discovery"]["gap"]
    assert gap["before"] > 5 * gap["noise_floor"]
    assert gap["after"] < 1.5 * gap["noise_floor"]
    assert gap["closed"] > 0.99
    # a coil is not fitted again for its plain errors
    assert (gap.get("plain_before") is None) == ("eddy" in study[0])


def test_the_page_lies_beside_the_decision(study):
    _, folder, summary = study
    page = folder / summary["discovery"]["page"]
    assert page == folder / "w" / "discover" / "discovery.html"
    text = page.read_text(encoding="utf-8")
    assert f"lacks {summary['discovery']['effects'][0]['name']}" not in text
    assert f"({summary['discovery']['effects'][0]['name']})" in text


def test_the_same_discovery_is_not_made_twice(study):
    name, folder, first = study
    order = ("--current-order", "fy=2,c=2") if name == "discover-current-lag" else ()
    page = folder / "w" / "discover" / "discovery.html"
    before = page.stat().st_mtime_ns
    again = answer(folder, "discover", "--model", first["discovery"]["base_model"], *order, "--work", "w")
    assert again["skipped"] and again["effects"] == first["discovery"]["effects"]
    assert page.stat().st_mtime_ns == before


def test_the_terminal_says_verdict_place_effect_candidates_and_how_to_go_on(study):
    name, folder, first = study
    effect, _ = HIDDEN[name]
    order = ("--current-order", "fy=2,c=2") if name == "discover-current-lag" else ()
    done = command(folder, "discover", "--model", first["discovery"]["base_model"], *order, "--work", "w")
    assert done.returncode == 0 and done.stderr == ""
    first_line = done.stdout.splitlines()[0]
    assert effect in first_line and first_line.endswith("(nothing had changed)")
    for said in (
        "of the squared error in",
        "On held-out conditions the error falls from",
        "standard errors",
        "Go on with",
    ):
        assert said in done.stdout, said
    assert all(c["name"] in done.stdout for c in first["discovery"]["candidates"])


def test_nothing_is_left_to_settle(study):
    _, folder, first = study
    assert answer(folder, "advise", "--work", "w")["advice"] == []
    done = command(folder, "advise", "--work", "w")
    assert done.stdout.startswith(f"Nothing to settle: the last discovery on {first['discovery']['base_model']}")


@pytest.mark.slow
@pytest.mark.parametrize("study", ["discover-eddy"], indirect=True)
def test_the_augmented_model_is_fitted_and_predicts_like_any_other(study):
    _, folder, first = study
    model = first["discovery"]["augmented_model"]
    fit = answer(folder, "fit", "--model", model, "--per", "all", "--weight", "floor", "--name", "whole", "--work", "w")
    held = next(m for m in fit["metrics"] if m["condition"] == "all" and m["role"] == "holdout")
    assert held["rmse"] < 1.4 * held["noise_floor"]
    log = ROOT / "datasets" / "coil-eddy" / "sine_10Hz_5A.csv"
    row = answer(folder, "predict", "--fit", "whole", log, "--work", "w")["metrics"][0]
    assert row["rmse"] < 2.0 * row["noise_floor"]


@pytest.mark.slow
def test_too_few_data_are_said_not_guessed_from(mrfit: Run, datasets: Path, tmp_path: Path) -> None:
    logs = [datasets / "coil-eddy" / f"sine_05Hz_{a}A.csv" for a in (1, 3)]
    assert mrfit("ingest", *logs).returncode == 0
    done = mrfit("discover", "--model", "boucwen-flux", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert (found["verdict"], found["effects"]) == ("insufficient-data", [])
    assert "held-out" in found["advice"][0]
    assert (tmp_path / "mrfit-work" / "discover" / "discovery.html").is_file()
    said = mrfit("discover", "--model", "boucwen-flux").stdout
    assert said.startswith("These data are too few to say whether something is missing from boucwen-flux")
    assert "held-out" in mrfit("advise").stdout


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--model", "boucwen-flx"), "boucwen-flux"),
        (("--model", "boucwen-flux+eddy-curent"), "eddy-current"),
        (("--model", "boucwen-flux", "--start", "Ls=1"), "Ls"),
        (("--model", "boucwen-flux", "--start", "Lc"), "NAME=VALUE"),
        (("--model", "tanh", "--current-order", "fz=2"), "fz"),
    ],
)
def test_wrong_names_are_refused_before_any_data_are_touched(mrfit: Run, tmp_path: Path, words, said) -> None:
    done = mrfit("discover", *words)
    assert done.returncode == 2, done.stderr
    assert said in done.stderr and done.stderr.count("\n") == 1
    assert not (tmp_path / "mrfit-work").exists()


def test_discover_and_advise_without_data_say_what_to_run_first(mrfit: Run) -> None:
    for words, remedy in ((("discover", "--model", "tanh"), "mrfit ingest"), (("advise",), "mrfit discover")):
        done = mrfit(*words)
        assert done.returncode == 1 and remedy in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("", "add a [[fit]], a [discover], a [compare] or a [sheet] table"),
        ("[discover]\nmodel = 'tanh'\nseeds = 1\n", "[discover] seeds"),
        ("[discover]\nmodel = 'tahn'\n", "tanh"),
    ],
)
def test_a_wrong_pipeline_file_is_refused(mrfit: Run, tmp_path: Path, table: str, said: str) -> None:
    (tmp_path / "p.toml").write_text(f"[ingest]\nlogs = ['*.csv']\n{table}")
    done = mrfit("run", "p.toml")
    assert done.returncode == 2 and said in done.stderr and done.stderr.count("\n") == 1, done.stderr


def test_effects_are_listed_and_shown(mrfit: Run) -> None:
    names = {row["name"] for row in json.loads(mrfit("list", "effects", "--json").stdout)}
    assert {"eddy-current", "current-lag", "inertia"} <= names
    shown = mrfit("show", "current-lag").stdout
    for said in (
        "d(i_sim)/dt = (i(t - t_d) - i_sim)/tau",
        "slot 'input'",
        "neutral",
        "Mistaken for: delay",
        "Told apart by",
        "eq. 9",
    ):
        assert said in shown, said
