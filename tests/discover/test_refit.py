"""The paired score calls a fall in error clear when it is, allowing for correlated residuals."""

import numpy as np

from mrfit.discover.refit import paired_z


def test_equal_errors_score_nothing_and_a_real_fall_scores_much() -> None:
    rng = np.random.default_rng(1)
    noise = rng.standard_normal(4000)
    extra = 0.3 * np.sin(np.arange(4000) / 30)
    assert paired_z([noise], [noise]) == 0.0
    assert paired_z([noise + extra], [noise]) > 5


def test_a_fall_in_correlated_noise_scores_less_than_in_white_noise_of_the_same_size() -> None:
    rng = np.random.default_rng(2)
    white = rng.standard_normal(6000)
    slow = np.convolve(rng.standard_normal(6200), np.ones(100), "valid")[:6000]
    slow /= slow.std()
    extra = 0.2 * np.sin(np.arange(6000) / 200)
    assert paired_z([slow + extra], [slow]) < 0.5 * paired_z([white + extra], [white])


def test_chance_falls_are_rarely_clear() -> None:
    rng = np.random.default_rng(3)
    scores = []
    for _ in range(200):
        before, after = (np.convolve(rng.standard_normal(1100), np.ones(20), "valid") for _ in range(2))
        scores.append(paired_z([before], [after]))
    assert np.mean(np.abs(scores) > 1.96) < 0.12
