"""Tests whose later part is held out are fitted to the earlier part, whether alone or together."""

from pathlib import Path
from typing import Literal

import pytest

import mrfit.fit.stage
from mrfit.segment.conditions import hold_out_after
from mrfit.simulate.assembly import assemble
from tests.fit.benches import Bench, write_workspace


@pytest.mark.parametrize("per", ["all", "condition"])
def test_no_sample_after_the_cut_is_fitted(per: Literal["all", "condition"], tmp_path: Path) -> None:
    assembly = assemble("bingham")
    bench = Bench(assembly, assembly.spec.start, 0.01, 1)
    workspace = write_workspace(tmp_path, bench, ((1.0, 0.01),), (0.0,))
    segments = workspace.read_segments()
    # one cycle leads in, eight of 100 samples follow
    workspace.write_segments(hold_out_after(segments, "6", {segments[0].recording: 0.01}), {})
    fit = mrfit.fit.stage.run(workspace, mrfit.fit.stage.Settings("bingham", "lsq", per=per))
    assert {m.role: m.samples for m in fit.metrics} == {"train": 500, "holdout": 300}
    assert all(m.rmse <= 1.2 * m.noise_floor for m in fit.metrics)
