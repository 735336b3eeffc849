"""Integrator offset against the integral of a constant voltage."""

import numpy as np

from mrfit.effects.integrator_offset import error


def test_drift_is_the_integral_of_the_offset_about_its_mean() -> None:
    t = 7.0 + np.arange(1001) * 0.01
    found = error({"time": t}, np.array([[2e-3], [-5e-3]]), 0.01)
    assert np.allclose(np.diff(found) / 0.01, [[2e-3], [-5e-3]], rtol=1e-9)
    assert np.abs(found.mean(axis=1)).max() <= 1e-15
