"""A formula as a plug-in keeps the contracts, is fitted jointly and exported; a discovery writes it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrfit.apply.damper import Damper
from mrfit.apply.tested import NamedMotion, beyond_tests
from mrfit.contracts.check import applying
from mrfit.contracts.effects import EFFECT_CHECKS
from mrfit.core import registry
from mrfit.core.protocols import Effect
from mrfit.discover.formula.plugin import NAME, source
from mrfit.discover.stage import Settings, run
from mrfit.discover.writing.formula import PLUGIN_FILE
from mrfit.export.compiler import compiler
from mrfit.export.head import head_lines
from mrfit.fit import stage as fit_stage
from mrfit.fit.extrapolation import outside
from mrfit.fit.predict import predict
from mrfit.fit.select import read_dataset
from mrfit.report.explain import sentences
from tests.discover import studies
from tests.discover.formula.cases import bump, found, gain, rebound
from tests.export.rigs import STRENGTH
from tests.export.test_c import agrees, rig, used

HIDDEN = {"bump": bump, "rebound": rebound, "gain": gain}


@pytest.fixture
def effect(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Effect:
    search = found(HIDDEN[request.param])
    assert search.rows and search.formula
    used(tmp_path, monkeypatch, found_force=source(search.rows, search.formula))
    return registry.load("effect", NAME)


@pytest.mark.parametrize("effect", HIDDEN, indirect=True)
def test_it_keeps_every_contract(effect: Effect) -> None:
    for check in applying(EFFECT_CHECKS, effect):
        check.run(effect)


@pytest.mark.parametrize("effect", HIDDEN, indirect=True)
@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_its_c_is_the_simulation(effect: Effect, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(STRENGTH, NAME, (90.0,))
    source = rig(f"tanh+{NAME}")
    agrees(source)
    assert any(line.startswith(f"  {NAME} was found at ") for line in head_lines(source))


@pytest.mark.parametrize("effect", ["bump"], indirect=True)
def test_a_drive_beyond_what_it_was_found_on_is_one_line(effect: Effect) -> None:
    within = {name: (low, high) for name, low, high in effect.SPEC.within}
    assert set(within) == {"displacement", "velocity"} and within["displacement"][1] == pytest.approx(0.012, rel=0.01)
    model = f"guo+{NAME}"
    assert outside(model, [within]) == []
    (caution,) = outside(model, [within, within | {"displacement": (-0.02, 0.0)}])
    assert (
        "found-force was found at displacement -0.012 to 0.012 m; here is displacement -0.02 to 0.012 m" in caution.text
    )
    damper = Damper("d", model, (), (), 0.0, 1.0)
    x, v = np.array([-0.02, 0.01]), np.array([-0.1, 0.1])
    (note,) = beyond_tests(damper, [NamedMotion("m", x, v)])
    assert "displacement -0.02 to 0.01 m" in note and "velocity" not in note


def test_a_discovery_that_ends_unexplained_proposes_it_and_a_joint_fit_finds_its_strength(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    work = studies.workspace(tmp_path / "w", bump=150.0)
    told = run(work, Settings("tanh", formulas=True)).found
    assert told.verdict == "unexplained" and told.proposed
    (coefficient,) = told.proposed.coefficients
    assert coefficient.low < 150.0 < coefficient.high
    assert told.proposed.closed is not None and told.proposed.closed > 0.95
    assert any(told.proposed.text in line for line in sentences(told))
    used(tmp_path, monkeypatch, found_force=(work.root / "discover" / PLUGIN_FILE).read_text())
    fits = [fit_stage.run(work, fit_stage.Settings(m, per="all")) for m in ("tanh", f"tanh+{NAME}")]
    errors = [next(m.nrmse for m in f.metrics if m.role == "holdout" and m.nrmse) for f in fits]
    assert errors[1] < 0.1 * errors[0]
    strength = next(p for p in fits[1].results[0].parameters if p.name == f"{NAME}.f1")
    assert strength.value == pytest.approx(150.0, rel=0.01)
    data = read_dataset(work)
    wider = {
        i: replace(r, channels={**r.channels, "displacement": 1.5 * r.channels["displacement"]})
        for i, r in data.recordings.items()
    }
    warned = [predict(fits[1], replace(data, recordings=r)).warnings for r in (data.recordings, wider)]
    assert [[w.kind for w in one] for one in warned] == [[], ["extrapolation"]]
