"""The loops that make responses of a model's or an effect's scalar ``step``, compiled once for each.

What ``step`` and ``rest`` take and return is said in ``core.protocols``. Inputs and parameters are linear over a step,
so that one loop serves equal and unequal steps, and parameters that hold or vary along the samples.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from mrfit.core.protocols import HasStep
from mrfit.core.specs import Array, EffectSpec, ModelSpec, Steps
from mrfit.kernels.branch import curve_at, rest_on_curve
from mrfit.kernels.jit import address_of, copy_of, kernel, row
from mrfit.kernels.past import RESERVED, begun, pushed

Rest = Callable[..., Any]
Step = Callable[..., Any]
Response = Callable[[Array, Array, Steps], Array]
# What a specialised loop finds in place of these
INPUTS: tuple[float, ...] = ()
PARAMETERS: tuple[float, ...] = ()
STATE: tuple[float, ...] = ()
LATE = OWN = 0
# Places of inputs at each end of a step, those at its end behind those at its beginning
WIRED = 16


def law(*values: Any) -> Any:
    """Stand for that of the element."""


def rest(now: Any, theta: Any) -> Any:
    """Stand for that of the element."""


def step(state: Any, before: Any, now: Any, theta: Any, dt: float, past: Any = None) -> Any:
    """Stand for that of the element."""


def _respond(drive: Array, theta: Array, steps: Array) -> Array:
    """Return the output (P, N) of inputs (D, N, C), parameters (P, M, K), M = 1 or N, and steps (1,) or (N,) in s.

    D is 1, of inputs that all points share, or P.
    """
    varying, last, samples = theta.shape[1] > 1, len(steps) - 1, drive.shape[1]
    parameters = theta.ravel()
    out = np.empty((len(theta), samples))
    past = np.empty(RESERVED + OWN + samples * (LATE + 1) if LATE + OWN > 0 else 0)
    for p in range(len(theta)):
        inputs = drive[min(p, len(drive) - 1)].ravel()
        place = p * theta.shape[1] * len(PARAMETERS)
        now, then = row(inputs, 0, INPUTS), row(parameters, place, PARAMETERS)
        state = rest(now, then)
        if LATE + OWN > 0:
            begun(past, samples, LATE, OWN)
            pushed(past, state, 0.0)
        out[p, 0], state = step(state, now, now, (then, then), 0.0, past)
        for j in range(1, samples):
            before, now, here = now, row(inputs, j * len(INPUTS), INPUTS), then
            if varying:
                here = row(parameters, place + j * len(PARAMETERS), PARAMETERS)
            dt = steps[min(j, last)]
            out[p, j], state = step(state, before, now, (then, here), dt, past)
            if LATE + OWN > 0:
                pushed(past, state, dt)
            then = here
    return out


def response_of(
    spec: ModelSpec | EffectSpec, rest: Rest, step: Step, late: int = 0, own: int = 0
) -> Callable[[Array, Array, Steps], Array]:
    """Return the batched response, at equal and at uneven steps, of a model's ``rest`` and ``step``.

    Parameters
    ----------
    spec
        Of the model.
    rest, step
        Functions of the subset that kernels are made of, see ``core.protocols``.
    late
        Number of signals at the head of the state that a step reads late.
    own
        Number of its own numbers in the past; with one of these or of those a step takes the past.
    """
    run = _laid_out(spec, rest, step, (late, own))

    def response(drive: Array, theta: Array, dt: Steps) -> Array:
        """Return the output (P, N) of inputs (C, N) and parameters (P, K) or (P, K, N), dt in s or (N,)."""
        values = theta if theta.ndim == 3 else theta[:, :, None]
        return run(drive.T[None], np.swapaxes(values, 1, 2), dt)

    return response


def rows_of(spec: EffectSpec, rest: Rest, step: Step, own: int = 0) -> Callable[..., Array]:
    """Return the same of an effect on outputs (P, N), each vector's own."""
    run = _laid_out(spec, rest, step, (0, own))

    def shape(output: Array, theta: Array, dt: Steps, *channels: Array) -> Array:
        """Return the changed outputs (P, N), theta (P, K), of the channels (N,) of the SPEC's inputs."""
        return run(np.stack(np.broadcast_arrays(output, *channels), axis=2), theta[:, None], dt)

    return shape


def _laid_out(spec: ModelSpec | EffectSpec, rest: Rest, step: Step, past: tuple[int, int]) -> Response:
    """Return ``_respond`` of a model, of arrays in any order in memory; ``past`` is what it reads late and owns."""

    def run(drive: Array, theta: Array, dt: Steps) -> Array:
        # the loop is compiled for one type and one order
        inputs, along = (np.ascontiguousarray(values, dtype=np.float64) for values in (drive, theta))
        loop = _loop(spec.name, step, rest, (drive.shape[2], len(spec.params), *past))
        found: Array = loop(inputs, along, np.atleast_1d(np.float64(dt)))
        return found

    return run


@cache
def _loop(name: str, step: Step, rest: Rest, sizes: tuple[int, int, int, int]) -> Any:
    inputs, parameters, late, numbers = sizes
    own = step.__module__.startswith("mrfit.")
    parts: dict[str, Any] = {"step": _with_past(name, step, late + numbers > 0, own), "rest": kernel(rest, own)}
    parts |= {"LATE": late, "OWN": numbers, "INPUTS": (0.0,) * inputs, "PARAMETERS": (0.0,) * parameters}
    return kernel(copy_of(_respond, name, parts), own)


def _with_past(name: str, step: Step, reads: bool, own: bool) -> Step:
    """Return a step, compiled, that takes a past, whether or not it reads one; ``own`` is of mrfit itself."""
    made = kernel(step, own)
    return made if reads else kernel(copy_of(_without_past, name, {"step": made}), own)


def _step_entry(state: Any, following: Any, inputs: Any, theta: Any, dt: float, past: Any) -> Any:
    """Take a step by pointers; a negative dt asks for the state at rest."""
    here, now = row(theta, len(PARAMETERS), PARAMETERS), row(inputs, WIRED, INPUTS)
    if dt < 0.0:
        start = rest(now, here)
        for k in range(len(STATE)):
            following[k] = start[k]
        return 0.0
    ends = (row(theta, 0, PARAMETERS), here)
    value, after = step(row(state, 0, STATE), row(inputs, 0, INPUTS), now, ends, dt, past)
    for k in range(len(STATE)):
        following[k] = after[k]
    return value


def _law_entry(state: Any, following: Any, inputs: Any, theta: Any, dt: float, past: Any) -> Any:
    """Evaluate a law without memory."""
    return law(*(row(inputs, WIRED, INPUTS) + row(theta, len(PARAMETERS), PARAMETERS)))


def _constant_entry(state: Any, following: Any, inputs: Any, theta: Any, dt: float, past: Any) -> Any:
    """Evaluate a law of no input."""
    return law(*row(theta, len(PARAMETERS), PARAMETERS))


def _factors_entry(state: Any, following: Any, inputs: Any, theta: Any, dt: float, past: Any) -> Any:
    """Evaluate factors of roles."""
    found = law(*(row(inputs, WIRED, INPUTS) + row(theta, len(PARAMETERS), PARAMETERS)))
    for k in range(len(STATE)):
        following[k] = found[k]
    return 0.0


@dataclass(frozen=True)
class Entry:
    """An element as compiled loops call it: where, its inputs, how many numbers it remembers, reads late, and owns."""

    address: int
    inputs: tuple[str, ...]
    state: int = 0
    late: int = 0
    own: int = 0


def _without_past(state: Any, before: Any, now: Any, theta: Any, dt: float, past: Any) -> Any:
    """Take a step of an element that knows its state alone."""
    return step(state, before, now, theta, dt)


def _on_curve(state: Any, before: Any, now: Any, theta: Any, dt: float, past: Any) -> Any:
    """Take a step along the branch curve whose numbers stand where others have their past."""
    return step(state, before, now, theta, dt, curve_at(past))


@cache
def entry_of(item: Any, curved: bool = False) -> Entry:
    """Return the compiled form of a model or an effect; ``item`` has a ``step`` and ``rest``, or a ``law``.

    One that is ``curved`` has ``step_on_curve``.

    Raises
    ------
    AttributeError
        If it has neither.
    """
    spec = item.SPEC
    needed = dict.fromkeys((*spec.inputs, *(p.needs for p in spec.params if p.needs)))
    signal = ("",) if getattr(spec, "slot", "") == "output" else ()
    inputs = (*signal, *needed)
    zeros, theta = (0.0,) * len(inputs), (0.0,) * len(spec.params)
    parts: dict[str, Any] = {"INPUTS": zeros, "PARAMETERS": theta}
    if curved:
        own, late, numbers = item.step_on_curve.__module__.startswith("mrfit."), 0, 0
        size = len(rest_on_curve(zeros, theta))
        on_curve = copy_of(_on_curve, spec.name, {"step": kernel(item.step_on_curve, own)})
        parts |= {"step": kernel(on_curve, own), "rest": kernel(rest_on_curve)}
        template: Any = _step_entry
    elif isinstance(item, HasStep):
        own = item.step.__module__.startswith("mrfit.")
        late, numbers = getattr(item, "LATE", 0), getattr(item, "OWN", 0)
        stepped = _with_past(spec.name, item.step, late + numbers > 0, own)
        parts |= {"step": stepped, "rest": kernel(item.rest, own)}
        size = len(item.rest(zeros, tuple(p.start for p in spec.params)))
        template = _step_entry
    else:
        own = item.law.__module__.startswith("mrfit.")
        parts |= {"law": kernel(item.law, own)}
        size, late, numbers = len(getattr(item, "ROLES", ())), 0, 0
        template = _factors_entry if size else _law_entry if inputs else _constant_entry
    copied = copy_of(template, f"{spec.name}_curve" if curved else spec.name, parts | {"STATE": (0.0,) * size})
    return Entry(address_of(copied, own), inputs, size, late, numbers)
