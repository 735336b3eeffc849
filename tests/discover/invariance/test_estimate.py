"""Partial regression on Gram matrices against plain least squares."""

from types import SimpleNamespace

import numpy as np
import pytest

from mrfit.core.registry import load
from mrfit.core.specs import Array, Breaks, EffectSpec, Invariance, Param
from mrfit.discover.invariance.base import none
from mrfit.discover.invariance.estimate import refine, rows_of, squares, table
from mrfit.discover.invariance.screening import screened
from mrfit.discover.invariance.sensitivity import ExaminedEffect, examined
from mrfit.discover.invariance.setting import RegressionData, setting_of
from mrfit.discover.invariance.weights import equal, residuals, rms, weights_of
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.law_rules import FULL, TRAVEL
from tests.discover.invariance.specimens import HALF_STROKE, records

STIFFNESS = 3e3


def effect(name: str) -> ExaminedEffect:
    found = examined(load("effect", name))
    assert found is not None
    return found


def spring(channels: dict[str, Array], force: Array) -> Array:
    return force + STIFFNESS * channels["displacement"]


def setting(*names: str, **made: object) -> RegressionData:
    rows = records(**made)  # type: ignore[arg-type]
    return setting_of(rows, none(rows).terms, [effect(n) for n in names], STANDARD)


def whole(own: RegressionData, state: dict[str, Array]) -> tuple[Array, Array]:
    rows = rows_of(own, state)
    return np.vstack(rows.law), np.concatenate(rows.target)


def test_the_step_of_a_linear_strength_is_that_of_least_squares() -> None:
    own = setting("gas-spring", effect=spring)
    state = {"gas-spring": np.array([0.0, 0.0])}
    made = table(own, equal(own), state)
    law, target = whole(own, state)
    x = np.concatenate([own.row_means(k, r.place) for k, r in enumerate(own.records)]) / own.scales.span
    ridge = np.vstack([np.sqrt(1e-6 * own.rows) * np.eye(law.shape[1] + 1)[:-1]])
    expected = np.linalg.lstsq(
        np.vstack([np.column_stack([law, x]), ridge]), np.append(target, np.zeros(law.shape[1])), rcond=None
    )[0][-1]
    assert made.steps()[0] == pytest.approx(expected, rel=1e-4)
    assert made.steps()[0] == pytest.approx(STIFFNESS, rel=0.1)


def test_a_jackknife_leaves_one_group_out() -> None:
    own = setting("gas-spring", effect=spring)
    made = table(own, equal(own), {"gas-spring": np.array([0.0, 0.0])})
    steps, left = made.jackknife()
    for g in (0, own.count - 1):
        found = made.solve(made.total - made.grams[g])
        assert steps[g, 0] == pytest.approx(found[made.size] / made.scales[0])
        assert left[g] == pytest.approx(squares(made.grams[g], found))


def test_a_residual_beside_the_nuisance_is_that_of_plain_regression() -> None:
    own = setting("gas-spring")
    x = [own.row_means(k, r.place) for k, r in enumerate(own.records)]
    made = table(own, equal(own), {}, [[c] for c in x])
    weights = made.beside(np.array([made.size]))
    law, _ = whole(own, {})
    place = np.concatenate(x)
    beyond = place - law @ np.linalg.lstsq(law, place, rcond=None)[0]
    share = float(weights[:, 0] @ made.total @ weights[:, 0] / made.total[made.size, made.size])
    assert share == pytest.approx(float(beyond @ beyond / (place @ place)), rel=0.05)


def test_fewer_levels_leave_more() -> None:
    own = setting("gas-spring")
    made = table(own, equal(own), {})
    assert made.left(FULL) < made.left(TRAVEL)
    assert rms(residuals(own, {}, made)) < 0.01


def test_numbers_that_do_not_enter_linearly_are_found() -> None:
    k_s, x_s, p = 2e4, 0.7 * HALF_STROKE, 1.5

    def stop(channels: dict[str, Array], force: Array) -> Array:
        depth = np.maximum(np.abs(channels["displacement"]) - x_s, 0.0)
        return force + k_s * 1e-3 * (depth / 1e-3) ** p * np.sign(channels["displacement"])

    own = setting("end-stop", effect=stop)
    weights = weights_of(own, {})
    start = screened(own, weights, {}).candidates[0]
    found = refine(own, weights, {"end-stop": np.array(start.theta)}).state["end-stop"]
    assert found[1] == pytest.approx(x_s, rel=0.05)
    depth = HALF_STROKE - x_s
    force = found[0] * 1e-3 * ((HALF_STROKE - found[2] - found[1]) / 1e-3) ** found[3]
    assert force == pytest.approx(k_s * 1e-3 * (depth / 1e-3) ** p, rel=0.05)


def test_a_sensitivity_in_the_span_of_every_law_has_nothing_left() -> None:
    spec = EffectSpec(
        "drag", "", "", "", "add", ("force",), ("velocity",), (Param("c", "N*s/m", -1e6, 1e6, 0.0),), (0.0,),
        breaks=Breaks(Invariance.POSITION),
    )  # fmt: skip
    own = examined(SimpleNamespace(SPEC=spec, term=lambda channels, theta, dt: theta[:, :1] * channels["velocity"]))
    assert own is not None
    rows = records()
    made = setting_of(rows, none(rows).terms, [own, effect("gas-spring")], STANDARD)
    left = {c.name: c.left for c in screened(made, equal(made), {}).candidates}
    assert left["drag"] < STANDARD.sensitivity_left < left["gas-spring"]


def test_weights_are_small_where_the_law_leaves_much() -> None:
    def rough(channels: dict[str, Array], force: Array) -> Array:
        wrong = 60.0 * np.sin(400.0 * channels["displacement"] / HALF_STROKE)
        return force + wrong * (channels["current"] > 0.5)

    own = setting("gas-spring", effect=rough)
    weights = weights_of(own, {})
    assert np.mean(weights[1]) < 0.5 * np.mean(weights[0])
    assert np.sqrt(np.mean(np.concatenate(weights) ** 2)) == pytest.approx(1.0)
