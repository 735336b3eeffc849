"""The stepping interface gives what a simulation of the whole log gives, whatever the model and its effects."""

from types import SimpleNamespace

import numpy as np
import pytest

from mrfit.apply.damper import Damper, damper
from mrfit.apply.stepper import Stepper, simulate
from mrfit.core import registry
from mrfit.core.specs import Array, ModelSpec, Param
from mrfit.errors import DataError
from mrfit.kernels.filters import level, level_of
from tests.apply.dampers import MODELS, STEP, channels, controllable, monotone, wandered
from tests.export.rigs import away

# Effects of a force, and parameters; of others a tenth of the way to their bounds
EFFECTS: dict[str, dict[str, float]] = {
    name: dict(zip((p.name for p in spec.params), away(spec), strict=True))
    for name in registry.names("effect")
    if "force" in (spec := registry.load("effect", name).SPEC).outputs
} | {
    "current-filter": {"T": 0.02, "tau": 0.0033},
    "residual-magnetism": {"w": 0.1},
    "slow-release": {"h": 0.4, "tau": 0.05},
    "current-saturation": {"q": 0.5},
    "force-filter": {"T": 0.004},
    "asymmetry": {"g_yield": 0.2},
    "temperature": {"b_yield": 0.01},
    "temperature-polynomial": {"a1": -0.4, "a2": 0.2},
    "gas-spring": {"k_g": 500.0},
    "inertia": {"m": 3.0},
    "end-stop": {"k_s": 1e4, "x_s": 0.008},
    "quadratic-drag": {"c2": 300.0},
    "force-offset": {"f_off": 30.0},
    "gain-drift": {"g": 0.1},
    "current-lag": {"tau": 0.02, "t_d": 0.0037},
    "coulomb-friction": {"fc": 50.0, "r": 1e-4, "v_r": 1e-3},
    "stribeck": {"fs": 50.0},
    "velocity-hysteresis": {"Omega": 1.0, "w": 0.02},
    "delay": {"tau": 0.0043, "s": 0.5},
}
ALL = "tanh+delay+force-filter+gain-drift+current-lag+coulomb-friction+temperature+asymmetry+slow-release"


def log(kind: str) -> tuple[dict[str, Array], float | Array]:
    """Return channels and steps of a stroke, a rough road or jittered samples, under a current that moves."""
    rng, steps = np.random.default_rng(0), np.full(400, STEP)
    if kind == "jittered":
        steps = STEP * rng.uniform(0.5, 1.5, 400)
    t = np.concatenate([[0.0], np.cumsum(steps[1:])])
    x = 0.01 * np.sin(2 * np.pi * 2 * t) + 0.004 * np.sin(2 * np.pi * 5.3 * t)
    if kind == "road":
        x = 2e-4 * np.cumsum(rng.normal(size=400))
    v = np.gradient(x, t)
    a = np.gradient(v, t)
    turning = {"angle": 5 * x, "angular_velocity": 5 * v, "angular_acceleration": 5 * a}
    current = np.where(t < 0.2, 0.1, 0.9) if kind == "road" else 0.5 + 0.4 * np.sin(63 * t)
    more = {"current": current, "temperature": 30 + 5 * np.sin(t), "time": t}
    return {
        "displacement": x,
        "velocity": v,
        "acceleration": a,
        **turning,
        **more,
    }, STEP if kind != "jittered" else steps


def error(one: Damper, kind: str = "sine") -> float:
    given, dt = log(kind)
    if "velocity-hysteresis" in one.model:  # the middle of the stroke, which steps take for 0
        given["displacement"] -= (
            level(given["displacement"]) if kind != "jittered" else level_of(given["displacement"], dt)
        )
    stepped = simulate(Stepper(one, held=False), given, dt)
    drive = np.stack([given[n] for n in one.assembly.spec.inputs])
    whole = one.assembly.simulate(drive, one.theta, dt)[0]
    return float(np.max(np.abs(stepped - whole)) / np.ptp(whole))


@pytest.mark.parametrize("kind", ["sine", "road", "jittered"])
@pytest.mark.parametrize("name", MODELS)
def test_steps_of_every_model_are_its_simulation(name: str, kind: str) -> None:
    assert error(controllable(name), kind) < 1e-9


@pytest.mark.parametrize("kind", ["sine", "road", "jittered"])
@pytest.mark.parametrize("effect", EFFECTS)
def test_steps_of_every_effect_of_a_force_are_its_simulation(effect: str, kind: str) -> None:
    one = monotone(f"tanh+{effect}", **{f"{effect}.{n}": value for n, value in EFFECTS[effect].items()})
    assert error(one, kind) < 1e-9


@pytest.mark.parametrize("kind", ["sine", "road", "jittered"])
def test_a_chain_of_effects_is_stepped_in_its_order(kind: str) -> None:
    values = {f"{e}.{n}": v for e in ALL.split("+")[1:] for n, v in EFFECTS[e].items()}
    assert error(monotone(ALL, **values), kind) < 1e-9
    names = ("coulomb-friction", "gas-spring", "current-lag", "gain-drift")
    own = {p.name: p.start for p in registry.load("model", "hammerstein-wiener").SPEC.params}
    own |= {f"{e}.{n}": v for e in names for n, v in EFFECTS[e].items()}
    assert error(damper("+".join(["hammerstein-wiener", *names]), own), kind) < 1e-9


def test_the_element_of_a_shape_that_holds_is_stepped_along_its_branch_curve() -> None:
    values = {p.name: p.start for p in registry.load("model", "boucwen").SPEC.params if p.name != "alpha"}
    one = damper("boucwen", {**values, "alpha@0A": 100.0, "alpha@1A": 900.0}, {"alpha": 1})
    assert error(one) < 1e-12


def test_of_a_stroke_about_another_middle_the_memory_of_velocity_differs_by_its_definition() -> None:
    one = monotone("tanh+velocity-hysteresis", **{"velocity-hysteresis.Omega": 5.0})
    given, dt = log("sine")
    given["displacement"] += 0.002
    stepped = simulate(Stepper(one, held=False), given, dt)
    whole = one.assembly.simulate(np.stack([given[n] for n in one.assembly.spec.inputs]), one.theta, dt)[0]
    assert np.max(np.abs(stepped - whole)) > 1e-3 * np.ptp(whole)


def test_a_drag_that_falls_with_the_temperature_is_stepped_as_it_is_simulated() -> None:
    one = monotone(
        "tanh+quadratic-drag+temperature",
        **{"quadratic-drag.c2": 300.0, "quadratic-drag.b_drag": 0.02, "temperature.b_viscous": 0.01},
    )
    assert error(one) < 1e-9


@pytest.mark.parametrize("name", ["boucwen", "spencer", "neural-network", "hammerstein-wiener"])
def test_a_step_that_was_tried_leaves_no_trace_and_lanes_do_not_meet(name: str) -> None:
    stepper, rng = Stepper(controllable(name)), np.random.default_rng(3)
    state, following = wandered(stepper, rng, 5)
    first = stepper.step(state, following, STEP).force
    stepper.step(state, channels(rng, 5), STEP)
    np.testing.assert_array_equal(stepper.step(state, following, STEP).force, first)
    lanes = np.array([3, 3, 0])
    chosen = stepper.step(state[lanes], {n: c[lanes] for n, c in following.items()}, STEP).force
    np.testing.assert_array_equal(chosen, first[lanes])


def test_steps_of_any_length_agree() -> None:
    # the drive is linear between its samples, so that half steps are the same path
    stepper = Stepper(controllable("spencer"))
    state, following = wandered(stepper, np.random.default_rng(0), 4)
    state = stepper.step(state, {**following, "velocity": 0.1 * following["velocity"]}, STEP).state
    known = dict(zip(stepper.inputs, state.T, strict=False))
    middle = {n: 0.5 * (value + following[n]) for n, value in known.items()}
    whole = stepper.step(state, {**following, "current": known["current"]}, STEP)
    first = stepper.step(state, {**middle, "current": known["current"]}, STEP / 2).state
    halves = stepper.step(first, {**following, "current": known["current"]}, STEP / 2)
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
    assert simulate(Stepper(damper("smoothing", {"c": 100.0})), log("sine")[0], STEP).shape == (400,)
