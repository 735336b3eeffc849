"""One entry, every strategy: each ends at the optimum that a closed form gives, within its limits, seed by seed."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.errors import ConfigError
from mrfit.search import run as search
from mrfit.search.auto import Auto
from mrfit.search.chain import OptimizerChain
from mrfit.search.cube import cube_of
from mrfit.search.descent import Descent
from mrfit.search.limits import Limits, own_generator
from mrfit.search.problem import LeastSquaresProblem, ResidualProblem, SegmentBlock
from mrfit.search.result import SearchResult
from mrfit.search.strategies import Strategy
from mrfit.simulate.assembly import assemble
from tests.fit.toy import block

# Yield velocity of the static damper a*i + b: held, so that force is linear in the other parameters
A, B, CURRENT = 0.02, 0.005, 1.0
KNEE = A * CURRENT + B
TRUTH = {"c_pre": 2.2e4, "c_post": 1500.0, "f0": 40.0}
NOISE = 5.0

STRATEGIES: dict[str, str | Strategy] = {
    **{name: name for name in ("auto", "staged", "staged-lsq", "lsq", "fmin", "multistart", "auto-lsq")},
    "swarm": OptimizerChain("pso-lsq", (("population", 10.0), ("iterations", 20.0))),
    "own": Auto(own_parameters=True),
    "descent": Descent(60, 1e-9, np.inf),
}
every_strategy = pytest.mark.parametrize("strategy", STRATEGIES.values(), ids=list(STRATEGIES))


def basis(velocity: Array) -> Array:
    """Force per c_pre, c_post and f0 (N, 3): the closed form that the model's equation is at a held knee."""
    below = np.clip(velocity, -KNEE, KNEE)
    return np.column_stack([below, velocity - below, np.ones(len(velocity))])


def strokes() -> list[tuple[str, Array]]:
    """Waveform of the stroke and its velocity: at constant speed, and a sine."""
    phase = np.arange(1200) * 2.0 * np.pi / 400.0
    return [("triangle", 0.08 * np.where(np.sin(phase) >= 0.0, 1.0, -1.0)), ("sine", 0.1 * np.cos(phase))]


def planted() -> tuple[LeastSquaresProblem, Array, float]:
    """Return the problem, and the parameters and the RMS error at its optimum by linear least squares."""
    rng, assembly = np.random.default_rng(3), assemble("hw-static")
    cube = cube_of(assembly.spec, {}, {}, {"a": A, "b": B})
    blocks: list[SegmentBlock] = []
    for waveform, velocity in strokes():
        force = basis(velocity) @ list(TRUTH.values()) + NOISE * rng.standard_normal(len(velocity))
        one = block(np.stack([velocity, np.full(len(velocity), CURRENT)]), force)
        segment = replace(one.segment, waveform=waveform, current=CURRENT)
        blocks.append(replace(one, segment=segment))
    rows, force = np.vstack([basis(v) for _, v in strokes()]), np.concatenate([b.target for b in blocks])
    best = np.linalg.lstsq(rows, force, rcond=None)[0]
    return (
        LeastSquaresProblem(blocks, np.ones(2), assembly, cube),
        best,
        float(np.sqrt(np.mean((rows @ best - force) ** 2))),
    )


@every_strategy
def test_every_strategy_ends_at_the_closed_form_optimum(strategy: str | Strategy) -> None:
    problem, best, cost = planted()
    told: list[tuple[int, float]] = []
    start = problem.cube.start[None, :]
    found = search.run(problem, start, Limits(), np.random.default_rng(0), strategy, lambda e, c: told.append((e, c)))
    values = dict(zip(problem.assembly.spec.names, problem.cube.to_theta(found.point[None, :])[0], strict=True))
    assert found.cost == pytest.approx(cost, rel=1e-6)
    assert [values[n] for n in TRUTH] == pytest.approx(best, rel=1e-3, abs=0.5)
    assert found.success and found.message and not found.cut_short and not found.out_of_time
    assert told[-1] == (found.nfev, pytest.approx(found.cost, rel=1e-6))
    assert np.sqrt(np.mean(problem.residuals(found.point[None, :]) ** 2)) == pytest.approx(found.cost, rel=1e-9)


@pytest.mark.parametrize("strategy", ["auto", Auto(own_parameters=True), Descent(60, 1e-9, np.inf)])
def test_descents_find_by_steps_what_is_not_known_to_be_linear(strategy: str | Strategy) -> None:
    problem, best, cost = planted()
    assembly = replace(problem.assembly, spec=replace(problem.assembly.spec, linear=()))
    stepped = replace(problem, assembly=assembly)
    starts = np.array([stepped.cube.start, [0.5, 0.5, 0.5]])
    found = search.run(stepped, starts, Limits(), np.random.default_rng(0), strategy)
    assert found.cost == pytest.approx(cost, rel=1e-6)
    assert found.nfev > 10 and found.success
    steps = [e for e, _ in found.history]
    assert steps == sorted(steps) and steps[-1] == found.nfev
    last = [c for _, c in found.history[found.preliminary :]]
    assert last == sorted(last, reverse=True)


@every_strategy
def test_the_seed_alone_decides(strategy: str | Strategy) -> None:
    problem, _, _ = planted()
    start = problem.cube.start[None, :]
    first, second = (search.run(problem, start, Limits(), np.random.default_rng(5), strategy) for _ in range(2))
    assert first.point.tobytes() == second.point.tobytes()
    assert (first.nfev, first.history) == (second.nfev, second.history)


@every_strategy
@pytest.mark.parametrize("budget", [8, 30])
def test_a_budget_holds_and_few_evaluations_find_a_point(strategy: str | Strategy, budget: int) -> None:
    problem, _, _ = planted()
    found = search.run(problem, problem.cube.start[None, :], Limits(budget), np.random.default_rng(0), strategy)
    assert 0 < found.nfev <= budget
    assert np.isfinite(found.cost)


@every_strategy
def test_simulations_that_all_diverge_are_told_not_raised(strategy: str | Strategy) -> None:
    problem, _, _ = planted()

    def diverging(drive: Array, theta: Array, dt: float) -> Array:
        return np.full((len(theta), drive.shape[1]), np.nan)

    lost = replace(problem, assembly=replace(problem.assembly, simulate=diverging, rough=None, sensitivities=None))
    found = search.run(lost, lost.cube.start[None, :], Limits(200), np.random.default_rng(0), strategy)
    assert found.cost == np.inf and found.nonfinite > 0
    assert found.first_nonfinite is not None and found.first_nonfinite.shape == lost.cube.start.shape


def test_a_result_cannot_be_changed() -> None:
    problem, _, _ = planted()
    found = search.run(problem, problem.cube.start[None, :], Limits(), np.random.default_rng(0), "lsq")
    with pytest.raises(FrozenInstanceError):
        found.cost = 0.0  # type: ignore[misc]


def test_stages_are_told_with_the_result_of_a_staged_search_alone() -> None:
    problem, _, _ = planted()
    start, rng = problem.cube.start[None, :], np.random.default_rng
    stages = search.run(problem, start, Limits(), rng(0), "staged").stages
    assert [s.stage for s in stages] == ["static map C"]
    assert stages[0].parameters == list(TRUTH)
    assert search.run(problem, start, Limits(), rng(0), "lsq").stages == ()


@pytest.mark.parametrize("strategy", ["auto", "staged", Descent(60, 1e-9, 0.0)])
def test_strategies_that_look_into_the_data_say_so(strategy: str | Strategy) -> None:
    bowl = ResidualProblem(lambda points: points - 0.3)
    with pytest.raises(TypeError, match="measured blocks"):
        search.run(bowl, np.full((1, 2), 0.5), Limits(), np.random.default_rng(0), strategy)
    found = search.run(bowl, np.full((1, 2), 0.5), Limits(), np.random.default_rng(0), "lsq")
    assert found.point == pytest.approx([0.3, 0.3])


@pytest.mark.parametrize(
    ("limits", "shown"), [(Limits(0), "0 evaluations"), (Limits(seconds=-2.0), "-2 s"), (Limits(stall=0.0), "--stall")]
)
@pytest.mark.parametrize("strategy", ["auto", "staged", "lsq"])
def test_limits_that_allow_nothing_are_refused_by_every_strategy(strategy: str, limits: Limits, shown: str) -> None:
    problem, _, _ = planted()
    with pytest.raises(ConfigError, match=shown):
        search.run(problem, problem.cube.start[None, :], limits, np.random.default_rng(0), strategy)


def test_the_best_of_several_starts_is_where_a_local_search_begins() -> None:
    def two_wells(points: Array) -> Array:
        x = points[:, :1]
        return np.where(x < 0.5, 1.0 + np.abs(x - 0.2), np.abs(x - 0.8))

    starts = np.array([[0.3], [0.7]])
    found = search.run(ResidualProblem(two_wells), starts, Limits(), np.random.default_rng(0), "lsq")
    assert found.point == pytest.approx([0.8], abs=1e-3)
    alone = search.run(ResidualProblem(two_wells), starts[:1], Limits(), np.random.default_rng(0), "lsq")
    assert alone.point == pytest.approx([0.2], abs=1e-3)


def test_a_part_of_a_search_has_randomness_of_its_own() -> None:
    rng, drawn = np.random.default_rng([7, 8]), np.random.default_rng([7, 8])
    drawn.random(100)
    first = own_generator(rng, "stages").random(3)
    # what the search drew before does not matter, its seed and the purpose do
    assert np.array_equal(first, own_generator(drawn, "stages").random(3))
    assert not np.array_equal(first, own_generator(rng, "levels").random(3))
    assert not np.array_equal(first, own_generator(np.random.default_rng([7, 9]), "stages").random(3))
    children = np.random.default_rng(7).spawn(2)
    assert not np.array_equal(own_generator(children[0], "x").random(3), own_generator(children[1], "x").random(3))


def test_a_descent_that_ends_far_off_on_thinned_data_is_only_measured_on_all() -> None:
    problem, _, cost = planted()
    assembly = replace(problem.assembly, spec=replace(problem.assembly.spec, linear=()))
    stepped, starts = replace(problem, assembly=assembly), np.array([problem.cube.start])

    def ended(far_above: float) -> SearchResult:
        how = Descent(60, 1e-9, 0.0, far_above=far_above)
        return search.run(stepped, starts, Limits(), np.random.default_rng(0), how)

    near, far = ended(1.5 * cost), ended(0.5 * cost)
    assert [link.allowed for link in near.links] == [240, 240]
    assert [link.allowed for link in far.links] == [240, problem.cube.start.size + 1] and far.links[1].evaluations
    assert np.sqrt(np.mean(stepped.residuals(far.point[None, :]) ** 2)) == pytest.approx(far.cost, rel=1e-9)
