"""Every region holds the samples that its name says, and the error that lies there."""

from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from mrfit.core.specs import Array, Mask
from mrfit.discover.evidence.bench import Bench, Stretch
from mrfit.discover.evidence.refit import Refit
from mrfit.discover.policy import STANDARD
from mrfit.discover.writing.regions import Region, in_words, locate, not_determined

COUNT, DT = 1200, 1e-3
TIME = np.arange(COUNT) * DT


def stretch(k: int, **more: Array | str) -> SimpleNamespace:
    """Return a sine test, the second one faster and shorter than the first."""
    frequency, amplitude = (2.0, 0.01) if k == 0 else (4.0, 0.004)
    w = 2.0 * np.pi * frequency
    drive = more.pop("drive", "displacement")
    channels = {
        "displacement": amplitude * np.sin(w * TIME),
        "velocity": amplitude * w * np.cos(w * TIME),
        "current": np.linspace(0.0, 1.0 + k, COUNT),
        "temperature": 20.0 + 10.0 * k + 10.0 * TIME / TIME[-1],
    } | more
    segment = SimpleNamespace(
        condition=f"c{k}", samples=COUNT, cycles=4, frequency=frequency, amplitude=amplitude, drive=drive
    )
    return SimpleNamespace(segment=segment, block=SimpleNamespace(dt=DT), channel=channels.get, channels=channels)


STRETCHES = (stretch(0), stretch(1))
FASTEST = [float(np.max(np.abs(s.channels["velocity"]))) for s in STRETCHES]
PLACES: Mapping[str, Callable[[int, Mapping[str, Array]], Mask]] = {
    "condition c1": lambda k, c: np.full(COUNT, k == 1),
    "frequency 2 Hz": lambda k, c: np.full(COUNT, k == 0),
    "amplitude 0.004 m (displacement)": lambda k, c: np.full(COUNT, k == 1),
    "early third of the records": lambda k, c: TIME < 0.4,
    "late third of the records": lambda k, c: TIME > 0.7999,
    # slow and fast are told by each test's own peak
    "pre-yield (slow: |v| below 15 % of its peak)": lambda k, c: np.abs(c["velocity"]) < 0.15 * FASTEST[k],
    "post-yield (fast: |v| above 15 % of its peak)": lambda k, c: np.abs(c["velocity"]) >= 0.15 * FASTEST[k],
    "rebound (v > 0)": lambda k, c: c["velocity"] > 0.0,
    "compression (v < 0)": lambda k, c: c["velocity"] < 0.0,
    # high, large and hot by the largest of all
    "high speed (|v| above 70 % of the largest)": lambda k, c: np.abs(c["velocity"]) > 0.7 * max(FASTEST),
    "end of stroke (|x| above 90 % of the largest)": lambda k, c: np.abs(c["displacement"]) > 0.009,
    "high current (|i| above 80 % of the largest)": lambda k, c: c["current"] > 1.6,
    "low current (|i| below 20 % of the largest)": lambda k, c: c["current"] < 0.4,
    "cold third": lambda k, c: c["temperature"] < 20.0 + 20.0 / 3.0,
    "hot third": lambda k, c: c["temperature"] > 40.0 - 20.0 / 3.0,
}


def bench(stretches: tuple[SimpleNamespace, ...] = STRETCHES) -> Bench:
    return cast(Bench, SimpleNamespace(stretches=stretches))


def located(errors: list[Array], stretches: tuple[SimpleNamespace, ...] = STRETCHES) -> dict[str, Region]:
    return {r.name: r for r in locate(bench(stretches), errors, cast(tuple[Stretch, ...], stretches))}


@pytest.mark.parametrize("name", PLACES)
def test_a_region_holds_the_error_that_lies_where_its_name_says(name: str) -> None:
    places = [PLACES[name](k, s.channels) for k, s in enumerate(STRETCHES)]
    samples = float(np.mean(np.concatenate(places)))
    found = located([1.0 * p for p in places])[name]
    assert (found.share_of_error, found.share_of_samples) == (pytest.approx(1.0), pytest.approx(samples))
    assert located([1.0 * ~p for p in places])[name].share_of_error == pytest.approx(0.0)
    assert 0.0 < samples < 1.0


def test_shares_are_of_the_squared_error() -> None:
    found = located([np.full(COUNT, 3.0), np.full(COUNT, 1.0)])
    assert found["condition c0"].share_of_error == pytest.approx(0.9)
    assert found["condition c0"].excess == pytest.approx(0.4)


def test_regions_come_by_what_they_hold_beyond_their_samples_and_none_is_everywhere() -> None:
    rng = np.random.default_rng(0)
    errors = [rng.standard_normal(COUNT), 3.0 * rng.standard_normal(COUNT)]
    rows = locate(bench(), errors, cast(tuple[Stretch, ...], STRETCHES))
    assert [r.excess for r in rows] == sorted((r.excess for r in rows), reverse=True)
    alone = located(errors[:1], STRETCHES[:1])
    assert not any(n.startswith(("condition", "frequency", "amplitude")) for n in alone)


def test_a_current_that_is_held_is_a_region_of_its_own() -> None:
    two = (stretch(0, current=np.full(COUNT, 0.5)), stretch(1, current=np.full(COUNT, 2.0)))
    found = located([np.ones(COUNT), np.zeros(COUNT)], two)
    assert found["current 0.5 A"].share_of_error == 1.0 and found["current 2 A"].share_of_error == 0.0
    assert not any("high current" in n or "step" in n for n in found)


def test_a_current_that_drives_has_reversals_and_no_steps() -> None:
    current = np.cos(2.0 * np.pi * 2.0 * TIME)
    found = located([np.ones(COUNT)], (stretch(0, current=current, drive="current"),))
    assert "near reversal of the current" in found and not any("step" in n for n in found)
    switched = np.where(TIME < 0.5, 0.0, 1.0)
    stepped = located([1.0 * (TIME >= 0.5) * (TIME < 0.53)], (stretch(0, current=switched),))
    assert "near reversal of the current" not in stepped
    assert stepped["0-40 ms after a current step up"].share_of_error == 1.0
    assert "0-40 ms after a current step down" not in stepped


def test_sentences_are_of_the_regions_that_hold_more_than_their_share() -> None:
    told = in_words([Region("a", 0.75, 0.2), Region("b", 0.5, 0.49), Region("c", 0.1, 0.9)], STANDARD)
    assert told == ["a: 75 % of the squared error in 20 % of the samples"]


def test_tests_that_the_training_does_not_determine_are_named_with_their_settings() -> None:
    near, far = stretch(0, current=np.full(COUNT, -2.0)), stretch(1, current=np.full(COUNT, 0.5))
    held = SimpleNamespace(of_role=lambda role: [near, far] if role == "holdout" else [])
    for error, named in ((1.3, True), (1.2, False)):
        base = SimpleNamespace(holdout=[np.full(COUNT, error), np.full(COUNT, 7.0)], chi=lambda role: 5.04)
        said = not_determined(cast(Bench, held), cast(Refit, base), 1.127, STANDARD)
        assert said.startswith("a fit to all tests leaves 1.1 noise floors where a fit to the training tests leaves 5:")
        assert ("c0 (up to 0.13 m/s and 2 A)" in said) is named
        assert "c1 (up to 0.1 m/s and 0.5 A)" in said
