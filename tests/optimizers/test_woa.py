import numpy as np
import pytest

from mrfit.core.specs import ModelSpec, Param
from mrfit.models import rotational_erf
from mrfit.optimizers.cost.objective import InParameters, Objective
from mrfit.optimizers.woa import swim
from mrfit.search import chain
from mrfit.search.cube import FreeParameters, cube_of
from mrfit.search.limits import Limits

PREY = np.array([0.4, 0.6, 0.5])


def test_whales_on_the_prey_stay_there_when_the_coefficient_is_spent():
    whales = np.tile(PREY, (200, 1))
    moved = swim(whales, PREY, 0.0, 1.0, np.random.default_rng(0))
    assert moved == pytest.approx(whales)


def test_half_of_the_whales_encircle_and_half_follow_the_spiral():
    whales = np.random.default_rng(0).random((4000, 3))
    moved = swim(whales, PREY, 0.0, 1.0, np.random.default_rng(1))
    on_prey = np.all(moved == PREY, axis=1)
    assert on_prey.mean() == pytest.approx(0.5, abs=0.03)


def test_spiral_scales_the_distance_by_one_number_per_whale():
    whales = PREY + np.array([[0.1, 0.05, 0.02]]) * np.ones((500, 1))
    moved = swim(whales, PREY, 0.0, 1.0, np.random.default_rng(1))
    inside = np.any(moved != PREY, axis=1)
    ratios = (moved[inside] - PREY) / [0.1, 0.05, 0.02]
    assert ratios.max(axis=1) == pytest.approx(ratios.min(axis=1))
    assert np.abs(ratios).max() <= np.e
    assert ratios.min() < -0.3


def test_others_are_followed_only_while_the_coefficient_exceeds_one():
    whales = np.full((300, 3), 0.2)
    stray = whales.copy()
    stray[1::2] = 0.9
    for coefficient, same in ((0.99, True), (2.0, False)):
        first = swim(whales, PREY, coefficient, 1.0, np.random.default_rng(3))[::2]
        second = swim(stray, PREY, coefficient, 1.0, np.random.default_rng(3))[::2]
        assert np.array_equal(first, second) == same


def searched(name, low, high, seed=0):
    """Return how a search ends whose truth is k = 1 and c = 0.2, between these bounds of k."""
    spec = ModelSpec(
        "toy", "", "", "", (), "force", (Param("k", "1", low, high, low), Param("c", "1", 0.01, 10.0, 5.0, "log"))
    )
    cube = cube_of(spec, {}, {}, {})
    objective = Objective(
        lambda points: cube.to_theta(points) - [1.0, 0.2], cube.start, 0, coordinates=FreeParameters(cube)
    )
    return objective, chain.run(name, objective, np.random.default_rng(seed), Limits(4000, stall=1.0))


def test_an_optimizer_may_ask_for_the_parameters_themselves():
    objective, _ = searched("lsq", -50.0, 50.0)
    seen = InParameters(objective)
    assert seen.low.tolist() == [-50.0, 0.01] and seen.high.tolist() == [50.0, 10.0]
    assert seen.best_values == pytest.approx([1.0, 0.2], abs=1e-4)
    objective.allow(10_000)
    costs = seen.costs(np.array([[1.0, 0.2], [4.0, 0.2], [-60.0, 0.2]]))
    # beyond a bound it is the bound that is simulated
    assert costs == pytest.approx(np.array([0.0, 3.0, 51.0]) / np.sqrt(2.0), abs=1e-9)


@pytest.mark.parametrize("name", ["woa", "mwoa"])
def test_whales_are_pulled_to_the_origin_of_the_parameters_not_to_their_lower_bounds(name):
    """C X pulls towards the origin: bounds that lie far below the truth must not draw the swarm to themselves."""
    ends = [[searched(name, low, high, seed)[1].cost for seed in range(6)] for low, high in ((-1e4, 1e4), (-1e4, 2e4))]
    assert max(np.median(ends, axis=1)) < 1e-2


@pytest.mark.parametrize(("name", "most"), [("woa", 1.5), ("mwoa", 1.5)])
def test_whales_identify_the_published_rotary_damper_within_wide_bounds(name, most):
    """In the unit cube, whose origin is k = T0 = -1e4, both end at 5 to 8 N*m in the median."""
    time = np.arange(333) / 1000.0
    drive = np.deg2rad(5.0) * np.stack([np.sin(6 * np.pi * time), 6 * np.pi * np.cos(6 * np.pi * time)])
    truth = np.array([[18.07, 2.2934, 5.7412, 18.51, 0.7216, 0.0]])
    torque = rotational_erf.response(drive, truth, 1e-3)[0] + 0.2 * np.random.default_rng(0).standard_normal(333)
    cube = cube_of(rotational_erf.SPEC, {}, {}, {})

    def ended(seed):
        start = np.random.default_rng(seed).random(6)
        objective = Objective(
            lambda p: rotational_erf.response(drive, cube.to_theta(p), 1e-3) - torque,
            start,
            0,
            coordinates=FreeParameters(cube),
        )
        return chain.run(name, objective, np.random.default_rng([seed, 1]), Limits(12_000, stall=1.0)).cost

    assert np.median([ended(seed) for seed in range(7)]) < most
