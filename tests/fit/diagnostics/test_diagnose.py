"""What is said of a fit's trustworthiness comes from its own residuals and sensitivities."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import stdtrit

from benchmarks.planted import problem
from mrfit.core.registry import names
from mrfit.core.specs import Array
from mrfit.fit.diagnostics.diagnose import diagnose, ranges_of
from mrfit.fit.identify import SearchSettings, search_optimum
from mrfit.fit.result import simulate_block
from mrfit.io.schemas.determined import State
from mrfit.io.schemas.fit import FitDiagnostics
from mrfit.models.tanh import SPEC
from mrfit.search.parts import Blocks
from mrfit.settings.fit import Intervals, Settings
from mrfit.simulate.assembly import assemble

OFFSETS = ("force-offset", "integrator-offset")


def judged(intervals: Intervals = "hac", missing: float = 0.0, model: str = "bingham") -> FitDiagnostics:
    """Fit planted logs, to which a force in proportion to displacement was added, and judge the fit."""
    group, assembly, cube = problem(model, 2, 6000, np.random.default_rng(1))
    if missing:
        # a spring the model does not have: a quarter of a cycle behind velocity
        springs = [missing * np.cumsum(b.drive[0])[b.nodes[:, 0]] * b.dt for b in group.full]
        parts = [replace(p, output=p.output + s) for p, s in zip(group.full.parts, springs, strict=True)]
        group = replace(group, full=Blocks(parts))
    settings = SearchSettings("auto", 0, None, None, "none")
    found = search_optimum(group, assembly, cube, cube.start[None, :], settings, lambda evaluations, cost: None)
    point = found.point
    theta = cube.to_theta(point[None, :])[0]
    simulated = [simulate_block(b, assembly, theta)[0] for b in group.full]
    return diagnose(
        group, assembly, cube, point, simulated, Settings(model, weight="none", intervals=intervals, seed=2)
    )


@pytest.mark.parametrize(("wander", "state"), [(1e-3, State.WELL), (0.3, State.POORLY)])
def test_an_offset_near_zero_is_judged_by_the_range_of_what_it_adds_to(wander: float, state: State) -> None:
    rng = np.random.default_rng(1)
    group, assembly, cube = problem("bingham", 2, 6000, rng)

    def without_offset(output: Array) -> Array:
        """The offset that was planted is taken off, and the zero wanders slowly."""
        walk = np.cumsum(rng.standard_normal(len(output)))
        made: Array = output - output.mean() + wander * np.ptp(output) * (walk - walk.mean()) / walk.std()
        return made

    parts = [replace(p, output=without_offset(p.output)) for p in group.full.parts]
    group = replace(group, full=Blocks(parts), search=[p.folded(0) for p in parts])
    settings = SearchSettings("auto", 0, None, None, "none")
    found = search_optimum(group, assembly, cube, cube.start[None, :], settings, lambda evaluations, cost: None)
    theta = cube.to_theta(found.point[None, :])[0]
    simulated = [simulate_block(b, assembly, theta)[0] for b in group.full]
    result = diagnose(group, assembly, cube, found.point, simulated, Settings("bingham", weight="none"))
    f0 = next(p for p in result.parameters if p.name == "f0")
    span = np.ptp(np.concatenate([p.output for p in parts]))
    assert f0.added_to == pytest.approx(span) and f0.low < 0.0 < f0.high
    assert f0.determined is state
    assert all(p.added_to is None for p in result.parameters if p.name != "f0")


def test_every_offset_is_judged_by_one_rule_whether_of_a_model_of_an_effect_or_derived() -> None:
    made = [assemble(name) for name in names("model")]
    made += [assemble(f"{'boucwen-flux' if e == 'integrator-offset' else 'bingham'}+{e}") for e in OFFSETS]
    for assembly in made:
        every = [*assembly.spec.params, *assembly.spec.derived]
        called = {p.name for p in every if "offset" in f"{p.name.rpartition('.')[2]} {p.text}" or p.name == "x0"}
        assert {p.name for p in every if p.role == "offset"} == called
    assert all(any(p.role == "offset" for p in a.spec.params) for a in made[-len(OFFSETS) :])


@pytest.mark.parametrize(("model", "unit"), [("boucwen-flux+integrator-offset", "V"), ("boucwen", "N")])
def test_what_an_offset_adds_to_has_a_range(model: str, unit: str) -> None:
    group, assembly, _ = problem(model, 2, 4000, np.random.default_rng(0))
    parts, ranges = group.training.parts, ranges_of(group.training.parts, assembly)
    outputs = [np.asarray(p.output) for p in parts]
    span = max(o.max() for o in outputs) - min(o.min() for o in outputs)
    # a voltage adds a flux in proportion to time, over the longest record the most
    expected = span / max(len(p.output) * p.dt for p in parts) if unit == "V" else span
    assert ranges[unit] == pytest.approx(expected)


def test_a_model_that_fits_is_determined_and_leaves_nothing_of_its_input() -> None:
    result = judged()
    assert result.conditioning.rank == 3
    assert result.identifiability == ["The data bound all 3 parameters; the intervals say how closely."]
    assert [r.independent for r in result.residual_tests] == [True]
    assert all(p.low < p.value < p.high for p in result.parameters)


def test_a_force_the_model_leaves_out_is_found_in_the_residual() -> None:
    row = judged(missing=2e4).residual_tests[0]
    assert row.channel == "velocity"
    assert not row.independent


@pytest.mark.parametrize("intervals", ["bootstrap", "profile"])
def test_other_intervals_agree_with_those_from_the_jacobian(intervals: Intervals) -> None:
    theirs, ours = judged(intervals, model="guo").parameters, judged(model="guo").parameters
    for a, b in zip(theirs, ours, strict=True):
        assert a.high - a.low == pytest.approx(b.high - b.low, rel=0.4)
        assert (a.low + a.high) / 2 == pytest.approx(b.value, abs=0.3 * (b.high - b.low))


def test_the_covariance_is_that_of_the_intervals_on_the_scale_of_the_search() -> None:
    found = judged(model="tanh")
    given = found.covariance
    assert given is not None and any(given.log)
    quantile = float(stdtrit(given.degrees, 0.975))
    rows = {row.name: row for row in (*found.parameters, *found.derived)}
    assert set(given.names) == {name for name, row in rows.items() if row.low is not None and not row.fixed}
    for k, name in enumerate(given.names):
        low, high = rows[name].low, rows[name].high
        assert low is not None and high is not None
        width = np.log(high / low) if given.log[k] else high - low
        assert quantile * np.sqrt(given.rows[k][k]) == pytest.approx(width / 2.0, rel=1e-6)
    assert np.allclose(given.rows, np.transpose(given.rows), rtol=1e-9)
    assert given.roles == [next(p.role for p in SPEC.params if p.name == n) for n in given.names]
