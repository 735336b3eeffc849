"""Advice asks for no test that has been made: which tests an experiment asks for is compared with those there are."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.core.recording import Segment
from mrfit.core.specs import EffectSpec, Programme
from mrfit.discover.writing.tests_already_made import is_there, still_to_do


def made(frequency: float, amplitude: float, current: float = np.nan, waveform: str = "sine") -> Segment:
    place = (0, 100, 0, waveform, "displacement", frequency, amplitude, 0.0, 5, current, np.nan, "train")
    return Segment("a#0", "a", "a", *place)


def spec(name: str) -> EffectSpec:
    found: EffectSpec = registry.load("effect", name).SPEC
    return found


DECADE = [made(f, a) for f in (1.0, 5.0, 10.02) for a in (1.0, 3.0)]


def test_sines_at_three_frequencies_are_not_asked_for_again_the_rest_is() -> None:
    assert still_to_do(spec("resistance-error"), DECADE).startswith("measure R by a direct current")
    assert still_to_do(spec("resistance-error"), DECADE[:4]) == spec("resistance-error").experiment
    # frequencies that differ together with the amplitude tell nothing
    mixed = [made(f, f) for f in (1.0, 5.0, 10.0)]
    assert still_to_do(spec("resistance-error"), mixed) == spec("resistance-error").experiment


def test_a_test_that_no_list_shows_is_always_asked_for() -> None:
    assert still_to_do(spec("integrator-offset"), DECADE) == spec("integrator-offset").experiment
    assert still_to_do(spec("current-lag"), DECADE) == spec("current-lag").experiment


@pytest.mark.parametrize(
    ("asked", "tests", "there"),
    [
        (Programme(frequencies=3, ratio=10.0), DECADE, True),
        (Programme(frequencies=3, ratio=20.0), DECADE, False),
        (Programme(amplitudes=2), DECADE, True),
        (Programme(amplitudes=3), DECADE, False),
        (Programme(currents=2), [made(1.0, 0.01, i) for i in (0.0, 1.0)], True),
        (Programme(currents=2), [made(1.0, 0.01 * (1 + i), i) for i in (0.0, 1.0)], False),
        # the same level, as a supply holds it
        (Programme(currents=2), [made(1.0, 0.01, i) for i in (1.0, 1.03)], False),
        (Programme(currents=2), [made(1.0, 0.01, i) for i in (-0.005, 0.004, 0.0)] + [made(2.0, 0.01, 2.0)], False),
        (Programme(speeds=3), [made(f, 0.01, 0.5) for f in (1.0, 2.0, 4.0)], True),
        (Programme(frequencies=1, waveform="triangle"), DECADE, False),
        (Programme(frequencies=1, waveform="triangle"), [*DECADE, made(1.0, 1.0, waveform="triangle")], True),
        (Programme(frequencies=3), [replace(s, frequency=0.0) for s in DECADE], False),
        (Programme(frequencies=3), [], False),
    ],
)  # fmt: skip
def test_what_is_asked_for_is_there_or_not(asked: Programme, tests: list[Segment], there: bool) -> None:
    assert is_there(asked, tests) is there


@pytest.mark.parametrize("name", registry.names("effect"))
def test_no_more_is_asked_for_than_an_experiment_says(name: str) -> None:
    effect = spec(name)
    assert len(effect.asks) <= len(effect.experiment.split("; "))
    # whatever was logged, no empty advice and none that begins in the middle of a sentence
    settings = product((0.5, 1.0, 5.0, 10.0, 20.0), (0.01, 0.02, 0.03), (0.0, 0.5, 1.0, 1.5, 2.0), ("sine", "triangle"))
    everything = [made(*setting) for setting in settings]
    left = still_to_do(effect, everything)
    assert not left.startswith(("or ", "; "))
