"""Scaled variables of records, and columns beside the best law."""

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.discover.formula.rows import FormulaRows, Scale, moving, samples_of, scales_of
from mrfit.discover.invariance.base import none
from mrfit.discover.invariance.setting import RegressionData, setting_of
from mrfit.discover.policy import STANDARD
from tests.discover.formula.plain import SCALES, rows_of, term
from tests.discover.invariance.specimens import HALF_STROKE, records


def setting(count: int = 4) -> RegressionData:
    own = records()[:count]
    return setting_of(own, none(own).terms, [], STANDARD)


SETTING = setting()
RECORDS = SETTING.records


def test_variables_are_scaled_by_what_was_visited() -> None:
    found = scales_of(SETTING)
    warm = np.concatenate([r.channels["temperature"] for r in RECORDS])
    assert (found["x"].size, found["x"].origin) == (pytest.approx(HALF_STROKE, rel=1e-3), pytest.approx(0.0, abs=1e-4))
    assert found["v"] == Scale(0.0, SETTING.scales.speed)
    assert found["L"] == Scale(0.0, SETTING.scales.span)
    assert (found["i"].size, found["t"].size) == (1.0, pytest.approx(RECORDS[0].channels["time"][-1]))
    assert found["T"] == Scale(pytest.approx(float(warm.mean())), pytest.approx(float(np.ptp(warm))))
    peaks = [np.percentile(np.abs(r.channels["acceleration"]), STANDARD.fast_percentile) for r in RECORDS]
    assert found["a"].size == pytest.approx(max(peaks))


def test_without_a_temperature_it_stands_still() -> None:
    cold = replace(SETTING, records=tuple(replace(r, channels=_without(r.channels)) for r in RECORDS))
    scales = scales_of(cold)
    samples = samples_of(cold, scales)
    assert all(not s["T"].any() for s in samples)
    assert "T" not in moving(samples, scales)


def _without(channels: Mapping[str, Array], name: str = "temperature") -> dict[str, Array]:
    return {n: c for n, c in channels.items() if n != name}


def test_a_sample_is_its_distance_from_the_origin_and_held_far_outside() -> None:
    scales = scales_of(SETTING) | {"v": Scale(0.0, 0.01), "x": Scale(0.002, 0.02)}
    found = samples_of(SETTING, scales)[0]
    np.testing.assert_allclose(found["x"], (RECORDS[0].place - 0.002) / 0.02)
    assert (found["v"].max(), found["v"].min()) == (STANDARD.formula_furthest, -STANDARD.formula_furthest)
    np.testing.assert_allclose(found["t"][0], 0.0, atol=1e-2)


def test_a_record_begins_at_no_time_before_zero() -> None:
    early = tuple(replace(r, channels={**r.channels, "time": r.channels["time"] - 1.0}) for r in RECORDS)
    assert min(float(s["t"].min()) for s in samples_of(replace(SETTING, records=early), scales_of(SETTING))) == 0.0


@pytest.mark.parametrize(
    ("current", "warming", "moves"),
    [
        (1.02 * STANDARD.moving_control, 2.1, "xvatiT"),
        (0.98 * STANDARD.moving_control, 2.1, "xvatT"),
        (1.02 * STANDARD.moving_control, 1.9, "xvati"),
    ],
)
def test_current_and_temperature_are_variables_where_they_move(current: float, warming: float, moves: str) -> None:
    wave = np.sqrt(2.0) * np.sin(np.linspace(0.0, 20.0 * np.pi, 1000, endpoint=False))
    samples = [{"i": current * wave, "T": 0.3 * wave}, {"i": current * wave, "T": 0.3 * wave}]
    assert moving(tuple(samples), {**SCALES, "T": Scale(30.0, warming)}) == frozenset(moves)


def test_a_temperature_that_is_out_of_range_once_does_not_move() -> None:
    held = np.zeros(10_000)
    held[5] = 1.0
    assert "T" not in moving(({"i": held, "T": held},), {**SCALES, "T": Scale(30.0, 50.0)})


U = np.linspace(-1.0, 1.0, 40)


def rows(targets: list[Array] | None = None) -> FormulaRows:
    samples = [{"x": U, "v": U**3 + 0.2}, {"x": 0.5 * U, "v": U[::-1]}]
    laws = [np.column_stack([np.ones(40), 3.0 * s["v"]]) for s in samples]
    weights = [np.linspace(0.5, 2.0, 40), np.full(40, 0.3)]
    return rows_of(samples, targets or [s["x"] ** 2 for s in samples], laws, weights)


def test_what_a_law_makes_is_taken_off_by_weights() -> None:
    own = rows()
    column = own.column(term(("x", "cube")))
    left = own.project(column)
    np.testing.assert_allclose(own.weighed.T @ left, 0.0, atol=1e-3 * np.linalg.norm(left))
    expected = np.linalg.lstsq(own.weighed, column * own.weights, rcond=None)[0]
    np.testing.assert_allclose(left, column * own.weights - own.weighed @ expected, atol=1e-4)
    np.testing.assert_allclose(own.project(np.column_stack([column, column]))[:, 1], left)
    np.testing.assert_allclose(np.sqrt(np.mean(own.law**2, axis=0)), 1.0)


def test_the_law_s_force_is_that_beside_a_force() -> None:
    """Of 0.3 + 2 v + force a law of a constant and v leaves nothing once the force is taken off."""
    bare = rows()
    force = bare.column(term(("x", "square")))
    speed = np.concatenate([s["v"] for s in bare.samples])
    own = rows(list(bare.parts(0.3 + 2.0 * speed + force)))
    np.testing.assert_allclose(own.law @ own.law_beside(force), 0.3 + 2.0 * speed, atol=1e-3)
    told = own.with_law_force(force)
    np.testing.assert_allclose(np.concatenate([s["L"] for s in told.samples]), 0.3 + 2.0 * speed, atol=1e-3)
    # beside no force it has to make all of it
    assert np.max(np.abs(own.law @ own.law_beside(0.0 * force) - 0.3 - 2.0 * speed)) > 0.05


def test_a_gain_is_less_its_mean_over_all_rows() -> None:
    own, gain = rows(), term(("x", "square"), ("v", "line"))
    squares = np.concatenate([s["x"] ** 2 for s in own.samples])
    assert own.gauge(gain) == pytest.approx(float(squares.mean()))
    assert own.gauge(term(("x", "square"))) == 0.0
    speed = np.concatenate([s["v"] for s in own.samples])
    np.testing.assert_allclose(own.column(gain), (squares - squares.mean()) * speed)
    np.testing.assert_allclose(own.columns([gain, term(("v", "line"))])[:, 1], speed)


def test_rows_are_parted_by_records_and_weighed_anew() -> None:
    own = rows()
    parts = own.parts(np.arange(80.0))
    assert [len(p) for p in parts] == [40, 40] and parts[1][0] == 40.0
    again = own.with_weights([np.ones(40), np.zeros(40)])
    np.testing.assert_allclose(again.project(own.target)[40:], 0.0, atol=1e-12)
    assert [len(g) for g in own.groups] == [40, 40]


def test_means_over_rows_are_taken_where_a_row_is_several_samples() -> None:
    setting = SimpleNamespace(**{**vars(rows().setting), "row_means": lambda k, v: v.reshape(20, 2).mean(axis=1)})
    halved = replace(rows(), setting=cast(RegressionData, setting), weights=np.ones(40))
    np.testing.assert_allclose(halved.column(term(("x", "line")))[:20], U.reshape(20, 2).mean(axis=1))
