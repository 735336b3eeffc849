import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.signal.metrics import METRICS, absorbed_energy, error_sums, together

VALUES = st.floats(-1e6, 1e6, allow_subnormal=False).map(lambda v: 0.0 if abs(v) < 1e-3 else v)
PAIRS = st.integers(2, 40).flatmap(
    lambda n: st.tuples(arrays(np.float64, n, elements=VALUES), arrays(np.float64, n, elements=VALUES))
)
# One whole cycle, the closing sample left out.
PHASE = 2.0 * np.pi * np.arange(4000) / 4000


def error_metrics(measured: Array, simulated: Array, drive: Array | None = None, starts: tuple[int, ...] = (0,)):  # type: ignore[no-untyped-def]
    return error_sums(measured, simulated, drive, starts).measures()


def test_sine_with_constant_error_has_closed_form_metrics():
    y = 3.0 * np.sin(PHASE)
    metrics = error_metrics(y, y + 0.3)
    expected = {
        "rmse": 0.3,
        "mse": 0.09,
        "nrmse": 0.05,
        "esr": 2.0,
        "relative_rmse": 0.1 * math.sqrt(2.0),
        "err_peak": 0.1,
        "fit_percent": 100.0 * (1.0 - 0.1 * math.sqrt(2.0)),
    }
    assert math.isnan(metrics.pop("err_energy"))
    assert metrics == pytest.approx(expected, rel=1e-9)


def test_metrics_are_those_documented_in_that_order():
    assert list(error_metrics(PHASE, PHASE)) == [m.name for m in METRICS]


def test_perfect_simulation_has_no_error_and_fits_fully():
    metrics = error_metrics(PHASE, PHASE, drive=PHASE)
    assert metrics.pop("fit_percent") == 100.0
    assert set(metrics.values()) == {0.0}


def test_predicting_the_mean_fits_zero_percent():
    y = np.cos(PHASE) + 5.0
    assert error_metrics(y, np.full_like(y, y.mean()))["fit_percent"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("offset", [0.0, -20.0, 1e3])
def test_error_to_signal_ratio_is_one_of_variances_so_that_an_offset_does_not_count_as_signal(offset):
    y = np.cos(PHASE) + offset
    assert error_metrics(y, np.full_like(y, y.mean()))["esr"] == pytest.approx(100.0)
    assert error_metrics(y, y - 0.1 * np.cos(PHASE))["esr"] == pytest.approx(1.0)


@given(PAIRS, st.floats(1e-3, 1e3))
def test_changing_the_unit_leaves_dimensionless_measures_alone(pair, factor):
    y, simulated = pair
    one, other = error_metrics(y, simulated), error_metrics(factor * y, factor * simulated)
    for name in ("nrmse", "esr", "relative_rmse", "err_peak"):
        assert other[name] == pytest.approx(one[name], rel=1e-6, nan_ok=True)
    assert other["rmse"] == pytest.approx(factor * one["rmse"], rel=1e-9)
    assert other["mse"] == pytest.approx(factor**2 * one["mse"], rel=1e-9)


@given(PAIRS)
def test_peak_error_never_exceeds_relative_error(pair):
    metrics = error_metrics(*pair)
    assert metrics["rmse"] == pytest.approx(math.sqrt(metrics["mse"]))
    if np.any(pair[0]):
        assert metrics["err_peak"] <= metrics["relative_rmse"] * (1.0 + 1e-12)
        if np.ptp(pair[0]):
            assert metrics["esr"] == pytest.approx(100.0 * (1.0 - metrics["fit_percent"] / 100.0) ** 2, rel=1e-6)


@given(PAIRS, st.randoms(use_true_random=False))
def test_order_of_samples_does_not_matter(pair, random):
    order = list(range(len(pair[0])))
    random.shuffle(order)
    one, other = error_metrics(*pair), error_metrics(pair[0][order], pair[1][order])
    assert other == pytest.approx(one, rel=1e-9, abs=1e-9, nan_ok=True)


def test_undefined_measures_are_nan_not_infinite():
    zero = error_metrics(np.zeros(5), np.ones(5))
    assert all(math.isnan(zero[k]) for k in ("nrmse", "esr", "relative_rmse", "err_peak", "err_energy", "fit_percent"))
    constant = error_metrics(np.full(5, 0.1), np.ones(5), drive=np.zeros(5))
    assert [k for k, v in constant.items() if math.isnan(v)] == ["nrmse", "esr", "err_energy", "fit_percent"]


def test_diverged_simulation_has_no_number():
    metrics = error_metrics(PHASE, np.where(PHASE > 3.0, np.inf, PHASE))
    assert all(math.isnan(v) for v in metrics.values())


@pytest.mark.parametrize("lengths", [(0, 0), (3, 4)])
def test_nothing_to_compare_is_refused(lengths):
    with pytest.raises(DataError, match="run `mrfit fit` again"):
        error_metrics(np.zeros(lengths[0]), np.zeros(lengths[1]))


def test_viscous_damper_absorbs_pi_c_omega_x_squared():
    amplitude, omega, damping = 0.02, 2.0 * np.pi * 5.0, 800.0
    x, force = amplitude * np.sin(PHASE), damping * amplitude * omega * np.cos(PHASE)
    assert absorbed_energy(force, x) == pytest.approx(np.pi * damping * omega * amplitude**2, rel=1e-5)


def test_lossy_coil_absorbs_the_ellipse_whichever_way_it_is_modelled():
    lag, inductance, current = 0.1, 0.02, 3.0
    i, flux = current * np.sin(PHASE), inductance * current * np.sin(PHASE - lag)
    expected = np.pi * inductance * current**2 * np.sin(lag)
    assert absorbed_energy(i, flux) == pytest.approx(expected, rel=1e-5)
    assert absorbed_energy(flux, i) == pytest.approx(-expected, rel=1e-5)


def test_energy_error_is_that_of_the_damping():
    x, force = np.sin(PHASE), 50.0 * np.cos(PHASE) + 200.0 * np.sin(PHASE)
    softer = 40.0 * np.cos(PHASE) + 300.0 * np.sin(PHASE)
    assert error_metrics(force, softer, drive=x)["err_energy"] == pytest.approx(0.2, rel=1e-6)


def test_offsets_of_force_and_position_do_no_work_over_whole_cycles():
    x, force = np.sin(PHASE), np.cos(PHASE)
    assert absorbed_energy(force + 1e4, x + 5.0) == pytest.approx(absorbed_energy(force, x), rel=1e-9)


def test_open_path_is_not_closed_on_its_own():
    assert absorbed_energy(np.full(11, 5.0), np.linspace(0.0, 2.0, 11)) == pytest.approx(10.0)


def test_energy_is_not_counted_across_segments():
    x, force = np.sin(PHASE), np.cos(PHASE)
    pushed = np.full(11, 5.0), np.linspace(7.0, 9.0, 11)
    y, path = np.concatenate([force, pushed[0]]), np.concatenate([x, pushed[1]])
    assert absorbed_energy(y, path, starts=(0, len(x))) == pytest.approx(np.pi + 10.0, rel=1e-5)


@given(
    arrays(np.float64, st.integers(1, 40), elements=st.floats(-1e3, 1e3)),
    st.lists(st.integers(0, 40), max_size=3),
)
def test_measures_of_stretches_add_up_to_those_of_the_whole(y: np.ndarray, cuts: list[int]) -> None:
    simulated, drive = y + np.sin(np.arange(len(y))), np.arange(len(y)) ** 1.5
    edges = sorted({0, len(y), *(c for c in cuts if c < len(y))})
    parts = [slice(a, b) for a, b in zip(edges, edges[1:], strict=False)]
    sums = together([error_sums(y[p], simulated[p], drive[p]) for p in parts])
    found, whole = sums.measures(), error_metrics(y, simulated, drive, edges[:-1])
    # of next to nothing a ratio is rounding
    small = {"err_energy"} if abs(sums.energy) <= 1e-3 else set()
    small |= {"nrmse", "esr", "fit_percent", "relative_rmse", "err_peak"} if np.ptp(y) <= 1e-3 else set()
    for name in whole.keys() - small:
        assert found[name] == pytest.approx(whole[name], rel=1e-6, abs=1e-9, nan_ok=True), name
