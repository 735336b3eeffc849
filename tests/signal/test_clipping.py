"""Samples at the end of a sensor's range are those that were cut off, and none where nothing was found to be."""

from dataclasses import replace

import numpy as np
import pytest

from mrfit.core.recording import Finding, Recording
from mrfit.core.specs import Array
from mrfit.signal.clipping import FEWEST_CLIPPED, clipped
from tests.discover.test_rules import segment

COUNT = 2000
WAVE = 100.0 * np.sin(2.0 * np.pi * np.arange(COUNT) / 200.0)
FOUND = Finding("clipped", "force", 0.0, "it is clipped")


def recording(force: Array, *findings: Finding) -> Recording:
    return Recording("0", "r.csv", "r", "none", 1e-3, 0.0, {"force": force}, {}, findings=findings)


@pytest.mark.parametrize("sides", [(-80.0, 80.0), (-200.0, 80.0), (-80.0, 200.0)])
def test_what_is_beyond_the_range_is_clipped(sides: tuple[float, float]) -> None:
    own = replace(segment("train", "0", COUNT), start=150, stop=1850)
    limited = np.clip(WAVE, *sides)
    ends = [k for k, end in ((np.argmin(limited), -80.0), (np.argmax(limited), 80.0)) if end in sides]
    found = clipped(recording(limited, *(replace(FOUND, at=1e-3 * float(k)) for k in ends)), own, "force")
    assert np.array_equal(found, ((WAVE <= sides[0]) | (WAVE >= sides[1]))[150:1850])


def test_samples_that_noise_took_off_the_limit_are_clipped_too() -> None:
    rng = np.random.default_rng(5)
    limited = np.clip(WAVE + 3.0 * rng.standard_normal(COUNT), -80.0, 80.0)
    both = [replace(FOUND, at=1e-3 * float(k)) for k in (np.argmin(limited), np.argmax(limited))]
    found = clipped(recording(limited, *both), segment("train", "0", COUNT), "force")
    beyond = np.abs(WAVE) > 82.0
    assert np.mean(found[beyond]) > 0.99 and not np.any(found[np.abs(WAVE) < 65.0])
    assert np.any(np.abs(limited[beyond]) < 80.0)


def test_an_end_of_which_nothing_was_found_is_no_limit() -> None:
    coarse = np.minimum(np.round(WAVE / 5.0) * 5.0, 80.0)
    found = clipped(
        recording(coarse, replace(FOUND, at=1e-3 * float(np.argmax(coarse)))), segment("train", "0", COUNT), "force"
    )
    assert np.all(found[WAVE > 80.0]) and not np.any(found[WAVE < 0.0])


def test_nothing_is_clipped_where_nothing_was_found_or_in_another_channel() -> None:
    limited, own = np.clip(WAVE, -80.0, 80.0), segment("train", "0", COUNT)
    for findings in ((), (replace(FOUND, channel="current"),), (replace(FOUND, kind="stuck"),)):
        assert not np.any(clipped(recording(limited, *findings), own, "force"))


@pytest.mark.parametrize(("count", "any_clipped"), [(FEWEST_CLIPPED - 1, False), (FEWEST_CLIPPED, True)])
def test_a_few_samples_at_an_end_are_its_peaks(count: int, any_clipped: bool) -> None:
    force = np.linspace(-100.0, 100.0, COUNT)
    force[500 : 500 + count] = 150.0
    found = clipped(recording(force, replace(FOUND, at=0.5)), segment("train", "0", COUNT), "force")
    assert np.count_nonzero(found) == count * any_clipped
