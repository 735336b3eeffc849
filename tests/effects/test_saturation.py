"""Saturation of the core against its two limits, small and large current."""

import numpy as np
import pytest

from mrfit.assembly import assemble
from mrfit.effects.saturation import transform


def test_inductance_starts_unsaturated_and_falls_to_zero() -> None:
    current = np.linspace(-40.0, 40.0, 8001)
    flux = transform({"current": current}, np.array([0.25]), 1e-3)["current"]
    slope = np.gradient(flux, current)
    assert slope[4000] == pytest.approx(1.0, abs=1e-4)
    # d(tanh(u))/du is a half at u = arccosh(sqrt(2))
    assert np.interp(2.0 * np.arccosh(np.sqrt(2)), current, slope) == pytest.approx(0.5, abs=1e-3)
    assert flux[-1] == pytest.approx(2.0)
    assert flux[0] == pytest.approx(-2.0)


def test_flux_of_a_saturated_coil_bends_by_a_third_harmonic() -> None:
    t = np.arange(2000) / 2000
    current, q = 1.5 * np.sin(2 * np.pi * t), 0.02
    base, whole = assemble("boucwen-flux"), assemble("boucwen-flux+saturation")
    # almost without hysteresis
    start = dict(zip(base.spec.names, base.spec.start, strict=True)) | {"A": 1.0, "Lc": 0.03}
    theta = np.array([[*start.values(), q]])
    harmonics = np.fft.rfft(whole.simulate(current[None], theta, 1e-3)[0]) / 1000
    # (q/3)*i^3 has a third harmonic of a quarter of its cube
    assert abs(harmonics[3]) == pytest.approx(0.03 * q / 3 * 1.5**3 / 4, rel=0.05)
    assert abs(harmonics[2]) <= 1e-12
