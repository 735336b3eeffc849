"""``--opt means``: conditions fitted one by one, means at each current, laws of current through them."""

from pathlib import Path

import numpy as np
import pytest

import mrfit.fit.stage
from mrfit.errors import ConfigError
from mrfit.fit.stage import Settings
from mrfit.io.workspace import Workspace
from mrfit.simulate.assembly import assemble
from tests.fit.benches import Bench, write_workspace
from tests.fit.test_points import TRUTH, values

SINES = ((1.0, 0.010), (2.0, 0.010))
LEVELS = (0.2, 0.4, 0.6)
ORDERS = "fy=1,c=1"


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    folder = tmp_path_factory.mktemp("means")
    return write_workspace(folder, Bench(assemble("tanh"), TRUTH, 0.02, 3), SINES, LEVELS)


def test_is_a_line_through_the_means_of_the_conditions_own_fits(workspace: Workspace) -> None:
    joint = mrfit.fit.stage.run(workspace, Settings("tanh", "means", per="all", current_order=ORDERS))
    used = {c for r in joint.results for c in r.conditions}
    alone = mrfit.fit.stage.run(workspace, Settings("tanh", "auto", name="alone"))
    found = values(joint.results[0])
    own = {i: [values(r) for r in alone.results if r.condition in used and r.at.current == i] for i in LEVELS}
    levels = [i for i in LEVELS if own[i]]
    for name in ("fy", "c"):
        line = np.polyfit(levels, [np.mean([v[name] for v in own[i]]) for i in levels], 1)
        # the fits alone hold a third of their cycles out
        for i in (0.2, 0.6):
            assert found[f"{name}@{i:g}A"] == pytest.approx(np.polyval(line, i), rel=0.02)
    assert joint.results[0].evaluations == 1
    assert any(w.kind == "no-search" and "means over the conditions" in w.text for w in joint.results[0].warnings)


def test_least_squares_go_on_from_the_means(workspace: Workspace) -> None:
    both = [
        mrfit.fit.stage.run(workspace, Settings("tanh", o, per="all", current_order=ORDERS, name=o)).results[0]
        for o in ("means", "means-lsq")
    ]
    assert both[1].cost < both[0].cost
    assert values(both[1])["fy@0.6A"] == pytest.approx(TRUTH[0], rel=0.02)


@pytest.mark.parametrize(("more", "message"), [({}, "add --per all"), ({"per": "all", "current_order": "0"}, "fy=1")])
def test_without_currents_to_go_over_it_is_refused(
    workspace: Workspace, tmp_path: Path, more: dict[str, str], message: str
) -> None:
    with pytest.raises(ConfigError, match=message if message != "fy=1" else "no parameter depends on current"):
        mrfit.fit.stage.run(workspace, Settings("tanh", "means", name="refused", **more))
