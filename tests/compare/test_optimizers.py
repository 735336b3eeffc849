"""Optimizers compared on one model: the same starts for all, counted honestly, the better ones lower."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrfit.compare.optimizers
import mrfit.fit.stage
from mrfit.compare.optimizers import Settings, start_point
from mrfit.errors import ConfigError
from mrfit.fit.identify import build_group
from mrfit.fit.select import read_dataset
from mrfit.io.workspace import Workspace
from mrfit.models import guo
from mrfit.search.cube import cube_of
from mrfit.search.problem import LeastSquaresProblem
from mrfit.search.starts import data_starts, to_points
from mrfit.simulate.assembly import assemble
from tests.fit.benches import Bench, write_workspace

TRUTH = np.array([400.0, 900.0, 90.0, 1.5, 4.0])
BUDGET = 600
SEEDS = 3


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> tuple[Workspace, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("optimizers")
    workspace = write_workspace(folder, Bench(assemble("guo"), TRUTH, 0.01, 2), ((0.5, 0.004), (2.0, 0.008)), (0.5,))
    fit = mrfit.fit.stage.Settings(model="guo", per="all", budget=BUDGET)
    return workspace, mrfit.compare.optimizers.run(workspace, Settings(("pso", "pso-lsq", "lsq"), fit, SEEDS))


def test_best_median_and_worst_are_in_order_and_the_budget_is_kept(compared: tuple[Workspace, dict[str, Any]]) -> None:
    rows = compared[1].rows
    assert [r.optimizer for r in rows] == ["pso", "pso-lsq", "lsq"]
    for row in rows:
        assert 0 < row.best <= row.median <= row.worst
        assert 0 < row.evaluations <= BUDGET
        assert row.seconds > 0 and row.unit == "N" and row.seeds == SEEDS


def test_a_local_search_after_the_swarm_reaches_the_noise_where_the_swarm_alone_does_not(
    compared: tuple[Workspace, dict[str, Any]],
) -> None:
    rows = {r.optimizer: r for r in compared[1].rows}
    assert rows["pso-lsq"].median < rows["pso"].median
    # 1 % of the range of each log, about 2.2 kN
    assert rows["pso-lsq"].best < 25.0


def test_curves_fall_and_end_at_the_median_cost(compared: tuple[Workspace, dict[str, Any]]) -> None:
    medians = {r.optimizer: r.median for r in compared[1].rows}
    for curve in compared[1].curves:
        assert np.all(np.diff(curve.cost) <= 0)
        assert curve.cost[-1] == pytest.approx(medians[curve.optimizer])


def test_curves_hold_no_cost_on_thinned_data(tmp_path: Path) -> None:
    workspace = write_workspace(tmp_path, Bench(assemble("guo"), TRUTH, 0.01, 2), ((0.5, 0.004), (2.0, 0.008)), (0.5,))
    fit = mrfit.fit.stage.Settings(model="guo", per="all")
    (curve,) = mrfit.compare.optimizers.run(workspace, Settings(("auto",), fit, SEEDS)).curves
    assert np.all(np.diff(curve.cost) <= 0)


def test_options_go_to_the_optimizers_that_have_them(tmp_path: Path) -> None:
    workspace = write_workspace(tmp_path, Bench(assemble("guo"), TRUTH, 0.01, 2), ((0.5, 0.004), (2.0, 0.008)), (0.5,))
    given = (("population", 5.0), ("iterations", 4.0), ("mwoa.iterations", 6.0))
    fit = mrfit.fit.stage.Settings(model="guo", per="all", stall=1.0, options=given)
    found = mrfit.compare.optimizers.run(workspace, Settings(("woa", "mwoa", "lsq"), fit, 2))
    assert [r.evaluations for r in found.rows[:2]] == [20, 30]
    assert found.settings["options"] == [list(pair) for pair in given]
    wrong = mrfit.fit.stage.Settings(model="guo", per="all", options=(("N_d", 5.0),))
    with pytest.raises(ConfigError, match="no option of woa, lsq; they are b, population, iterations"):
        mrfit.compare.optimizers.run(workspace, Settings(("woa", "lsq"), wrong, 2))


def test_seeds_start_at_the_models_start_and_then_at_random_points_equal_for_all() -> None:
    cube = cube_of(guo.SPEC, {}, {}, {})
    assert np.array_equal(start_point(cube, 0), cube.start)
    assert np.array_equal(start_point(cube, 3), start_point(cube, 3))
    assert not np.array_equal(start_point(cube, 1), start_point(cube, 2))


def test_auto_starts_where_the_data_say_as_a_fit_does(tmp_path: Path) -> None:
    workspace = write_workspace(tmp_path, Bench(assemble("guo"), TRUTH, 0.01, 2), ((0.5, 0.004), (2.0, 0.008)), (0.5,))
    fit = mrfit.fit.stage.Settings(model="guo", per="all", budget=4)
    prepared = mrfit.fit.stage.prepare(read_dataset(workspace), fit)
    group = build_group("all", prepared.groups["all"], prepared.recordings, prepared.assembly, split=False)
    posed = LeastSquaresProblem(group.search, np.ones(len(group.search)), prepared.assembly, prepared.cube)
    given = to_points(prepared.cube, data_starts(group.training, prepared.assembly, prepared.dependence, ()))
    least = np.sqrt(np.mean(posed.residuals(given) ** 2, axis=1)).min()
    rows = mrfit.compare.optimizers.run(workspace, Settings(("auto", "lsq"), fit, SEEDS)).rows
    assert rows[0].worst <= least * 1.01 < rows[1].median


def test_seconds_are_in_the_table_alone(compared: tuple[Workspace, dict[str, Any]]) -> None:
    folder = compared[0].root / "compare"
    with (folder / "optimizers.csv").open() as handle:
        assert all(float(r["seconds"]) > 0 for r in csv.DictReader(handle))
    stored = json.loads((folder / "optimizers.json").read_text())
    assert "seconds" not in stored["rows"][0]
    page = (folder / "optimizers.html").read_text()
    assert "pso-lsq" in page and "http" not in page


def test_wrong_names_and_no_seeds_are_refused(tmp_path: Path) -> None:
    fit = mrfit.fit.stage.Settings(model="guo")
    with pytest.raises(ConfigError, match="psoo"):
        mrfit.compare.optimizers.run(Workspace(tmp_path), Settings(("psoo",), fit))
    with pytest.raises(ConfigError, match="begins with stages"):
        mrfit.compare.optimizers.run(Workspace(tmp_path), Settings(("staged-lsq",), fit))
    with pytest.raises(ConfigError, match="--seeds 0"):
        mrfit.compare.optimizers.run(Workspace(tmp_path), Settings(("pso",), fit, 0))
