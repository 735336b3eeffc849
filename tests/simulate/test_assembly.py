"""Assemblies against direct evaluation: dependence on current, the order of the chain, what may be joined."""

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.core.specs import EffectSpec
from mrfit.effects import current_lag, current_saturation, residual_magnetism, velocity_hysteresis
from mrfit.errors import ConfigError
from mrfit.models import bingham, tanh
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence

DT = 1e-3
LINEAR = CurrentDependence((("fy", 1), ("C_inf", 1)), 0.0, 2.0)


def motion(count: int = 800) -> tuple[np.ndarray, np.ndarray]:
    t = np.arange(count) * DT
    x = 0.01 * np.sin(2 * np.pi * 3 * t) + 0.004 * np.sin(2 * np.pi * 7.1 * t)
    return x, np.gradient(x, DT)


def random_theta(name: str, count: int, dependence: CurrentDependence | None = None) -> np.ndarray:
    """Return parameter vectors around the start values, offsets and neutrals included."""
    spec, rng = assemble(name, dependence).spec, np.random.default_rng(2)
    low, high = np.array([(p.low, p.high) for p in spec.params]).T
    theta = spec.start * rng.uniform(0.5, 1.5, (count, len(low))) + 1e-3 * rng.uniform(-1, 1, (count, len(low)))
    return np.clip(theta, low, high)


def test_a_base_alone_is_the_model_itself() -> None:
    x, v = motion()
    theta = random_theta("tanh", 4)
    whole = assemble("tanh")
    assert whole.spec is tanh.SPEC
    assert np.array_equal(whole.simulate(np.stack([x, v]), theta, DT), tanh.response(np.stack([x, v]), theta, DT))


@pytest.mark.parametrize(
    "dependence", [None, CurrentDependence((), 0.0, 1.0), CurrentDependence((("fy", 0),), 0.0, 1.0)]
)
def test_order_0_is_the_base(dependence: CurrentDependence | None) -> None:
    assert assemble("bingham", dependence).spec is bingham.SPEC


@pytest.mark.parametrize("current", [0.0, 0.35, 2.0])
def test_constant_current_gives_the_base_with_interpolated_parameters(current: float) -> None:
    _, v = motion()
    theta = np.array([[100.0, 900.0, 400.0, 600.0, 12.0]])
    found = assemble("bingham", LINEAR).simulate(np.stack([v, np.full(len(v), current)]), theta, DT)
    direct = bingham.response(v[None], np.array([[100 + 400 * current, 400 + 100 * current, 12.0]]), DT)
    assert np.allclose(found, direct, rtol=1e-13)


def test_moving_current_gives_every_sample_its_own_parameters() -> None:
    x, v = motion()
    current = 1 + np.cos(np.arange(len(v)) / 40)
    dependence = CurrentDependence((("fy", 2), ("a1", 1)), 0.0, 2.0)
    theta = np.array([[80.0, 500.0, 700.0, 40.0, 160.0, 60.0, 900.0, 200.0, -5.0]])
    found = assemble("tanh", dependence).simulate(np.stack([x, v, current]), theta, DT)[0]
    for j in range(0, len(v), 97):
        fy = np.polyval(np.polyfit([0.0, 1.0, 2.0], [80.0, 500.0, 700.0], 2), current[j])
        a1 = 40.0 * 4.0 ** (current[j] / 2)
        here = np.array([[fy, a1, 60.0, 900.0, 200.0, -5.0]])
        assert found[j] == pytest.approx(tanh.response(np.stack([x, v])[:, j : j + 1], here, DT)[0, 0], rel=1e-11)


def test_effect_parameters_come_after_the_base_s_under_the_effect_s_name() -> None:
    spec = assemble("bingham+current-lag+delay", LINEAR).spec
    assert spec.names == (
        "fy@0A",
        "fy@2A",
        "C_inf@0A",
        "C_inf@2A",
        "f0",
        "current-lag.tau",
        "current-lag.t_d",
        "delay.tau",
        "delay.s",
    )
    assert spec.inputs == ("velocity", "current")
    for p in spec.params:
        assert p.low <= p.start <= p.high
    assert assemble("bingham+current-lag+delay", LINEAR).name == "bingham+current-lag+delay"


def test_inputs_an_effect_needs_are_added_once() -> None:
    inputs = assemble("bingham+gas-spring+inertia+temperature+quadratic-drag").spec.inputs
    assert inputs[0] == "velocity"
    assert sorted(inputs) == ["acceleration", "displacement", "temperature", "velocity"]
    assert assemble("tanh+velocity-hysteresis").spec.inputs == ("displacement", "velocity")


@pytest.mark.parametrize("written", ["delay+inertia+velocity-hysteresis", "inertia+velocity-hysteresis+delay"])
def test_effects_act_in_the_order_of_their_slots_whatever_the_order_of_writing(written: str) -> None:
    x, v = motion()
    a = np.gradient(v, DT)
    whole = assemble(f"bingham+{written}")
    own = {
        "velocity-hysteresis.Omega": 4.0,
        "velocity-hysteresis.w": 0.01,
        "inertia.m": 3.0,
        "delay.tau": 5e-3,
        "delay.s": 0.0,
        "fy": 300.0,
        "C_inf": 800.0,
        "f0": 7.0,
    }
    drive = {"velocity": v, "displacement": x, "acceleration": a}
    theta = np.array([[own[n] for n in whole.spec.names]])
    found = whole.simulate(np.stack([drive[n] for n in whole.spec.inputs]), theta, DT)[0]
    changed = velocity_hysteresis.transform({"displacement": x, "velocity": v}, np.array([4.0, 0.01]), DT)["velocity"]
    force = bingham.response(changed[None], np.array([[300.0, 800.0, 7.0]]), DT)[0] + 3.0 * a
    assert np.allclose(found[5:], force[:-5], rtol=1e-12)
    assert (found[:5] == force[0]).all()


@pytest.mark.parametrize("written", ["current-lag+current-saturation", "current-saturation+current-lag"])
def test_effects_of_one_slot_act_in_the_order_of_their_names(written: str) -> None:
    current = np.where(np.arange(400) < 100, 0.1, 1.5)
    whole = assemble(f"bingham+{written}", LINEAR)
    assert whole.spec.names[-3:] == ("current-lag.t_d", "current-saturation.q", "current-saturation.p")
    theta = np.array([[100.0, 900.0, 400.0, 600.0, 0.0, 0.03, 0.0, 0.5, 2.0]])
    found = whole.simulate(np.stack([np.ones(400), current]), theta, DT)
    lagged = current_lag.transform({"current": current}, np.array([0.03, 0.0]), DT)
    field = current_saturation.transform(lagged, np.array([0.5, 2.0]), DT)["current"]
    assert np.allclose(found[0], 500 + 500 * field, rtol=1e-12)


@pytest.mark.parametrize("written", ["current-lag+residual-magnetism", "residual-magnetism+current-lag"])
def test_the_core_remembers_before_the_field_lags(written: str) -> None:
    current = np.where(np.arange(400) // 100 % 2 == 0, 0.1, 1.5)
    whole = assemble(f"bingham+{written}", LINEAR)
    assert whole.spec.names[-3:] == ("residual-magnetism.w", "current-lag.tau", "current-lag.t_d")
    theta = np.array([[100.0, 900.0, 400.0, 600.0, 0.0, 0.2, 0.03, 0.0]])
    found = whole.simulate(np.stack([np.ones(400), current]), theta, DT)
    remembered = residual_magnetism.transform({"current": current}, np.array([0.2]), DT)
    field = current_lag.transform(remembered, np.array([0.03, 0.0]), DT)["current"]
    direct = assemble("bingham", LINEAR).simulate(np.stack([np.ones(400), field]), theta[:, :5], DT)
    assert np.allclose(found, direct, rtol=1e-13)


def test_points_that_share_their_input_effects_give_what_they_give_one_by_one() -> None:
    x, v = motion()
    current = 1 + np.cos(np.arange(len(v)) / 40)
    name, dependence = "tanh+current-lag+velocity-hysteresis", CurrentDependence((("fy", 1),), 0.0, 2.0)
    whole, theta = assemble(name, dependence), random_theta(name, 12, CurrentDependence((("fy", 1),), 0.0, 2.0))
    theta[:, -4:] = [[0.0, 0.0, 0.0, 0.0], [0.02, 0.0, 0.0, 0.0], [0.02, 0.003, 3.0, 0.0]] * 4
    drive = np.stack([x, v, current])
    singly = np.vstack([whole.simulate(drive, row[None], DT) for row in theta])
    assert np.abs(whole.simulate(drive, theta, DT) - singly).max() <= 1e-12 * np.abs(singly).max()


def test_temperature_scales_parameters_that_also_depend_on_current() -> None:
    _, v = motion()
    current, temperature = np.full(len(v), 1.2), np.linspace(25.0, 75.0, len(v))
    whole = assemble("bingham+temperature", LINEAR)
    assert whole.spec.inputs == ("velocity", "current", "temperature")
    theta = np.array([[100.0, 900.0, 400.0, 600.0, 12.0, 0.01, 0.002]])
    found = whole.simulate(np.stack([v, current, temperature]), theta, DT)[0]
    fy, c = 580.0 * np.exp(-0.01 * (temperature - 25)), 520.0 * np.exp(-0.002 * (temperature - 25))
    assert np.allclose(found, 12.0 + fy * np.sign(v) + c * v, rtol=1e-12)


def test_a_role_the_base_does_not_have_changes_nothing() -> None:
    base, whole = assemble("rotational-hybrid"), assemble("rotational-hybrid+temperature")
    assert "viscous" not in {p.role for p in base.spec.params}
    rng = np.random.default_rng(0)
    drive = np.vstack([rng.normal(size=(2, 50)), np.linspace(0, 80, 50)])
    theta = np.array([[*base.spec.start, 0.0, 0.03]])
    assert np.array_equal(whole.simulate(drive, theta, DT), base.simulate(drive[:2], theta[:, :-2], DT))


def test_start_values_of_the_data_pass_through_dependence_and_effects() -> None:
    x, v = motion()
    output = tanh.response(np.stack([x, v]), tanh.SPEC.start[None], DT)[0]
    plain = assemble("tanh").start_values(np.stack([x, v]), output, DT)
    whole = assemble("tanh+delay", CurrentDependence((("fy", 2),), 0.0, 2.0))
    found = whole.start_values(np.stack([x, v, np.ones(len(v))]), output, DT)
    assert found["fy@0A"] == found["fy@1A"] == found["fy@2A"] == plain["fy"]
    assert found["c"] == plain["c"]
    assert "delay.tau" not in found


def test_derived_quantities_of_the_base_survive_effects() -> None:
    base, whole = assemble("boucwen-flux"), assemble("boucwen-flux+eddy-current")
    theta = np.column_stack([base.spec.start[None], [1e-3]])
    assert np.array_equal(whole.derived(theta), base.derived(base.spec.start[None]))
    assert whole.spec.derived == base.spec.derived
    assert assemble("bingham+delay").derived(np.zeros((3, 4))).shape == (3, 0)


def test_effects_are_no_longer_independent_of_rate() -> None:
    assert assemble("boucwen-flux").spec.rate_independent
    assert not assemble("boucwen-flux+eddy-current").spec.rate_independent


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("tanh+curent-lag", "did you mean current-lag"),
        ("tan+delay", "did you mean tanh"),
        ("tanh+", "unknown effect ''"),
        ("tanh+delay+delay", "names the effect delay twice"),
        ("boucwen-flux+delay", "delay acts on force or torque, not on flux"),
        ("tanh+eddy-current", "eddy-current acts on flux, not on force"),
        ("rotational-erf+inertia", "inertia acts on force, not on torque"),
    ],
)
def test_what_cannot_be_joined_is_refused_with_the_reason(name: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        assemble(name)


@pytest.mark.parametrize("name", registry.names("effect"))
def test_every_effect_refuses_outputs_it_does_not_act_on(name: str) -> None:
    spec: EffectSpec = registry.load("effect", name).SPEC
    bases = {"flux": "boucwen-flux", "force": "bingham", "torque": "rotational-erf"}
    for output, base in bases.items():
        if output in spec.outputs:
            assert assemble(f"{base}+{name}").spec.output == output
        else:
            with pytest.raises(ConfigError, match=f"not on {output}"):
                assemble(f"{base}+{name}")
