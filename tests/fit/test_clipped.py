"""What a sensor's range cut off is not compared: a fit recovers the law, and its errors are those of what is left."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrfit.core.recording import Finding
from mrfit.discover import stage as discover_stage
from mrfit.fit import stage as fit_stage
from mrfit.io.schemas.fit import Fit
from mrfit.io.workspace import Workspace
from tests.discover.studies import LAW, NOISE, workspace

FOUND = Finding("clipped", "force", 0.0, "it is clipped")


def clipped_study(folder: Path, *findings: Finding) -> Workspace:
    """Return tests of a tanh damper whose force is cut off at 90 % of its largest in each."""
    study = workspace(folder)
    for name in {s.recording for s in study.read_segments()}:
        record = study.read_recording(name)
        force = np.asarray(record.channels["force"])
        limit = 0.9 * float(np.max(np.abs(force)))
        channels = {**record.channels, "force": np.clip(force, -limit, limit)}
        ends = [float(k) * record.dt for k in (np.argmin(channels["force"]), np.argmax(channels["force"]))]
        told = tuple(replace(f, at=at) for f in findings for at in ends)
        study.write_recording(replace(record, channels=channels, findings=told))
    return study


def fitted(study: Workspace) -> tuple[dict[str, float], Fit]:
    fit = fit_stage.run(study, fit_stage.Settings("tanh", per="all"))
    return {q.name: q.value for q in fit.results[0].parameters}, fit


def test_a_fit_to_clipped_tests_recovers_the_law_where_they_were_found_to_be(tmp_path: Path) -> None:
    pulled, _ = fitted(clipped_study(tmp_path / "unseen"))
    values, fit = fitted(clipped_study(tmp_path / "seen", FOUND))
    for name, true in LAW.items():
        assert values[name] == pytest.approx(true, rel=0.03)
    assert abs(pulled["c"] - LAW["c"]) > 0.05 * LAW["c"]
    held_out = next(m for m in fit.metrics if (m.role, m.condition) == ("holdout", "all"))
    whole = sum(s.samples for s in clipped_study(tmp_path / "again").read_segments() if s.role == "holdout")
    assert held_out.rmse == pytest.approx(NOISE, rel=0.1) and 0.4 * whole < held_out.samples < 0.9 * whole


def test_a_discovery_of_clipped_tests_misses_nothing(tmp_path: Path) -> None:
    found = discover_stage.run(clipped_study(tmp_path, FOUND), discover_stage.Settings("tanh")).found
    assert found.verdict == "none"
