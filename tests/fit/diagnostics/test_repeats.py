"""Repeats of a condition that differ by far more than their noise are told, whatever the model; others are not."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mrfit.fit.stage
from mrfit.core.specs import Array
from mrfit.fit.stage import Settings
from mrfit.io.workspace import Workspace
from mrfit.simulate.assembly import assemble
from tests.fit.benches import Bench, write_workspace

Change = Callable[[Array], Array]


def repeated(folder: Path, change: Change, noise: float = 0.01) -> Workspace:
    """A damper's log twice, the second with its own noise and phase, and its force changed."""
    assembly = assemble("tanh")
    workspace = write_workspace(
        folder, Bench(assembly, np.array(assembly.spec.start), noise, 1), ((1.0, 0.010),), (0.5,)
    )
    (segment,) = workspace.read_segments()
    log = workspace.read_recording(segment.recording)
    rng = np.random.default_rng(2)
    force = change(log.channels["force"]) + noise * np.ptp(log.channels["force"]) * rng.standard_normal(log.samples)
    turned = {n: -v for n, v in log.channels.items() if n != "current"}
    other = replace(log, id="again", channels={**log.channels, **turned, "force": -force})
    workspace.write_recording(other)
    workspace.write_segments([segment, replace(segment, id="again#1", recording="again")], {})
    return workspace


@pytest.mark.parametrize(
    ("change", "agree"),
    [(lambda f: f, True), (lambda f: 1.2 * f, False), (lambda f: f + 0.2 * np.ptp(f), False)],
)
@pytest.mark.parametrize("model", ["tanh", "bingham"])
def test_a_gain_or_an_offset_between_repeats_is_told_and_half_a_cycle_is_not(
    model: str, change: Change, agree: bool, tmp_path: Path
) -> None:
    (result,) = mrfit.fit.stage.run(repeated(tmp_path, change), Settings(model, "lsq")).results
    (row,) = result.repeats
    assert row.segments == 2 and row.agree is agree
    told = [w.text for w in result.warnings if w.kind == "repeats-disagree"]
    assert len(told) == (not agree)
    assert all("sine-1Hz-0.01-0.5A" in text and "do not ingest the one that differs" in text for text in told)
