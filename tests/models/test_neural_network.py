"""The network against its formula, its published size, and its 4 ms of memory."""

import numpy as np
import pytest

from mrfit.models.neural_network import SPEC, response, start_values

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
