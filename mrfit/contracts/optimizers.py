"""Checks of every optimizer."""

from collections.abc import Callable
from typing import Any

import numpy as np

from mrfit.contracts.check import Check, check_of, need
from mrfit.core.protocols import Optimizer
from mrfit.core.specs import Array
from mrfit.optimizers.cost.objective import Objective
from mrfit.search import chain
from mrfit.search.limits import Limits
from mrfit.search.result import SearchResult

Residuals = Callable[[Array], Array]


def quadratic(target: Array) -> Residuals:
    """Return residuals (P, M) that vanish at a point (K,)."""

    def residuals(points: Array) -> Array:
        return (points - target) * np.linspace(1.0, 3.0, points.shape[1])

    return residuals


def rosenbrock(points: Array) -> Array:
    """Return the residuals (P, 2) of a curved valley that ends at (0.75, 0.75)."""
    x = -2.0 + 4.0 * points
    return np.stack([10.0 * (x[:, 1] - x[:, 0] ** 2), 1.0 - x[:, 0]], axis=1)


def run(
    optimizer: Optimizer, residuals: Residuals, start: Any, budget: int | None = None, seed: int = 0, **more: Any
) -> tuple[SearchResult, list[Array]]:
    """Return the end of a search, and the points of every batch."""
    batches: list[Array] = []

    def recorded(points: Array) -> Array:
        batches.append(points.copy())
        return residuals(points)

    objective = Objective(recorded, np.asarray(start, dtype=float), 0, **more)
    return chain.run(optimizer.SPEC.name, objective, np.random.default_rng(seed), Limits(budget)), batches


def specification_is_sound(optimizer: Optimizer) -> None:
    """The SPEC says what it is, what it may spend, and options whose defaults are allowed."""
    spec = optimizer.SPEC
    need("-" not in spec.name, "chains are written with hyphens, so its name has none")
    need(spec.title and spec.reference, "no title or no reference")
    need(spec.kind in ("global", "local", "start"), f"kind '{spec.kind}'")
    small, large = spec.budget(1, spec.defaults), spec.budget(20, spec.defaults)
    need(0 < small <= large < 1_000_000, f"budget {small} for 1 parameter, {large} for 20")
    for option in spec.options:
        need(option.low <= option.default <= option.high and option.text, f"option {option.name}")
        need("." not in option.name and "=" not in option.name, f"option {option.name}: . or = in its name")


def options_at_their_bounds_still_search(optimizer: Optimizer) -> None:
    """With every option at its least or most it searches within the cube and the budget."""
    for option in optimizer.SPEC.options:
        for value in (option.low, option.high):
            objective = Objective(quadratic(np.full(3, 0.6)), np.full(3, 0.5), 0)
            given = ((option.name, value),)
            outcome = chain.run(optimizer.SPEC.name, objective, np.random.default_rng(0), Limits(200), given)
            what = f"{option.name}={value:g}"
            need(np.isfinite(outcome.cost) and outcome.nfev <= 200, f"{what}: {outcome.nfev} of 200")
            need(outcome.point.min() >= 0.0 and outcome.point.max() <= 1.0, f"{what}: a point outside the cube")


def points_stay_in_the_cube(optimizer: Optimizer) -> None:
    """Points stay in the unit cube."""
    for target in (0.0, 0.6, 1.0):
        _, batches = run(optimizer, quadratic(np.full(3, target)), [0.5, 0.0, 1.0], budget=2000)
        points = np.vstack(batches)
        need(points.min() >= 0.0 and points.max() <= 1.0, f"points from {points.min()} to {points.max()}")


def budget_is_never_exceeded(optimizer: Optimizer) -> None:
    """The budget is never exceeded, and every evaluation is counted."""
    for budget in (1, 4, 39, 40, 41, 997):
        outcome, batches = run(optimizer, rosenbrock, [0.2, 0.7], budget=budget)
        done = sum(len(b) for b in batches)
        need(outcome.nfev == done <= budget, f"{done} of {budget}, {outcome.nfev} counted")
        need(outcome.links[0].evaluations == done, f"{done} of {budget}, the chain says {outcome.links[0].evaluations}")


def whole_budget_is_used(optimizer: Optimizer) -> None:
    """A global search uses its whole budget on a problem that needs more, unless it stalls."""
    directions = 60.0 * np.random.default_rng(1).standard_normal((4, 30))
    for budget in (40, 203):
        outcome, _ = run(optimizer, lambda points: 2.0 + np.sin(points @ directions), np.full(4, 0.5), budget=budget)
        spent = budget - 4 <= outcome.nfev <= budget
        need(outcome.links[0].ending == "stalled" or spent, f"{outcome.nfev} of {budget}")


def result_is_never_worse_than_the_start(optimizer: Optimizer) -> None:
    """The result is never worse than the start."""
    start = np.array([0.61, 0.58])
    outcome, _ = run(optimizer, quadratic(start), start, budget=60)
    need(outcome.cost <= 1e-8, f"started at the minimum and ended at {outcome.cost:.3g}")


def same_seed_gives_the_same_bytes(optimizer: Optimizer) -> None:
    """The same seed gives the same bytes, and numpy's global random state is left alone."""
    before = np.random.get_state()
    try:
        np.random.seed(1)  # noqa: NPY002
        state = np.random.get_state()[1].copy()  # type: ignore[index]
        first = np.vstack(run(optimizer, rosenbrock, [0.2, 0.7], budget=700, seed=5)[1])
        need(np.array_equal(np.random.get_state()[1], state), "it draws from numpy's global state")  # type: ignore[index]
        np.random.seed(2)  # noqa: NPY002
        second = np.vstack(run(optimizer, rosenbrock, [0.2, 0.7], budget=700, seed=5)[1])
        need(first.tobytes() == second.tobytes(), "two searches with one seed differ")
    finally:
        np.random.set_state(before)


def another_seed_searches_elsewhere(optimizer: Optimizer) -> None:
    """Another seed searches elsewhere if the search is global, and in the same places otherwise."""
    first = np.vstack(run(optimizer, rosenbrock, [0.2, 0.7], budget=100, seed=5)[1])
    second = np.vstack(run(optimizer, rosenbrock, [0.2, 0.7], budget=100, seed=6)[1])
    same, kind = np.array_equal(first, second), optimizer.SPEC.kind
    need(same != (kind == "global"), f"a {kind} one that searches {'in the same places' if same else 'elsewhere'}")


def progress_is_told_after_every_batch(optimizer: Optimizer) -> None:
    """Progress is told after every batch."""
    told: list[tuple[int, float]] = []
    outcome, batches = run(
        optimizer, rosenbrock, [0.2, 0.7], budget=500, on_progress=lambda done, cost: told.append((done, cost))
    )
    need([e for e, _ in told] == list(np.cumsum([len(b) for b in batches])), "not after every batch")
    need(told[-1] == (outcome.nfev, outcome.cost), f"told {told[-1]} at the end")


def best_so_far_falls(optimizer: Optimizer) -> None:
    """The best cost so far only falls, and belongs to the point returned."""
    outcome, _ = run(optimizer, rosenbrock, [0.2, 0.7], budget=1500)
    costs = [cost for _, cost in outcome.links[0].history]
    need(all(b <= a for a, b in zip(costs, costs[1:], strict=False)), "the best cost rises")
    need(outcome.cost == np.sqrt(np.mean(rosenbrock(outcome.point[None, :]) ** 2)), "the cost is another point's")


def diverging_simulations_cost_only_themselves(optimizer: Optimizer) -> None:
    """Simulations that diverge in a part of the cube cost only themselves."""
    for bad in (np.nan, np.inf, 1e200):

        def residuals(points: Array, bad: float = bad) -> Array:
            values = quadratic(np.array([0.3, 0.4]))(points)
            values[points[:, 0] > 0.62] = bad
            return values

        outcome, _ = run(optimizer, residuals, [0.6, 0.6], budget=4000)
        need(outcome.cost < 1e-2, f"ended at {outcome.cost:.3g}")
        if optimizer.SPEC.kind == "global":
            first = outcome.first_nonfinite
            need(outcome.nonfinite > 0 and first is not None and first[0] > 0.62, "none of them was met")


def all_diverging_is_no_error(optimizer: Optimizer) -> None:
    """It ends without an error where all simulations diverge."""
    for dimension in (1, 3):
        outcome, _ = run(optimizer, lambda p: np.full((len(p), 4), np.nan), np.full(dimension, 0.5), budget=500)
        need(outcome.cost == np.inf, f"cost {outcome.cost}")
        need(outcome.nonfinite == outcome.nfev > 0, f"{outcome.nonfinite} of {outcome.nfev} counted")
        need(outcome.first_nonfinite is not None and outcome.first_nonfinite.shape == (dimension,), "no first one")
        need(not any(d.settled for d in outcome.descents), "a descent settled")


def flat_objective_ends_quietly(optimizer: Optimizer) -> None:
    """A flat objective ends the search quietly."""
    outcome, _ = run(optimizer, lambda p: np.ones((len(p), 5)), np.full(3, 0.5), budget=1000)
    need(outcome.cost == 1.0, f"cost {outcome.cost}")
    need(np.isfinite(outcome.point).all(), "the point is not finite")


def quadratic_is_minimised(optimizer: Optimizer) -> None:
    """A quadratic is minimised in one dimension and in twenty."""
    for dimension, share in ((1, 1e-4), (20, 0.1)):
        target, start = np.linspace(0.3, 0.6, dimension), np.full(dimension, 0.9)
        first = np.sqrt(np.mean(quadratic(target)(start[None, :]) ** 2))
        outcome, _ = run(optimizer, quadratic(target), start, budget=16000)
        need(outcome.cost < share * first, f"{outcome.cost:.3g} of {first:.3g} left in {dimension} dimensions")
        need(dimension > 1 or abs(outcome.point[0] - target[0]) <= 1e-3, f"ended at {outcome.point[0]}, not 0.3")


def curved_valley_is_followed(optimizer: Optimizer) -> None:
    """A curved valley is followed to its end."""
    outcome, _ = run(optimizer, rosenbrock, [0.2, 0.75], budget=16000)
    near = np.all(np.abs(outcome.point - 0.75) <= np.maximum(0.01, 1e-6))
    need(outcome.cost < 0.05 and near, f"ended at {outcome.point.tolist()}, cost {outcome.cost:.3g}")


def minimum_on_the_boundary_is_reached(optimizer: Optimizer) -> None:
    """A minimum on the boundary is reached."""
    outcome, _ = run(optimizer, quadratic(np.array([1.4, 0.4, -0.5])), [0.5, 0.5, 0.5], budget=16000)
    near = np.all(np.abs(outcome.point - [1.0, 0.4, 0.0]) <= 5e-3)
    need(near, f"ended at {outcome.point.tolist()}, not at [1, 0.4, 0]")


def _searches(optimizer: Optimizer) -> bool:
    return optimizer.SPEC.kind != "start"


OPTIMIZER_CHECKS: tuple[Check[Optimizer], ...] = (
    check_of(specification_is_sound),
    check_of(options_at_their_bounds_still_search, lambda o: bool(o.SPEC.options)),
    check_of(points_stay_in_the_cube),
    check_of(budget_is_never_exceeded),
    check_of(whole_budget_is_used, lambda o: o.SPEC.kind == "global"),
    check_of(result_is_never_worse_than_the_start),
    check_of(same_seed_gives_the_same_bytes),
    check_of(another_seed_searches_elsewhere),
    check_of(progress_is_told_after_every_batch),
    check_of(best_so_far_falls),
    check_of(diverging_simulations_cost_only_themselves, _searches),
    check_of(all_diverging_is_no_error),
    check_of(flat_objective_ends_quietly),
    check_of(quadratic_is_minimised, _searches),
    check_of(curved_valley_is_followed, _searches),
    check_of(minimum_on_the_boundary_is_reached, _searches),
)
