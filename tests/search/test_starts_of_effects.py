"""Where a search begins with effects whose neutral values lie in a minimum of their own."""

from pathlib import Path

import numpy as np
import pytest

import mrfit
from datasets.studies import force_tracking
from mrfit.core import registry
from mrfit.search.starts import beside_effects


def test_an_effect_with_starts_begins_away_from_neutral_beside_the_most_informed_start() -> None:
    found = beside_effects([{}, {"fy": 300.0}], "tanh+current-lag+inertia", [])
    values = registry.load("effect", "current-lag").SPEC.starts
    assert found == [{"fy": 300.0, "current-lag.tau": tau, "current-lag.t_d": dead} for tau, dead in values]
    assert values and all(v != registry.load("effect", "current-lag").SPEC.neutral for v in values)


@pytest.mark.parametrize("taken", ["current-lag.tau", "current-lag.t_d"])
def test_what_the_user_says_of_an_effect_stands(taken: str) -> None:
    assert beside_effects([{}], "tanh+current-lag", [taken]) == []


@pytest.mark.parametrize("model", ["tanh", "tanh+inertia+delay", "boucwen-flux+eddy-current"])
def test_other_models_begin_where_they_did(model: str) -> None:
    assert beside_effects([{}], model, []) == []


def test_starts_of_effects_lie_within_their_bounds() -> None:
    for name in registry.names("effect"):
        spec = registry.load("effect", name).SPEC
        for values in spec.starts:
            assert len(values) == len(spec.params)
            assert all(p.low <= v <= p.high for p, v in zip(spec.params, values, strict=True))


@pytest.mark.slow
def test_a_lag_is_found_where_a_dead_time_alone_is_a_minimum_too(tmp_path: Path) -> None:
    force_tracking.make(tmp_path, 0)
    logs = mrfit.read([str(p) for p in (*tmp_path.glob("sine_1Hz_10mm_*.csv"), tmp_path / "steps_1Hz_10mm.csv")])
    options = {"model": "tanh+current-lag", "per": "all", "holdout": "none"}
    free = mrfit.fit(logs, **options)
    held = mrfit.fit(logs, **options, fixed={"current-lag.tau": force_tracking.LAG})
    # what is free to be the truth may not leave more than the truth
    errors = [float(f.metrics["rmse"].iloc[-1]) for f in (free, held)]
    assert errors[0] <= errors[1] * 1.001
    assert free.params.loc["current-lag.tau", "value"] == pytest.approx(force_tracking.LAG, rel=0.25)
    assert np.isfinite(errors).all()
