"""What every model in the registry must keep, whatever its equations."""

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pint
import pytest

from mrfit.core import registry
from mrfit.core.channels import CHANNELS
from mrfit.core.specs import ModelSpec

SAMPLES = 600
DT = 2e-3
ROLES = {"yield", "knee", "viscous", "stiffness", "hysteresis", "offset", "inductance", ""}
NAMES = registry.names("model")
SPECS = {name: registry.load("model", name).SPEC for name in NAMES}


@pytest.fixture(params=NAMES)
def model(request: pytest.FixtureRequest) -> ModuleType:
    return registry.load("model", request.param)


def channels() -> dict[str, np.ndarray]:
    """Two sines with a rest at the start and end, in sizes usual for dampers and coils; derivatives exact."""
    t = np.arange(SAMPLES) * DT
    wave = {"x": np.zeros(SAMPLES), "v": np.zeros(SAMPLES), "a": np.zeros(SAMPLES)}
    for frequency, share, phase in ((2.0, 0.8, 0.0), (5.3, 0.2, 0.7)):
        w = 2 * np.pi * frequency
        wave["x"] += share * np.sin(w * t + phase)
        wave["v"] += share * w * np.cos(w * t + phase)
        wave["a"] -= share * w**2 * np.sin(w * t + phase)
    current = 0.8 + 0.4 * np.sin(2 * np.pi * 1.3 * t)
    return {
        "displacement": 0.01 * wave["x"],
        "velocity": 0.01 * wave["v"],
        "acceleration": 0.01 * wave["a"],
        "angle": 0.3 * wave["x"],
        "angular_velocity": 0.3 * wave["v"],
        "angular_acceleration": 0.3 * wave["a"],
        "current": current,
        "voltage": 5.0 * current,
        "flux": 0.03 * wave["x"],
        "temperature": 25.0 + 10.0 * t / t[-1],
    }


def drive_of(spec: ModelSpec) -> np.ndarray:
    made = channels()
    return np.stack([made[name] for name in spec.inputs])


def theta_of(spec: ModelSpec, count: int, spread: float = 0.1) -> np.ndarray:
    """Return the start values and random vectors around them (spread 1: anywhere within the bounds)."""
    rng = np.random.default_rng(7)
    low, high, start = np.array([(p.low, p.high, p.start) for p in spec.params]).T
    log = np.array([p.scale == "log" for p in spec.params])
    to: Callable[[np.ndarray], np.ndarray] = lambda v: np.where(log, np.log(np.where(log, v, 1.0)), v)  # noqa: E731
    u = (to(start) - to(low)) / (to(high) - to(low))
    u = np.clip(u + spread * rng.uniform(-1, 1, (count, len(u))), 0, 1)
    u[0] = (to(start) - to(low)) / (to(high) - to(low))
    value = to(low) + u * (to(high) - to(low))
    return np.clip(np.where(log, np.exp(np.where(log, value, 0.0)), value), low, high)


def test_specification_is_named_after_its_file_and_says_what_it_is(model: ModuleType) -> None:
    spec = model.SPEC
    assert model.__name__.rsplit(".", 1)[1].replace("_", "-") == spec.name
    assert spec.title and spec.equation and spec.reference
    assert spec.output in CHANNELS and set(spec.inputs) <= set(CHANNELS)
    assert len(set(spec.names)) == len(spec.names)
    assert set(spec.linear) <= set(spec.names)
    assert {p.role for p in spec.params} <= ROLES
    # temperature and the coil's field change forces of this role, so it may name nothing else
    assert {p.unit for p in spec.params if p.role == "yield"} <= {"N", "N*m"}
    assert all(p.text for p in spec.params)


def test_every_input_and_parameter_is_in_the_docstring(model: ModuleType) -> None:
    assert "Source:" in model.__doc__
    if len(model.SPEC.params) <= 16:
        missing = [p.name for p in model.SPEC.params if p.name not in model.__doc__]
        assert not missing


def test_bounds_are_finite_and_enclose_the_start(model: ModuleType) -> None:
    for p in model.SPEC.params:
        assert np.isfinite([p.low, p.high]).all()
        assert p.low < p.high
        assert p.low <= p.start <= p.high
        assert p.scale == "linear" or p.low > 0


def test_units_are_known_to_pint(model: ModuleType) -> None:
    units = pint.UnitRegistry()
    for quantity in (*model.SPEC.params, *model.SPEC.derived):
        assert units.parse_units(quantity.unit) is not None


def test_response_is_a_finite_contiguous_batch(model: ModuleType) -> None:
    drive, theta = drive_of(model.SPEC), theta_of(model.SPEC, 5)
    out = model.response(drive, theta, DT)
    assert out.shape == (5, SAMPLES)
    assert out.dtype == np.float64
    assert out.flags.c_contiguous
    assert np.isfinite(out).all()


def test_response_is_finite_anywhere_within_the_bounds(model: ModuleType) -> None:
    out = model.response(drive_of(model.SPEC), theta_of(model.SPEC, 64, spread=1.0), DT)
    assert np.isfinite(out).all()


def test_response_leaves_its_inputs_untouched_and_accepts_read_only_ones(model: ModuleType) -> None:
    drive, theta = drive_of(model.SPEC), theta_of(model.SPEC, 3)
    before = drive.copy(), theta.copy()
    drive.flags.writeable = theta.flags.writeable = False
    model.response(drive, theta, DT)
    assert np.array_equal(drive, before[0])
    assert np.array_equal(theta, before[1])


def test_response_is_deterministic(model: ModuleType) -> None:
    drive, theta = drive_of(model.SPEC), theta_of(model.SPEC, 3)
    assert np.array_equal(model.response(drive, theta, DT), model.response(drive, theta, DT))


def test_batch_equals_single_vectors(model: ModuleType) -> None:
    drive, theta = drive_of(model.SPEC), theta_of(model.SPEC, 9)
    batch = model.response(drive, theta, DT)
    single = np.vstack([model.response(drive, row[None], DT) for row in theta])
    assert np.abs(batch - single).max() <= 1e-12 * np.abs(batch).max()


def test_response_is_causal(model: ModuleType) -> None:
    drive, theta = drive_of(model.SPEC), theta_of(model.SPEC, 3)
    changed = drive.copy()
    changed[:, 400:] = 0.5 * drive[:, 400:] + 0.1 * drive[:, :200]
    one, other = model.response(drive, theta, DT), model.response(changed, theta, DT)
    assert np.array_equal(one[:, :400], other[:, :400])
    assert not np.array_equal(one, other)


def test_every_parameter_moves_the_response(model: ModuleType) -> None:
    drive, theta = drive_of(model.SPEC), theta_of(model.SPEC, 2)[1]
    for k, p in enumerate(model.SPEC.params):
        moved = theta.copy()
        moved[k] = p.low + 0.37 * (p.high - p.low)
        pair = model.response(drive, np.array([theta, moved]), DT)
        assert not np.array_equal(pair[0], pair[1]), p.name


def test_finite_difference_jacobian_is_consistent(model: ModuleType) -> None:
    drive, theta = drive_of(model.SPEC), theta_of(model.SPEC, 2)[1]
    for k, p in enumerate(model.SPEC.params):
        size = abs(theta[k]) if p.scale == "log" else min(p.high - p.low, max(abs(theta[k]), abs(p.start), 1e-3))
        steps = size * np.array([1e-4, -1e-4, 5e-5, -5e-5])
        rows = model.response(drive, theta + steps[:, None] * np.eye(len(theta))[k], DT)
        wide, narrow = (rows[0] - rows[1]) / 2e-4, (rows[2] - rows[3]) / 1e-4
        floor = 1e-6 * np.abs(rows).max()
        assert np.sqrt(np.mean((wide - narrow) ** 2)) <= 0.02 * np.sqrt(np.mean(wide**2)) + floor, p.name


@pytest.mark.parametrize("name", [n for n in NAMES if SPECS[n].linear])
def test_linear_parameters_are_jointly_affine(name: str) -> None:
    model = registry.load("model", name)
    spec = model.SPEC
    columns = [spec.names.index(name) for name in spec.linear]
    ends = theta_of(spec, 3, spread=0.5)[1:]
    ends[1, [k for k in range(len(spec.names)) if k not in columns]] = np.delete(ends[0], columns)
    path = np.array([ends[0], 0.7 * ends[0] + 0.3 * ends[1], ends[1]])
    rows = model.response(drive_of(spec), path, DT)
    assert np.abs(rows[1] - 0.7 * rows[0] - 0.3 * rows[2]).max() <= 1e-10 * np.abs(rows).max()


@pytest.mark.parametrize(
    "name", [n for n in NAMES if SPECS[n].output in ("force", "torque") and "current" not in SPECS[n].inputs]
)
def test_parameters_may_vary_along_the_samples(name: str) -> None:
    model = registry.load("model", name)
    spec = model.SPEC
    drive, theta = drive_of(spec), theta_of(spec, 3)
    constant = model.response(drive, theta, DT)
    held = np.repeat(theta[:, :, None], SAMPLES, axis=2)
    assert np.abs(model.response(drive, held, DT) - constant).max() <= 1e-12 * np.abs(constant).max()
    held[:, :, SAMPLES // 2 :] = theta_of(spec, 4)[1:, :, None]
    varied = model.response(drive, held, DT)
    assert np.isfinite(varied).all()
    before, after = np.s_[:, : SAMPLES // 2], np.s_[:, SAMPLES // 2 :]
    assert np.abs(varied[before] - constant[before]).max() <= 1e-5 * np.ptp(constant)
    assert not np.array_equal(varied[after], constant[after])


@pytest.mark.parametrize("name", [n for n in NAMES if SPECS[n].rate_independent])
def test_rate_independent_models_follow_the_path_only(name: str) -> None:
    model = registry.load("model", name)
    drive, theta = drive_of(model.SPEC), theta_of(model.SPEC, 3)
    slow = model.response(np.repeat(drive, 2, axis=1), theta, 10 * DT)[:, ::2]
    assert np.abs(slow - model.response(drive, theta, DT)).max() <= 1e-12 * np.abs(slow).max()


def test_a_model_has_a_function_of_derived_quantities_if_it_names_some(model: ModuleType) -> None:
    assert hasattr(model, "derived") == bool(model.SPEC.derived)


@pytest.mark.parametrize("name", [n for n in NAMES if SPECS[n].derived])
def test_derived_quantities_have_their_shape(name: str) -> None:
    model = registry.load("model", name)
    values = model.derived(theta_of(model.SPEC, 4))
    assert values.shape == (4, len(model.SPEC.derived))
    assert np.isfinite(values).all()


@pytest.mark.parametrize(
    ("name", "kind"),
    [(n, k) for n in NAMES for k in ("start_values", "far_starts") if hasattr(registry.load("model", n), k)],
)
def test_start_values_are_inside_the_bounds_on_any_finite_data(name: str, kind: str) -> None:
    model = registry.load("model", name)
    spec, rng = model.SPEC, np.random.default_rng(3)
    drive = drive_of(spec)
    outputs = [
        model.response(drive, spec.start[None], DT)[0],
        np.zeros(SAMPLES),
        1e9 * rng.normal(size=SAMPLES),
        np.linspace(-1, 1, SAMPLES),
    ]
    for inputs in (drive, np.zeros_like(drive), rng.normal(size=drive.shape), drive[:, :3]):
        for output in outputs:
            every = getattr(model, kind)(inputs, output[: inputs.shape[1]], DT)
            for found in [every] if kind == "start_values" else every:
                assert set(found) <= set(spec.names)
                for p in spec.params:
                    assert p.low <= found.get(p.name, p.start) <= p.high


REDUCIBLE = [name for name in NAMES if hasattr(registry.load("model", name), "REDUCED")]
EXACT = [name for name in NAMES if hasattr(registry.load("model", name), "sensitivities")]


@pytest.mark.parametrize("name", REDUCIBLE)
def test_reduced_parameters_give_the_same_response_and_lead_back_to_it(name: str) -> None:
    module = registry.load("model", name)
    reduced, drive, theta = module.REDUCED, drive_of(module.SPEC), theta_of(module.SPEC, 9)
    spec = reduced.spec
    assert (spec.name, spec.inputs, spec.output) == (module.SPEC.name, module.SPEC.inputs, module.SPEC.output)
    assert set(spec.linear) <= set(spec.names) and len(spec.params) <= len(module.SPEC.params)
    response, less = module.response(drive, theta, DT), reduced.reduce(theta)
    assert less.shape == (9, len(spec.params))
    size = np.ptp(response)
    assert np.abs(reduced.response(drive, less, DT) - response).max() <= 1e-9 * size
    assert np.abs(module.response(drive, reduced.restore(less), DT) - response).max() <= 1e-6 * size
    assert reduced.reduce(reduced.restore(less)) == pytest.approx(less, rel=1e-9)
    if reduced.rough is not None:
        assert 0.0 < np.abs(reduced.rough(drive, less, DT) - response).max() <= 1e-3 * size


@pytest.mark.parametrize("name", REDUCIBLE)
def test_reduced_parameters_marked_linear_are_so(name: str) -> None:
    reduced = registry.load("model", name).REDUCED
    drive, theta = drive_of(reduced.spec), theta_of(reduced.spec, 3)
    columns = [reduced.spec.names.index(n) for n in reduced.spec.linear]
    other = theta.copy()
    other[:, columns] *= np.linspace(0.5, 1.7, len(columns))
    middle = 0.3 * theta + 0.7 * other
    middle[:, [k for k in range(theta.shape[1]) if k not in columns]] = np.delete(theta, columns, axis=1)
    ends = [reduced.response(drive, each, DT) for each in (theta, other, middle)]
    assert ends[2] == pytest.approx(0.3 * ends[0] + 0.7 * ends[1], rel=1e-7, abs=1e-9 * np.ptp(ends[0]))


@pytest.mark.parametrize("name", EXACT)
def test_sensitivities_are_the_response_and_its_derivatives(name: str) -> None:
    module = registry.load("model", name)
    # the start lies on corners: a delay of one sample
    drive, theta = drive_of(module.SPEC), theta_of(module.SPEC, 4)[1:]
    columns = np.arange(theta.shape[1])[::-1].copy()
    steps = np.tile(1e-6 * np.array([p.high - p.low for p in module.SPEC.params])[columns], (3, 1))
    steps = np.minimum(steps, 1e-3 * np.abs(theta[:, columns]) + 1e-9)
    rows = module.sensitivities(drive, theta, DT, columns)
    response = module.response(drive, theta, DT)
    assert rows.shape == (3, 1 + len(columns), SAMPLES)
    assert rows[:, 0] == pytest.approx(response, rel=1e-9, abs=1e-9 * np.ptp(response))
    for q, column in enumerate(columns):
        ahead, behind = theta.copy(), theta.copy()
        ahead[:, column] += steps[:, q]
        behind[:, column] -= steps[:, q]
        rise = (module.response(drive, ahead, DT) - module.response(drive, behind, DT)) / 2
        largest = np.abs(rise).max()
        # at its corners a response has two slopes
        apart = np.abs(steps[:, q, None] * rows[:, 1 + q] - rise) > 1e-3 * largest + 1e-12 * np.ptp(response)
        assert np.mean(apart) < 0.05, module.SPEC.names[column]


def test_a_flux_has_an_unknown_constant_and_its_loop_is_co_energy(model: ModuleType) -> None:
    integrated = model.SPEC.output == "flux"
    assert model.SPEC.free_offset == integrated
    assert model.SPEC.co_energy == integrated
