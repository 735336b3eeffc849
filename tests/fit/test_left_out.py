"""A log without a channel that the model needs is left out, by name, and keeps no other log from being fitted."""

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

import mrfit.fit.stage
import mrfit.report.stage
from mrfit.cli import output
from mrfit.errors import ConfigError, DataError
from mrfit.fit.predict import predict, read_fit
from mrfit.fit.select import read_dataset
from mrfit.fit.stage import Settings
from mrfit.io.workspace import Workspace, plain, to_json
from mrfit.simulate.assembly import assemble
from tests.fit.benches import Bench, write_workspace

SINES = ((0.5, 0.004), (1.0, 0.010), (2.0, 0.008), (3.0, 0.008))


def damper(folder: Path, lacking: dict[str, str], held_out: tuple[float, ...] = (3.0,)) -> Workspace:
    """Four logs of a damper, by frequency in Hz; ``lacking`` names the channel that the log of a frequency has not."""
    bench = Bench(assemble("bingham"), np.array([300.0, 900.0, 0.0]), 0.01, 1)
    workspace = write_workspace(folder, bench, SINES, (0.5,))
    segments = workspace.read_segments()
    workspace.write_segments([replace(s, role="holdout" if s.frequency in held_out else s.role) for s in segments], {})
    for segment in segments:
        channel = lacking.get(f"{segment.frequency:g}")
        if channel:
            log = workspace.read_recording(segment.recording)
            dropped = {"velocity", "displacement"} if channel == "velocity" else {channel}
            kept = {n: v for n, v in log.channels.items() if n not in dropped}
            workspace.write_recording(replace(log, channels=kept))
    return workspace


@pytest.mark.parametrize("per", ["all", "condition"])
def test_the_others_are_fitted_and_the_warning_names_log_and_reason(
    per: Literal["all", "condition"], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    workspace = damper(tmp_path, {"0.5": "force", "2": "velocity", "3": "force"})
    fit = mrfit.fit.stage.run(workspace, Settings("bingham", "lsq", per=per))
    assert {m.condition for m in fit.metrics} == {"sine-1Hz-0.01-0.5A", "all"}
    force, velocity = fit.warnings
    assert {force.kind, velocity.kind} == {"recordings-left-out"}
    assert force.text.startswith("2 of 4 segments (1 held out) take no part, those of 0.5Hz0.004at0.5, 3Hz")
    assert "no force in this log" in force.text
    assert velocity.text.startswith("1 of 4 segments take no part, those of 2Hz") and "no velocity" in velocity.text
    output.fit(to_json(fit), tmp_path)
    assert "warning recordings-left-out: 2 of 4 segments" in capsys.readouterr().out
    mrfit.report.stage.run(workspace, mrfit.report.stage.Settings())
    page, table = ((workspace.report_folder / name).read_text() for name in ("index.html", f"tables/{fit.name}.tex"))
    assert "recordings left out" in page and "those of 2Hz0.008at0.5" in page and "those of 2Hz0.008at0.5" in table


def test_what_was_left_out_does_not_change_what_is_fitted(tmp_path: Path) -> None:
    settings = Settings("bingham", "lsq", per="all")
    lacking = mrfit.fit.stage.run(damper(tmp_path / "a", {"2": "force"}), settings)
    without = damper(tmp_path / "b", {})
    without.write_segments([s for s in without.read_segments() if s.frequency != 2.0], {})
    assert lacking.results == mrfit.fit.stage.run(without, settings).results


def test_a_fit_of_complete_logs_has_no_such_warning(tmp_path: Path) -> None:
    assert mrfit.fit.stage.run(damper(tmp_path, {}), Settings("bingham", "lsq")).warnings == []


def test_logs_left_out_of_a_choice_are_not_those_it_did_not_name(tmp_path: Path) -> None:
    workspace = damper(tmp_path, {"0.5": "force", "2": "velocity"})
    named = mrfit.fit.stage.run(workspace, Settings("bingham", "lsq", only="sine-[12]Hz*"))
    assert [w.text.partition(" take")[0] for w in named.warnings] == ["1 of 2 segments"]
    # a log without velocity is in no band, and keeps none from being chosen
    fast = mrfit.fit.stage.run(workspace, Settings("bingham", "lsq", only="MH"))
    assert {r.condition for r in fast.results} == {"sine-1Hz-0.01-0.5A", "sine-3Hz-0.008-0.5A"}
    with pytest.raises(ConfigError, match="leaves nothing to train on.*sine-1Hz"):
        mrfit.fit.stage.run(workspace, Settings("bingham", "lsq", only="nosuch*"))


def test_where_no_log_is_left_to_train_on_the_reason_is_the_error(tmp_path: Path) -> None:
    every = damper(tmp_path / "every", {f"{f:g}": "force" for f, _ in SINES})
    with pytest.raises(DataError, match=r"^0.5Hz0.004at0.5: no force in this log.*3 more logs cannot be used either"):
        mrfit.fit.stage.run(every, Settings("bingham", "lsq"))
    training = damper(tmp_path / "training", {f"{f:g}": "force" for f, _ in SINES[:3]})
    with pytest.raises(DataError, match="no force in this log"):
        mrfit.fit.stage.run(training, Settings("bingham", "lsq", per="all"))


def test_a_prediction_leaves_out_what_it_cannot_simulate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fitted = damper(tmp_path / "fit", {})
    fit: dict[str, Any] = mrfit.fit.stage.run(fitted, Settings("bingham", "lsq", per="all"))
    found = predict(fit, read_dataset(damper(tmp_path / "logs", {"2": "velocity"})))
    assert len(found.used) == 3 and found.warnings[0].kind == "recordings-left-out"
    told = {"fit": fit.name, "output": "force", "metrics": plain(found.metrics), "used": found.used}
    told |= {"conditions": {b.segment.id: b.segment.condition for b in found.blocks}, "findings": []}
    output.predict(
        {**told, "outdated": False, "reasons": [], "refused": [], "band": "", "warnings": plain(found.warnings)}
    )
    assert "warning recordings-left-out: 1 of 4 segments" in capsys.readouterr().out
    with pytest.raises(DataError, match="no velocity in this log"):
        predict(fit, read_dataset(damper(tmp_path / "none", {f"{f:g}": "velocity" for f, _ in SINES})))


@pytest.mark.parametrize("damage", ["{", "[]", '{"model": "bingham"}', '{"results": []}'])
def test_a_damaged_fit_is_not_taken_for_none(damage: str, tmp_path: Path) -> None:
    workspace = damper(tmp_path, {})
    name = mrfit.fit.stage.run(workspace, Settings("bingham", "lsq")).name
    (workspace.fit_folder(name) / "fit.json").write_text(damage)
    with pytest.raises(DataError, match=r"fit\.json: damaged, or another mrfit's: .*; delete it and run"):
        read_fit(workspace, name)
    with pytest.raises(DataError, match="no fit named 'other'"):
        read_fit(workspace, "other")
