"""A term that the law lacks is named, nothing beside an exact base; its plug-in is an effect like any other."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrfit.contracts.check import applying
from mrfit.contracts.effects import EFFECT_CHECKS
from mrfit.core import registry
from mrfit.core.specs import Array
from mrfit.discover.evidence.refit import Refit
from mrfit.discover.invariance.records import Record, thinned
from mrfit.discover.policy import STANDARD
from mrfit.discover.repair.choice import ConditionGrams
from mrfit.discover.repair.plugin import REPAIR_NAME, source
from mrfit.discover.repair.proposal import Repair, of_chance, repaired
from mrfit.discover.repair.rows import FittedBase, fitted_base, rows_of
from mrfit.discover.repair.terms import TERM_KINDS, LawTerm, TermInputs, candidates
from mrfit.discover.stage import Settings, run
from mrfit.discover.writing.law_repair import REPAIR_FILE, entry_of
from mrfit.export.compiler import compiler
from mrfit.kernels.filters import lag
from mrfit.report.explain import sentences
from mrfit.search.cube import Cube
from mrfit.simulate.assembly import assemble
from tests.discover import studies
from tests.export.rigs import STRENGTH, rig
from tests.export.test_c import agrees, used

DT, TAU = 2e-3, 0.02
THETA = {"fy": 300.0, "a1": 15.0, "a2": 0.0, "c": 800.0, "k": 0.0, "f0": 0.0}


def sines(branch: float = 0.0, noise: float = 2.0) -> list[Record]:
    """Sines on a tanh damper, perhaps with a Maxwell branch of so many N*s/m beside it."""
    rng, found = np.random.default_rng(3), []
    for f, x in [(f, x) for f in (1.0, 2.5, 6.0) for x in (0.004, 0.01, 0.02)]:
        t = np.arange(int(4.0 / f / DT)) * DT
        w = 2.0 * np.pi * f
        v = x * w * np.cos(w * t)
        channels = {
            "displacement": x * np.sin(w * t),
            "velocity": v,
            "acceleration": -x * w**2 * np.sin(w * t),
            "time": t,
        }
        force = THETA["fy"] * np.tanh(THETA["a1"] * v) + THETA["c"] * v
        force += branch * lag(v[None], np.array([TAU / DT]))[0] + noise * rng.standard_normal(len(t))
        found.append(thinned(f"{f:g} Hz {1e3 * x:g} mm", DT, channels, force, "force"))
    return found


def base() -> Refit:
    """The tanh damper at its parameters."""
    assembly = assemble("tanh")
    cube = Cube(assembly.spec.params, np.arange(len(assembly.spec.params)))
    theta = np.array([THETA.get(p.name, p.start) for p in assembly.spec.params])
    return Refit((), assembly, cube, cube.to_points(theta[None])[0], [], [], lambda: None)  # type: ignore[arg-type, return-value]


def beside(records: list[Record]) -> FittedBase:
    own = base()
    response = [own.assembly.simulate(np.stack([r.place, r.speed]), own.theta[None], r.dt)[0] for r in records]
    return fitted_base(own, records, [r.output - f for r, f in zip(records, response, strict=True)])


def parted(branch: float) -> Repair:
    made = sines(branch)
    held = made.pop(4)
    return repaired(beside(made), beside([held]))


MAXWELL = parted(2000.0)
assert MAXWELL.rows and MAXWELL.choice
ROWS, CHOICE = MAXWELL.rows, MAXWELL.choice
SCALES = replace(ROWS.scales, control=2.0)


def test_a_maxwell_branch_is_named_with_its_strength_and_lowers_the_held_out_error() -> None:
    entry = entry_of(MAXWELL, "force")
    assert entry.titles[0] == "a Maxwell branch"
    assert MAXWELL.terms[0].reach(ROWS.scales) == pytest.approx(TAU, rel=0.5)
    assert entry.before and entry.after and entry.after < 0.6 * entry.before
    assert entry.takes > entry.chance


def test_nothing_is_named_beside_an_exact_base() -> None:
    found = parted(0.0)
    assert not found.terms and "shifted in time" in found.why


def test_terms_shifted_in_time_are_not_taken() -> None:
    drawn = of_chance(ROWS, np.random.default_rng(1), 20, STANDARD)
    assert max(c.first.takes for c in drawn) < CHOICE.first.takes


def test_errors_with_each_term_are_those_of_fits_with_it() -> None:
    rows = rows_of(beside(sines(500.0)), candidates(False)[:4])
    grams = ConditionGrams(rows.grams(), rows.base.shape[1])
    np.testing.assert_allclose(grams.errors_with_each(())[:, 2], grams.errors((2,)), rtol=1e-2)


EVERY = [LawTerm(kind, own.speeds[-1], own.memories[-1]) for kind, own in TERM_KINDS.items()]
PAIRS = [(EVERY[k], LawTerm(EVERY[k + 1].kind, EVERY[k + 1].speed, EVERY[k + 1].memory, "*i")) for k in range(0, 12, 2)]


@pytest.fixture
def terms(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[LawTerm, ...]:
    text = source(request.param, np.array([0.1] * len(request.param)), SCALES, "force")
    used(tmp_path, monkeypatch, lacking_force=text)
    given: tuple[LawTerm, ...] = request.param
    return given


@pytest.mark.parametrize("terms", [*PAIRS, (EVERY[-1],)], indirect=True, ids=lambda t: "-".join(o.kind for o in t))
def test_the_plug_in_keeps_every_contract_and_makes_the_columns(terms: tuple[LawTerm, ...]) -> None:
    effect = registry.load("effect", REPAIR_NAME)
    for check in applying(EFFECT_CHECKS, effect):
        check.run(effect)
    scales, t = SCALES, np.arange(1000) * DT
    v, i, force = np.cos(9.0 * t), np.linspace(0.0, 1.0, len(t)), 50.0 * np.tanh(5.0 * np.cos(9.0 * t))
    drive = TermInputs(v, i, force, DT)
    for k, term in enumerate(terms):
        theta = np.zeros((1, len(terms)))
        theta[0, k] = 1.0
        made = _made(effect, {"velocity": v, "current": i}, force, theta)
        np.testing.assert_allclose(made, term.column(drive, scales), atol=1e-9)


def _made(effect: Any, channels: dict[str, Array], force: Array, theta: Array) -> Array:
    if hasattr(effect, "shape"):
        return np.asarray(effect.shape(force[None], channels, theta, DT)[0] - force)
    return np.asarray(effect.term(channels, theta, DT)[0])


@pytest.mark.parametrize("terms", PAIRS[2:4], indirect=True, ids=lambda t: "-".join(o.kind for o in t))
@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_its_c_is_the_simulation(terms: tuple[LawTerm, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(STRENGTH, REPAIR_NAME, (90.0, 40.0))
    agrees(rig(f"tanh+{REPAIR_NAME}"))


def test_a_discovery_that_ends_unexplained_says_what_the_law_lacks(tmp_path: Path) -> None:
    work = studies.workspace(tmp_path / "w", branch=2000.0)
    told = run(work, Settings("tanh", formulas=True)).found
    assert told.verdict == "unexplained" and told.lacking
    assert any("The law of tanh lacks a Maxwell branch" in line for line in sentences(told))
    assert (work.root / "discover" / REPAIR_FILE).read_text() == told.lacking.source
