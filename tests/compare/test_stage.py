"""Models compared on logs whose maker is known: the maker comes first, what does not apply is left out with reason."""

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrfit.compare.stage
from mrfit.compare.stage import Settings
from mrfit.errors import ConfigError, DataError
from mrfit.io.schemas.fit import Fit, MetricRow
from mrfit.io.workspace import Workspace
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
    segments, _ = made.read_segments()
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
            metrics=[MetricRow(condition="all", role=role, samples=n, nrmse=error)],
        )
        for name, output, role, n, error in (
            ("few", "force", "holdout", 500, 0.01),
            ("worse", "force", "holdout", 900, 0.05),
            ("best", "force", "holdout", 900, 0.02),
            ("untried", "force", "train", 900, 0.001),
            ("coil", "flux", "train", 900, 0.09),
        )
    ]
    ranked = [fit.model for fit in sorted(fits, key=mrfit.compare.stage.rank)]
    assert ranked == ["coil", "best", "worse", "few", "untried"]


def test_unknown_names_are_refused_before_anything_is_fitted(workspace: Workspace) -> None:
    with pytest.raises(ConfigError, match="tahn"):
        mrfit.compare.stage.run(workspace, Settings(models=("tahn",)))


def test_logs_no_model_fits_are_an_error_with_the_first_reason(tmp_path: Path) -> None:
    bench = Bench(assemble("bingham"), np.array([300.0, 900.0, 0.0]), 0.01, 1)
    workspace = write_workspace(tmp_path, bench, SINES[:1], (0.5,))
    with pytest.raises(DataError, match="none of 1 models can be fitted; boucwen-flux: .*flux"):
        mrfit.compare.stage.run(workspace, Settings(models=("boucwen-flux",)))


def test_the_bench_gives_the_same_log_for_the_same_seed() -> None:
    bench = Bench(assemble("bingham"), np.array([300.0, 900.0, 0.0]), 0.01, 1)
    segment = planted_segments(SINES, LEVELS)[0]
    one, two = (record(bench, segment, np.random.default_rng(7)).channels["force"] for _ in range(2))
    assert np.array_equal(one, two)


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
