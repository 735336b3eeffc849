"""The turning points before a record: those planted are found again, and none where none explain it better."""

import numpy as np
import pytest

from mrfit.apply.history import fitted_history
from mrfit.core.specs import Array


@pytest.mark.parametrize("planted", [(2.0, -1.0), (-1.3, 0.4), (2.9, 2.9)])
def test_planted_turning_points_are_found(planted: tuple[float, float]) -> None:
    def error(lead: Array) -> float:
        return 10.0 if not len(lead) else float(np.sum((lead[1:] - planted) ** 2))

    found = fitted_history(error, 3.0)
    # rounds of grids, each within 1.2 steps of the one before
    assert found.shape == (3,) and found[0] == 0.0
    np.testing.assert_allclose(found[1:], planted, atol=0.01 * 3.0)


def test_no_history_is_taken_where_none_is_as_good() -> None:
    assert fitted_history(lambda lead: 0.0, 3.0).shape == (0,)
    assert fitted_history(lambda lead: 1.0 if len(lead) else 0.5, 3.0).shape == (0,)
    assert fitted_history(lambda lead: 0.5 if len(lead) else 1.0, 3.0).shape == (3,)


def test_no_turning_point_beyond_the_reach_is_tried() -> None:
    tried = list[Array]()

    def error(lead: Array) -> float:
        tried.append(lead)
        return 1e9 if not len(lead) else float(np.sum((lead[1:] - 5.0) ** 2))

    found = fitted_history(error, 2.0)
    np.testing.assert_allclose(found, [0.0, 2.0, 2.0])
    assert max(float(np.abs(lead).max(initial=0.0)) for lead in tried) == 2.0
    assert all(lead[0] == 0.0 for lead in tried if len(lead))
