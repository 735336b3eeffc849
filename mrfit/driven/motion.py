"""A mass on a force model, driven by a force or by the acceleration of its base: what moves it in, its motion out.

    m*x'' + F(x, x', …; θ) = u(t)             driven by a force u in N
    m*(x'' + x_g'') + F(x, x', …; θ) = 0      driven by a base acceleration x_g'' in m/s^2; x is relative to the base

Written ``MODEL@force`` or ``MODEL@base``, with what is predicted behind where that is not the displacement, as in
``boucwen+delay@base-acceleration``. The mass begins at rest, on a law that has stood still.

Between samples the drive is band-limited: a Kaiser-windowed sinc over 48 samples to either side, the record continued
point-symmetrically beyond its ends. It is exact to 1e-8 for what lies below 0.43 of the sampling rate.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from hashlib import sha256

import numpy as np

from mrfit.core.channels import EXCITATIONS, MOTION_OF_MASS
from mrfit.core.remembered import remembered
from mrfit.core.specs import Array, ModelSpec, Param, Response
from mrfit.driven.integrator import PER_SAMPLE, MovingMass, StepPattern, moved_mass
from mrfit.errors import ConfigError
from mrfit.simulate.current_dependence import CurrentDependence
from mrfit.simulate.program import DEFAULTS, DamperProgram

MASS = Param("mass", "kg", 1e-3, 1e7, 1.0, "log", "inertia", "mass that the excitation moves")
STEP_TOLERANCE = 5e-6
# Masses simulated side by side
_LANES = 2
# Samples to either side from which the drive is interpolated, and the window that they bear
_SINC_SAMPLES, _SINC_WINDOW = 48, ("kaiser", 18.0)
BAND_LIMIT = 0.43
"""Share of the sampling rate up to which the drive is known between samples."""


def split(name: str) -> tuple[str, str, str]:
    """Return the written force model, what drives it, and what is predicted; the last two empty where nothing does.

    Raises
    ------
    ConfigError
        If the drive or the prediction is none that there is.
    """
    model, driven, written = name.partition("@")
    drive, _, output = written.partition("-")
    output = output.replace("-", "_") or MOTION_OF_MASS[0]
    if driven and (drive not in EXCITATIONS or output not in MOTION_OF_MASS):
        ends = ", ".join(o.replace("_", "-") for o in MOTION_OF_MASS)
        raise ConfigError(f"'{name}': behind @ stands {' or '.join(EXCITATIONS)}, then -OUTPUT, one of {ends}")
    return model, drive, output if driven else ""


def spec_around(law: ModelSpec, name: str) -> ModelSpec:
    """Return the SPEC of a mass on a force model.

    Raises
    ------
    ConfigError
        If the model's output is no force.
    """
    _, drive, output = split(name)
    if law.output != "force":
        raise ConfigError(f"'{name}': a mass moves on a model of force; '{law.name}' predicts {law.output}")
    pushed = "excitation_force" if drive == "force" else "-mass*base_acceleration"
    return replace(
        law,
        name=name,
        title=f"Mass on: {law.title}",
        equation=f"mass*x'' + F(x, x') = {pushed};  {law.equation}",
        inputs=(EXCITATIONS[drive], *(n for n in law.inputs if n not in MOTION_OF_MASS)),
        output=output,
        params=(*law.params, MASS),
        linear=(),
        rate_independent=False,
        passive=None,
        jumps=(),
        rests_at="",
    )


def response_around(
    law: ModelSpec, name: str, dependence: CurrentDependence | None, tolerance: float | None = None
) -> Response:
    """Return the batched response of a mass on a force model, whose SPEC is given.

    The tolerance is that of a step; None is ``STEP_TOLERANCE``. All masses of a batch take the steps of the first. With
    a tolerance of its own all that follow do, too: as parameters move, what is simulated then changes smoothly.
    """
    model, drive, output = split(name)
    spec = spec_around(law, name)
    taken: dict[bytes, StepPattern] = {}

    def simulate(inputs: Array, theta: Array, dt: float) -> Array:
        """Return the motion (P, N) of inputs (C, N), parameters (P, K) and dt in s."""
        given = dict(zip(spec.inputs, inputs, strict=True))
        pushed, carrying = between_samples(inputs[0]), inputs[0] if drive == "base" else 0.0
        known = {**DEFAULTS, "current": 0.0, **given}

        of_these = sha256(inputs.tobytes()).digest()
        pattern, follows = taken.get(of_these), of_these in taken
        if pattern is None:
            pattern = np.full(len(pushed), -1, np.int8)

        def lane(values: Array, follows: bool = True) -> Array:
            program, mass = DamperProgram(model, values[:-1], dependence, False, dt / PER_SAMPLE), float(values[-1])
            chain, names = program.chain, program.channels
            places = np.array([names.index(n) if n in names else -1 for n in MOTION_OF_MASS[:3]])
            others = np.array([np.broadcast_to(known.get(n, 0.0), inputs.shape[1]) for n in names]).T
            others = np.ascontiguousarray(others[:1] if np.all(others == others[0]) else others)
            push = pushed * (1.0 / mass if drive == "force" else -1.0)
            speed = dt * max(np.abs(push[: PER_SAMPLE + 1]).max(), 1e-6 * np.abs(push).max(), 1e-290)
            body = MovingMass(chain, places, others, push, dt / PER_SAMPLE, mass)
            found = moved_mass(body, tolerance or STEP_TOLERANCE, speed, pattern, follows)
            rows = [*found[:3], found[2] + carrying]
            motion: Array = rows[MOTION_OF_MASS.index(output)]
            return motion

        first = [] if follows else [lane(theta[0], False)]
        if tolerance:
            taken[of_these] = pattern
        with ThreadPoolExecutor(_LANES) as pool:
            return np.stack([*first, *pool.map(lane, theta[len(first) :])])

    return simulate


@remembered
def between_samples(values: Array) -> Array:
    """Return a band-limited signal (N,) at ``PER_SAMPLE`` times the rate, from the first sample to the last."""
    from scipy.signal import firwin, upfirdn

    # a record shorter than the window is continued again at the ends of what continues it
    continued = np.pad(values, _SINC_SAMPLES, "reflect", reflect_type="odd")
    taps = PER_SAMPLE * firwin(2 * _SINC_SAMPLES * PER_SAMPLE + 1, 1.0 / PER_SAMPLE, window=_SINC_WINDOW)
    found = upfirdn(taps, continued, PER_SAMPLE)
    first = 2 * _SINC_SAMPLES * PER_SAMPLE
    return found[first : first + (len(values) - 1) * PER_SAMPLE + 1]
