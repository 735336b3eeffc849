"""Models compared on logs whose maker is known: the maker comes first, what does not apply is left out with reason."""

import csv
import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrfit.compare.stage
from mrfit.compare import optimizers
from mrfit.compare.page import labels
from mrfit.compare.stage import Settings
from mrfit.errors import ConfigError, DataError
from mrfit.fit import stage as fit_stage
from mrfit.io.schemas.fit import Fit, MetricRow
from mrfit.io.workspace import Workspace, check_name
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence
from tests.conftest import Run
from tests.fit.benches import Bench, planted_segments, record, write_workspace

SINES = ((0.5, 0.004), (1.0, 0.010), (2.0, 0.008))
LEVELS = (0.0, 1.0)
MODELS = ("bingham", "tanh", "boucwen-flux", "hammerstein-wiener", "rotational-erf")
HELD_OUT = 1.0


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    """Logs of a tanh damper, one frequency held out."""
    dependence = CurrentDependence((("fy", 1),), *LEVELS)
    theta = np.array([200.0, 900.0, 60.0, 30.0, 700.0, 500.0, 5.0])
    bench = Bench(assemble("tanh", dependence), theta, 0.01, 4)
    made = write_workspace(tmp_path_factory.mktemp("compare"), bench, SINES, LEVELS)
    segments = made.read_segments()
    made.write_segments([replace(s, role="holdout" if s.frequency == HELD_OUT else "train") for s in segments], {})
    return made


@pytest.fixture(scope="module")
def summary(workspace: Workspace) -> dict[str, Any]:
    return mrfit.compare.stage.run(workspace, Settings(models=MODELS, budget=4000))


def test_the_model_that_made_the_data_comes_first_at_the_noise_floor(summary: dict[str, Any]) -> None:
    names = [m.model for m in summary.models]
    assert names[0] == "tanh" and names[-1] == "bingham"
    best = next(m for m in summary.metrics if (m.model, m.role, m.condition) == ("tanh", "holdout", "all"))
    assert best.rmse <= 1.05 * best.noise_floor
    errors = [m.holdout_nrmse for m in summary.models]
    assert errors == sorted(errors)
    assert summary.models[-1].holdout_nrmse > 3 * summary.models[0].holdout_nrmse


def test_every_model_has_a_row_for_every_condition_and_role(summary: dict[str, Any]) -> None:
    conditions = {
        s.condition: "holdout" if s.frequency == HELD_OUT else "train" for s in planted_segments(SINES, LEVELS)
    }
    for model in ("tanh", "bingham"):
        rows = {(m.condition, m.role) for m in summary.metrics if m.model == model}
        assert rows == {*conditions.items(), ("all", "train"), ("all", "holdout")}


def test_models_the_logs_cannot_serve_are_left_out_with_the_reason(summary: dict[str, Any]) -> None:
    left = {one.model: one.reason for one in summary.left_out}
    assert set(left) == {"boucwen-flux", "rotational-erf"}
    assert "flux" in left["boucwen-flux"] and "torque" in left["rotational-erf"]


def test_times_are_in_the_table_and_in_no_file_that_is_the_same_every_time(
    summary: dict[str, Any], workspace: Workspace
) -> None:
    assert all(s is not None and s > 0 for s in summary.seconds.values())
    folder = workspace.root / "compare"
    with (folder / "compare.csv").open() as handle:
        rows = list(csv.DictReader(handle))
    assert {r["model"] for r in rows} == {"tanh", "bingham", "hammerstein-wiener"}
    assert all(float(r["seconds"]) > 0 for r in rows)
    assert float(rows[0]["nrmse"]) == pytest.approx(summary.models[0].holdout_nrmse)
    before = {n: (folder / n).read_bytes() for n in ("compare.json", "compare.html")}
    again = mrfit.compare.stage.run(workspace, Settings(models=MODELS, budget=4000))
    assert {n: (folder / n).read_bytes() for n in before} == before
    # fits that stand are not made again, and keep the time they took
    assert again.seconds == pytest.approx(summary.seconds, abs=1e-3)


def test_the_page_opens_offline_and_names_every_model(summary: dict[str, Any], workspace: Workspace) -> None:
    page = (workspace.root / "compare" / "compare.html").read_text()
    assert all(m.model in page for m in summary.models) and "rotational-erf" in page
    assert "http" not in page and page.count("<script>") == page.count("<script") == 1
    assert page.count("<svg") == page.count("<figcaption>") == 1


def test_a_model_judged_on_fewer_samples_comes_after_those_judged_on_all() -> None:
    fits = [
        Fit(
            name=name,
            model=name,
            optimizer="auto",
            output=output,
            results=[],
            metrics=[MetricRow(condition=c, role=role, samples=n, nrmse=error) for c in ("a", "all")],
        )
        for name, output, role, n, error in (
            ("few", "force", "holdout", 500, 0.01),
            ("worse", "force", "holdout", 900, 0.05),
            ("best", "force", "holdout", 900, 0.02),
            ("untried", "force", "train", 900, 0.001),
            ("coil", "flux", "train", 900, 0.09),
        )
    ]
    tried = mrfit.compare.stage.ModelFits(fits, [], {})
    ranked = [row.model for row in mrfit.compare.stage.summary_of(Settings(), tried).models]
    assert ranked == ["coil", "best", "worse", "few", "untried"]


def test_unknown_names_are_refused_before_anything_is_fitted(workspace: Workspace) -> None:
    with pytest.raises(ConfigError, match="tahn"):
        mrfit.compare.stage.run(workspace, Settings(models=("tahn",)))


def test_logs_no_model_fits_are_an_error_with_the_first_reason(tmp_path: Path) -> None:
    bench = Bench(assemble("bingham"), np.array([300.0, 900.0, 0.0]), 0.01, 1)
    workspace = write_workspace(tmp_path, bench, SINES[:1], (0.5,))
    with pytest.raises(DataError, match="none of 1 model can be fitted; boucwen-flux: .*flux"):
        mrfit.compare.stage.run(workspace, Settings(models=("boucwen-flux",)))


def test_the_bench_gives_the_same_log_for_the_same_seed() -> None:
    bench = Bench(assemble("bingham"), np.array([300.0, 900.0, 0.0]), 0.01, 1)
    segment = planted_segments(SINES, LEVELS)[0]
    one, two = (record(bench, segment, np.random.default_rng(7)).channels["force"] for _ in range(2))
    assert np.array_equal(one, two)


@pytest.mark.slow
def test_the_command_prints_one_table_and_refuses_half_a_question(mrfit: Run, datasets: Path) -> None:
    assert mrfit("ingest", datasets / "coil" / "coil_05Hz_1A.csv").returncode == 0
    done = mrfit("compare", "--models", "bingham,tanh,boucwen-mmf,boucwen-flux", "--budget", 300)
    assert done.returncode == 0, done.stderr
    # models of one output stand together, and what keeps several from being fitted is said once
    current, flux = (done.stdout.index(f"Models of {output} in") for output in ("current", "flux"))
    assert current < done.stdout.index("boucwen-mmf") < flux < done.stdout.index("boucwen-flux")
    assert done.stdout.count("left out ") == 1 and "left out bingham, tanh: " in done.stdout
    options = ("--model", "boucwen-flux", "--seeds", 2, "--budget", 100)
    asked = mrfit("compare", "--optimizers", "lsq,fmin", *options, "--json")
    assert [r["optimizer"] for r in json.loads(asked.stdout)["rows"]] == ["lsq", "fmin"]
    narrow = mrfit("compare", "--optimizers", "lsq", *options, "--bounds", "n=8:9", "--fix", "D=20", "--json")
    (held,), (free, _) = (json.loads(done.stdout)["rows"] for done in (narrow, asked))
    assert held["best"] > 1.1 * free["best"]
    for refused, said in (
        (mrfit("compare", "--optimizers", "pso"), "--models"),
        (mrfit("compare", "--models", "bingham", "--fix", "c=1"), "--optimizers"),
    ):
        assert refused.returncode == 2 and said in refused.stderr


QUICK = {"optimizer": "lsq", "budget": 60}


@pytest.fixture
def own(workspace: Workspace, tmp_path: Path) -> Workspace:
    for name in ("recordings", "segments.parquet", "ingest.json"):
        place = workspace.root / name
        if place.is_dir():
            shutil.copytree(place, tmp_path / name)
        elif place.is_file():
            shutil.copy(place, tmp_path / name)
    return Workspace(tmp_path)


def compared(workspace: Workspace, *models: str, **settings: Any) -> Any:
    return mrfit.compare.stage.run(workspace, Settings(models=models, **{**QUICK, **settings}))


def test_a_second_comparison_adds_its_models_and_loses_none(own: Workspace) -> None:
    first = compared(own, "bingham", "boucwen-flux")
    second = compared(own, "polynomial")
    assert {m.model for m in first.models} == {"bingham"}
    assert {m.model for m in second.models} == {"bingham", "polynomial"} and second.kept == [first.models[0].fit]
    # the row is what it was, the reason of a model left out too, and so is its time
    assert [m for m in second.models if m.model == "bingham"] == first.models
    assert [m for m in second.metrics if m.model == "bingham"] == first.metrics
    assert second.left_out == first.left_out and second.seconds[first.models[0].fit] is not None
    with (own.root / "compare" / "compare.csv").open() as handle:
        assert {row["model"] for row in csv.DictReader(handle)} == {"bingham", "polynomial"}
    assert "polynomial" in (page := (own.root / "compare" / "compare.html").read_text()) and "bingham" in page
    # the same once more changes nothing
    before = (own.root / "compare" / "compare.json").read_bytes()
    compared(own, "polynomial")
    assert (own.root / "compare" / "compare.json").read_bytes() == before


def test_another_setting_makes_another_name_and_another_row(own: Workspace) -> None:
    compared(own, "bingham")
    both = compared(own, "bingham", budget=70, weight="floor")
    names = [m.fit for m in both.models]
    assert sorted(names) == ["bingham.lsq.all.budget-60", "bingham.lsq.all.budget-70.weight-floor"]
    assert set(labels(both.models).values()) == set(names)


def test_a_fit_that_is_gone_leaves_the_table_with_a_word(own: Workspace) -> None:
    (gone,) = compared(own, "bingham").models
    shutil.rmtree(own.fit_folder(gone.fit))
    after = compared(own, "polynomial")
    assert after.dropped == {gone.fit: "it is gone"} and {m.model for m in after.models} == {"polynomial"}


def test_a_fit_of_ones_own_is_never_replaced_by_a_comparison(own: Workspace) -> None:
    mine = fit_stage.Settings("bingham", "lsq", per="all", bounds=(("fy", 1.0, 400.0),), budget=60)
    mine = replace(mine, name=Settings(**QUICK).name_of("bingham"))
    made = fit_stage.run(own, mine)
    before = (own.fit_folder(made.name) / "fit.json").read_bytes()
    (row,) = compared(own, "bingham").models
    assert row.fit == f"{made.name}.compare"
    assert (own.fit_folder(made.name) / "fit.json").read_bytes() == before


def test_names_of_fits_hold_what_is_not_at_its_default_and_are_names() -> None:
    long = Settings(optimizer="pso-fmin", options=(("population", 40.0), ("w", 0.7)), current_order="fy=2,c=1", seed=3)
    assert Settings().name_of("tanh") == "tanh.auto.all"
    assert long.name_of("tanh") == "tanh.pso-fmin.all.options-population40_w0.7.seed-3.current-order-fy_2_c_1"
    check_name(replace(long, only="MH,sine-*-1A" + ",x" * 90).name_of("tanh"))


def test_optimizers_are_added_to_those_of_the_same_comparison(own: Workspace) -> None:
    fit = fit_stage.Settings("bingham", per="all", budget=40)
    settings = optimizers.Settings(("lsq",), fit, 1)
    first = optimizers.run(own, settings)
    both = optimizers.run(own, replace(settings, optimizers=("fmin",)))
    assert [r.optimizer for r in both.rows] == ["fmin", "lsq"] and both.kept == ["lsq"]
    assert both.rows[1] == replace(first.rows[0], seconds=pytest.approx(first.rows[0].seconds, abs=1e-3))
    other = optimizers.run(own, replace(settings, fit=replace(fit, budget=50)))
    assert [r.optimizer for r in other.rows] == ["lsq"] and other.kept == []
