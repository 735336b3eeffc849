import numpy as np
import pytest

from mrfit.optimizers.cost.objective import Objective
from mrfit.search import chain
from tests.optimizers.curve_fits import CERTIFIED

RAT42 = CERTIFIED[1]


def test_certified_minimum_is_refined_from_the_start():
    objective = Objective(RAT42.residuals, RAT42.to_cube(RAT42.start), 0)
    outcome = chain.run("fmin", objective, np.random.default_rng(0))
    assert outcome.success
    assert outcome.cost == pytest.approx(RAT42.cost(), rel=1e-5)


def test_every_gradient_is_one_batch():
    sizes = []
    objective = Objective(lambda p: (sizes.append(len(p)), RAT42.residuals(p))[1], RAT42.to_cube(RAT42.start), 0)
    chain.run("fmin", objective, np.random.default_rng(0))
    assert set(sizes) == {1, 4}


@pytest.mark.parametrize("unit", [1e-9, 1e9])
def test_result_does_not_hang_on_the_unit_of_the_residuals(unit):
    objective = Objective(lambda p: unit * RAT42.residuals(p), RAT42.to_cube(RAT42.start), 0)
    outcome = chain.run("fmin", objective, np.random.default_rng(0))
    assert outcome.cost == pytest.approx(unit * RAT42.cost(), rel=1e-5)


def test_bound_that_cuts_off_the_minimum_is_kept():
    objective = Objective(lambda p: p - [1.5, 0.4], np.array([0.2, 0.9]), 0)
    outcome = chain.run("fmin", objective, np.random.default_rng(0))
    assert outcome.point == pytest.approx([1.0, 0.4], abs=1e-6)
