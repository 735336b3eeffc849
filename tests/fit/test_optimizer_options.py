"""What the user changes of an optimizer is part of the fit: of its settings, its key and its result."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mrfit.fit.stage
from mrfit.errors import ConfigError
from mrfit.fit.stage import Settings, check
from mrfit.io.workspace import Workspace
from mrfit.simulate.assembly import assemble
from tests.fit.benches import Bench, write_workspace

SETTINGS = Settings("bingham", "mwoa", stall=1.0, options=(("population", 8.0), ("iterations", 6.0)))


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    bench = Bench(assemble("bingham"), np.array([300.0, 900.0, 5.0]), 0.01, 1)
    return write_workspace(tmp_path, bench, ((2.0, 0.010),), (1.0,))


def test_options_are_recorded_and_change_the_key_and_the_search(workspace: Workspace) -> None:
    first = mrfit.fit.stage.run(workspace, SETTINGS)
    # the two starts, the model's own and that of the data, are tried before
    assert first.results[0].evaluations == 2 + 8 * 6
    assert first.settings["options"] == [["population", 8.0], ["iterations", 6.0]]
    assert mrfit.fit.stage.run(workspace, SETTINGS).skipped
    more = mrfit.fit.stage.run(workspace, replace(SETTINGS, options=(("population", 9.0), ("iterations", 6.0))))
    assert not more.skipped and more.key != first.key
    assert more.results[0].evaluations == 2 + 9 * 6


def test_a_budget_goes_before_the_iterations(workspace: Workspace) -> None:
    fit = mrfit.fit.stage.run(workspace, replace(SETTINGS, budget=30))
    assert fit.results[0].evaluations <= 30


def test_options_are_checked_before_any_data_are_touched() -> None:
    with pytest.raises(ConfigError, match="N_d=0: takes 1 to 1e"):
        check(replace(SETTINGS, options=(("N_d", 0.0),)))
    check(replace(SETTINGS, options=(("N_d", 1.0), ("mwoa.M", 5.0))))
