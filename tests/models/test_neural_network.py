"""The network against its formula, its published size, its 4 ms of memory, and its derivatives against differences."""

import numpy as np
import pytest

from mrfit.models.neural_network import SPEC, response, sensitivities, start_values

DT = 1e-3
THETA = SPEC.start.copy()


def drive() -> np.ndarray:
    t = DT * np.arange(300)
    return np.stack([0.2 * np.sin(20 * t), 1 + 0.5 * np.cos(33 * t)])


def test_has_the_published_number_of_parameters() -> None:
    assert len(SPEC.params) == 31


def test_is_two_layers_of_three_hyperbolic_tangents() -> None:
    v, i = drive()
    j = 120
    u = np.array([v[j], i[j], v[j - 4], i[j - 4]])
    value = dict(zip(SPEC.names, THETA, strict=True))
    names = ("v", "i", "v_ago", "i_ago")
    h1 = [
        np.tanh(sum(value[f"W1_{a}_{m}"] * x for m, x in zip(names, u, strict=True)) + value[f"b1_{a}"])
        for a in (1, 2, 3)
    ]
    h2 = [np.tanh(sum(value[f"W2_{a}_{b}"] * h1[b - 1] for b in (1, 2, 3)) + value[f"b2_{a}"]) for a in (1, 2, 3)]
    expected = sum(value[f"w3_{a}"] * h2[a - 1] for a in (1, 2, 3)) + value["b3"]
    assert response(drive(), THETA[None], DT)[0, j] == pytest.approx(expected)


def test_forgets_an_input_after_4_ms() -> None:
    pulse = drive()
    pulse[0, 100] += 0.5
    changed = response(pulse, THETA[None], DT)[0] != response(drive(), THETA[None], DT)[0]
    assert np.flatnonzero(changed).tolist() == [100, 104]


def test_units_of_a_layer_start_apart() -> None:
    start = dict(zip(SPEC.names, THETA, strict=True))
    assert len({round(start[f"W1_{j}_v"], 6) for j in (1, 2, 3)}) == 3
    assert len({round(start[f"b2_{j}"], 6) for j in (1, 2, 3)}) == 3


def test_start_values_span_the_output() -> None:
    force = 800 * np.tanh(30 * drive()[0]) + 100
    found = start_values(drive(), force, DT)
    theta = np.array([[found.get(p.name, p.start) for p in SPEC.params]])
    out = response(drive(), theta, DT)[0]
    assert 0.1 < np.ptp(out) / np.ptp(force) < 3
    assert found["b3"] == pytest.approx(force.mean())


EVERY = np.arange(31)


def held_current() -> np.ndarray:
    return np.stack([drive()[0], np.full(300, 0.7)])


def thetas(seed: int) -> np.ndarray:
    spread = np.random.default_rng(seed).normal(size=(3, 31)) * [1.5 * max(abs(p.start), 0.2) for p in SPEC.params]
    return np.clip(SPEC.start + spread, [p.low for p in SPEC.params], [p.high for p in SPEC.params])


@pytest.mark.parametrize("log", [drive(), held_current()], ids=["current varies", "current held"])
@pytest.mark.parametrize("dt", [1e-3, 1.7e-3, 1e-2])
@pytest.mark.parametrize("seed", range(3))
def test_sensitivities_are_the_response_and_its_differences(log: np.ndarray, dt: float, seed: int) -> None:
    theta = thetas(seed)
    columns = np.random.default_rng(seed).permutation(31)
    out = sensitivities(log, theta, dt, columns)
    base = response(log, theta, dt)
    force = np.abs(theta[:, 27:]).sum()
    np.testing.assert_allclose(out[:, 0], base, rtol=0, atol=1e-11 * force)
    for c, k in enumerate(columns):
        h = 1e-5 * max(1.0, abs(SPEC.start[k]))
        side = h * np.eye(31)[k]
        slope = (response(log, theta + side, dt) - response(log, theta - side, dt)) / (2 * h)
        np.testing.assert_allclose(out[:, 1 + c], slope, rtol=1e-6, atol=1e-7 * force)


def test_sensitivities_to_no_parameter_are_the_response() -> None:
    out = sensitivities(drive(), thetas(3), DT, EVERY[:0])
    assert out.shape == (3, 1, 300)
    np.testing.assert_allclose(out[:, 0], response(drive(), thetas(3), DT), rtol=0, atol=1e-7)


def test_steps_along_linear_parameters_are_exact() -> None:
    theta, columns = thetas(4), np.array([SPEC.names.index(name) for name in ("b3", *SPEC.linear[:3])])
    out = sensitivities(drive(), theta, DT, columns)
    for c, k in enumerate(columns):
        moved = response(drive(), theta + 250.0 * np.eye(31)[k], DT)
        np.testing.assert_allclose(out[:, 0] + 250.0 * out[:, 1 + c], moved, rtol=0, atol=1e-7)


def test_sensitivities_take_views_and_read_only_arrays() -> None:
    theta = thetas(5)
    expected = sensitivities(drive(), theta, DT, EVERY)
    sealed = drive()
    sealed.flags.writeable = False
    wide = np.repeat(theta, 2, axis=0)[::2]
    out = sensitivities(sealed, wide, DT, np.arange(62)[::2] // 2)
    np.testing.assert_array_equal(out, expected)


def test_sensitivities_of_a_vector_that_is_not_a_number_are_none() -> None:
    theta = thetas(6)
    theta[1, 4] = np.nan
    out = sensitivities(drive(), theta, DT, EVERY)
    assert np.isnan(out[1]).all() and np.isfinite(out[[0, 2]]).all()
