"""Prediction by a fit of conditions: the nearest set of parameters is used, and how near it is is said."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mrfit.fit.stage
from mrfit.core.specs import Array
from mrfit.fit.predict import predict
from mrfit.fit.result import simulate_block
from mrfit.fit.select import read_dataset
from mrfit.fit.stage import Settings
from mrfit.io.workspace import Workspace
from mrfit.simulate.assembly import Assembly, assemble
from tests.fit.benches import Bench, write_workspace

TRUTH = np.array([300.0, 900.0, 5.0])


def logs(folder: Path, frequency: float, amplitude: float, current: float) -> Workspace:
    return write_workspace(folder, Bench(assemble("bingham"), TRUTH, 0.01, 1), ((frequency, amplitude),), (current,))


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    return logs(tmp_path_factory.mktemp("fit"), 2.0, 0.010, 1.0)


@pytest.mark.parametrize(
    ("frequency", "amplitude", "current", "told", "untold"),
    [
        (4.0, 0.010, 1.0, ["frequency 2 Hz instead of 4 Hz (-50 %)"], ["amplitude", "current"]),
        (2.0, 0.008, 1.0, ["amplitude 0.01 m instead of 0.008 m (+25 %)"], ["frequency", "current"]),
        (2.0, 0.010, 3.0, ["current 1 A instead of 3 A (-67 %)"], ["frequency", "amplitude"]),
        (1.0, 0.020, 0.0, ["frequency 2 Hz", "amplitude 0.01 m", "current 1 A instead of 0 A"], []),
    ],
)
def test_a_condition_that_was_not_fitted_is_predicted_with_a_warning_that_says_how_far_the_nearest_is(
    frequency: float,
    amplitude: float,
    current: float,
    told: list[str],
    untold: list[str],
    fitted: Workspace,
    tmp_path: Path,
) -> None:
    fit = mrfit.fit.stage.run(fitted, Settings("bingham", "lsq"))
    found = predict(fit, read_dataset(logs(tmp_path, frequency, amplitude, current)))
    assert [w.kind for w in found.warnings] == ["nearest-set"]
    text = found.warnings[0].text
    assert all(part in text for part in told), text
    assert not any(f"{part} " in text for part in untold), text


def test_its_own_condition_and_a_joint_fit_are_predicted_without_one(fitted: Workspace, tmp_path: Path) -> None:
    own = mrfit.fit.stage.run(fitted, Settings("bingham", "lsq"))
    assert predict(own, read_dataset(logs(tmp_path / "own", 2.0, 0.010, 1.0))).warnings == []
    joint = mrfit.fit.stage.run(fitted, Settings("bingham", "lsq", per="all"))
    assert predict(joint, read_dataset(logs(tmp_path / "other", 4.0, 0.020, 3.0))).warnings == []


def test_a_moving_current_is_not_taken_for_a_level(fitted: Workspace, tmp_path: Path) -> None:
    fit = mrfit.fit.stage.run(fitted, Settings("bingham", "lsq"))
    moving = logs(tmp_path, 2.0, 0.010, 1.0)
    segment = replace(moving.read_segments()[0], current=float("nan"), condition="sine-2Hz-0.01")
    moving.write_segments([segment], {})
    assert "current 1 A instead of a moving one" in predict(fit, read_dataset(moving)).warnings[0].text


@pytest.mark.parametrize("model", ["bingham", "boucwen-flux"])
def test_a_block_is_simulated_once(model: str, tmp_path: Path) -> None:
    assembly = assemble(model)
    bench = Bench(assembly, assembly.spec.start, 0.01, 1)
    workspace = write_workspace(tmp_path, bench, ((1.0, 0.010),), (0.5,))
    settings = Settings(model, "lsq")
    from mrfit.fit.identify import build_group
    from mrfit.fit.stage import prepare
    from mrfit.search.problem import differences

    prepared = prepare(read_dataset(workspace), settings)
    ((name, segments),) = prepared.groups.items()
    block = build_group(name, segments, prepared.recordings, assembly, split=False).full[0]
    calls = []

    def counted(drive: Array, theta: Array, dt: float) -> Array:
        calls.append(len(theta))
        return assembly.simulate(drive, theta, dt)

    watched: Assembly = replace(assembly, simulate=counted)
    output, offset = simulate_block(block, watched, assembly.spec.start)
    assert calls == [1]
    assert output == pytest.approx(block.target + differences(block, assembly, assembly.spec.start[None])[0], rel=1e-12)
    raw = block.at_targets(assembly.simulate(block.drive, assembly.spec.start[None], block.dt))[0]
    assert output - raw == pytest.approx(np.full(len(raw), offset), rel=1e-6, abs=1e-9 * np.ptp(raw))
