"""The default fit ends at an error no worse than the best of the other optimizers, within 0.1 %."""

import numpy as np
import pytest

from benchmarks.planted import problem
from mrfit.fit.identify import SearchSettings, search_optimum

OTHERS = ("pso-fmin", "cma-lsq", "lsq")


@pytest.mark.parametrize(
    "model",
    [
        *("boucwen-flux", "bingham"),
        *(pytest.param(m, marks=pytest.mark.slow) for m in ("tanh", "rotational-erf", "hysteretic-biviscous")),
    ],
)
def test_auto_is_not_worse_than_the_best_of_the_others(model: str) -> None:
    group, assembly, cube = problem(model, 1, 6000, np.random.default_rng(2))

    def cost(optimizer: str) -> float:
        settings = SearchSettings(optimizer, 0, None, None, "none")
        found = search_optimum(group, assembly, cube, cube.start[None, :], settings, lambda evaluations, best: None)
        return found.cost

    assert cost("auto") <= 1.001 * min(map(cost, OTHERS))
