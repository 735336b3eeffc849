import numpy as np
import pytest

from mrfit.optimizers.cost.objective import Objective
from mrfit.search import chain
from tests.optimizers.curve_fits import CERTIFIED

RAT42 = CERTIFIED[1]


def test_certified_minimum_is_refined_from_the_start():
    objective = Objective(RAT42.residuals, RAT42.to_cube(RAT42.start), 0)
    outcome = chain.run("lsq", objective, np.random.default_rng(0))
    assert outcome.success
    assert outcome.cost == pytest.approx(RAT42.cost(), rel=1e-8)
    assert outcome.point == pytest.approx(RAT42.to_cube(RAT42.certified), rel=1e-4)


def test_every_jacobian_is_one_batch():
    sizes = []
    objective = Objective(lambda p: (sizes.append(len(p)), RAT42.residuals(p))[1], RAT42.to_cube(RAT42.start), 0)
    chain.run("lsq", objective, np.random.default_rng(0))
    assert set(sizes) == {1, 4}


def test_search_goes_on_from_the_best_point_known():
    objective = Objective(lambda p: p - 0.3, np.array([0.9, 0.9]), 100)
    objective.costs(np.array([[0.4, 0.2]]))
    seen = []
    objective.residuals_of = lambda p: (seen.append(p.copy()), p - 0.3)[1]
    chain.run("lsq", objective, np.random.default_rng(0))
    assert seen[0].tolist() == [[0.4, 0.2]]
