"""Structure that a model without physics predicts, and what repeats from cycle to cycle."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.discover.evidence.bench import Bench
from mrfit.discover.evidence.refit import Refit
from mrfit.discover.evidence.residual_structure import _past, explainable, repeated_error

DT, COUNT = 1e-3, 1500


def stretch(frequency: float, repeats: bool = True) -> SimpleNamespace:
    time = np.arange(COUNT) * DT
    w = 2.0 * np.pi * frequency
    channels = {"displacement": 0.01 * np.sin(w * time), "velocity": 0.01 * w * np.cos(w * time)}
    return SimpleNamespace(channel=channels.get, block=SimpleNamespace(dt=DT), repeats=repeats)


PARTS = {"train": [stretch(2.0), stretch(5.0)], "holdout": [stretch(3.0)]}
BENCH = cast(Bench, SimpleNamespace(of_role=PARTS.__getitem__))


def residuals(role: str, structure: float, noise: float = 1.0) -> list[Array]:
    rng = np.random.default_rng(7 if role == "train" else 8)
    return [structure * np.tanh(s.channel("velocity") / 0.05) + noise * rng.standard_normal(COUNT) for s in PARTS[role]]


def test_what_the_state_of_the_specimen_tells_of_an_error_is_predicted_on_other_tests() -> None:
    """A force of the size of the noise is half of the squared error."""
    found = explainable(BENCH, residuals("train", 1.2), residuals("holdout", 1.2), 0)
    power = np.mean(residuals("holdout", 1.2, noise=0.0)[0] ** 2)
    assert 0.6 * power / (power + 1.0) < found < power / (power + 1.0) + 0.05


def test_of_noise_nothing_is_predicted_and_of_another_structure_less_than_nothing() -> None:
    assert explainable(BENCH, residuals("train", 0.0), residuals("holdout", 0.0), 0) < 0.05
    opposed = [-r for r in residuals("holdout", 1.2)]
    assert explainable(BENCH, residuals("train", 1.2), opposed, 0) < -0.5


def test_the_features_are_those_of_the_seed() -> None:
    parts = residuals("train", 1.0), residuals("holdout", 1.0)
    assert explainable(BENCH, *parts, 3) == explainable(BENCH, *parts, 3) != explainable(BENCH, *parts, 4)


@pytest.mark.parametrize(
    ("seconds", "past"), [(0.002, [5, 5, 5, 6, 7]), (1e-9, [5, 5, 6, 7, 8]), (1.0, [5, 5, 5, 5, 5])]
)
def test_the_past_of_a_channel_begins_with_its_first_value(seconds: float, past: list[int]) -> None:
    assert _past(np.array([5.0, 6.0, 7.0, 8.0, 9.0]), DT, seconds).tolist() == past


@pytest.mark.parametrize(
    ("train", "holdout", "error"),
    [
        ([(2.0, True), (9.0, False)], [(1.5, True)], 2.0),
        ([(1.0, True)], [(3.0, True), (9.0, False)], 3.0),
        ([(9.0, False)], [(1.5, True)], 1.5),
        ([(9.0, False)], [(9.0, False)], 0.0),
    ],
)
def test_what_repeats_is_the_larger_error_of_fitted_and_held_out_records_where_cycles_tell_the_noise(
    train: list[tuple[float, bool]], holdout: list[tuple[float, bool]], error: float
) -> None:
    parts = {
        role: [SimpleNamespace(repeats=r) for _, r in rows] for role, rows in (("train", train), ("holdout", holdout))
    }
    fit = SimpleNamespace(train=[np.full(9, e) for e, _ in train], holdout=[np.full(9, e) for e, _ in holdout])
    bench = cast(Bench, SimpleNamespace(of_role=parts.__getitem__))
    assert repeated_error(bench, cast(Refit, fit)) == error
