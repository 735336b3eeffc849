"""Records are means of what was measured, at no more samples than the motion needs."""

from dataclasses import replace

import numpy as np
import pytest

from mrfit.discover.invariance.base import none
from mrfit.discover.invariance.estimate import table
from mrfit.discover.invariance.records import from_block, thinned, with_steady_currents
from mrfit.discover.invariance.setting import setting_of
from mrfit.discover.invariance.weights import equal, residuals, weights_of
from mrfit.discover.policy import STANDARD
from mrfit.search.problem import full_block
from mrfit.signal.smoothing import Drive
from tests.discover.invariance.specimens import records
from tests.discover.test_rules import segment

RATE = 4000.0


def channels(f: float, seconds: float = 2.0, lead: int = 0) -> dict[str, np.ndarray]:
    t = (np.arange(int(seconds * RATE) + lead) - lead) / RATE
    w = 2.0 * np.pi * f
    x = 0.01 * np.sin(w * t)
    return {"displacement": x, "velocity": 0.01 * w * np.cos(w * t), "acceleration": -(w**2) * x, "time": t}


@pytest.mark.parametrize(("f", "rate"), [(2.0, STANDARD.rate_max), (20.0, 20.0 * STANDARD.samples_of_fastest)])
def test_a_record_has_as_many_samples_as_its_motion_needs(f: float, rate: float) -> None:
    found = thinned("a", 1.0 / RATE, channels(f), np.ones(int(2 * RATE)), "force")
    assert 1.0 / found.dt == pytest.approx(rate, rel=0.15)
    assert found.fastest == pytest.approx(f, rel=0.3)


def test_samples_are_means_and_the_lead_in_stays_aligned() -> None:
    made, lead = channels(2.0, lead=403), 403
    output = made["velocity"][lead:]
    found = thinned("a", 1.0 / RATE, made, output, "force")
    np.testing.assert_allclose(found.measured(found.speed), found.output, atol=1e-12)
    np.testing.assert_allclose(found.measured(found.channels["time"])[0], np.mean(np.arange(8) / RATE), atol=1e-12)
    assert found.lead == 403 // 8


def test_a_current_that_hardly_moves_is_held_at_its_mean() -> None:
    made = channels(2.0)
    noise = np.random.default_rng(0).normal(0.0, 0.01, len(made["time"]))
    for level, moves in ((1.0, False), (0.0, False)):
        found = thinned("a", 1.0 / RATE, {**made, "current": level + noise * level}, np.ones(len(noise)), "force")
        assert found.moves is moves
        assert np.ptp(found.control) == 0.0
    found = thinned("a", 1.0 / RATE, {**made, "current": 1.0 + 10.0 * noise}, np.ones(len(noise)), "force")
    assert found.moves


@pytest.mark.parametrize(("share", "moves"), [(0.99, False), (1.01, True)])
def test_noise_about_zero_current_is_no_current_that_moves(share: float, moves: bool) -> None:
    made = channels(2.0)
    wave = np.sqrt(2.0) * np.sin(2.0 * np.pi * 5.0 * made["time"])
    output = np.ones(len(wave))
    full = thinned("full", 1.0 / RATE, {**made, "current": np.full(len(wave), 2.0)}, output, "force")
    still = thinned(
        "still", 1.0 / RATE, {**made, "current": 2.0 * STANDARD.moving_control * share * wave}, output, "force"
    )
    assert still.moves
    kept, steady = with_steady_currents([full, still])
    assert steady.moves is moves
    assert bool(np.ptp(steady.control) > 0.0) is moves
    assert np.mean(steady.control) == pytest.approx(np.mean(still.control), abs=1e-9)
    np.testing.assert_array_equal(kept.control, full.control)


@pytest.mark.parametrize(("conditions", "whole"), [(8, True), (STANDARD.fewest_groups - 1, False)])
def test_few_conditions_are_cut_into_pieces(conditions: int, whole: bool) -> None:
    rows = records()[:conditions]
    own = setting_of(rows, none(rows).terms, [], STANDARD)
    assert own.count == conditions if whole else own.count > conditions
    assert {len(set(g.tolist())) for g in own.groups} == {1} if whole else max(len(set(g)) for g in own.groups) > 1


def test_a_row_with_a_clipped_sample_has_no_weight_and_no_residual() -> None:
    made, count = channels(2.0), int(2 * RATE)
    block = full_block(
        segment("train", "0", count),
        Drive(np.stack([*made.values()]), 0, 1.0 / RATE, "none", {}, None),
        1000.0 * made["velocity"],
    )
    counts = np.ones(count)
    counts[1000:1101] = 0.0
    record = from_block(replace(block, counts=counts), [*made], "force")
    assert record.compared is not None and from_block(block, [*made], "force").compared is None
    setting = setting_of([record] * 2, none([record] * 2).terms, [], STANDARD)
    lost = setting.compared[0] == 0.0
    width = len(record.output) * (count // len(record.output)) // len(lost)
    assert np.array_equal(np.flatnonzero(lost), np.arange(1000 // width, 1100 // width + 1))
    assert np.array_equal(weights_of(setting, {})[0] > 0.0, ~lost)
    assert np.all(residuals(setting, {}, table(setting, equal(setting), {}))[0][lost] == 0.0)
