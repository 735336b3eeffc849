"""Parameters that a model fixes are held where the training logs say, in fits of one test and of all."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrfit.fit.stage
from mrfit.io.schemas.fit import Fit, Quantity
from mrfit.search import run as search
from mrfit.simulate.assembly import assemble
from tests.fit.benches import Bench, write_workspace

SINES = ((0.5, 0.002), (2.0, 0.008))
FASTEST = [2 * np.pi * f * x for f, x in SINES]


def polynomial_fit(folder: Path, **settings: Any) -> Fit:
    assembly = assemble("polynomial")
    theta = np.append(np.random.default_rng(5).normal(size=26) * 100.0, 0.2)
    workspace = write_workspace(folder, Bench(assembly, theta, 0.01, 1), SINES, (0.0,))
    return mrfit.fit.stage.run(workspace, mrfit.fit.stage.Settings("polynomial", "lsq", name="p", **settings))


def scales(fit: Fit) -> list[Quantity]:
    return [p for r in fit.results for p in r.parameters if p.name == "v_max"]


def test_a_scale_is_held_at_the_greatest_velocity_of_all_logs_fitted_together(tmp_path: Path) -> None:
    (held,) = scales(polynomial_fit(tmp_path, per="all"))
    assert held.fixed and abs(held.value - max(FASTEST)) < 0.01 * max(FASTEST)


def test_each_test_fitted_alone_has_its_own_scale(tmp_path: Path) -> None:
    found = scales(polynomial_fit(tmp_path))
    assert np.allclose(sorted(p.value for p in found), sorted(FASTEST), rtol=0.01)


def test_the_user_s_value_goes_before_that_of_the_logs(tmp_path: Path) -> None:
    (held,) = scales(polynomial_fit(tmp_path, per="all", fixed=(("v_max", 0.15),)))
    assert held.fixed and held.value == 0.15


def test_a_limit_of_seconds_holds_for_the_searches_that_give_starts_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assembly = assemble("tanh")
    workspace = write_workspace(tmp_path, Bench(assembly, np.array(assembly.spec.start), 0.01, 1), SINES, (0.0, 1.0))
    run, given = search.run, []

    def watched(problem: Any, starts: Any, limits: Any, *rest: Any) -> Any:
        given.append(limits.seconds)
        return run(problem, starts, limits, *rest)

    monkeypatch.setattr(search, "run", watched)
    settings = mrfit.fit.stage.Settings("tanh", "lsq", per="all", seconds=0.5, current_order="1")
    (result,) = mrfit.fit.stage.run(workspace, settings).results
    # two currents and the joint search
    assert len(result.per_current) == 2 and len(given) == 3
    assert 0.5 >= given[0] > given[1] >= given[2] > 0.0
    given.clear()
    mrfit.fit.stage.run(workspace, mrfit.fit.stage.Settings("tanh", "lsq", per="all", current_order="1"))
    assert given == [None, None, None]
