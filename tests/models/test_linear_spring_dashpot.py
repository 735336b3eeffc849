"""Linear spring and dashpot: what it stores and what it loses."""

import numpy as np
import pytest

from mrfit.models.linear_spring_dashpot import response


def test_loop_area_is_the_dashpots_and_the_line_the_springs() -> None:
    k, c, amplitude, omega = 3e4, 80.0, 2e-3, 12.0
    phase = np.linspace(0.0, 2 * np.pi, 4001)
    x, v = amplitude * np.sin(phase), amplitude * omega * np.cos(phase)
    force = response(np.stack([x, v]), np.array([[k, c, 5.0]]), 1e-3)[0]
    assert np.trapezoid(force, x) == pytest.approx(np.pi * c * omega * amplitude**2, rel=1e-6)
    assert np.polyfit(x[:-1], force[:-1], 1) == pytest.approx([k, 5.0], rel=1e-9)
