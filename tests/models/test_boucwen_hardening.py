"""Bouc-Wen with shapes of either sign against its closed form on one stroke, and against boucwen where both are one."""

import numpy as np
import pytest

from mrfit.models import boucwen
from mrfit.models.boucwen_hardening import response

STROKE = np.stack([np.linspace(0.0, 4e-3, 200), np.full(200, 0.01)])


@pytest.mark.parametrize(("b", "g"), [(-2.2, 1.6), (0.5, 0.5)])
def test_first_stroke_is_exponential_where_n_is_one(b: float, g: float) -> None:
    alpha, z0 = 5e4, 2e-3
    force = response(STROKE, np.array([[1e-2, 1.0, 0.0, alpha, b, g, 1.0, z0]]), 1e-3)[0]
    rate = (b + g) / z0
    x = STROKE[0]
    assert force == pytest.approx(1e-2 * 0.01 + x - alpha * np.expm1(-rate * x) / rate, rel=1e-8)


def test_is_boucwen_where_the_loop_softens() -> None:
    c, k, alpha, b, g, n, z0 = 20.0, 3e4, 5e4, 0.7, 0.4, 2.0, 2e-3
    phase = np.linspace(0.0, 20.0, 3000)
    drive = np.stack([4e-3 * np.sin(phase), 0.1 * np.cos(phase)])
    found = response(drive, np.array([[c, k, 0.0, alpha, b, g, n, z0]]), 1e-3)
    same = boucwen.response(drive, np.array([[c, k, 0.0, alpha * z0, 1 / z0, b / z0, g / z0, n]]), 1e-3)
    assert found == pytest.approx(same, abs=2e-8 * float(np.ptp(same)))
