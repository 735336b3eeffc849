"""The generic loop against fast paths at equal steps, and against itself where samples are added on a line."""

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.core.specs import Array
from mrfit.kernels.elements import response_of
from mrfit.simulate.assembly import assemble

N, DT = 500, 1e-3
T = DT * np.arange(N)
CHANNELS = {
    "displacement": 0.01 * np.sin(20 * T) + 0.002 * np.sin(101 * T),
    "velocity": 0.2 * np.cos(20 * T) + 0.2 * np.cos(101 * T),
    "current": 0.5 + 0.4 * np.sin(63 * T) + 0.3 * (np.sin(9 * T) > 0),
}
EVEN = np.full(N, DT)
EFFECTS = {
    "slow-release": (0.4, 0.05),
    "current-filter": (0.02, 0.15, 0.3, 0.0033),
    "current-lag": (0.02, 0.0037),
    "velocity-hysteresis": (0.0, 0.05),
    "coulomb-friction": (50.0, 1e-4, 0.6, 1e-3),
    "stribeck": (50.0, 0.02, 2.0, 2e-5, 0.5, 3e-4),
    "force-filter": (0.004, 0.5, 0.25, 0.125, 0.375, 0.7),
    "delay": (0.006, 0.4),
}
MODELS = ("spencer", "neural-network", "hammerstein-wiener", "boucwen")


def acted(name: str, theta: Array, dt: float | Array) -> Array:
    effect = registry.load("effect", name)
    given = {n: CHANNELS[n] for n in effect.SPEC.inputs}
    if effect.SPEC.slot == "input":
        return np.asarray(next(iter(effect.transform(given, theta, dt).values())))
    if effect.SPEC.slot == "add":
        return np.asarray(effect.term(given, theta[None], dt)[0])
    return np.asarray(effect.shape(CHANNELS["velocity"][None], given, theta[None], dt)[0])


@pytest.mark.parametrize("name", EFFECTS)
def test_steps_of_an_effect_are_its_filter_at_equal_steps(name: str) -> None:
    theta = np.array(EFFECTS[name])
    fast = acted(name, theta, DT)
    assert np.abs(acted(name, theta, EVEN) - fast).max() < 1e-9 * np.ptp(fast)


@pytest.mark.parametrize("name", ["backlash", "degradation", "delay", "force-filter"])
def test_outputs_in_any_order_in_memory_are_changed_each_by_its_own_parameters(name: str) -> None:
    effect = registry.load("effect", name)
    given = {n: (CHANNELS | {"time": T})[n] for n in effect.SPEC.inputs}
    low, high = np.array([(p.low, p.high) for p in effect.SPEC.params]).T
    theta = low + (high - low) * np.random.default_rng(2).uniform(0.1, 0.4, size=(3, len(low)))
    outputs = np.array([[1.0], [-2.0], [30.0]]) * CHANNELS["velocity"]
    each = [effect.shape(outputs[k : k + 1], given, theta[k : k + 1], EVEN)[0] for k in range(3)]
    assert np.array_equal(effect.shape(np.asfortranarray(outputs), given, theta, EVEN), each)


@pytest.mark.parametrize("name", MODELS)
def test_steps_of_a_model_are_its_fast_path(name: str) -> None:
    model = registry.load("model", name)
    spec = model.SPEC
    drive = np.stack([CHANNELS[n] for n in spec.inputs])
    theta = spec.start[None] * np.array([[1.0], [1.1]])
    stepped = response_of(spec, model.rest, model.step, getattr(model, "LATE", 0), getattr(model, "OWN", 0))
    # the branch curve is good to 3e-7, for n up to 2 to 2e-8
    bound = 2e-8 if name == "boucwen" else 1e-9
    fast = model.response(drive, theta, DT)
    assert np.abs(stepped(drive, theta, EVEN) - fast).max() < bound * np.ptp(fast)


def test_steps_of_spencer_are_its_lanes_under_moving_parameters() -> None:
    model = registry.load("model", "spencer")
    drive = np.stack([CHANNELS[n] for n in model.SPEC.inputs])
    # more vectors than lanes, every parameter on its own way, one held
    theta = model.SPEC.start[:, None] * np.ones((9, 1, N))
    theta *= 1.0 + 0.2 * np.random.default_rng(3).uniform(size=(9, 10, 1)) * CHANNELS["current"]
    theta[4] = theta[4][:, :1]
    fast = model.response(drive, theta, DT)
    steps = response_of(model.SPEC, model.rest, model.step)(drive, theta, EVEN)
    assert np.abs(steps - fast).max() < 1e-9 * np.ptp(fast)


@pytest.mark.parametrize("name", ["lugre", "spencer", "tanh+current-filter", "tanh+slow-release", "tanh+force-filter"])
def test_samples_added_on_a_line_are_not_felt(name: str) -> None:
    rng, model = np.random.default_rng(1), assemble(name)
    times = np.cumsum(rng.uniform(1e-3, 4e-3, 40))
    every = np.sort(np.concatenate([times, rng.uniform(times[0], times[-1], 80)]))
    values = {p.name: p.start for p in model.spec.params} | {
        "current-filter.T": 0.01, "slow-release.h": 0.4, "force-filter.T": 0.01, "C0": 1e4, "dF": 0.01, "a1": 1e-6,
    }  # fmt: skip
    theta = model.spec.theta({n: values[n] for n in model.spec.names})[None]
    drive = 0.1 * rng.normal(size=(len(model.spec.inputs), 40))
    if "displacement" in model.spec.inputs:
        drive[model.spec.inputs.index("displacement")] = 0.0
    more = np.stack([np.interp(every, times, row) for row in drive])
    coarse, fine = (np.diff(t, prepend=t[0] - 1e-3) for t in (times, every))
    at = np.searchsorted(every, times)
    one, both = model.simulate(drive, theta, coarse)[0], model.simulate(more, theta, fine)[0, at]
    assert np.abs(both - one).max() < (1e-4 if name == "spencer" else 1e-6) * np.ptp(one)


def test_a_lag_of_a_parabola_is_its_closed_form() -> None:
    steps = np.random.default_rng(7).uniform(1e-4, 3e-3, 400)
    times, tau = np.concatenate([[0.0], np.cumsum(steps[1:])]), 0.02
    lag = registry.load("effect", "current-lag")
    found = lag.transform({"current": times**2}, np.array([tau, 0.0]), steps)["current"]
    exact = times**2 - 2.0 * tau * (times - tau * (1.0 - np.exp(-times / tau)))
    # at the first sample no second derivative is known: half a step's bend, which is forgotten
    assert np.abs(found - exact)[times > 0.3].max() < 1e-6 * np.ptp(exact)
