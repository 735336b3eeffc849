"""Eddy currents against a coil with a parallel loss resistance: solved on paper, and by a circuit solver."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mrfit.core.specs import Array
from mrfit.effects.eddy_current import closed
from mrfit.simulate.assembly import assemble

INDUCTANCE, CURRENT = 0.03, 2.0
PER_CYCLE = 4000


def flux_of(frequency: float, conductance: float) -> tuple[np.ndarray, np.ndarray]:
    """Return current and flux over the last of six cycles of a linear coil."""
    t = np.arange(6 * PER_CYCLE + 1) / (PER_CYCLE * frequency)
    current = CURRENT * np.sin(2 * np.pi * frequency * t)
    flux = closed(lambda i: INDUCTANCE * i, current, np.array([conductance]), t[1])
    return current[-PER_CYCLE - 1 :], flux[-PER_CYCLE - 1 :]


def test_flux_is_that_of_the_inductance_beside_the_loss_resistance() -> None:
    loss_resistance, frequency = 20.0, 10.0
    _, flux = flux_of(frequency, 1.0 / loss_resistance)
    w = 2 * np.pi * frequency
    # current divider: i_m = i*R_e/(R_e + j*w*L)
    phasor = INDUCTANCE * CURRENT * loss_resistance / (loss_resistance + 1j * w * INDUCTANCE)
    angle = 2 * np.pi * np.arange(len(flux)) / PER_CYCLE
    assert np.abs(flux - np.imag(phasor * np.exp(1j * angle))).max() <= 1e-5 * np.ptp(flux)


def test_loop_area_grows_with_frequency_and_is_the_energy_lost() -> None:
    conductance, areas = 1.0 / 150.0, []
    for frequency in (1.0, 5.0, 10.0):
        current, flux = flux_of(frequency, conductance)
        areas.append(np.trapezoid(current, flux))
        turn = 2 * np.pi * frequency * conductance * INDUCTANCE
        assert areas[-1] == pytest.approx(np.pi * INDUCTANCE * CURRENT**2 * turn / (1 + turn**2), rel=1e-4)
    assert areas[1] / areas[0] == pytest.approx(5, rel=1e-3)
    assert areas[2] / areas[0] == pytest.approx(10, rel=1e-3)


def test_coil_whose_inductance_falls_to_a_third_agrees_with_a_circuit_solver() -> None:
    """flux(i_m) = b*asinh(i_m/a) makes i_m' = (i - i_m)*hypot(i_m, a)/(b*G), which a circuit solver steps."""
    a, b, conductance, frequency = 1.0, 0.03, 0.1, 20.0
    w = 2 * np.pi * frequency
    t = np.arange(3 * PER_CYCLE + 1) / (PER_CYCLE * frequency)
    current = 3.0 * np.sin(w * t)
    solved = solve_ivp(
        lambda s, i: (3.0 * np.sin(w * s) - i) * np.hypot(i, a) / (b * conductance),
        (0.0, t[-1]), [0.0], t_eval=t, rtol=1e-9, atol=1e-12, method="DOP853",
    )  # fmt: skip
    flux = closed(lambda i: b * np.arcsinh(i / a), current, np.array([conductance]), t[1])
    assert np.abs(flux - b * np.arcsinh(solved.y[0] / a)).max() <= 1e-6 * np.ptp(flux)


def test_the_hysteretic_flux_obeys_the_circuit() -> None:
    whole, base = assemble("boucwen-flux+eddy-current"), assemble("boucwen-flux")
    t = np.arange(4 * 1000 + 1) / (1000 * 10.0)
    current = 3.0 * np.sin(2 * np.pi * 10.0 * t)
    theta, conductance = base.spec.start[None, :], 0.08
    flux = whole.simulate(current[None, :], np.column_stack([theta, [[conductance]]]), t[1])
    magnetising = current - conductance * np.gradient(flux[0], t[1])
    static = base.simulate(magnetising[None, :], theta, t[1])
    assert np.abs(flux - static)[0, 1000:].max() <= 1e-3 * np.ptp(flux)
    assert np.abs(flux - base.simulate(current[None, :], theta, t[1])).max() >= 0.02 * np.ptp(flux)


def test_a_constant_current_gives_the_static_flux() -> None:
    assert np.array_equal(closed(lambda i: 0.1 * i, np.full(9, 3.0), np.array([0.5]), 1e-3), 0.1 * np.full(9, 3.0))


# A, Lc, kappa, beta, gamma, n, D
ROUND_LOOP, FALLING = [1.18, 0.016, 0.35, 2.2, 5.4, 1.02, 1.0], [1.18, 0.016, 0.35, 2.2, 5.4, 1.02, 0.03]
STEEP_LOOP = [0.748, 0.00471, 0.3635, 367.1, 36.95, 8.937, 0.00213]


@pytest.mark.parametrize(
    ("theta", "conductance", "rises", "least", "most"),
    [(ROUND_LOOP, 0.12, True, 5, 30), (STEEP_LOOP, 0.5, True, 25, 60), (FALLING, 0.12, False, 14, 20)],
)
def test_rounds_go_on_until_they_settle_but_where_the_flux_falls(
    theta: list[float], conductance: float, rises: bool, least: int, most: int
) -> None:
    base, t, drives = assemble("boucwen-flux"), np.arange(751) * 0.001, list[Array]()

    def static(current: Array) -> Array:
        drives.append(current)
        return base.simulate(current[None, :], np.array([theta]), t[1])[0]

    current = 5.0 * np.sin(2 * np.pi * 10.0 * t)
    assert (np.min(np.diff(static(current)) * np.diff(current)) >= 0.0) == rises
    drives.clear()
    assert np.isfinite(closed(static, current, np.array([conductance]), t[1])).all()
    assert least <= len(drives) <= most
    assert (np.abs(drives[-1] - drives[-2]).max() <= 1e-9) == rises
