"""A formula as a plug-in keeps the contracts, is fitted jointly and exported; a discovery writes it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrfit.apply.damper import Damper
from mrfit.apply.tested import NamedMotion, beyond_tests
from mrfit.contracts.check import applying
from mrfit.contracts.effects import EFFECT_CHECKS
from mrfit.core import registry
from mrfit.core.protocols import Effect
from mrfit.discover.formula.plugin import NAME, source
from mrfit.discover.formula.proposal import force_of
from mrfit.discover.formula.standing import Formula
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
from tests.discover.formula.plain import SCALES, formula, rows_of, term
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


U = np.linspace(-0.7, 0.8, 31)
VISITED = {n: U + 0.01 * k for k, n in enumerate("xvaiTtL")}
SPAN = SCALES["L"].size


def in_si(scaled: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {n: SCALES[n].origin + SCALES[n].size * u for n, u in scaled.items()}


def written(own: Formula) -> dict[str, Any]:
    """Return what the source of a formula defines."""
    namespace: dict[str, Any] = {}
    exec(source(rows_of([VISITED]), own), namespace)
    return namespace


EVERY = formula(
    [
        term(("x", "square"), ("L", "line")),
        term(("i", "line"), ("v", "under", -0.25)),
        term(("T", "thermal", 0.3)),
        term(("t", "decay", 0.3), ("x", "gas-column", -0.3, 1.3)),
        term(("a", "line")),
    ],
    [0.2, -0.3, 0.1, 0.05, -0.4],
)


def test_its_source_is_the_force_that_was_found_held_at_the_edge_of_what_was_visited() -> None:
    law, values = written(EVERY)["law"], in_si(VISITED)
    expected = values["L"] + force_of(rows_of([VISITED]), EVERY, VISITED) * SPAN
    made = law(values["L"], *(values[n] for n in "xvaiTt"), *(EVERY.theta * SPAN))
    np.testing.assert_allclose(made, expected, rtol=1e-6)
    far = in_si({n: 9.0 * (U - 0.05) for n in "xvaiTt"})
    edge = in_si({n: np.clip(9.0 * (U - 0.05), VISITED[n].min(), VISITED[n].max()) for n in "xvaiTt"})
    outside, inside = (law(100.0, *(v[n] for n in "xvaiTt"), *(EVERY.theta * SPAN)) for v in (far, edge))
    np.testing.assert_allclose(outside, inside, rtol=1e-6)


def test_its_declaration_says_inputs_strengths_and_where_it_was_found() -> None:
    spec = written(EVERY)["SPEC"]
    assert (spec.slot, spec.outputs, spec.steady) == ("output", ("force",), False)
    assert spec.inputs == ("displacement", "velocity", "acceleration", "current", "temperature", "time")
    # ten times what was found at full scale, and no less than 200 N
    assert [(p.name, p.unit, p.high) for p in spec.params] == [
        ("f1", "N", 1000.0), ("f2", "N", 1500.0), ("f3", "N", 500.0), ("f4", "N", 250.0), ("f5", "N", 2000.0),
    ]  # fmt: skip
    assert all(p.low == -p.high for p in spec.params) and spec.neutral == (0.0,) * 5
    box = {name: (low, high) for name, low, high in spec.within}
    assert box["displacement"] == pytest.approx((0.006 - 0.7 * 0.02, 0.006 + 0.8 * 0.02))


@pytest.mark.parametrize(
    ("own", "steady", "slot"),
    [
        (formula([term(("x", "line"))], [1e-3]), True, "add"),
        (formula([term(("x", "line")), term(("t", "line"))], [0.1, 0.1]), False, "add"),
        (formula([term(("T", "line"))], [0.1]), False, "add"),
        (formula([term(("x", "line"), ("L", "line"))], [0.1]), True, "output"),
    ],
)
def test_it_is_steady_where_it_knows_neither_time_nor_warmth(own: Formula, steady: bool, slot: str) -> None:
    spec = written(own)["SPEC"]
    assert (spec.steady, spec.slot) == (steady, slot)
    assert spec.params[0].high == pytest.approx(max(10.0 * abs(own.theta[0]) * SPAN, 200.0))
    aliases = [registry.load("effect", n).SPEC for n in spec.aliases]
    assert 0 < len(aliases) <= 3 and all("force" in a.outputs for a in aliases)


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
