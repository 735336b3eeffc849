import numpy as np
import pytest

from mrfit.optimizers.cost.objective import Objective
from mrfit.search import chain
from mrfit.search.limits import Limits


def run(residuals, start, budget=None, seed=0):
    batches = []

    def recorded(points):
        batches.append(points.copy())
        return residuals(points)

    return chain.run(
        "cma", Objective(recorded, np.array(start), 0), np.random.default_rng(seed), Limits(budget)
    ), batches


def ellipsoid(points):
    rotation = np.linalg.qr(np.random.default_rng(0).standard_normal((5, 5)))[0]
    return ((points - 0.4) @ rotation) * np.logspace(0, 3, 5)


def test_rotated_ill_conditioned_quadratic_is_minimised():
    outcome, _ = run(ellipsoid, [0.8] * 5)
    assert outcome.cost < 1e-6
    assert outcome.point == pytest.approx(np.full(5, 0.4), abs=1e-5)


@pytest.mark.parametrize("unit", [1e-9, 1e9])
def test_search_does_not_hang_on_the_unit_of_the_residuals(unit):
    def line(points):
        return unit * (points - 0.4)

    outcome, batches = run(line, [0.8] * 2)
    _, reference = run(lambda points: line(points) / unit, [0.8] * 2)
    assert outcome.cost < 1e-6 * unit
    assert len(batches) == pytest.approx(len(reference), rel=0.1)


def test_restarts_double_the_population_until_one_brings_no_gain():
    outcome, batches = run(lambda p: np.hstack([p - 0.4, np.ones((len(p), 1))]), [0.8, 0.8, 0.8])
    assert {len(b) for b in batches} == {1, 7, 14}
    assert outcome.success
    assert "no gain" in outcome.links[0].reason
