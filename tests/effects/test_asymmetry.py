"""Asymmetry: a gain in one direction only."""

import numpy as np
import pytest

from mrfit.assembly import assemble


def test_force_of_one_direction_is_larger_by_the_gain() -> None:
    whole = assemble("bingham+asymmetry")
    force = whole.simulate(np.array([[0.2, -0.2]]), np.array([[300.0, 500.0, 0.0, 0.35]]), 1e-3)[0]
    assert force == pytest.approx([400.0 * 1.35, -400.0])


def test_difference_grows_with_the_force_where_that_of_an_offset_does_not() -> None:
    asymmetric, offset = assemble("bingham+asymmetry"), assemble("bingham+force-offset")
    v = np.array([[0.2, -0.2]])
    for model, extra, ratio in ((asymmetric, 0.5, 2.0), (offset, 50.0, 1.0)):
        weak, strong = model.simulate(v, np.array([[200.0, 0.0, 0.0, extra], [400.0, 0.0, 0.0, extra]]), 1e-3).sum(1)
        assert strong / weak == pytest.approx(ratio)
