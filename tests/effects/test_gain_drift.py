"""Gain drift: a gain that grows with the time since the record's start."""

import numpy as np
import pytest

from mrfit.simulate.assembly import assemble


def test_amplitude_grows_in_proportion_to_time() -> None:
    whole = assemble("bingham+gain-drift")
    drive = np.stack([np.full(4, 0.2), np.array([0.0, 1.0, 2.0, 10.0])])
    assert whole.spec.inputs == ("velocity", "time")
    force = whole.simulate(drive, np.array([[300.0, 500.0, 0.0, 0.02]]), 1.0)[0]
    assert force == pytest.approx(400.0 * (1.0 + 0.02 * drive[1]))


def test_drift_is_in_the_velocity_free_of_sign() -> None:
    whole = assemble("bingham+gain-drift")
    drive = np.stack([np.array([0.2, -0.2]), np.array([5.0, 5.0])])
    force = whole.simulate(drive, np.array([[300.0, 500.0, 0.0, -0.01]]), 1e-3)[0]
    assert force[0] == pytest.approx(-force[1])
