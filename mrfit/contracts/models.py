"""Checks of every model, independent of its equations."""

from collections.abc import Callable
from typing import cast

import numpy as np
import pint

from mrfit.contracts.check import Check, check_of, need, need_close
from mrfit.contracts.signals import CONTRACT_SAMPLES, DT, for_models
from mrfit.core.channels import ANTIDERIVATIVES, CHANNELS
from mrfit.core.protocols import (
    HasDerived,
    HasFarStarts,
    HasReduced,
    HasSensitivities,
    HasStartValues,
    HoldsParameters,
    Model,
)
from mrfit.core.specs import Array, ModelSpec

_ROLES = {"yield", "knee", "viscous", "stiffness", "hysteresis", "offset", "inductance", "saturation", "coercive", ""}
# Share of the response's range from which a step at an input's change of sign is a jump
LEAST_JUMP = 0.01


def drive_of(spec: ModelSpec) -> Array:
    """Return the input channels (C, N)."""
    made = for_models()
    return np.stack([made[name] for name in spec.inputs])


def theta_of(spec: ModelSpec, count: int, spread: float = 0.1) -> Array:
    """Return the start values and random vectors around them (spread 1: anywhere within the bounds)."""
    rng = np.random.default_rng(7)
    low, high, start = np.array([(p.low, p.high, p.start) for p in spec.params]).T
    log = np.array([p.scale == "log" for p in spec.params])
    to: Callable[[Array], Array] = lambda v: np.where(log, np.log(np.where(log, v, 1.0)), v)  # noqa: E731
    u = (to(start) - to(low)) / (to(high) - to(low))
    u = np.clip(u + spread * rng.uniform(-1, 1, (count, len(u))), 0, 1)
    u[0] = (to(start) - to(low)) / (to(high) - to(low))
    value = to(low) + u * (to(high) - to(low))
    return np.clip(np.where(log, np.exp(np.where(log, value, 0.0)), value), low, high)


def specification_is_sound(model: Model) -> None:
    """The SPEC names known channels and roles, and every parameter once, with its meaning."""
    spec = model.SPEC
    need(spec.title, "no title")
    unknown = {*spec.inputs, spec.output} - set(CHANNELS)
    need(not unknown, f"unknown channel {', '.join(sorted(unknown))}")
    need(len(set(spec.names)) == len(spec.names), "a parameter is named twice")
    need(set(spec.linear) <= set(spec.names), "linear names what is no parameter")
    need(set(spec.jumps) <= set(spec.inputs), "jumps names what is no input")
    need(not spec.rests_at or spec.rests_at in spec.inputs, "rests_at names what is no input")
    roles = {p.role for p in spec.params} - _ROLES
    need(not roles, f"unknown role {', '.join(sorted(roles))}")
    # temperature and the coil's field change forces of this role, so it may name nothing else
    need({p.unit for p in spec.params if p.role == "yield"} <= {"N", "N*m"}, "the role yield is for forces and torques")
    need(all(p.text for p in spec.params), "a parameter does not say what it means")


def bounds_enclose_the_start(model: Model) -> None:
    """Bounds are finite and enclose the start; those of a logarithmic scale are positive."""
    for p in model.SPEC.params:
        need(np.isfinite([p.low, p.high]).all() and p.low < p.high, f"{p.name}: bounds {p.low} to {p.high}")
        need(p.low <= p.start <= p.high, f"{p.name}: starts at {p.start}, outside {p.low} to {p.high}")
        need(p.scale == "linear" or p.low > 0, f"{p.name}: logarithmic from {p.low}")


def units_are_known(model: Model) -> None:
    """Units are known to pint."""
    units: pint.UnitRegistry[float] = pint.UnitRegistry()
    for unit in (*(p.unit for p in model.SPEC.params), *(d.unit for d in model.SPEC.derived)):
        units.parse_units(unit)


def response_is_a_finite_batch(model: Model) -> None:
    """The response to a batch is a contiguous array (P, N) of finite floats."""
    out = model.response(drive_of(model.SPEC), theta_of(model.SPEC, 5), DT)
    need(out.shape == (5, CONTRACT_SAMPLES), f"shape {out.shape} instead of {(5, CONTRACT_SAMPLES)}")
    need(out.dtype == np.float64, f"type {out.dtype} instead of float64")
    need(out.flags.c_contiguous, "not contiguous")
    need(np.isfinite(out).all(), "not finite at the start values or near them")


def response_is_finite_within_the_bounds(model: Model) -> None:
    """The response is finite anywhere within the bounds."""
    theta = theta_of(model.SPEC, 64, spread=1.0)
    out = model.response(drive_of(model.SPEC), theta, DT)
    wrong = np.flatnonzero(~np.isfinite(out).all(axis=1))
    at = dict(zip(model.SPEC.names, theta[wrong[0]].tolist(), strict=True)) if len(wrong) else {}
    need(not len(wrong), f"not finite at {len(wrong)} of 64 points, as at {at}")


def response_is_finite_at_rest(model: Model) -> None:
    """The response is finite where the motion rests, as at the ends of a slow test, and where nothing moves at all."""
    drive = drive_of(model.SPEC)
    still = np.empty_like(drive)
    for row, rest, name in zip(drive, still, model.SPEC.inputs, strict=True):
        rest[:] = row[200:300] = 0.0 if name in ANTIDERIVATIVES else row[200]
    for held, where in ((drive, "while it rests"), (still, "where it never moves")):
        out = model.response(held, theta_of(model.SPEC, 5), DT)
        need(np.isfinite(out).all(), f"not finite {where}: of a rate of 0, or of an input that does not change")


def inputs_are_left_untouched(model: Model) -> None:
    """The response leaves its inputs as they are, and takes read-only ones."""
    drive, theta = drive_of(model.SPEC), theta_of(model.SPEC, 3)
    before = drive.copy(), theta.copy()
    model.response(drive, theta, DT)
    need(np.array_equal(drive, before[0]), "it changes the drive")
    need(np.array_equal(theta, before[1]), "it changes the parameters")
    drive.flags.writeable = theta.flags.writeable = False
    model.response(drive, theta, DT)


def response_is_deterministic(model: Model) -> None:
    """The response is the same at every call."""
    drive, theta = drive_of(model.SPEC), theta_of(model.SPEC, 3)
    need(np.array_equal(model.response(drive, theta, DT), model.response(drive, theta, DT)), "two calls differ")


def batch_equals_single_vectors(model: Model) -> None:
    """Every row of a batch is what its parameter vector gives by itself."""
    drive, theta = drive_of(model.SPEC), theta_of(model.SPEC, 9)
    batch = model.response(drive, theta, DT)
    single = np.vstack([model.response(drive, row[None], DT) for row in theta])
    need_close(batch, single, 0.0, 1e-12 * float(np.abs(batch).max()), "batch and single vectors")


def response_is_causal(model: Model) -> None:
    """The response depends on the past of its inputs, not on their future."""
    drive, theta = drive_of(model.SPEC), theta_of(model.SPEC, 3)
    changed = drive.copy()
    changed[:, 400:] = 0.5 * drive[:, 400:] + 0.1 * drive[:, :200]
    one, other = model.response(drive, theta, DT), model.response(changed, theta, DT)
    need(np.array_equal(one[:, :400], other[:, :400]), "samples before a change of the inputs change with it")
    need(not np.array_equal(one, other), "the inputs make no difference")


def every_parameter_moves_the_response(model: Model) -> None:
    """Every parameter makes a difference."""
    drive, theta = drive_of(model.SPEC), theta_of(model.SPEC, 2)[1]
    for k, p in enumerate(model.SPEC.params):
        moved = theta.copy()
        moved[k] = p.low + 0.37 * (p.high - p.low)
        pair = model.response(drive, np.array([theta, moved]), DT)
        need(not np.array_equal(pair[0], pair[1]), f"{p.name} does not")


def differences_are_consistent(model: Model) -> None:
    """Difference quotients agree, so that a search sees slopes and not noise."""
    drive, theta = drive_of(model.SPEC), theta_of(model.SPEC, 2)[1]
    for k, p in enumerate(model.SPEC.params):
        size = abs(theta[k]) if p.scale == "log" else min(p.high - p.low, max(abs(theta[k]), abs(p.start), 1e-3))
        steps = size * np.array([1e-4, -1e-4, 5e-5, -5e-5])
        rows = model.response(drive, theta + steps[:, None] * np.eye(len(theta))[k], DT)
        wide, narrow = (rows[0] - rows[1]) / 2e-4, (rows[2] - rows[3]) / 1e-4
        floor = 1e-6 * np.abs(rows).max()
        apart, whole = np.sqrt(np.mean((wide - narrow) ** 2)), np.sqrt(np.mean(wide**2))
        need(apart <= 0.02 * whole + floor, f"{p.name}: two step sizes differ by {apart:.3g} in {whole:.3g}")


def linear_parameters_are_jointly_affine(model: Model) -> None:
    """The response is jointly linear in the parameters that the SPEC calls linear, where these vary along it too."""
    spec = model.SPEC
    columns = [spec.names.index(name) for name in spec.linear]
    ends = np.vstack([theta_of(spec, 3, spread=0.5)[1:], theta_of(spec, 7)[1:]]).reshape(4, 2, -1)
    others = [k for k in range(len(spec.names)) if k not in columns]
    ends[:, 1, others] = ends[:, 0, others]
    pairs = list(ends)
    if _may_vary(model):
        # between the two, each in its own way: what depends on how fast they vary is found, and no bound is passed
        phase = np.linspace(0.0, 20.0, CONTRACT_SAMPLES)
        shares = 0.5 + 0.5 * np.array([np.sin(phase), np.cos(1.7 * phase)])
        pairs += [a[:, None] + (b - a)[:, None] * shares[:, None] for a, b in ends]
    for first, last in pairs:
        rows = model.response(drive_of(spec), np.array([first, 0.7 * first + 0.3 * last, last]), DT)
        most = 1e-10 * float(np.abs(rows).max())
        need_close(rows[1], 0.7 * rows[0] + 0.3 * rows[2], 0.0, most, "between two vectors")


def _may_vary(model: Model) -> bool:
    if isinstance(model, HoldsParameters):
        return False
    return model.SPEC.output in ("force", "torque") and "current" not in model.SPEC.inputs


def parameters_may_vary_along_the_samples(model: Model) -> None:
    """Parameters may vary along the samples, (P, K, N), as under a current that moves."""
    spec = model.SPEC
    drive, theta = drive_of(spec), theta_of(spec, 3)
    constant = model.response(drive, theta, DT)
    held = np.repeat(theta[:, :, None], CONTRACT_SAMPLES, axis=2)
    size = float(np.abs(constant).max())
    need_close(model.response(drive, held, DT), constant, 0.0, 1e-12 * size, "held parameters as (P, K, N)")
    held[:, :, CONTRACT_SAMPLES // 2 :] = theta_of(spec, 4)[1:, :, None]
    varied = model.response(drive, held, DT)
    need(np.isfinite(varied).all(), "not finite where parameters change")
    before, after = np.s_[:, : CONTRACT_SAMPLES // 2], np.s_[:, CONTRACT_SAMPLES // 2 :]
    need_close(varied[before], constant[before], 0.0, 1e-5 * float(np.ptp(constant)), "before parameters change")
    need(not np.array_equal(varied[after], constant[after]), "a change of parameters makes no difference")


def rate_independent_response_follows_the_path(model: Model) -> None:
    """The response depends on the path of the input only, since the SPEC says so."""
    drive, theta = drive_of(model.SPEC), theta_of(model.SPEC, 3)
    slow = model.response(np.repeat(drive, 2, axis=1), theta, 10 * DT)[:, ::2]
    need_close(slow, model.response(drive, theta, DT), 0.0, 1e-12 * float(np.abs(slow).max()), "a slower path")


def jumps_are_declared(model: Model) -> None:
    """The response jumps at the change of sign of those inputs that the SPEC says, and of no other."""
    spec, drive = model.SPEC, drive_of(model.SPEC)
    size = float(np.ptp(model.response(drive, spec.start[None], DT)))
    for row, name in enumerate(spec.inputs):
        # what moves beside it is where it is when the input passes zero in a cycle: at its largest
        held = np.repeat(np.abs(drive).max(axis=1)[:, None], CONTRACT_SAMPLES, axis=1)
        held[row] *= 1e-9 * np.where(np.arange(CONTRACT_SAMPLES) < CONTRACT_SAMPLES // 2, -1.0, 1.0)
        steps = np.abs(np.diff(model.response(held, spec.start[None], DT)[0]))
        before, crossing = steps[CONTRACT_SAMPLES // 2 - 2 : CONTRACT_SAMPLES // 2]
        jumps = crossing - 2.0 * before > LEAST_JUMP * size
        need(not jumps or name in spec.jumps, f"it jumps where {name} changes its sign: name it in jumps")
        need(jumps or name not in spec.jumps, f"it does not jump where {name} changes its sign, as jumps says")


def derived_quantities_have_their_function(model: Model) -> None:
    """There is a function of derived quantities if the SPEC names some, and none otherwise."""
    need(isinstance(model, HasDerived) == bool(model.SPEC.derived), "derived(theta) and SPEC.derived belong together")


def derived_quantities_have_their_shape(model: Model) -> None:
    """Derived quantities are finite, (P, D)."""
    values = cast(HasDerived, model).derived(theta_of(model.SPEC, 4))
    need(values.shape == (4, len(model.SPEC.derived)), f"shape {values.shape}")
    need(np.isfinite(values).all(), "not finite")


def start_values_are_inside_the_bounds(model: Model) -> None:
    """Start values lie within the bounds, on any finite data."""
    spec, rng = model.SPEC, np.random.default_rng(3)
    drive = drive_of(spec)
    outputs = [
        model.response(drive, spec.start[None], DT)[0],
        np.zeros(CONTRACT_SAMPLES),
        1e9 * rng.normal(size=CONTRACT_SAMPLES),
        np.linspace(-1, 1, CONTRACT_SAMPLES),
    ]
    for inputs in (drive, np.zeros_like(drive), rng.normal(size=drive.shape), drive[:, :3]):
        for output in outputs:
            data = inputs, output[: inputs.shape[1]], DT
            every = [model.start_values(*data)] if isinstance(model, HasStartValues) else []
            every += model.far_starts(*data) if isinstance(model, HasFarStarts) else []
            for found in every:
                need(set(found) <= set(spec.names), f"start of {', '.join(sorted(set(found) - set(spec.names)))}")
                for p in spec.params:
                    value = found.get(p.name, p.start)
                    need(p.low <= value <= p.high, f"{p.name} starts at {value}, outside {p.low} to {p.high}")


def reduced_parameters_give_the_same_response(model: Model) -> None:
    """Reduced parameters give the same response and lead back to it."""
    reduced, drive, theta = cast(HasReduced, model).REDUCED, drive_of(model.SPEC), theta_of(model.SPEC, 9)
    spec, own = reduced.spec, model.SPEC
    need((spec.name, spec.inputs, spec.output) == (own.name, own.inputs, own.output), "another name or channel")
    need(set(spec.linear) <= set(spec.names) and len(spec.params) <= len(own.params), "more parameters than the model")
    response, less = model.response(drive, theta, DT), reduced.reduce(theta)
    need(less.shape == (9, len(spec.params)), f"shape {less.shape}")
    size = float(np.ptp(response))
    need_close(reduced.response(drive, less, DT), response, 0.0, 1e-9 * size, "reduced response")
    need_close(model.response(drive, reduced.restore(less), DT), response, 0.0, 1e-6 * size, "restored response")
    need_close(reduced.reduce(reduced.restore(less)), less, 1e-9, 1e-12, "reduced again")
    if reduced.rough is not None:
        apart = np.abs(reduced.rough(drive, less, DT) - response).max()
        need(0.0 < apart <= 1e-3 * size, f"rough response off by {apart:.3g} in {size:.3g}")


def reduced_linear_parameters_are_linear(model: Model) -> None:
    """The reduced response is jointly linear in the parameters it calls linear."""
    reduced = cast(HasReduced, model).REDUCED
    drive, theta = drive_of(reduced.spec), theta_of(reduced.spec, 3)
    columns = [reduced.spec.names.index(n) for n in reduced.spec.linear]
    other = theta.copy()
    other[:, columns] *= np.linspace(0.5, 1.7, len(columns))
    middle = 0.3 * theta + 0.7 * other
    middle[:, [k for k in range(theta.shape[1]) if k not in columns]] = np.delete(theta, columns, axis=1)
    ends = [reduced.response(drive, each, DT) for each in (theta, other, middle)]
    need_close(ends[2], 0.3 * ends[0] + 0.7 * ends[1], 1e-7, 1e-9 * float(np.ptp(ends[0])), "between two vectors")


def sensitivities_are_the_derivatives(model: Model) -> None:
    """Sensitivities are the response and its derivatives."""
    spec, exact = model.SPEC, cast(HasSensitivities, model)
    # the start lies on corners: a delay of one sample
    drive, theta = drive_of(spec), theta_of(spec, 4)[1:]
    columns = np.arange(theta.shape[1])[::-1].copy()
    steps = np.tile(1e-6 * np.array([p.high - p.low for p in spec.params])[columns], (3, 1))
    steps = np.minimum(steps, 1e-3 * np.abs(theta[:, columns]) + 1e-9)
    rows, response = exact.sensitivities(drive, theta, DT, columns), model.response(drive, theta, DT)
    need(rows.shape == (3, 1 + len(columns), CONTRACT_SAMPLES), f"shape {rows.shape}")
    need_close(rows[:, 0], response, 1e-9, 1e-9 * float(np.ptp(response)), "row 0")
    for q, column in enumerate(columns):
        ahead, behind = theta.copy(), theta.copy()
        ahead[:, column] += steps[:, q]
        behind[:, column] -= steps[:, q]
        rise = (model.response(drive, ahead, DT) - model.response(drive, behind, DT)) / 2
        largest = np.abs(rise).max()
        # at its corners a response has two slopes
        apart = np.abs(steps[:, q, None] * rows[:, 1 + q] - rise) > 1e-3 * largest + 1e-12 * np.ptp(response)
        need(np.mean(apart) < 0.05, f"{spec.names[column]}: wrong at {100 * np.mean(apart):.0f} % of the samples")


MODEL_CHECKS: tuple[Check[Model], ...] = (
    check_of(specification_is_sound),
    check_of(bounds_enclose_the_start),
    check_of(units_are_known),
    check_of(response_is_a_finite_batch),
    check_of(response_is_finite_within_the_bounds),
    check_of(response_is_finite_at_rest),
    check_of(inputs_are_left_untouched),
    check_of(response_is_deterministic),
    check_of(batch_equals_single_vectors),
    check_of(response_is_causal),
    check_of(every_parameter_moves_the_response),
    check_of(differences_are_consistent),
    check_of(linear_parameters_are_jointly_affine, lambda m: bool(m.SPEC.linear)),
    check_of(parameters_may_vary_along_the_samples, _may_vary),
    check_of(rate_independent_response_follows_the_path, lambda m: m.SPEC.rate_independent),
    check_of(jumps_are_declared),
    check_of(derived_quantities_have_their_function),
    check_of(derived_quantities_have_their_shape, lambda m: isinstance(m, HasDerived)),
    check_of(start_values_are_inside_the_bounds, lambda m: isinstance(m, HasStartValues | HasFarStarts)),
    check_of(reduced_parameters_give_the_same_response, lambda m: isinstance(m, HasReduced)),
    check_of(reduced_linear_parameters_are_linear, lambda m: isinstance(m, HasReduced)),
    check_of(sensitivities_are_the_derivatives, lambda m: isinstance(m, HasSensitivities)),
)
