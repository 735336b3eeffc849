"""Linear parameters eliminated: the same optimum, an honest Jacobian, and only where the response is affine."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.planted import problem
from mrfit.core import registry
from mrfit.core.specs import Array
from mrfit.search import chain, variable_projection
from mrfit.search import run as search
from mrfit.search.auto import Auto
from mrfit.search.coarse_to_fine import objective_of
from mrfit.search.cube import cube_of
from mrfit.search.limits import Limits
from mrfit.search.problem import LeastSquaresProblem
from mrfit.search.variable_projection import ProjectedPoints, Projection, SeparableObjective, projection_of
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence
from tests.fit.toy import block, linear_model

OWN = Auto(own_parameters=True)


def fits(effect: str) -> bool:
    return "force" in registry.load("effect", effect).SPEC.outputs


def posed(model: str, conditions: int = 1) -> LeastSquaresProblem:
    group, assembly, cube = problem(model, conditions, 3000, np.random.default_rng(1))
    return LeastSquaresProblem(group.search, np.ones(conditions), assembly, cube)


def projection(at: LeastSquaresProblem) -> Projection:
    found = projection_of(at, at.cube.probes())
    assert found is not None
    return found


def bend_over_linear_parameters(at: LeastSquaresProblem, rng: np.random.Generator) -> float:
    """How far residuals bend between two values of what the SPEC calls linear, as a share of the largest."""
    ends = at.cube.to_theta(rng.uniform(0.05, 0.95, (2, 8, len(at.cube.free))).reshape(16, -1)).reshape(2, 8, -1)
    linear = [n in at.assembly.spec.linear for n in at.assembly.spec.names]
    ends[1] = np.where(linear, ends[1], ends[0])
    first, last, middle = (at.of_theta(theta) for theta in (*ends, ends.mean(axis=0)))
    return float((np.abs(middle - 0.5 * (first + last)).max(axis=1) / np.abs(middle).max(axis=1)).max())


def rms(rows: Array) -> Array:
    costs: Array = np.sqrt(np.mean(rows**2, axis=1))
    return costs


@pytest.mark.parametrize("model", ["bingham", "tanh", "boucwen", "rotational-erf"])
def test_a_point_has_the_least_cost_over_its_linear_parameters(model: str) -> None:
    at = posed(model, 2)
    own = projection(at)
    points = np.random.default_rng(0).uniform(0.3, 0.7, (4, len(own.cube.free)))
    costs = rms(own.residuals(points))
    assert rms(at.residuals(own.completed(points))) == pytest.approx(costs, rel=1e-9)
    best = own.solve(points).theta
    low, high = (np.array([getattr(at.cube.params[k], end) for k in own.linear]) for end in ("low", "high"))
    assert np.all((best[:, own.linear] >= low) & (best[:, own.linear] <= high))
    for _ in range(30):
        other = best.copy()
        shaken = other[:, own.linear] * np.random.default_rng(_).uniform(0.98, 1.02, (4, len(own.linear)))
        other[:, own.linear] = np.clip(shaken, low, high)
        assert np.all(rms(at.of_theta(other)) >= costs * (1 - 1e-9))


def test_the_gradient_is_that_of_the_projected_cost() -> None:
    own = projection(posed("tanh"))
    point = np.array([[0.5, 0.45]])
    _, gradient, curvature = own.models(point)
    h = 1e-5
    ends = np.concatenate([point + h * np.eye(2), point - h * np.eye(2)])
    squares = rms(own.residuals(ends)) ** 2
    assert 2.0 * gradient[0] == pytest.approx((squares[:2] - squares[2:]) / (2 * h), rel=1e-3)
    assert np.all(np.linalg.eigvalsh(curvature[0]) > 0.0)


@pytest.mark.parametrize("model", ["tanh", "boucwen", "biviscous"])
def test_a_model_is_the_same_in_one_call_and_in_two(model: str, monkeypatch: pytest.MonkeyPatch) -> None:
    own = projection(posed(model, 2))
    points = np.random.default_rng(0).uniform(0.3, 0.7, (4, len(own.cube.free)))
    for more in (10**9, -1):
        monkeypatch.setattr(variable_projection, "MORE_SAMPLES", more)
        again = replace(own)
        assert again.at_once == (more > 0)
        costs, gradients, curvatures = again.models(points)
        if more > 0:
            expected = costs, gradients, curvatures
    assert costs == pytest.approx(expected[0], rel=1e-12)
    scale = np.sqrt(np.einsum("pkk->pk", curvatures))
    assert np.all(np.abs(gradients - expected[1]) <= 1e-5 * scale * costs[:, None])
    assert np.all(np.abs(curvatures - expected[2]) <= 1e-5 * scale[:, :, None] * scale[:, None, :])


@pytest.mark.parametrize("model", ["tanh", "boucwen", "boucwen-flux", "guo", "biviscous"])
def test_the_share_of_the_last_linear_parameter_is_what_the_others_leave(model: str) -> None:
    own = projection(posed(model, 2))
    assert own.complete
    plain = replace(own, complete=False)
    points = np.random.default_rng(0).uniform(0.3, 0.7, (4, len(own.cube.free)))
    assert own.solve(points).costs == pytest.approx(plain.solve(points).costs, rel=1e-10)
    assert own.simulations == plain.simulations - 1
    ours, theirs = own.models(points), plain.models(points)
    scale = np.sqrt(np.einsum("pkk->pk", theirs[2]))
    assert np.all(np.abs(ours[1] - theirs[1]) <= 1e-4 * scale * theirs[0][:, None])
    assert np.all(np.abs(ours[2] - theirs[2]) <= 1e-4 * scale[:, :, None] * scale[:, None, :])


def test_what_stays_without_the_linear_parameters_is_no_share_of_theirs() -> None:
    # the friction of LuGre's bristles is no linear parameter
    assert not projection(posed("lugre")).complete


@pytest.mark.parametrize("base", ["tanh", "biviscous"])
@pytest.mark.parametrize("effect", [e for e in registry.names("effect") if fits(e)])
def test_residuals_are_those_of_the_whole_model_whatever_an_effect_does(base: str, effect: str) -> None:
    """Where a projection looks what a model is like, an end stop may lie beyond the stroke."""
    at = posed(base, 2)
    assembly = assemble(f"{base}+{effect}")
    inputs = len(at.assembly.spec.inputs)
    time = np.linspace(0.0, 1.0, at.blocks[0].drive.shape[1])
    more = {"temperature": 20.0 + 30.0 * time, "current": 1.0 + np.sin(20.0 * time)}
    rows = [more.get(name, np.gradient(time)) for name in assembly.spec.inputs[inputs:]]
    blocks = [replace(b, drive=np.vstack([b.drive, *rows])) for b in at.blocks]
    whole = replace(at, blocks=blocks, assembly=assembly, cube=cube_of(assembly.spec, {}, {}, {}))
    rng = np.random.default_rng(0)
    own = projection_of(whole, whole.cube.probes())
    if own is None:
        assert bend_over_linear_parameters(whole, rng) > 1e-6
        return
    solved = own.solve(rng.uniform(0.05, 0.95, (8, len(own.cube.free))))
    expected = whole.of_theta(solved.theta)
    error = np.abs(solved.residuals - expected).max(axis=1)
    assert np.all(error <= 1e-6 * np.abs(expected).max(axis=1))


@pytest.mark.parametrize("model", ["neural-network", "hammerstein-wiener"])
def test_exact_derivatives_give_the_model_that_differences_give(model: str) -> None:
    at = posed(model)
    own = projection(at)
    plain = projection(replace(at, assembly=replace(at.assembly, sensitivities=None)))
    points = np.clip(own.cube.start + np.random.default_rng(0).uniform(-0.02, 0.02, (3, len(own.cube.free))), 0, 1)
    (costs, gradients, curvatures), expected = own.models(points), plain.models(points)
    assert costs == pytest.approx(expected[0], rel=1e-9)
    scale = np.sqrt(np.einsum("pkk->pk", curvatures))
    # a parameter without effect, as a filter's on a constant current, has rounding for differences
    scale = np.maximum(scale, 1e-6 * scale.max())
    # differences to one side are as true as the response is straight over a step
    assert np.all(np.abs(gradients - expected[1]) <= 1e-2 * scale * costs[:, None])
    assert np.all(np.abs(curvatures - expected[2]) <= 3e-2 * scale[:, :, None] * scale[:, None, :])
    assert own.model_simulations == 2 < plain.model_simulations


@pytest.mark.parametrize("model", ["guo", "boucwen-flux", "rotational-hybrid"])
def test_the_optimum_is_that_of_all_parameters(model: str) -> None:
    at = posed(model)
    objective = objective_of(at, None, at.cube.start[None, :], None)
    whole = chain.run("multistart", objective, np.random.default_rng(0))
    found = search.run(at, at.cube.start[None, :], Limits(), np.random.default_rng(0), OWN)
    assert found.cost <= whole.cost * (1 + 1e-4)
    assert rms(at.residuals(found.point[None, :]))[0] == pytest.approx(found.cost, rel=1e-6)


def test_where_all_parameters_are_linear_there_is_nothing_to_search() -> None:
    at = posed("bingham")
    found = search.run(at, at.cube.start[None, :], Limits(), np.random.default_rng(0), OWN)
    assert found.nfev == 1
    assert found.success and found.links[0].reason == "all parameters are linear"


def test_every_simulation_counts_as_an_evaluation_and_the_budget_holds() -> None:
    at = posed("tanh")
    own = projection(at)
    simulated: list[int] = []
    inner = own.posed.of_theta

    def counted(theta: Array) -> Array:
        simulated.append(len(theta))
        return inner(theta)

    for budget in (3, 40, 333):
        objective = objective_of(at, own, at.cube.start[None, :], None)
        assert isinstance(objective, SeparableObjective)
        # what does not depend on the point is simulated once, here
        objective.projection.solve(objective.start[None, :])
        objective.projection.posed.__dict__["of_theta"] = counted
        simulated.clear()
        outcome = chain.run("multistart", objective, np.random.default_rng(0), Limits(budget))
        assert sum(simulated) == outcome.nfev <= budget


def test_only_shares_of_the_response_that_move_are_simulated_anew() -> None:
    own = projection(posed("tanh"))
    names = [own.cube.params[int(k)].name for k in own.linear[own.moving]]
    assert names == ["fy"]
    points = np.random.default_rng(0).random((5, len(own.cube.free)))
    every = replace(own, moving=np.arange(len(own.linear)), complete=False)
    assert own.residuals(points) == pytest.approx(every.residuals(points), rel=1e-9, abs=1e-9)


def test_an_effect_that_bends_the_output_leaves_no_parameter_linear() -> None:
    group, _, _ = problem("boucwen-flux", 1, 3000, np.random.default_rng(1))
    for name, affine in (("boucwen-flux", True), ("boucwen-flux+saturation", False)):
        assembly = assemble(name)
        at = LeastSquaresProblem(group.search, np.ones(1), assembly, cube_of(assembly.spec, {}, {}, {}))
        assert (projection_of(at, at.cube.probes()) is not None) == affine


def test_a_valve_that_is_closed_at_nearly_all_places_leaves_no_parameter_linear() -> None:
    """The force at which it opens has six decades, and the share that it relieves is neutral at the start."""
    at = posed("bingham")
    assembly = assemble("bingham+relief-valve")
    still = np.zeros(at.blocks[0].drive.shape[1])
    blocks = [replace(b, drive=np.vstack([b.drive, still])) for b in at.blocks]
    for start in ({}, {"relief-valve.r_p": 0.3, "relief-valve.F_o": 40.0}):
        cube = cube_of(assembly.spec, {}, start, {})
        valve = replace(at, blocks=blocks, assembly=assembly, cube=cube)
        assert projection_of(valve, cube.start[None, :]) is None


@pytest.mark.parametrize(
    ("model", "places"), [("bingham", 0), ("bingham at currents", 7), ("bingham+relief-valve at currents", 12)]
)
def test_only_an_effect_is_asked_at_points_of_the_search_whether_it_is_affine(
    model: str, places: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    name, _, moving = model.partition(" ")
    assembly = assemble(name, CurrentDependence((("fy", 1),), 0.0, 1.0) if moving else None)
    own = posed("bingham").blocks[0]
    rows = {"velocity": own.drive[0], "current": np.linspace(0.0, 1.0, own.drive.shape[1])}
    drive = np.vstack([rows.get(n, np.zeros_like(own.drive[0])) for n in assembly.spec.inputs])
    cube = cube_of(assembly.spec, {}, {}, {})
    at = LeastSquaresProblem([replace(own, drive=drive)], np.ones(1), assembly, cube)
    asked, departure = list[int](), Projection._departure

    def counted(self: Projection, solved: ProjectedPoints) -> tuple[Array, Array]:
        asked.append(len(solved.theta))
        return departure(self, solved)

    monkeypatch.setattr(Projection, "_departure", counted)
    found = projection_of(at, np.repeat(cube.start[None, :], 5, axis=0))
    assert (found is not None) == (places < 12) and sum(asked) == places


def test_a_wrong_mark_is_found_out() -> None:
    assembly, cube = linear_model("", "")
    drive = np.random.default_rng(0).standard_normal((2, 400))
    marked = replace(assembly.spec, linear=("p0", "p1"))
    for power, affine in ((1, True), (2, False)):

        def simulate(drive: Array, theta: Array, dt: float, power: int = power) -> Array:
            return theta**power @ drive

        at = LeastSquaresProblem(
            [block(drive, drive[0])], np.ones(1), replace(assembly, spec=marked, simulate=simulate), cube
        )
        assert (projection_of(at, at.cube.probes()) is not None) == affine
