"""The stepping interface gives what a simulation of the whole log gives, whatever the model and its effects."""

from types import SimpleNamespace

import numpy as np
import pytest

from mrfit.apply.damper import Damper, damper
from mrfit.apply.stepper import Stepper, simulate, take
from mrfit.core import registry
from mrfit.core.specs import Array, ModelSpec, Param
from mrfit.errors import DataError
from mrfit.kernels.filters import level
from tests.apply.dampers import MODELS, STEP, channels, controllable, monotone, wandered

# Of the log's range: the branch curve's and Spencer's tolerances
TOLERANCE = {"boucwen": 1e-6, "spencer": 2e-6}
# Effects, parameters, tolerance: what looks ahead over a log (a parabola between samples, the mean of the stroke, the
# first samples of a shifted record) differs by its step
EFFECTS = {
    "current-filter": ({"T": 0.02}, 1e-9),
    "residual-magnetism": ({"w": 0.1}, 1e-9),
    "slow-release": ({"h": 0.4, "tau": 0.05}, 1e-9),
    "current-saturation": ({"q": 0.5}, 1e-9),
    "force-filter": ({"T": 0.004}, 1e-9),
    "asymmetry": ({"g_yield": 0.2}, 1e-9),
    "temperature": ({"b_yield": 0.01}, 1e-9),
    "temperature-polynomial": ({"a1": -0.4, "a2": 0.2}, 1e-9),
    "gas-spring": ({"k_g": 500.0}, 1e-9),
    "inertia": ({"m": 3.0}, 1e-9),
    "end-stop": ({"k_s": 1e4, "x_s": 0.008}, 1e-9),
    "quadratic-drag": ({"c2": 300.0}, 1e-9),
    "force-offset": ({"f_off": 30.0}, 1e-9),
    "gain-drift": ({"g": 0.1}, 1e-9),
    "current-lag": ({"tau": 0.02}, 1e-5),
    "coulomb-friction": ({"fc": 50.0, "r": 1e-4, "v_r": 1e-3}, 1e-3),
    "stribeck": ({"fs": 50.0}, 2e-3),
    "velocity-hysteresis": ({"Omega": 1.0}, 2e-2),
    "delay": ({"tau": 0.004, "s": 0.5}, 5e-3),
}


def log() -> dict[str, Array]:
    t = np.arange(400) * STEP
    x = 0.01 * np.sin(2 * np.pi * 2 * t) + 0.004 * np.sin(2 * np.pi * 5.3 * t)
    x -= level(x)  # the middle of the stroke, which steps take for 0
    v = np.gradient(x, STEP)
    a = np.gradient(v, STEP)
    turning = {"angle": 5 * x, "angular_velocity": 5 * v, "angular_acceleration": 5 * a}
    more = {"current": 0.5 + 0.4 * np.sin(7 * t), "temperature": 30 + 5 * np.sin(t), "time": t}
    return {"displacement": x, "velocity": v, "acceleration": a, **turning, **more}


def error(one: Damper) -> float:
    given = log()
    stepped = simulate(Stepper(one, held=False), given, STEP)
    whole = one.assembly.simulate(np.stack([given[n] for n in one.assembly.spec.inputs]), one.theta, STEP)[0]
    return float(np.max(np.abs(stepped - whole)) / np.ptp(whole))


@pytest.mark.parametrize("name", MODELS)
def test_steps_of_every_model_are_its_simulation(name: str) -> None:
    assert error(controllable(name)) < TOLERANCE.get(name, 1e-12)


@pytest.mark.parametrize("effect", EFFECTS)
def test_steps_of_every_effect_of_a_force_are_its_simulation(effect: str) -> None:
    parameters, tolerance = EFFECTS[effect]
    one = monotone(f"tanh+{effect}", **{f"{effect}.{n}": value for n, value in parameters.items()})
    assert error(one) < tolerance


def test_a_drag_that_falls_with_the_temperature_is_stepped_as_it_is_simulated() -> None:
    one = monotone(
        "tanh+quadratic-drag+temperature",
        **{"quadratic-drag.c2": 300.0, "quadratic-drag.b_drag": 0.02, "temperature.b_viscous": 0.01},
    )
    assert error(one) < 1e-9


def test_every_effect_of_a_force_is_among_them() -> None:
    there = {n for n in registry.names("effect") if "force" in registry.load("effect", n).SPEC.outputs}
    assert there == set(EFFECTS)


@pytest.mark.parametrize("name", ["boucwen", "spencer", "neural-network", "hammerstein-wiener"])
def test_a_step_that_was_tried_leaves_no_trace_and_lanes_do_not_meet(name: str) -> None:
    stepper, rng = Stepper(controllable(name)), np.random.default_rng(3)
    state, following = wandered(stepper, rng, 5)
    first = stepper.step(state, following, STEP).force
    stepper.step(state, channels(rng, 5), STEP)
    np.testing.assert_array_equal(stepper.step(state, following, STEP).force, first)
    lanes = np.array([3, 3, 0])
    chosen = stepper.step(take(state, lanes), {n: c[lanes] for n, c in following.items()}, STEP).force
    np.testing.assert_array_equal(chosen, first[lanes])


def test_steps_of_any_length_agree() -> None:
    # the drive is linear between its samples, so that half steps are the same path
    stepper = Stepper(controllable("spencer"))
    state, following = wandered(stepper, np.random.default_rng(0), 4)
    state = stepper.step(state, {**following, "velocity": 0.1 * following["velocity"]}, STEP).state
    middle = {n: 0.5 * (state.given[n] + following[n]) for n in state.given}
    whole = stepper.step(state, {**following, "current": state.given["current"]}, STEP)
    first = stepper.step(state, {**middle, "current": state.given["current"]}, STEP / 2).state
    halves = stepper.step(first, {**following, "current": state.given["current"]}, STEP / 2)
    np.testing.assert_allclose(halves.force, whole.force, rtol=1e-5, atol=1e-3)


def test_a_model_with_a_memory_of_its_own_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def response(drive: Array, theta: Array, dt: float) -> Array:
        return theta[:, :1] * np.cumsum(drive[0]) * dt + drive[1]

    params = (Param("c", "N*s/m", 1.0, 1e4, 100.0),)
    spec = ModelSpec("smoothing", "", "", "", ("velocity", "current"), "force", params)
    item = SimpleNamespace(SPEC=spec, response=response)
    load = registry.load
    monkeypatch.setattr(registry, "load", lambda kind, name: item if name == "smoothing" else load(kind, name))
    with pytest.raises(DataError, match="^'smoothing' has a memory, and apply knows no steps of it") as raised:
        Stepper(damper("smoothing", {"c": 100.0}))
    assert "\n" not in str(raised.value)
    item.response = lambda drive, theta, dt: theta[:, :1] * drive[0] + drive[1]
    assert simulate(Stepper(damper("smoothing", {"c": 100.0})), log(), STEP).shape == (400,)
