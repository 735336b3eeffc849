"""What every effect in the registry must keep, whatever its equations."""

from types import ModuleType

import numpy as np
import pint
import pytest

from mrfit.core import registry
from mrfit.core.channels import CHANNELS
from mrfit.core.recording import FLUX_RESISTANCE
from mrfit.core.specs import EffectSpec
from mrfit.simulate.assembly import SLOTS, Assembly, assemble
from mrfit.simulate.current_dependence import CurrentDependence

SAMPLES = 600
DT = 2e-3
NAMES = registry.names("effect")
FUNCTIONS = {
    "input": "transform",
    "loop": "closed",
    "theta": "factors",
    "add": "term",
    "output": "shape",
    "record": "error",
}
BASES = {
    "flux": ("boucwen-flux", ()),
    "force": ("tanh", (("fy", 1),)),
    "torque": ("rotational-erf", (("alpha", 1),)),
}
CASES = [(n, output) for n in NAMES for output in registry.load("effect", n).SPEC.outputs]


@pytest.fixture(params=NAMES)
def effect(request: pytest.FixtureRequest) -> ModuleType:
    return registry.load("effect", request.param)


@pytest.fixture(params=CASES, ids=lambda case: f"{case[0]} on {case[1]}")
def pair(request: pytest.FixtureRequest) -> tuple[EffectSpec, Assembly, Assembly]:
    """Return an effect, a base, and the base with the effect."""
    name, output = request.param
    base, orders = BASES[output]
    dependence = CurrentDependence(orders, 0.0, 2.0)
    return registry.load("effect", name).SPEC, assemble(base, dependence), assemble(f"{base}+{name}", dependence)


def channels() -> dict[str, np.ndarray]:
    """Return two sines with exact derivatives, moving current and temperature, in sizes usual for dampers and coils."""
    t = np.arange(SAMPLES) * DT
    wave = {"x": np.zeros(SAMPLES), "v": np.zeros(SAMPLES), "a": np.zeros(SAMPLES)}
    for frequency, share, phase in ((2.0, 0.8, 0.0), (5.3, 0.2, 0.7)):
        w = 2 * np.pi * frequency
        wave["x"] += share * np.sin(w * t + phase)
        wave["v"] += share * w * np.cos(w * t + phase)
        wave["a"] -= share * w**2 * np.sin(w * t + phase)
    return {
        "displacement": 0.02 * wave["x"],
        "velocity": 0.02 * wave["v"],
        "acceleration": 0.02 * wave["a"],
        "angle": 0.3 * wave["x"],
        "angular_velocity": 0.3 * wave["v"],
        "current": 0.8 + 0.7 * np.sin(2 * np.pi * 1.7 * t),
        "temperature": 25.0 + 30.0 * t / t[-1],
        "time": 3.0 + t,
        FLUX_RESISTANCE: np.full(SAMPLES, 2.1),
    }


def drive_of(whole: Assembly) -> np.ndarray:
    made = channels()
    return np.stack([made[name] for name in whole.spec.inputs])


def theta_of(whole: Assembly, spec: EffectSpec, own: np.ndarray) -> np.ndarray:
    """Return the base's start values, growing with current, beside effect parameters (P, Q)."""
    start = whole.spec.start[: -len(spec.params)]
    start = start * np.array([2.0 if name.endswith("@2A") else 1.0 for name in whole.spec.names[: len(start)]])
    return np.column_stack([np.tile(start, (len(own), 1)), own])


def anywhere(spec: EffectSpec, count: int) -> np.ndarray:
    """Return effect parameters (P, Q) within the bounds, the bounds themselves first."""
    low, high = np.array([(p.low, p.high) for p in spec.params]).T
    share = np.random.default_rng(5).uniform(size=(count, len(low)))
    share[0], share[1] = 0.0, 1.0
    return low + share * (high - low)


def weak(spec: EffectSpec, count: int) -> np.ndarray:
    """Return effect parameters (P, Q): strengths near neutral, shapes (those on a log scale) at neutral."""
    near = np.array(spec.neutral) + 0.02 * (anywhere(spec, count) - np.array(spec.neutral))
    return np.where([p.scale == "log" for p in spec.params], spec.neutral, near)


def test_specification_is_named_after_its_file_and_says_what_it_is(effect: ModuleType) -> None:
    spec = effect.SPEC
    assert effect.__name__.rsplit(".", 1)[1].replace("_", "-") == spec.name
    assert spec.title and spec.equation and spec.reference
    assert spec.slot in SLOTS
    assert spec.outputs and set(spec.outputs) <= {"flux", "force", "torque"}
    assert set(spec.inputs) <= {*CHANNELS, "time", FLUX_RESISTANCE}


def test_module_has_the_function_of_its_slot_and_no_other(effect: ModuleType) -> None:
    own = FUNCTIONS[effect.SPEC.slot]
    # a wrong input also misleads a reconstruction from it
    allowed = [[own], [own, FUNCTIONS["record"]]] if effect.SPEC.slot == "input" else [[own]]
    assert [f for f in FUNCTIONS.values() if hasattr(effect, f)] in allowed


def test_every_slot_and_its_function_are_documented() -> None:
    told = " ".join((EffectSpec.__doc__ or "").split())
    assert [slot for slot in SLOTS if f"- ``{slot}``: ``{FUNCTIONS[slot]}(" not in told] == []


def test_experiment_says_which_test_tells_it_from_what_it_is_mistaken_for(effect: ModuleType) -> None:
    assert effect.SPEC.aliases
    assert len(effect.SPEC.experiment.split()) >= 12


def test_aliases_are_known_and_mutual(effect: ModuleType) -> None:
    for alias in effect.SPEC.aliases:
        if alias in NAMES:
            assert effect.SPEC.name in registry.load("effect", alias).SPEC.aliases
            assert set(effect.SPEC.outputs) & set(registry.load("effect", alias).SPEC.outputs)
        else:
            assert alias in registry.names("model")


def test_parameters_stand_in_the_equation_and_their_units_in_the_docstring(effect: ModuleType) -> None:
    assert "Source:" in effect.__doc__
    for p in effect.SPEC.params:
        assert p.name in effect.SPEC.equation
        assert p.name in effect.__doc__
        assert f"({p.unit}" in effect.__doc__
        assert p.text


def test_units_are_known_to_pint(effect: ModuleType) -> None:
    units = pint.UnitRegistry()
    for p in effect.SPEC.params:
        assert units.parse_units(p.unit) is not None


def test_bounds_are_finite_and_hold_the_neutral_which_is_the_start(effect: ModuleType) -> None:
    spec = effect.SPEC
    assert len(spec.neutral) == len(spec.params)
    for p, neutral in zip(spec.params, spec.neutral, strict=True):
        assert np.isfinite([p.low, p.high]).all()
        assert p.low < p.high
        assert p.low <= neutral <= p.high
        assert p.start == neutral
        assert p.scale == "linear" or p.low > 0


def test_neutral_survives_the_way_through_the_unit_interval(effect: ModuleType) -> None:
    for p, neutral in zip(effect.SPEC.params, effect.SPEC.neutral, strict=True):
        if p.scale == "linear":
            assert p.low + (p.high - p.low) * ((neutral - p.low) / (p.high - p.low)) == neutral


def test_neutral_leaves_the_base_bit_for_bit(pair: tuple[EffectSpec, Assembly, Assembly]) -> None:
    spec, base, whole = pair
    drive, own = drive_of(whole), np.tile(spec.neutral, (3, 1))
    theta = theta_of(whole, spec, own)
    expected = base.simulate(drive[: len(base.spec.inputs)], theta[:, : -len(spec.params)], DT)
    assert np.array_equal(whole.simulate(drive, theta, DT), expected)


def test_neutral_leaves_the_base_bit_for_bit_in_a_batch_that_is_not(
    pair: tuple[EffectSpec, Assembly, Assembly],
) -> None:
    spec, base, whole = pair
    drive, own = drive_of(whole), weak(spec, 4)
    own[2] = spec.neutral
    theta = theta_of(whole, spec, own)
    expected = base.simulate(drive[: len(base.spec.inputs)], theta[2:3, : -len(spec.params)], DT)
    assert np.array_equal(whole.simulate(drive, theta, DT)[2:3], expected)


def test_every_parameter_moves_the_output(pair: tuple[EffectSpec, Assembly, Assembly]) -> None:
    spec, _, whole = pair
    rows = np.repeat(weak(spec, 2)[1:], 2, axis=0)
    for q, p in enumerate(spec.params):
        moved = rows.copy()
        moved[1, q] = 0.8 * moved[0, q]
        out = whole.simulate(drive_of(whole), theta_of(whole, spec, moved), DT)
        assert np.abs(out[1] - out[0]).max() >= 1e-6 * np.ptp(out[0]), p.name


def test_sensitivity_to_the_strength_does_not_vanish_at_neutral(pair: tuple[EffectSpec, Assembly, Assembly]) -> None:
    spec, _, whole = pair
    first = spec.params[0]
    for share in (1e-3, 1e-6):
        rows = np.tile(spec.neutral, (2, 1))
        rows[1, 0] += share * (first.high - first.low)
        out = whole.simulate(drive_of(whole), theta_of(whole, spec, rows), DT)
        assert np.abs(out[1] - out[0]).max() >= 1e-2 * share * np.ptp(out[0])


def test_output_is_finite_anywhere_within_the_bounds(pair: tuple[EffectSpec, Assembly, Assembly]) -> None:
    spec, _, whole = pair
    out = whole.simulate(drive_of(whole), theta_of(whole, spec, anywhere(spec, 64)), DT)
    assert out.shape == (64, SAMPLES)
    assert np.isfinite(out).all()


def test_inputs_are_left_untouched_and_may_be_read_only(pair: tuple[EffectSpec, Assembly, Assembly]) -> None:
    spec, _, whole = pair
    drive, theta = drive_of(whole), theta_of(whole, spec, anywhere(spec, 3))
    before = drive.copy(), theta.copy()
    drive.flags.writeable = theta.flags.writeable = False
    whole.simulate(drive, theta, DT)
    assert np.array_equal(drive, before[0])
    assert np.array_equal(theta, before[1])


def test_output_is_deterministic(pair: tuple[EffectSpec, Assembly, Assembly]) -> None:
    spec, _, whole = pair
    drive, theta = drive_of(whole), theta_of(whole, spec, anywhere(spec, 3))
    assert np.array_equal(whole.simulate(drive, theta, DT), whole.simulate(drive, theta, DT))


def test_batch_equals_single_vectors(pair: tuple[EffectSpec, Assembly, Assembly]) -> None:
    spec, _, whole = pair
    drive, theta = drive_of(whole), theta_of(whole, spec, anywhere(spec, 9))
    batch = whole.simulate(drive, theta, DT)
    single = np.vstack([whole.simulate(drive, row[None], DT) for row in theta])
    assert np.abs(batch - single).max() <= 1e-12 * np.abs(batch).max()


def test_constant_channels_are_no_trouble(pair: tuple[EffectSpec, Assembly, Assembly]) -> None:
    spec, _, whole = pair
    drive = np.repeat(drive_of(whole)[:, :1], 50, axis=1)
    assert np.isfinite(whole.simulate(drive, theta_of(whole, spec, anywhere(spec, 5)), DT)).all()


def test_an_effect_that_knows_time_or_temperature_may_change_within_a_record(effect: ModuleType) -> None:
    assert effect.SPEC.steady == (not {"time", "temperature"} & set(effect.SPEC.inputs))


def test_what_must_move_is_an_input(effect: ModuleType) -> None:
    assert {name for name, _ in effect.SPEC.moves} <= set(effect.SPEC.inputs)
    assert all(least > 0.0 for _, least in effect.SPEC.moves)
