"""Steps from neutral, shapes that are tried, and what screening makes of sensitivities: no model is simulated."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.core.specs import Array, EffectSpec, Param
from mrfit.discover.evidence import gather
from mrfit.discover.evidence.bench import Bench
from mrfit.discover.evidence.refit import Fitter, Refit
from mrfit.discover.evidence.screen import (
    ScreenedEffect,
    _Data,
    _gain,
    _screening,
    _shape_grid,
    _steps,
    _trial_values,
    _within,
    cosines,
    is_law_of_current,
    is_level,
    reach,
    unjudgeable,
)
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.questions import Candidate
from mrfit.simulate.assembly import assemble


def spec(name: str) -> EffectSpec:
    found: EffectSpec = registry.load("effect", name).SPEC
    return found


def fitter(largest: float = 700.0) -> Fitter:
    bench = cast(Bench, SimpleNamespace(largest=largest))
    return Fitter(bench, "tanh", None, {}, {}, lambda effects, point: None)


MASS = spec("inertia")
(BOUNDS,) = ((p.low, p.high) for p in MASS.params)


def test_a_step_ends_at_the_bounds_of_a_strength_and_one_that_they_forbid_is_none() -> None:
    one_sided = replace(MASS, params=(replace(MASS.params[0], low=0.0, high=50.0),))
    for step, taken in ((2.0, 2.0), (90.0, 50.0), (-1.0, 0.0)):
        assert _within(one_sided, np.array([step])).tolist() == [taken]
    # from a neutral value elsewhere it is the way to the bound
    gain = replace(one_sided, neutral=(20.0,))
    for step, taken in ((2.0, 2.0), (90.0, 30.0), (-25.0, -20.0)):
        assert _within(gain, np.array([step])).tolist() == [taken]


def test_a_gain_is_the_share_of_the_squared_error_along_a_change() -> None:
    rng = np.random.default_rng(1)
    errors, change = rng.standard_normal((2, 50))
    # the error that is left is least at the best multiple of the change
    best = -float(errors @ change) / float(change @ change)
    left = float(np.sum((errors + best * change) ** 2)) / float(errors @ errors)
    change *= np.sign(best)
    assert _gain(errors, change) == pytest.approx(1.0 - left)
    assert _gain(errors, -change) == 0.0 == _gain(errors, 0.0 * change)


def test_a_refit_starts_at_the_step_or_a_little_off_neutral() -> None:
    errors = np.sin(np.arange(200) / 3.0)
    data = _Data(errors, [120, 80], np.empty((200, 0)), STANDARD)
    found = _screening(MASS, {}, np.array([3.0]), -0.5 * errors, data).candidate
    assert found.start == {"inertia.m": 3.0} and found.gain == pytest.approx(1.0)
    still = _screening(MASS, {}, np.array([0.0]), 0.0 * errors, data).candidate
    assert still.start == {"inertia.m": pytest.approx(1e-4 * (BOUNDS[1] - BOUNDS[0]))}
    assert (still.gain, still.strength) == (0.0, 0.0)


def test_shapes_are_tried_over_their_decades_levels_over_what_was_measured() -> None:
    speed = next(p for p in spec("stribeck").params if p.role == "shape" and p.scale == "log")
    values = _trial_values(speed, fitter())
    assert len(values) == STANDARD.screened_shapes
    ratios = np.diff(np.log([speed.low, *values, speed.high]))
    np.testing.assert_allclose(ratios, ratios[0])
    level = next(p for p in spec("relief-valve").params if is_level(p, "force"))
    np.testing.assert_allclose(_trial_values(level, fitter(700.0)), 700.0 * np.arange(1, 6) / 6.0)
    # no lower than a level can be
    assert min(_trial_values(level, fitter(0.1 * level.low))) == level.low


def test_a_shape_of_either_sign_is_tried_on_both_sides_and_another_at_its_start_only() -> None:
    signed = Param("q", "1", -2.0, 2.0, 0.3, role="shape")
    assert _trial_values(signed, fitter()) == pytest.approx([0.3, 0.04, -0.04, 0.2, -0.2, 1.0, -1.0])
    assert _trial_values(replace(signed, low=-1.0), fitter()) == []


@pytest.mark.parametrize(
    ("param", "level"),
    [
        (Param("F_o", "N", 1.0, 1e4, 100.0, scale="log", role="shape"), True),
        (Param("F_o", "N", 1.0, 1e4, 100.0, role="shape"), False),
        (Param("F_o", "N", 1.0, 1e4, 100.0, scale="log"), False),
        (Param("v_o", "m/s", 1e-3, 1.0, 0.1, scale="log", role="shape"), False),
    ],
)
def test_a_level_is_a_logarithmic_shape_in_the_unit_of_the_output(param: Param, level: bool) -> None:
    assert is_level(param, "force") is level
    assert not is_level(param, "torque")


def test_one_shape_is_tried_the_others_stay_at_their_start() -> None:
    grid = _shape_grid(spec("relief-valve"), fitter())
    shapes = [p for p in spec("relief-valve").params if p.role == "shape"]
    assert len(grid) == STANDARD.screened_shapes
    for row in grid:
        assert set(row) == {f"relief-valve.{p.name}" for p in shapes}
        assert sum(row[f"relief-valve.{p.name}"] != p.start for p in shapes) <= 1
    assert _shape_grid(MASS, fitter()) == [{}]


def test_what_changes_an_input_is_tried_at_steps_of_every_size() -> None:
    assert _steps(MASS) == [STANDARD.screening_step]
    assert _steps(spec("residual-magnetism")) == [STANDARD.screening_step, *STANDARD.screened_signed_shapes]


def test_only_a_change_of_the_current_at_once_may_be_a_law_of_current() -> None:
    found = {n for n in registry.names("effect") if is_law_of_current(spec(n))}
    assert "current-saturation" in found
    assert not found & {"current-lag", "residual-magnetism", "free-play", "inertia", "temperature"}


def screened(*columns: Array, direction: Array | None = None) -> ScreenedEffect:
    own = np.column_stack(columns) if columns else np.empty((0, 0))
    return ScreenedEffect(Candidate("a"), np.empty(0) if direction is None else direction, own)


def test_together_effects_reach_what_a_regression_on_all_their_columns_takes() -> None:
    rng = np.random.default_rng(2)
    parts, columns = [rng.standard_normal(31), rng.standard_normal(20)], rng.standard_normal((3, 17))
    fit = cast(Refit, SimpleNamespace(train=parts))
    errors = np.concatenate(parts)[::3]
    left = errors - columns.T @ np.linalg.lstsq(columns.T, errors, rcond=None)[0]
    two = [screened(columns[0], columns[1]), screened(columns[2]), screened()]
    assert reach(two, fit, 3) == pytest.approx(1.0 - float(left @ left) / float(errors @ errors))
    assert reach([screened()], fit, 3) == 0.0


def test_an_effect_without_a_direction_is_like_no_other() -> None:
    one, other = np.array([1.0, 0.0]), np.array([0.6, 0.8])
    found = cosines([screened(direction=one), screened(), screened(direction=-other)])
    np.testing.assert_allclose(found, [[1.0, 0.0, -0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 1.0]])


def held(*currents: Array) -> Bench:
    stretches = [
        SimpleNamespace(channel=lambda name, c=c: c if name == "current" else np.arange(3.0)) for c in currents
    ]
    channels = {"displacement", "velocity", "current", "acceleration"}
    return cast(Bench, SimpleNamespace(stretches=stretches, channels=channels))


@pytest.mark.parametrize(("moves", "judged"), [(0.051, True), (0.049, False)])
def test_an_effect_that_remembers_the_current_needs_one_that_moves_by_more_than_a_twentieth(
    moves: float, judged: bool
) -> None:
    """Of the largest current of all tests, which are judged together."""
    bench = held(np.array([2.0, 2.0]), np.array([0.0, 2.0 * moves]))
    said = unjudgeable(bench, spec("current-lag"))
    assert (said == "") is judged
    assert judged or said == "cannot be judged: every test holds the current"
    assert unjudgeable(bench, spec("inertia")) == ""


def test_a_channel_that_is_lacking_is_named() -> None:
    lacking = cast(Bench, SimpleNamespace(stretches=(), channels={"velocity"}))
    assert unjudgeable(lacking, spec("inertia")) == f"cannot be judged: no {spec('inertia').inputs[0]}"


def test_a_start_is_so_many_times_the_distance_that_screening_found_within_the_bounds() -> None:
    """Shapes start where they were screened."""
    params = {p.name: p for p in assemble("tanh+stribeck").spec.params}
    fs, vs = params["stribeck.fs"], params["stribeck.vs"]
    candidate = Candidate("stribeck", start={"stribeck.fs": 0.1 * fs.high, "stribeck.vs": 0.05})
    near = gather._scaled(fitter(), candidate, 0.1)
    assert near == {"stribeck.fs": pytest.approx(0.01 * fs.high), "stribeck.vs": 0.05}
    assert gather._scaled(fitter(), candidate, 30.0)["stribeck.fs"] == fs.high
    assert vs.role == "shape"
