import numpy as np
import pytest

from mrfit.flux.integral import integrate
from mrfit.signal.cycles import steady_stretches
from tests.flux.records import remove_drift

FREQUENCY = 5.0


def signals(per_cycle: int, cycles: float = 6.0) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return λ, dλ/dt, i and dt of a loop with a third harmonic."""
    dt = 1 / (FREQUENCY * per_cycle)
    turn = 2 * np.pi * np.arange(int(per_cycle * cycles)) / per_cycle
    flux = np.sin(turn - 0.1) + 0.2 * np.sin(3 * turn)
    induced = 2 * np.pi * FREQUENCY * (np.cos(turn - 0.1) + 0.6 * np.cos(3 * turn))
    return flux, induced, np.sin(turn), dt


@pytest.mark.parametrize(("rule", "order"), [("trapezoid", 2), ("simpson", 4)])
def test_the_integral_converges_with_the_order_of_its_rule(rule: str, order: int) -> None:
    errors = []
    for per_cycle in (100, 200, 400):
        flux, induced, _, dt = signals(per_cycle)
        integral = integrate(induced, dt, rule)
        errors.append(np.max(np.abs(integral - flux + flux[0])[::2]))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert rates == pytest.approx(order, abs=0.25)


@pytest.mark.parametrize("method", ["cycle", "linear"])
@pytest.mark.parametrize("per_cycle", [400, 333])
def test_an_offset_is_removed_and_reported(method: str, per_cycle: int) -> None:
    flux, induced, current, dt = signals(per_cycle, 6.3)
    integral = integrate(induced + 0.05, dt, "trapezoid")
    found, drift = remove_drift(integral, current, dt, steady_stretches(current, dt), method)
    assert found == pytest.approx(flux, abs=3e-4)
    assert drift.offset_volt == pytest.approx(0.05, rel=1e-3)
    assert np.max(np.abs(drift.closure)) < 1e-4
    assert len(drift.closure) == 6


def test_steady_cycles_lose_nothing_but_a_constant() -> None:
    flux, _, current, dt = signals(250, 7.7)
    found, drift = remove_drift(flux + 3.0, current, dt, steady_stretches(current, dt), "cycle")
    assert found == pytest.approx(flux, abs=1e-6)
    assert drift.constant == pytest.approx(-3.0, abs=1e-6)
    assert abs(drift.offset_volt) < 1e-6


def test_the_walk_of_a_noisy_integrator_is_removed_by_cycles() -> None:
    rng = np.random.default_rng(1)
    flux, induced, current, dt = signals(200, 30)
    integral = integrate(induced + 5.0 * rng.standard_normal(len(induced)), dt, "trapezoid")
    stretches = steady_stretches(current, dt)
    errors = {
        m: np.std(remove_drift(integral, current, dt, stretches, m)[0] - flux) for m in ("cycle", "linear", "none")
    }
    assert errors["cycle"] < 0.5 * errors["linear"]
    assert errors["linear"] < errors["none"]


def test_a_mean_that_moves_with_the_current_is_no_drift() -> None:
    flux, _, current, dt = signals(400, 10)
    settling = 0.015 * np.exp(-np.arange(len(flux)) / 800)
    found, _ = remove_drift(flux + settling, current + settling, dt, steady_stretches(current + settling, dt), "cycle")
    assert np.max(np.abs(found - flux - settling)[400:-400]) < 2e-3


def test_without_cycles_the_drift_is_fitted_beside_the_current() -> None:
    rng = np.random.default_rng(2)
    current = np.convolve(rng.standard_normal(20_000), np.hanning(301) / 30, mode="valid")
    time = np.arange(len(current)) * 1e-3
    flux = 0.1 * current + 0.001 * current**3
    found, drift = remove_drift(flux + 0.02 * time, current, 1e-3, [], "cycle")
    assert drift.offset_volt == pytest.approx(0.02, rel=1e-6)
    assert found == pytest.approx(flux - flux.mean(), abs=1e-6)


def test_a_single_ramp_says_that_drift_cannot_be_told() -> None:
    ramp = np.linspace(0, 5, 1000)
    _, drift = remove_drift(0.1 * ramp, ramp, 1e-3, [], "cycle")
    assert drift.offset_volt == 0.0
    assert "cannot be told" in drift.method


def test_every_periodic_stretch_of_a_long_log_has_its_own_line() -> None:
    flux, _, current, dt = signals(400, 8)
    slow = np.interp(np.arange(3 * len(flux)), [0, len(flux), 2 * len(flux), 3 * len(flux)], [0, 0.5, 0.4, 1.4])
    currents = np.concatenate([current, 3 * current, 0.5 * current])
    fluxes = np.concatenate([flux, 3 * flux, 0.5 * flux])
    stretches = steady_stretches(currents, dt)
    found, drift = remove_drift(fluxes + slow, currents, dt, stretches, "cycle")
    assert len(stretches) == 3 and "3 periodic stretches" in drift.method
    for stretch in stretches:
        inside = slice(stretch.start + 250, stretch.stop - 250)
        assert np.max(np.abs(found - fluxes)[inside]) < 0.04


@pytest.mark.parametrize("backwards", [False, True])
def test_beyond_the_cycles_of_a_sweep_drift_goes_on_as_over_a_time_that_long(backwards: bool) -> None:
    """Where a sweep is fast, no two cycles are alike: its few periodic stretches say little of the seconds beyond."""
    dt, seconds = 4e-4, 8.0
    time = np.arange(0, seconds, dt)
    rate = 4.59 * (40 / 4.59) ** (time / seconds)
    current = 4.9 * 4.59 / rate * np.sin(2 * np.pi * np.cumsum(rate) * dt)
    order = slice(None, None, -1 if backwards else 1)
    current, flux = current[order], (0.02 * current + 5e-4 * np.abs(current) * np.cos(40 * time))[order]
    stretches = steady_stretches(current, dt)
    ends = [s.boundaries(dt)[k] * dt for s, k in ((stretches[0], 0), (stretches[-1], -1))]
    assert max(ends[0], seconds - ends[1]) > 1.5
    found, _ = remove_drift(flux + 0.03 * time, current, dt, stretches, "cycle")
    assert np.max(np.abs(found - flux)) < 3e-3


def biased(cycles: int, biases: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return λ, dλ/dt, i and dt of a saturating coil under a sine whose mean goes from bias to bias."""
    dt, rate = 1e-3, 2.0
    levels = np.repeat(biases, int(cycles / (rate * dt)))
    soft = np.hanning(201) / np.sum(np.hanning(201))
    time = np.arange(len(levels)) * dt
    current = np.sin(2 * np.pi * rate * time) + np.convolve(np.pad(levels, 100, "edge"), soft, "valid")
    flux = 0.3 * np.arctan(current / 3)
    return flux, np.gradient(flux, dt), current, dt


@pytest.mark.parametrize("method", ["cycle", "linear"])
@pytest.mark.parametrize("biases", [(0.0, 2.0), (2.0, 0.0), (0.0, 2.0, -1.0)])
def test_flux_follows_a_change_of_bias(method: str, biases: tuple[float, ...]) -> None:
    flux, induced, current, dt = biased(20, biases)
    integral = integrate(induced + 0.05, dt, "trapezoid")
    stretches = steady_stretches(current, dt)
    found, drift = remove_drift(integral, current, dt, stretches, method)
    assert len(stretches) == len(biases)
    assert np.max(np.abs(found - flux)) < 2e-3 * np.ptp(flux)
    assert drift.offset_volt == pytest.approx(0.05, rel=1e-2)
    assert drift.finding == ""


def test_a_change_of_bias_that_drift_hides_is_said() -> None:
    flux, induced, current, dt = biased(20, (0.0, 2.0))
    walk = np.cumsum(0.02 * np.random.default_rng(3).standard_normal(len(flux))) * np.sqrt(dt)
    integral = integrate(induced, dt, "trapezoid") + walk
    stretches = steady_stretches(current, dt)
    found, drift = remove_drift(integral, current, dt, stretches, "cycle")
    for stretch in stretches:
        assert abs(np.mean(found[stretch.start : stretch.stop])) < 0.02 * np.ptp(flux)
    assert "from " in drift.finding and "to 2 A" in drift.finding and "--drift none" in drift.finding
    assert remove_drift(integral, current, dt, stretches, "none")[1].finding == ""


def test_one_bias_is_left_as_it_is() -> None:
    flux, _, current, dt = signals(400, 8)
    currents = 5.0 + np.concatenate([current, 3 * current])
    drift = remove_drift(np.concatenate([flux, 3 * flux]), currents, dt, steady_stretches(currents, dt), "cycle")[1]
    assert drift.method == "line through the means of whole cycles in each of 2 periodic stretches"
    assert drift.finding == ""


def test_the_trapezoid_rule_gives_scipys_bits() -> None:
    from scipy.integrate import cumulative_trapezoid

    voltage = np.random.default_rng(3).standard_normal(10_001)
    for dt in (1e-3, 1.0 / 3.0, 2.0):
        np.testing.assert_array_equal(
            integrate(voltage, dt, "trapezoid"), cumulative_trapezoid(voltage, dx=dt, initial=0)
        )
