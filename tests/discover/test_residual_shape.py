"""The shape of an error: a curve over a channel, a loop, or nothing; learnt on some conditions, judged on others."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.discover.policy import STANDARD
from mrfit.discover.writing.residual_shape import residual_shapes, shape_in_words
from mrfit.io.schemas.discovery import Look


class _Stretch:
    def __init__(self, velocity: Array) -> None:
        self.velocity = velocity

    def channel(self, name: str) -> Array:
        assert name == "velocity"
        return self.velocity


def rows_for(shape: str) -> list[Look]:
    rng = np.random.default_rng(3)
    phase = np.arange(4000) * 2 * np.pi / 500.0
    parts: dict[str, list[Any]] = {"train": [], "holdout": []}
    errors: dict[str, list[Array]] = {"train": [], "holdout": []}
    for role, amplitude in (("train", 0.1), ("train", 0.2), ("holdout", 0.15)):
        velocity = amplitude * np.sin(phase)
        error = {
            "curve": np.tanh(velocity / 0.05),
            "loop": np.sign(np.cos(phase)) * np.exp(-((velocity / 0.05) ** 2)),
            "turn": np.sign(np.cos(phase)) * np.exp(-(amplitude - np.sign(np.cos(phase)) * -velocity) / 0.02),
            "noise": np.zeros(len(phase)),
        }[shape]
        parts[role].append(_Stretch(velocity))
        errors[role].append(error + 0.3 * rng.standard_normal(len(phase)))
    bench = SimpleNamespace(channels=frozenset({"velocity"}), of_role=lambda role: parts[role])
    return residual_shapes(bench, SimpleNamespace(train=errors["train"], holdout=errors["holdout"]))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        ("curve", "one curve over the velocity: a static law is missing"),
        ("loop", "a loop over the velocity predicts"),
        ("turn", "the path of the velocity since its last reversal predicts"),
        ("noise", ""),
    ],
)
def test_shape_is_told(shape: str, words: str) -> None:
    said = shape_in_words(rows_for(shape), STANDARD)
    assert words in said if words else not said


def test_loop_is_not_predicted_by_a_curve_and_a_curve_by_both() -> None:
    (curve,), (loop,) = rows_for("curve"), rows_for("loop")
    assert curve.curve == pytest.approx(curve.loop, abs=0.05) and curve.curve > 0.8
    assert loop.loop > 0.4 and loop.curve < 0.05
