"""Functions of ``mrfit.apply``: the work of the commands, on a fit in memory."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from mrfit.apply.car import CONTROLS, Car, Control, Timing
from mrfit.apply.damper import Damper, damper_of
from mrfit.apply.laws import Law, law_of
from mrfit.apply.motion import Motion, of_recordings
from mrfit.apply.ride import QuarterCar
from mrfit.apply.ride import quarter_car as study
from mrfit.apply.roads import Road, road
from mrfit.apply.series import Inversion, inversion
from mrfit.apply.tracking import SCHEMES, Gains, TrackingStudy, demands_of, tracking
from mrfit.core.arguments import check_arguments
from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.errors import ConfigError, DataError
from mrfit.io.bars import Heard, shown
from mrfit.settings.apply import Amplifier

if TYPE_CHECKING:
    from mrfit.api.fitting import FitResult


def as_damper(fit: "FitResult | Damper") -> Damper:
    """Return the damper of a fit, or a damper as it is."""
    return fit if isinstance(fit, Damper) else damper_of(fit)


def as_motions(motion: "Motion | Recording | Iterable[Motion | Recording]", damper: Damper) -> list[Motion]:
    """Return motions of what a call was given."""
    given = [motion] if isinstance(motion, (Motion, Recording)) else list(motion)
    found: list[Motion] = []
    for one in given:
        needs = damper.assembly.spec.inputs
        found += [one] if isinstance(one, Motion) else of_recordings([one], needs, damper.output)
    if not found:
        raise ConfigError("there is no motion; give a log or mrfit.apply.sine(frequency, amplitude)")
    return found


@check_arguments
def invert(
    fit: "FitResult | Damper",
    motion: Motion | Recording,
    desired: Array | Law | str | None = None,
    amplifier: Amplifier | None = None,
    progress: Heard = True,
) -> Inversion:
    """Return the current for a desired force at every sample of a motion.

    Parameters
    ----------
    fit
        A fit with one set of parameters for all currents, or ``mrfit.apply.damper(...)``.
    motion
        A log, or ``mrfit.apply.sine(...)``.
    desired
        Forces (N,), a law as ``"c=2e4"``, or None: the force that the log measured.
    amplifier
        What coil and amplifier allow.
    progress
        Whether to show a bar in a notebook and on a terminal, or a function called as ``progress(what, done, total)``.

    Raises
    ------
    DataError
        If the fit does not depend on current, or a channel is missing.
    """
    damper = as_damper(fit)
    moved = as_motions(motion, damper)[0]
    with shown(progress) as told:
        return inversion(damper, moved.channels, wanted(damper, moved, desired), moved.dt, amplifier, told)


@check_arguments
def track(  # noqa: PLR0913
    fit: "FitResult | Damper",
    motions: "Motion | Recording | Iterable[Motion | Recording]",
    laws: "str | Law | Iterable[str | Law]",
    schemes: Iterable[str] = SCHEMES,
    plant: "FitResult | Damper | None" = None,
    amplifier: Amplifier | None = None,
    gains: Gains | None = None,
    progress: Heard = True,
) -> TrackingStudy:
    """Track the forces of laws by feedforward, feedback and both.

    Parameters
    ----------
    fit
        Whose inverse the controller has.
    motions
        Logs, or ``mrfit.apply.sine(...)``.
    laws
        As ``"c=2e4"`` and ``"k=-1e5,c=1e4"``.
    schemes
        Of ``feedforward``, ``feedback``, ``both`` and ``uninverted``.
    plant
        What answers; default: the fit itself.
    amplifier, gains
        What coil and amplifier allow, and the feedback's gains.
    progress
        Whether to show a bar in a notebook and on a terminal, or a function called as ``progress(what, done, total)``.
    """
    damper = as_damper(fit)
    written = [laws] if isinstance(laws, (str, Law)) else list(laws)
    chosen = [law_of(one) if isinstance(one, str) else one for one in written]
    tasks = [(m, demands_of(chosen, m, damper)) for m in as_motions(motions, damper)]
    answers = damper if plant is None else as_damper(plant)
    with shown(progress) as told:
        return tracking(damper, answers, tasks, tuple(schemes), amplifier, gains, told)


@check_arguments
def quarter_car(  # noqa: PLR0913
    fit: "FitResult | Damper",
    car: Car | None = None,
    controls: Iterable[Control] = (),
    roads: Iterable[Road] = (),
    timing: Timing | None = None,
    amplifier: Amplifier | None = None,
    check: bool = True,
    progress: Heard = True,
) -> QuarterCar:
    """Drive a quarter car on a damper.

    Parameters
    ----------
    fit
        The damper.
    car
        Masses, spring, tyre.
    controls
        Default: all, at 2000 N*s/m.
    roads
        Of ``mrfit.apply.road("bump")``, ``"A"`` to ``"D"``, ``"sweep"``; default: the bump.
    timing
        Sample time of the control, and steps of the simulation in it.
    amplifier
        What coil and amplifier allow.
    check
        Whether to simulate the first road adaptively too.
    progress
        Whether to show a bar in a notebook and on a terminal, or a function called as ``progress(what, done, total)``.
    """
    chosen = tuple(controls) or tuple(Control(name) for name in CONTROLS)
    driven = tuple(roads) or (road("bump"),)
    damper = as_damper(fit)
    with shown(progress) as told:
        return study(damper, car or Car(), chosen, driven, timing or Timing(), amplifier, check, told)


def wanted(damper: Damper, motion: Motion, desired: Array | Law | str | None) -> Array:
    """Return the desired force at every sample of a motion.

    Raises
    ------
    DataError
        If none is given and none was measured, or it has another length.
    """
    if desired is None:
        if motion.force is None:
            raise DataError(
                f"{motion.name}: no {damper.output} was measured to be wanted again; "
                "give a law (--law) or a file (--desired)"
            )
        return np.asarray(motion.force, dtype=np.float64)
    if isinstance(desired, str):
        desired = law_of(desired)
    x, v, _ = damper.motion
    force = desired.force(motion.channels[x], motion.channels[v]) if isinstance(desired, Law) else np.asarray(desired)
    if force.shape != (motion.samples,) or not np.isfinite(force).all():
        raise DataError(f"{motion.name}: {motion.samples} finite forces are needed, not an array {force.shape}")
    return force
