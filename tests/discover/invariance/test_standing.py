"""How clearly an effect shows, against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.discover.invariance.standing import scatter, typical_gain
from mrfit.discover.policy import STANDARD


def test_a_jackknife_of_means_has_the_standard_error_of_a_mean() -> None:
    values = np.random.default_rng(0).normal(size=(20, 3))
    without = (values.sum(axis=0) - values) / 19
    np.testing.assert_allclose(scatter(without), values.std(axis=0, ddof=1) / np.sqrt(20))


@given(st.floats(0.11, 9.0), st.lists(st.floats(1e-3, 1e3), min_size=2, max_size=20))
def test_what_is_taken_of_all_groups_alike_is_what_is_taken(ratio: float, before: list[float]) -> None:
    assert typical_gain(np.array(before), ratio * np.array(before)) == pytest.approx(1.0 - ratio, abs=1e-9)


def test_one_hopeless_group_hides_nothing_and_a_useless_effect_takes_nothing() -> None:
    before, after = np.array([1.0, 1.0, 1.0, 1.0, 100.0]), np.array([0.1, 0.1, 0.1, 0.1, 200.0])
    assert typical_gain(before, after) > 0.5
    assert typical_gain(before, before) == pytest.approx(0.0)
    assert typical_gain(np.array([1.0]), np.array([1e6])) == pytest.approx(1.0 - STANDARD.group_ratio)
