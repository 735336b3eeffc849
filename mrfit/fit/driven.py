"""Fits of a mass that a force or its base drives, in two phases.

First by inverse dynamics: the law is fitted to the force that the logged motion asks for, u - m*x'', its derivatives
those of a Fourier series as far as the excitation reaches, or of local polynomials. There begins the second, the output
error of the free run.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.channels import EXCITATIONS, MOTION_OF_MASS, OUTPUT_ON_MASS, unit_of
from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array
from mrfit.driven.motion import BAND_LIMIT, STEP_TOLERANCE, response_around, split
from mrfit.errors import ConfigError, DataError
from mrfit.io.dataset import Dataset
from mrfit.io.schemas.fit import Caution
from mrfit.search import run as search
from mrfit.search.cube import Cube, cube_of
from mrfit.search.descent import Descent, without_forgotten
from mrfit.search.limits import Limits
from mrfit.search.parts import SegmentPart
from mrfit.search.problem import LeastSquaresProblem, SegmentBlock, full_block
from mrfit.search.starts import at_scales, data_starts, to_points
from mrfit.settings.fit import Settings
from mrfit.signal.smoothing import Drive, smooth
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_levels import base_of

# Share of the excitation's largest line below which a line is none; share of its power that may lie beyond the band
LEAST_LINE, ALIASED = 1e-2, 0.05
# Greatest force at rest over the greatest that drives
LARGEST_OFFSET = 10.0
# Of the two phases: evaluations for each parameter and one more, and the share of the squared cost that each may leave.
# A law without its mass forgets soon: most of the cycle before the first one compared is left out.
INVERSE_DESCENT = Descent(20, 1e-4, 0.0, shortens=True)
# The free run may err by this share of what the fit leaves of the record; tolerances of a step that are tried
SOLVER_SHARE, TOLERANCES = 0.005, tuple(STEP_TOLERANCE * 8.0**k for k in (3, 2, 1, 0))
# Share of the largest residual by which leaving out what comes long before the first sample may change any, near the
# optimum and far from it
FORGOTTEN, FORGOTTEN_ROUGHLY = 1e-3, 0.05
# Speed as a record begins, as a share of its scatter, from which the mass did not stand still
LEAST_START_SPEED = 0.1
INERTIA = "inertia.m"
INERTIA_EFFECT = INERTIA.partition(".")[0]
# Place of the one motion that is beside that of the base
ABSOLUTE = 3


def with_drive(settings: Settings, recordings: Mapping[str, Recording]) -> Settings:
    """Return settings whose model is written as a mass that is driven, where they ask for one.

    Raises
    ------
    ConfigError
        If the mass is neither given nor free, or given to what nothing drives.
    DataError
        If a log holds force and base acceleration, or no motion, or its excitation is not known between samples.
    """
    if settings.driven_by == "none":
        if settings.mass:
            raise ConfigError(f"--mass {settings.mass} is for a mass that is driven: add --driven-by force or base")
        return settings
    channel, logs = EXCITATIONS[settings.driven_by], list(recordings.values())
    for log in logs:
        if set(EXCITATIONS.values()) <= set(log.channels):
            what = " and ".join(EXCITATIONS.values())
            raise DataError(f"{log.source}: holds {what}, and one of them drives; leave the other out (ignore = […])")
        if channel in log.channels:
            _check_band(log, np.asarray(log.channels[channel]))
    able = [log for log in logs if channel in log.channels] or logs
    output = next((n for n in MOTION_OF_MASS if all(n in log.channels for log in able)), MOTION_OF_MASS[0])
    fixed, bounds, weight = settings.fixed, settings.bounds, 1.0
    if settings.mass != "free":
        fixed = (*fixed, ("mass", _mass_of(settings.mass)))
        weight = fixed[-1][1] if settings.driven_by == "base" else 1.0
    if settings.mass != "free" or settings.driven_by != "base":
        largest = max(
            (float(np.abs(log.channels[channel]).max()) for log in logs if channel in log.channels), default=0.0
        )
        bounds = (*bounds, *_offset_bounds(settings, LARGEST_OFFSET * weight * largest))
    written = f"{settings.model}@{settings.driven_by}-{output.replace('_', '-')}"
    order = "0" if settings.current_order == "auto" else settings.current_order
    name = settings.fit_name
    return replace(settings, name=name, model=written, fixed=fixed, bounds=bounds, current_order=order)


def _offset_bounds(settings: Settings, largest: float) -> list[tuple[str, float, float]]:
    """Return bounds of forces at rest that the user says nothing of; far wider ones hide what else is determined."""
    said = {row[0] for row in (*settings.bounds, *settings.start, *settings.fixed)}
    found = [p for p in assemble(settings.model).spec.params if p.role == "offset" and p.unit == "N"]
    return [(p.name, max(p.low, -largest), min(p.high, largest)) for p in found if largest > 0.0 and p.name not in said]


def _mass_of(text: str) -> float:
    try:
        mass = float(text)
    except ValueError:
        mass = np.nan
    if not 0.0 < mass < np.inf:
        given = f"--mass {text} is no mass" if text else "a mass is driven, and none is given"
        raise ConfigError(f"{given}: give it in kg (--mass 2.0), or fit it (--mass free)")
    return mass


def _check_band(log: Recording, values: Array) -> None:
    power = np.abs(np.fft.rfft((values - values.mean()) * np.hanning(len(values)))) ** 2
    beyond = float(power[round(2 * BAND_LIMIT * len(power)) :].sum() / max(power.sum(), 1e-300))
    if beyond > ALIASED:
        raise DataError(
            f"{log.source}: {100 * beyond:.0f} % of the excitation's power lies above {BAND_LIMIT:g} of the sampling "
            "rate, so that it is not known between samples (aliased or white): log it faster, or filtered"
        )


@dataclass(frozen=True)
class OutputErrorDescent(Descent):
    """Strategy: a descent of the free run, simulated roughly at first and then as closely as the noise asks."""

    def thinned(self, posed: LeastSquaresProblem, starts: Array) -> LeastSquaresProblem:
        """Return the problem on thinned data, roughly simulated, without what the mass forgets."""
        thin = at_tolerance(super().thinned(posed, starts), TOLERANCES[0])
        return without_forgotten(thin, starts, FORGOTTEN_ROUGHLY)

    def closely(self, posed: LeastSquaresProblem, points: Array) -> LeastSquaresProblem:
        """Return the problem on all data, see ``within_noise``, without what the mass forgets."""
        return without_forgotten(within_noise(posed, points), points, FORGOTTEN)


OUTPUT_ERROR_DESCENT = OutputErrorDescent(30, 1e-7, 0.0, thinned_tolerance=5e-4)


def at_tolerance(posed: LeastSquaresProblem, tolerance: float) -> LeastSquaresProblem:
    """Return a problem of driven masses whose steps may err by a tolerance, see ``motion.response_around``."""
    name, dependence = posed.assembly.recipe or (posed.assembly.name, None)
    response = response_around(assemble(split(name)[0], dependence).spec, name, dependence, tolerance)
    return replace(posed, assembly=replace(posed.assembly, simulate=response))


def within_noise(posed: LeastSquaresProblem, points: Array) -> LeastSquaresProblem:
    """Return a problem of driven masses that is simulated no closer than the noise of its records asks.

    The error of a tolerance is the difference to an eighth of it, which halves the steps or nearly so.

    Parameters
    ----------
    posed
        What is fitted.
    points
        Near the optimum in the cube, (1, F): what they leave of the records is taken as noise.
    """
    made = [at_tolerance(posed, t) for t in TOLERANCES]
    rough = made[0].residuals(points)
    for own, closer in zip(made, made[1:], strict=False):
        close = closer.residuals(points)
        if not np.linalg.norm(close - rough) > SOLVER_SHARE * np.linalg.norm(close):
            return own
        rough = close
    return made[-1]


def inverse_dynamics(
    parts: Sequence[SegmentPart], recordings: Mapping[str, Recording], settings: Settings, cube: Cube
) -> tuple[Cube, list[dict[str, float]]]:
    """Return the cube with the scales that the motion gives, and the start values of the law fitted to its force.

    Parameters
    ----------
    parts
        Training parts.
    recordings
        Recordings by id.
    settings
        Of the fit, with the drive in the model.
    cube
        Of the driven mass.
    """
    law_name, drive, output = split(settings.model)
    mass = cube.params[-1]
    held = len(cube.params) - 1 not in cube.free or drive == "base"
    law = assemble(law_name if held else f"{law_name}+{INERTIA_EFFECT}")
    logs = (recordings[p.segment.recording] for p in parts)
    carried = mass.start * held
    blocks = [_force_block(p, log, law.spec.inputs, (output, carried)) for p, log in zip(parts, logs, strict=True)]
    names, base = set(law.spec.names), base_of(settings.model)
    bounds = {n: (low, high) for n, low, high in settings.bounds if n in names}
    start, fixed = ({n: v for n, v in given if n in names} for given in (settings.start, settings.fixed))
    if not held:
        bounds[INERTIA] = (mass.low, max(mass.high if "mass" in dict(settings.start) else 1e4, mass.low * 10))
    own = at_scales(cube_of(law.spec, bounds, start, fixed), blocks, base)
    points = to_points(own, data_starts(blocks, base, None, start) or [{}])
    posed = LeastSquaresProblem(blocks, np.ones(len(blocks)), law, own)
    rng = np.random.default_rng(settings.seed)
    ended = search.run(posed, points, Limits(seconds=settings.seconds), rng, INVERSE_DESCENT)
    found = dict(zip(law.spec.names, own.to_theta(ended.point[None, :])[0].tolist(), strict=True))
    found["mass"] = found.pop(INERTIA, mass.start)
    scaled = {p.name: p.start for p in own.params if p.fixed}
    params = tuple(replace(p, start=scaled.get(p.name, p.start)) for p in cube.params)
    return replace(cube, params=params), [{n: v for n, v in found.items() if n not in dict(settings.start)}]


def _force_block(part: SegmentPart, log: Recording, inputs: Sequence[str], of: tuple[str, float]) -> SegmentBlock:
    """Return a part with the motion in, and the force out that it asks for: u, less mass times its acceleration."""
    segment, rows, (output, mass) = part.segment, part.drive.values, of
    excitation, first, order = rows[0], part.drive.warm_up, MOTION_OF_MASS.index(output)
    base = segment.drive == EXCITATIONS["base"]
    others = (n for n in inputs if n not in MOTION_OF_MASS)
    known = dict(zip((segment.drive, *others), rows, strict=True))
    if segment.cycles:
        period = rows.shape[1] - first
        mean = np.asarray(part.output)[: segment.cycles * period].reshape(segment.cycles, period).mean(axis=0)
        moved = _by_series(mean, excitation[-period:], order, part.dt)
        motion = [np.resize(np.roll(v, first % period), rows.shape[1]) for v in moved]
    else:
        motion = _by_polynomials(segment, log, order)
    target = excitation * (not base) - mass * (motion[2] + excitation * base)
    drive = np.stack([{**known, **dict(zip(MOTION_OF_MASS, motion, strict=False))}[n] for n in inputs])
    return full_block(segment, Drive(drive, first, part.dt, "derivatives of the motion", {}, None), target[first:])


def _by_series(values: Array, excitation: Array, order: int, dt: float) -> list[Array]:
    """Return displacement, velocity and acceleration (P,) of one cycle, as far as the excitation has lines."""
    lines = np.abs(np.fft.rfft(excitation))
    last = int(np.flatnonzero(lines > LEAST_LINE * lines[1:].max()).max())
    spectrum = np.fft.rfft(values - excitation if order == ABSOLUTE else values)
    spectrum[last + 1 :] = 0.0
    rates, mean = 2j * np.pi * np.fft.rfftfreq(len(values), dt), spectrum[0] * (order == 0)
    rates[0] = 1.0
    found = []
    for k in range(3):
        whole = spectrum * rates ** (k - min(order, 2))
        whole[0] = mean * (k == 0)
        found.append(np.fft.irfft(whole, len(values)))
    return found


def _by_polynomials(segment: Segment, log: Recording, order: int) -> list[Array]:
    """Return the same of a motion that does not repeat, over part and lead-in; integrals without their trend.

    The trend is that of the displacement, so that an offset and what was there before the record are taken off at once.
    A line taken off a velocity would become a parabola as large as the motion.
    """
    from scipy.integrate import cumulative_trapezoid

    values = np.asarray(log.channels[MOTION_OF_MASS[order]])
    if order == ABSOLUTE:
        values = values - np.asarray(log.channels[segment.drive])
    place, time = min(order, 2), log.dt * np.arange(len(values))
    made = {MOTION_OF_MASS[place]: values}
    path = values - values.mean()
    for name in reversed(MOTION_OF_MASS[:place]):
        made[name] = path = cumulative_trapezoid(path, dx=log.dt, initial=0)
    trend = np.polynomial.Polynomial.fit(time, path, place)
    for degree, name in enumerate(MOTION_OF_MASS[:place]):
        made[name] = made[name] - trend.deriv(degree)(time)
    plain = replace(segment, cycles=0, frequency=0.0)
    return list(smooth(replace(log, channels=made), plain, MOTION_OF_MASS[:3]).values)


def moving_starts(parts: Sequence[SegmentPart], recordings: Mapping[str, Recording]) -> list[Caution]:
    """Return a warning of masses that move as their record begins; without cycles they are simulated from rest."""
    found = []
    for part in parts:
        segment, log = part.segment, recordings[part.segment.recording]
        output = next((k for k, n in enumerate(MOTION_OF_MASS[:2]) if n in log.channels), None)
        if segment.drive not in EXCITATIONS.values() or segment.cycles or part.before or output is None:
            continue
        speed = _by_polynomials(_whole(segment, log), log, output)[1]
        if abs(speed[0]) > LEAST_START_SPEED * float(np.std(speed)):
            found.append(f"{log.id} ({speed[0]:.3g} m/s)")
    if not found:
        return []
    logs = ", ".join(dict.fromkeys(found))
    told = (
        f"the mass moves as the record begins in {logs}, and is simulated from rest: log from rest, or "
        "state the frequency at which whole cycles repeat ([condition] of the channel map)"
    )
    return [Caution(kind="moving-start", text=told)]


def _whole(segment: Segment, log: Recording) -> Segment:
    return replace(segment, start=0, stop=log.samples, warm_up=0)


def tests_of_law(dataset: Dataset, driven_by: str, mass: str) -> Dataset:
    """Return logs of driven masses as tests of the law: the motion in, and out u - m*x'', the force on what moves.

    Where the mass is free, it is that of the plane through displacement, velocity and acceleration next to the force.

    Parameters
    ----------
    dataset
        Segments of logs with an excitation, and the logs.
    driven_by
        ``force`` or ``base``.
    mass
        In kg, or ``free``.

    Raises
    ------
    ConfigError
        If the mass is neither given nor free, or free where the base drives.
    DataError
        If a log has no excitation or no motion.
    """
    if mass == "free" and driven_by == "base":
        raise ConfigError("--mass free: where its base drives it, only the force over the mass is known; give it in kg")
    given = None if mass == "free" else _mass_of(mass)
    found = [_motion_and_push(s, dataset.recordings[s.recording], driven_by) for s in dataset.segments]
    if given is None:
        motion, push = np.hstack([m for m, _, _ in found]), np.concatenate([p for _, p, _ in found])
        given = float(np.linalg.lstsq(np.vstack([motion, np.ones_like(push)]).T, push, rcond=None)[0][2])
    recordings, segments = dict(dataset.recordings), list[Segment]()
    for segment, (motion, push, carried) in zip(dataset.segments, found, strict=True):
        log, force = recordings[segment.recording], push - given * (motion[2] + carried)
        others = {n: v for n, v in log.channels.items() if n not in (*EXCITATIONS.values(), *MOTION_OF_MASS)}
        channels = {**others, **dict(zip(MOTION_OF_MASS, motion, strict=False)), OUTPUT_ON_MASS: force}
        recordings[log.id] = replace(log, channels=channels, units={n: unit_of(n) for n in channels})
        # the first cycle leads the law in
        lead, cycles = (segment.samples // segment.cycles, segment.cycles - 1) if segment.cycles > 1 else (0, 0)
        warm_up = lead if segment.cycles else segment.warm_up
        moved = replace(segment, drive=MOTION_OF_MASS[0], start=segment.start + lead, warm_up=warm_up, cycles=cycles)
        path = motion[0, segment.start : segment.stop]
        segments.append(replace(moved, amplitude=float(np.ptp(path)) / 2.0, offset=float(np.mean(path))))
    return Dataset(segments, recordings)


def _motion_and_push(segment: Segment, log: Recording, driven_by: str) -> tuple[Array, Array, Array]:
    """Return displacement, velocity and acceleration (3, N) of a log, the force and the acceleration that drive it."""
    channel = EXCITATIONS[driven_by]
    output = next((n for n in MOTION_OF_MASS if n in log.channels), "")
    if channel not in log.channels or not output:
        raise DataError(f"{log.source}: no {'motion of the mass' if channel in log.channels else channel} in this log")
    excitation, order = np.asarray(log.channels[channel]), MOTION_OF_MASS.index(output)
    if segment.cycles:
        motion = _by_series(np.asarray(log.channels[output]), excitation, order, log.dt)
    else:
        # of the whole log: other segments may be parts of it too
        motion = _by_polynomials(_whole(segment, log), log, order)
    base = excitation * (driven_by == "base")
    return np.stack(motion), excitation - base, base
