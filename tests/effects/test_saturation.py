"""Saturation of the core against its two limits, small and large flux, and the loop that closes between them."""

import numpy as np
import pytest

from mrfit.effects.saturation import shape
from mrfit.simulate.assembly import assemble

KNEE = 0.05
Q = np.array([[1 / KNEE**2, 2.0]])


def test_inductance_starts_unsaturated_and_falls_to_zero() -> None:
    unsaturated = np.linspace(-1.0, 1.0, 8001)
    flux = shape(unsaturated[None], {}, Q, 1e-3)[0]
    slope = np.gradient(flux, unsaturated)
    assert slope[4000] == pytest.approx(1.0, abs=1e-4)
    # d(u/sqrt(1 + u^2))/du is a half at u = sqrt(2^(2/3) - 1)
    assert np.interp(KNEE * np.sqrt(2 ** (2 / 3) - 1), unsaturated, slope) == pytest.approx(0.5, abs=1e-3)
    assert flux[-1] == pytest.approx(KNEE, rel=2e-3)
    assert flux[0] == pytest.approx(-KNEE, rel=2e-3)


def test_flux_of_a_saturated_coil_bends_by_a_third_harmonic() -> None:
    t = np.arange(2000) / 2000
    unsaturated = 0.01 * np.sin(2 * np.pi * t)
    harmonics = np.fft.rfft(shape(unsaturated[None], {}, Q, 1e-3)[0]) / 1000
    # (q/2)*flux^3 has a third harmonic of a quarter of its cube
    assert abs(harmonics[3]) == pytest.approx(0.01**3 / 2 / KNEE**2 / 4, rel=0.1)
    assert abs(harmonics[2]) <= 1e-12


def opening(flux: np.ndarray, current: np.ndarray, height: float) -> float:
    """Return how far the falling and the rising branch of a settled cycle are apart at one current."""
    falling, rising = slice(2500, 3500), slice(3500, 4500)
    down, up = (flux[part][np.argmin(np.abs(current[part] - height))] for part in (falling, rising))
    return float(down - up)


def test_loop_is_as_open_as_ever_in_the_middle_and_closed_where_the_core_is_saturated() -> None:
    current = 5 * np.sin(2 * np.pi * np.arange(6000) / 2000)
    base, whole = assemble("boucwen-flux"), assemble("boucwen-flux+saturation")
    theta = dict(zip(base.spec.names, base.spec.start, strict=True)) | {"D": 0.05}
    wide = base.simulate(current[None], np.array([[*theta.values()]]), 1e-3)[0]
    bent = whole.simulate(current[None], np.array([[*theta.values(), *Q[0]]]), 1e-3)[0]
    assert opening(bent, current, 0.0) == pytest.approx(opening(wide, current, 0.0), rel=0.05)
    assert abs(opening(bent, current, 4.0)) <= 0.3 * abs(opening(wide, current, 4.0))
