"""Repeats of one condition disagree by their gain and offset, beyond noise and beyond a share of the output."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.fit.diagnostics.repeats import REPEAT_NOISES, REPEAT_SHARE, repeat_rows

WAVE = np.sin(2.0 * np.pi * np.arange(400) / 100)
RMS = np.sqrt(0.5)


def part(output: Array, condition: str = "sine", role: str = "train", cycles: int = 4) -> Any:
    return SimpleNamespace(output=output, segment=SimpleNamespace(condition=condition, role=role, cycles=cycles))


def rows(*outputs: Array, floor: float = 1e-3, simulated: Array = WAVE, **given: Any) -> list[Any]:
    parts = [part(output, **given) for output in outputs]
    return repeat_rows(parts, [floor] * len(parts), [simulated] * len(parts))


def test_repeats_alike_agree_and_a_gain_or_an_offset_apart_do_not() -> None:
    (alike,) = rows(WAVE, 1.01 * WAVE)
    assert alike.agree and alike.difference == pytest.approx(0.01 * RMS) and alike.segments == 2
    (gain,) = rows(WAVE, 1.3 * WAVE)
    assert not gain.agree and gain.difference == pytest.approx(0.3 * RMS)
    (offset,) = rows(WAVE, WAVE + 0.4)
    assert not offset.agree and offset.difference == pytest.approx(0.4)


def test_gain_and_offset_together_are_one_difference() -> None:
    (row,) = rows(WAVE, 1.3 * WAVE + 0.4)
    assert row.difference == pytest.approx(np.hypot(0.3 * RMS, 0.4))


def test_a_difference_has_to_be_more_than_noise_and_more_than_a_share() -> None:
    apart = 1.2 * REPEAT_SHARE * np.sqrt(2.0) * RMS
    assert not rows(WAVE, WAVE + apart, floor=apart / REPEAT_NOISES / 1.1)[0].agree
    assert rows(WAVE, WAVE + apart, floor=apart / REPEAT_NOISES * 1.1)[0].agree
    assert rows(WAVE, WAVE + 0.5 * REPEAT_SHARE * RMS, floor=0.0)[0].agree


def test_an_error_of_the_model_that_all_share_is_no_difference() -> None:
    wrong = WAVE + 0.8 * np.cos(2.0 * np.pi * np.arange(400) / 50)
    assert rows(wrong, wrong)[0].difference == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("given", [{"role": "holdout"}, {"cycles": 0}], ids=["held out", "not periodic"])
def test_only_periodic_training_segments_are_compared(given: dict[str, Any]) -> None:
    assert rows(WAVE, 1.3 * WAVE, **given) == [] and rows(WAVE) == []


def test_conditions_are_judged_each_by_itself_by_its_worst_pair() -> None:
    parts = [part(WAVE, "a"), part(1.3 * WAVE, "b"), part(1.01 * WAVE, "a"), part(WAVE, "b"), part(1.6 * WAVE, "b")]
    first, second = repeat_rows(parts, [1e-3, 1e-3, 1e-3, 1e-3, 0.2], [WAVE] * 5)
    assert (first.condition, first.agree, first.segments) == ("a", True, 2)
    assert (second.condition, second.segments) == ("b", 3) and second.difference == pytest.approx(0.6 * RMS)
    assert second.noise_floor == 0.2


def test_a_simulation_that_stands_still_leaves_the_difference_of_the_means() -> None:
    (row,) = rows(WAVE, WAVE + 0.4, simulated=np.zeros(400))
    assert row.difference == pytest.approx(0.4)
