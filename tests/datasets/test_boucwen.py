import numpy as np
import pytest

from datasets.rig.boucwen import FluxBoucWen


def sweep(*corners, points=101):
    return np.concatenate(
        [[corners[0]], *(np.linspace(a, b, points)[1:] for a, b in zip(corners, corners[1:], strict=False))]
    )


def test_n_equal_one_follows_the_exponential_branches():
    model = FluxBoucWen(A=1.2, Lc=0.02, kappa=3.5, beta=30, gamma=60, n=1.0, D=20)
    current = sweep(0.0, 0.05, 0.03)
    z = model.hysteretic(current)
    turn = 3.5 / 90 * (1 - np.exp(-90 * 0.05))
    assert z[100] == pytest.approx(turn, rel=1e-9)
    # falling with z > 0: dz/di = kappa - (beta - gamma) z
    rate = 30.0 - 60.0
    falling = current[100:]
    expected = 3.5 / rate + (turn - 3.5 / rate) * np.exp(-rate * (falling - 0.05))
    positive = expected > 0
    assert positive.sum() > 40
    assert np.abs(z[100:] - expected)[positive].max() < 1e-9


def test_the_saturated_level_is_the_root_of_the_branch():
    model = FluxBoucWen(A=1.2, Lc=0.02, kappa=3.4887, beta=30, gamma=60, n=1.27, D=20)
    z = model.hysteretic(sweep(0.0, 4.0, -4.0))
    limit = (3.4887 / 90) ** (1 / 1.27)
    assert z[100] == pytest.approx(limit, rel=1e-8)
    assert z[-1] == pytest.approx(-limit, rel=1e-8)


def test_it_depends_on_the_path_not_on_the_sampling():
    model = FluxBoucWen(A=1.2, Lc=0.02, kappa=3.4887, beta=30, gamma=60, n=1.27, D=20)
    coarse, fine = (model.hysteretic(sweep(0.0, 1.0, 1.0, -0.4, 0.6, points=p))[-1] for p in (7, 301))
    assert coarse == pytest.approx(fine, abs=1e-9)
