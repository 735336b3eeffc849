"""Residuals that still hold something of an input are told from correlated noise, condition by condition."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import mrfit.fit.stage
import mrfit.report.stage
from mrfit.cli import output
from mrfit.core.specs import Array
from mrfit.fit.diagnostics.residual_tests import ALL, input_dependence
from mrfit.fit.stage import Settings
from mrfit.io.schemas.fit import ResidualTest
from mrfit.io.workspace import Workspace, to_json
from mrfit.simulate.assembly import assemble
from tests.fit.benches import Bench, write_workspace
from tests.fit.toy import coloured

SAMPLES, CYCLES = 4000, 8
PERIOD = SAMPLES / CYCLES
DRIVE = np.sin(2 * np.pi * np.arange(SAMPLES) / PERIOD)


def dependence(inputs: Sequence[Array], residuals: Sequence[Array], period: float = PERIOD) -> ResidualTest | None:
    """The test with one record in every condition, a, b, c and so on."""
    names = [chr(ord("a") + k) for k in range(len(inputs))]
    return input_dependence("u", inputs, residuals, [period] * len(inputs), names)


def road(rng: np.random.Generator, samples: int) -> Array:
    """A drive that never repeats, of 100 samples' memory."""
    return coloured(rng, samples, 0.98)


@pytest.mark.parametrize("rho", [0.0, 0.9])
@pytest.mark.parametrize(("conditions", "runs"), [(1, 40), (5, 20), pytest.param(30, 8, marks=pytest.mark.slow)])
@pytest.mark.parametrize("periodic", [True, False])
def test_correlated_noise_passes_in_nearly_all_runs(
    rho: float, conditions: int, runs: int, periodic: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    # the limit alone decides, not what is too small to matter
    monkeypatch.setattr("mrfit.fit.diagnostics.residual_tests.CORRELATION_MIN", 0.0)
    rng = np.random.default_rng([20, conditions, round(10 * rho), periodic])
    found = []
    for _ in range(runs):
        drives = [DRIVE if periodic else road(rng, SAMPLES) for _ in range(conditions)]
        noise = [coloured(rng, SAMPLES, rho) for _ in drives]
        row = dependence(drives, noise, PERIOD if periodic else 0.0)
        assert row is not None and row.conditions == conditions
        found.append(not row.independent)
    # by chance 5 % of the runs at most: three in forty happens once in thirty times
    assert sum(found) <= 3


@pytest.mark.parametrize("periodic", [True, False])
def test_what_changes_sign_between_conditions_and_cancels_in_their_sum_is_found(periodic: bool) -> None:
    rng = np.random.default_rng(5)
    shares = (-0.9, -0.6, 0.1, 0.5, 0.9)
    drives = [DRIVE if periodic else road(rng, SAMPLES) for _ in shares]
    residuals = [s * u / u.std() + 0.3 * coloured(rng, SAMPLES, 0.5) for s, u in zip(shares, drives, strict=True)]
    row = dependence(drives, residuals, PERIOD if periodic else 0.0)
    assert row is not None and not row.independent
    assert (row.dependent, row.conditions) == (5, 5)
    # nearly all of the residual in the first and the last
    assert row.condition in "ae" and abs(row.correlation) > 0.9
    pooled = sum(float(u @ r) for u, r in zip(drives, residuals, strict=True))
    assert abs(pooled) < 0.1 * sum(
        float(np.linalg.norm(u) * np.linalg.norm(r)) for u, r in zip(drives, residuals, strict=True)
    )


def test_the_condition_that_is_worst_is_named_among_those_that_hold_nothing() -> None:
    rng = np.random.default_rng(6)
    residuals = [coloured(rng, SAMPLES, 0.5) for _ in range(6)]
    residuals[3] = residuals[3] + 0.5 * DRIVE
    row = dependence([DRIVE] * 6, residuals)
    assert row is not None and not row.independent
    assert (row.condition, row.dependent, row.conditions) == ("d", 1, 6)


def test_a_tiny_correlation_is_no_matter_in_any_condition() -> None:
    rng = np.random.default_rng(7)
    residuals = [s * 0.15 * np.sqrt(2) * DRIVE + coloured(rng, SAMPLES, 0.0) for s in (1, -1, 1, -1)]
    row = dependence([DRIVE] * 4, residuals)
    assert row is not None and row.independent and row.dependent == 0
    assert row.limit < abs(row.correlation) < 0.2


def test_what_no_short_record_shows_alone_all_of_them_show_together() -> None:
    rng = np.random.default_rng(8)
    drives = [rng.standard_normal(130) for _ in range(40)]
    row = dependence(drives, [0.3 * u + rng.standard_normal(130) for u in drives], 0.0)
    assert row is not None and not row.independent
    assert row.condition == ALL
    assert row.correlation == pytest.approx(0.3 / np.sqrt(1.09), abs=0.06)


def test_what_a_model_leaves_out_of_its_input_is_found() -> None:
    rng = np.random.default_rng(2)
    velocity = np.cos(2 * np.pi * np.arange(SAMPLES) / PERIOD)
    found = dependence([DRIVE], [0.5 * velocity + coloured(rng, SAMPLES, 0.5)])
    assert found is not None
    assert not found.independent
    # a quarter of a cycle
    assert found.lag == -125
    assert found.correlation == pytest.approx(np.sqrt(0.125 / 1.125), abs=0.05)


def test_the_lag_of_a_delayed_random_input_is_found_with_its_sign() -> None:
    rng = np.random.default_rng(3)
    drive = rng.standard_normal(SAMPLES)
    found = dependence([drive], [0.5 * np.roll(drive, 7) + rng.standard_normal(SAMPLES)], 0.0)
    assert found is not None
    assert (found.lag, found.independent) == (7, False)
    assert found.correlation == pytest.approx(0.5 / np.sqrt(1.25), abs=0.05)


def test_a_residual_that_is_all_input_does_not_raise_its_own_limit() -> None:
    drive = road(np.random.default_rng(9), 1000)
    found = dependence([drive], [drive + 0.05 * np.random.default_rng(10).standard_normal(1000)], 0.0)
    assert found is not None and found.correlation > 0.99
    assert not found.independent and found.limit < 0.2


def test_a_constant_input_has_no_verdict() -> None:
    assert dependence([np.ones(SAMPLES)], [DRIVE], 0.0) is None


def test_no_correlation_exceeds_one_where_the_input_grows() -> None:
    grows = np.linspace(0.0, 1.0, 300) ** 3 * np.sin(np.arange(300.0))
    found = dependence([grows], [-np.roll(grows, 20)], 0.0)
    assert found is not None
    assert -1.0 - 1e-9 <= found.correlation < -0.95


def sprung(folder: Path, stiffness: float) -> Workspace:
    """Logs of a damper at five currents, with a spring that turns from a pull to a push of so many N/m as they rise."""
    currents = (0.0, 0.5, 1.0, 1.5, 2.0)
    bench = Bench(assemble("bingham"), np.array([300.0, 900.0, 0.0]), 0.01, 1)
    workspace = write_workspace(folder, bench, ((1.0, 0.010),), currents)
    for segment in workspace.read_segments():
        log = workspace.read_recording(segment.recording)
        spring = stiffness * (segment.current - 1.0) * log.channels["displacement"]
        log.channels["force"][:] += spring  # type: ignore[index]
        workspace.write_recording(log)
    return workspace


@pytest.mark.slow
def test_a_stiffness_that_changes_sign_with_current_is_said_of_a_joint_fit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    workspace = sprung(tmp_path, 5e3)
    fit = mrfit.fit.stage.run(workspace, Settings("bingham", "lsq", per="all"))
    (row,) = fit.results[0].residual_tests
    assert (row.channel, row.independent, row.conditions, row.dependent) == ("velocity", False, 5, 4)
    assert row.condition in ("sine-1Hz-0.01-0A", "sine-1Hz-0.01-2A") and abs(row.correlation) > 0.9
    (warning,) = [w for w in fit.results[0].warnings if w.kind == "input-residual"]
    said = f"correlated with velocity in 4 of 5 conditions, most on {row.condition} (correlation {row.correlation:.2f}"
    assert said in warning.text
    output.fit(to_json(fit), tmp_path)
    mrfit.report.stage.run(workspace, mrfit.report.stage.Settings())
    page = (workspace.report_folder / "index.html").read_text()
    for shown in (" ".join(capsys.readouterr().out.split()), " ".join(page.split())):
        assert said in shown


def test_a_joint_fit_that_leaves_only_noise_says_nothing(tmp_path: Path) -> None:
    fit = mrfit.fit.stage.run(sprung(tmp_path, 0.0), Settings("bingham", "lsq", per="all"))
    (row,) = fit.results[0].residual_tests
    assert row.independent and row.dependent == 0
    assert not [w for w in fit.results[0].warnings if w.kind == "input-residual"]
