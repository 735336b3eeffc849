"""A formula as a plug-in keeps the contracts, is fitted jointly and exported; a discovery writes it."""

from pathlib import Path

import pytest

from mrfit.contracts.check import applying
from mrfit.contracts.effects import EFFECT_CHECKS
from mrfit.core import registry
from mrfit.discover.formula.plugin import NAME, source
from mrfit.discover.stage import Settings, run
from mrfit.discover.writing.formula import PLUGIN_FILE
from mrfit.export.compiler import compiler
from mrfit.fit import stage as fit_stage
from mrfit.report.explain import sentences
from tests.discover import studies
from tests.discover.formula.cases import bump, found, gain, rebound
from tests.export.rigs import STRENGTH
from tests.export.test_c import agrees, rig, used

FOUND = {"bump": found(bump), "rebound": found(rebound), "gain": found(gain)}


@pytest.fixture
def effect(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> object:
    search = FOUND[request.param]
    assert search.rows and search.formula
    used(tmp_path, monkeypatch, found_force=source(search.rows, search.formula))
    return registry.load("effect", NAME)


@pytest.mark.parametrize("effect", FOUND, indirect=True)
def test_it_keeps_every_contract(effect: object) -> None:
    for check in applying(EFFECT_CHECKS, effect):
        check.run(effect)


@pytest.mark.parametrize("effect", FOUND, indirect=True)
@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_its_c_is_the_simulation(effect: object, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(STRENGTH, NAME, (90.0,))
    agrees(rig(f"tanh+{NAME}"))


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
