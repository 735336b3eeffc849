"""``--opt points``: parameters read off the characteristic points of the loop, without a search."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrfit.compare.optimizers
import mrfit.compare.stage
import mrfit.fit.stage
from mrfit.errors import ConfigError
from mrfit.fit.stage import Settings
from mrfit.io.workspace import Workspace
from mrfit.models.tanh import SPEC, start_values
from mrfit.simulate.assembly import assemble
from tests.fit.benches import Bench, write_workspace

# Inverse-tanh paper Table 2, fitted, at 0.6 A in SI
TRUTH = np.array([705.7, 74.5, 81.8, 2550.0, 170.0, -23.0])
SINES = ((1.0, 0.010), (2.0, 0.010), (1.0, 0.005))


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    folder = tmp_path_factory.mktemp("points")
    return write_workspace(folder, Bench(assemble("tanh"), TRUTH, 0.002, 3), SINES, (0.6,))


def values(result: dict[str, Any]) -> dict[str, float]:
    return {p.name: p.value for p in result.parameters}


@pytest.fixture(scope="module")
def fit(workspace: Workspace) -> dict[str, Any]:
    return mrfit.fit.stage.run(workspace, Settings("tanh", "points"))


def test_parameters_are_the_characteristic_points_and_nothing_else(workspace: Workspace, fit: dict[str, Any]) -> None:
    assert len(fit.results) == 3
    for result in fit.results:
        segment = next(s for s in workspace.read_segments() if s.condition == result.condition)
        log = workspace.read_recording(segment.recording)
        # the first two thirds of the cycles: the rest is held out
        part = slice(segment.start, segment.stop - (segment.cycles // 3) * 100)
        drive = np.stack([log.channels[n][part] for n in SPEC.inputs])
        expected = start_values(drive, log.channels["force"][part], log.dt)
        assert values(result) == pytest.approx(expected, rel=0.02, abs=2.0)
        assert result.evaluations == 1
        assert "points: read off" in result.stopped


def test_errors_are_of_the_size_the_paper_has_for_estimates(fit: dict[str, Any]) -> None:
    whole = next(m for m in fit.metrics if m.condition == "all" and m.role == "holdout")
    # Table 1: 0.07 to 0.145 for estimates; without the paper's own noise they are nearer
    assert 0.01 < whole.relative_rmse < 0.145


def test_a_fit_without_a_search_says_so_and_one_that_goes_on_does_not(
    workspace: Workspace, fit: dict[str, Any]
) -> None:
    assert all("no-search" in [w.kind for w in r.warnings] for r in fit.results)
    gone_on = mrfit.fit.stage.run(workspace, Settings("tanh", "points-lsq"))
    assert not any("no-search" in [w.kind for w in r.warnings] for r in gone_on.results)
    for result in gone_on.results:
        assert values(result)["fy"] == pytest.approx(TRUTH[0], rel=0.02)


def test_a_joint_fit_lays_its_dependence_on_current_through_the_points(tmp_path: Path) -> None:
    logs = write_workspace(tmp_path, Bench(assemble("tanh"), TRUTH, 0.002, 3), SINES[:1], (0.2, 0.4, 0.6))
    fit = mrfit.fit.stage.run(logs, Settings("tanh", "points", per="all", current_order="fy=1"))
    found = values(fit.results[0])
    assert fit.results[0].evaluations == 1
    assert found["fy@0.2A"] == pytest.approx(found["fy@0.6A"], rel=0.05)


def test_the_users_own_values_go_before_the_points(workspace: Workspace) -> None:
    fit = mrfit.fit.stage.run(
        workspace, Settings("tanh", "points", name="own", start=(("k", 170.0),), fixed=(("c", 2550.0),))
    )
    for result in fit.results:
        assert (values(result)["k"], values(result)["c"]) == pytest.approx((170.0, 2550.0), rel=1e-9)


@pytest.mark.parametrize(
    ("model", "open_"),
    [("boucwen", "leave n open"), ("neural-network", "more"), ("tanh+delay", "delay.tau"), ("spencer", "K0")],
)
def test_a_model_whose_points_leave_parameters_open_is_refused_in_one_line(
    model: str, open_: str, workspace: Workspace
) -> None:
    with pytest.raises(ConfigError, match="--opt points: the characteristic points of .* leave .* open") as error:
        mrfit.fit.stage.run(workspace, Settings(model, "points", name=f"refused-{model}"))
    assert open_ in str(error.value) and "\n" not in str(error.value)
    assert not (workspace.fit_folder(f"refused-{model}") / "fit.json").exists()


def test_optimizers_and_models_are_compared_with_it(workspace: Workspace) -> None:
    fit = Settings("tanh", budget=400)
    asked = mrfit.compare.optimizers.Settings(("points", "points-lsq"), fit, 3)
    rows = mrfit.compare.optimizers.run(workspace, asked).rows
    points = [r for r in rows if r.optimizer == "points"]
    # every seed takes the same points
    assert all(r.best == r.worst and r.evaluations == 1 for r in points)
    assert all(r.best < p.best for r, p in zip(rows[1::2], points, strict=True))
    models = mrfit.compare.stage.Settings(("tanh", "neural-network"), "points")
    found = mrfit.compare.stage.run(workspace, models)
    assert [m.model for m in found.models] == ["tanh"]
    assert "--opt points" in found.left_out[0].reason
    header = (workspace.root / "compare" / "compare.csv").read_text().splitlines()[0]
    assert "esr" in header.split(",")
    assert all(m.esr == pytest.approx(100.0 * (1.0 - m.fit_percent / 100.0) ** 2) for m in found.metrics)
