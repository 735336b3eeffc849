"""Levels of a held signal: flat where it was held, untouched where it moves."""

import numpy as np
import pytest

from mrfit.signal.plateaus import at_levels

NOISE = 2e-3


def noisy(signal: np.ndarray, seed: int = 0) -> np.ndarray:
    return signal + np.random.default_rng(seed).normal(0.0, NOISE, len(signal))


def test_steps_are_flat_at_their_means_up_to_the_edges() -> None:
    signal = np.repeat([0.4, 2.3, 0.0, 1.8], [120, 300, 90, 400])
    values = noisy(signal)
    found = at_levels(values, values, NOISE)
    assert np.abs(found - signal).max() <= 4 * NOISE / np.sqrt(90) + 2 * NOISE
    inner = np.abs(np.arange(len(signal)) - np.array([[120], [420], [510]])).min(axis=0) > 2
    assert np.abs(found - signal)[inner].max() <= 4 * NOISE / np.sqrt(90)
    assert len(np.unique(found[inner])) == 4


def test_an_overshoot_of_the_smoother_beside_an_edge_goes_away() -> None:
    signal = np.repeat([0.0, 1.0], 200)
    smoothed = signal.copy()
    smoothed[203] += 0.1
    assert np.abs(at_levels(noisy(signal), smoothed, NOISE)[202:] - 1.0).max() <= NOISE


@pytest.mark.parametrize("moving", [np.linspace(0.0, 0.02, 500), 2.0 * np.sin(np.linspace(0, 20, 500))])
def test_what_moves_stays_as_it_was_smoothed(moving: np.ndarray) -> None:
    assert np.array_equal(at_levels(noisy(moving), moving, NOISE), moving)


def test_a_signal_without_noise_or_too_short_stays() -> None:
    values = np.ones(40)
    assert at_levels(values, values, 0.0) is values
    assert at_levels(values[:20], values[:20], NOISE).shape == (20,)
