"""Bounds follow the size of the output where it is beyond what a model's own are meant for, and only there."""

import numpy as np
import pytest

import mrfit
from mrfit.core import registry
from mrfit.fit.bounds import bounds_of_size
from mrfit.fit.select import doubtful_channels
from mrfit.io.keys import fit_key

TIME = np.arange(1500) * 0.004
PARAMETERS = {"fy": 400.0, "c": 900.0, "f0": 30.0}


def log(scale: float = 1.0, velocity: float = 1.0) -> mrfit.Recording:
    """Return two amplitudes of a sine in one record, of a tanh law whose force is so many times the usual."""
    x = 0.01 * np.sin(2.0 * np.pi * TIME)
    v = 0.02 * np.pi * np.cos(2.0 * np.pi * TIME)
    noise = np.random.default_rng(1).standard_normal(len(TIME))
    force = 400.0 * np.tanh(60.0 * v) + 900.0 * v + 30.0 + noise
    return mrfit.Recording.from_arrays(dt=0.004, name="log", displacement=x, velocity=velocity * v, force=scale * force)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3, 1e4])
def test_a_force_of_any_size_gives_parameters_of_that_size(scale: float) -> None:
    fit = mrfit.fit(log(scale), model="tanh", fixed={"k": 0.0, "a2": 0.0}, holdout="none", budget=3000)
    for name, value in PARAMETERS.items():
        assert fit.params.loc[name, "value"] == pytest.approx(scale * value, rel=0.05), name
    assert "at-bound" not in {w.kind for w in fit.warnings}


@pytest.mark.parametrize(
    ("scale", "factor"), [(1.0, None), (100.0, None), (1e3, 10.0), (1e4, 100.0), (1e-1, None), (1e-3, 0.01)]
)
def test_bounds_move_by_powers_of_ten_and_only_where_they_must(scale: float, factor: float | None) -> None:
    spec = registry.load("model", "tanh").SPEC
    found = {name: (low, high) for name, low, high in bounds_of_size(spec, [log(scale)])}
    assert set(found) == (set() if factor is None else {"fy", "c", "k", "f0"})
    if factor and factor > 1.0:
        assert found["fy"] == (1.0, 1e6 * factor) and found["f0"] == (-1e5 * factor, 1e5 * factor)
    elif factor:
        assert found["fy"] == (pytest.approx(factor), 1e6) and found["f0"] == (-1e5, 1e5)


def test_bounds_that_were_given_stay() -> None:
    fit = mrfit.fit(log(1e3), model="tanh", bounds={"fy": (1.0, 2e5)}, holdout="none", budget=500)
    assert fit.params.loc["fy", "value"] <= 2e5 * (1.0 + 1e-9)


@pytest.mark.parametrize(("value", "warned"), [(1e6, False), (2e6, True), (-0.5, True), (0.0, True)])
def test_a_parameter_held_outside_its_bounds_is_a_warning_of_the_fit(value: float, warned: bool) -> None:
    fit = mrfit.fit(log(), model="tanh", fixed={"fy": value}, holdout="none", budget=200)
    told = [w.text for w in fit.warnings if w.kind == "held-outside"]
    text = f"fy is held at {value:g}, outside its bounds of 1 to 1e+06 N" + "; check its unit" * (value != 0.0)
    assert told == [text] * warned


def test_a_velocity_in_a_wrong_unit_is_a_warning_of_the_fit() -> None:
    wrong = mrfit.fit(log(velocity=1e3), model="bingham", holdout="none", budget=300)
    (told,) = [w for w in wrong.warnings if w.kind == "velocity-differs"]
    assert told.text.startswith("velocity is 1000 times the slope of displacement")
    right = mrfit.fit(log(), model="bingham", holdout="none", budget=300)
    assert "velocity-differs" not in {w.kind for w in right.warnings}
    assert doubtful_channels([log(velocity=1e3)], {"displacement", "force"}) == []


def test_a_fit_is_the_same_under_any_name() -> None:
    settings = {"model": "tanh", "optimizer": "auto", "name": "", "jobs": 1}
    key = fit_key(settings, {}, [])
    assert (
        fit_key({**settings, "name": "tanh.auto"}, {}, []) == key != fit_key({**settings, "optimizer": "lsq"}, {}, [])
    )
