"""Energy per cycle of a driven coil: what tells resistance, static hysteresis and eddy currents apart."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from mrfit.core.specs import Array
from mrfit.io.columns import part_of
from mrfit.io.schemas.stages import SeparationRow
from mrfit.signal.cycles import SteadyCycles
from mrfit.signal.harmonics import HarmonicFit, Spectrum, series_at

# Loops whose amplitudes differ by less belong to one group; frequencies closer than this count as one.
SAME_LOOP_AMPLITUDE = 0.1
SAME_LOOP_FREQUENCY = 0.05
NEEDED_FREQUENCIES = 3
# Static loss of loops of several amplitudes: a sum of these powers of the flux amplitude, left out by so much of a loop
STATIC_LOSS_POWERS = (1, 2, 3)
STATIC_LOSS_MISFIT = 0.01
NEEDED_LOOPS = len(STATIC_LOSS_POWERS) + 4
RESISTANCE_ROUNDS = 8


@dataclass(frozen=True, slots=True)
class LoopEnergy:
    """Energies of one steady loop.

    Attributes
    ----------
    recording
        Id of the recording.
    frequency, amplitude, cycles
        Fundamental in Hz, half the peak-to-peak current in A, whole cycles averaged over.
    supplied
        ∮ u·i dt per cycle in J, means removed.
    squared
        ∮ i² dt per cycle in A²·s, mean removed.
    error
        Standard error in J of ∮ u·i dt − R·∮ i² dt, from the noise of u and i.
    volts, amps
        Fourier coefficients of voltage and current above the mean, in V and A.
    """

    recording: str
    frequency: float
    amplitude: float
    cycles: int
    supplied: float
    squared: float
    error: float
    volts: Spectrum = field(repr=False, compare=False)
    amps: Spectrum = field(repr=False, compare=False)

    def flux(self, resistance: float) -> tuple[float, float]:
        """Return the flux amplitude in Wb and ∮ (dλ/dt)² dt in V²·s of the loop at a resistance in Ω."""
        rate = self.volts - resistance * self.amps
        order = 2j * np.pi * self.frequency * np.arange(1, len(rate) + 1)
        waves = HarmonicFit(self.frequency, np.concatenate([[0.0], rate / order]), 0.0)
        return waves.amplitude, float(np.sum(np.abs(rate) ** 2)) / (2 * self.frequency)

    def area(self, resistance: float) -> float:
        """Return the loop's area ∮ i dλ in J at a resistance in Ω."""
        return self.supplied - resistance * self.squared


def loop_of(voltage: Array, current: Array, dt: float, stretch: SteadyCycles, recording: str) -> LoopEnergy:
    """Return the energies of a stretch's mean cycle.

    They come from the Fourier series of u and i, since noise in a sampled current would add its own power to ∮ i² dt.

    Parameters
    ----------
    voltage, current
        Whole recording (N,), V and A.
    dt
        Sample interval in s.
    stretch
        Steady cycles.
    recording
        Id of the recording.
    """
    frequency, current_fit = stretch.fit.frequency, stretch.fit
    voltage_fit = series_at(part_of(voltage, stretch.start, stretch.stop), dt, frequency)
    count = min(current_fit.harmonics, voltage_fit.harmonics) + 1
    amps = current_fit.coefficients
    supplied = float(np.sum(voltage_fit.coefficients[1:count] * np.conj(amps[1:count])).real) / (2 * frequency)
    squared = float(np.sum(np.abs(amps[1:]) ** 2)) / (2 * frequency)
    resistance = supplied / squared if squared > 0.0 else 0.0
    samples = stretch.stop - stretch.start
    # δ∮(u·i − R·i²)dt = ∮ i·δu dt + ∮ (u − 2R·i)·δi dt, averaged over the cycles.
    weight = 1.0 / (frequency * np.sqrt(samples))
    amps_rms = np.sqrt(squared * frequency)
    volts = np.zeros(len(amps), dtype=complex)
    volts[:count] = voltage_fit.coefficients[:count]
    rest_rms = float(np.sqrt(np.sum(np.abs(volts[1:] - 2 * resistance * amps[1:]) ** 2) / 2))
    error = float(weight * np.hypot(amps_rms * voltage_fit.residual, rest_rms * current_fit.residual))
    amplitude = current_fit.amplitude
    return LoopEnergy(
        recording, frequency, amplitude, stretch.cycles, supplied, squared, error, volts[1:count], amps[1:count]
    )


def groups(loops: Sequence[LoopEnergy]) -> list[list[LoopEnergy]]:
    """Return loops grouped by amplitude, groups with enough frequencies only."""
    grouped: list[list[LoopEnergy]] = []
    for loop in sorted(loops, key=lambda p: (p.amplitude, p.frequency, p.recording)):
        if grouped and loop.amplitude <= grouped[-1][0].amplitude * (1 + SAME_LOOP_AMPLITUDE):
            grouped[-1].append(loop)
        else:
            grouped.append([loop])
    return [g for g in grouped if len(distinct_frequencies(g)) >= NEEDED_FREQUENCIES]


def distinct_frequencies(loops: Sequence[LoopEnergy]) -> tuple[float, ...]:
    """Return the different frequencies of loops, rising."""
    distinct: list[float] = []
    for frequency in sorted(loop.frequency for loop in loops):
        if not distinct or frequency > distinct[-1] * (1 + SAME_LOOP_FREQUENCY):
            distinct.append(frequency)
    return tuple(distinct)


def estimate_resistance(loops: Sequence[LoopEnergy]) -> tuple[float, float] | None:
    """Return coil resistance and its standard error in Ω from how energy per cycle varies with frequency.

    W = R·∮ i² dt + a²·(static + eddy·f) over all amplitude groups with at least three frequencies, one R and two loss
    coefficients per group; a is the amplitude. Loops outside of such groups are taken by ``LossesOverCurrent``, where
    they are enough. None if there are neither.
    """
    grouped = groups(loops)
    if _of_uneven_amplitudes(loops, grouped):
        # no more than all of the energy is heat
        begun = min(loop.supplied / loop.squared for loop in loops)
        found = losses_over_current(loops, dict.fromkeys((loop.recording for loop in loops), begun))
        return begun - float(found.solution[-1]), float(np.sqrt(found.covariance[-1, -1]))
    if not grouped:
        return None
    members = [loop for group in grouped for loop in group]
    rows = np.zeros((len(members), 1 + 2 * len(grouped)))
    owners = [k for k, group in enumerate(grouped) for _ in group]
    for row, k, loop in zip(rows, owners, members, strict=True):
        row[0], row[1 + 2 * k], row[2 + 2 * k] = loop.squared / loop.amplitude**2, 1.0, loop.frequency
    squares = np.array([loop.amplitude**2 for loop in members])
    supplied = np.array([loop.supplied for loop in members]) / squares
    means = [float(np.mean([loop.amplitude for loop in group])) for group in grouped]
    solution, covariance = _weighted(rows, supplied, np.array([loop.error for loop in members]) / squares)
    errors = [_error(loop, float(solution[0]), means[k]) for loop, k in zip(members, owners, strict=True)]
    solution, covariance = _weighted(rows, supplied, np.array(errors) / squares)
    return float(solution[0]), float(np.sqrt(covariance[0, 0]))


def _error(loop: LoopEnergy, resistance: float, amplitude: float) -> float:
    """Return a loop's standard error in J once its area is scaled to its group's amplitude.

    Losses grow as a power of the amplitude that is 2 within about 1, so the scaling is that uncertain.
    """
    return float(np.hypot(loop.error, loop.area(resistance) * np.log(loop.amplitude / amplitude)))


@dataclass(frozen=True, slots=True)
class LossesOverCurrent:
    """Loop areas of all amplitudes and frequencies as area = Σ_p h_p·Λ^p + G·∮ (dλ/dt)² dt − resistance_error·∮ i² dt.

    Λ is the flux amplitude: hysteresis depends on it alone, eddy currents on the rate of the flux.

    Attributes
    ----------
    loops, rows
        The loops, and the factors of h_p, G and the resistance error in each, shape (N, K).
    solution, covariance
        Estimates (K,) and their covariance (K, K), widened where the scatter is larger than the errors say.
    """

    loops: tuple[LoopEnergy, ...]
    rows: Array
    solution: Array
    covariance: Array

    def separations(self) -> list[SeparationRow]:
        """Return the static and the eddy loss of every loop at its current and frequency."""
        resistance = float(self.solution[-1]), float(np.sqrt(self.covariance[-1, -1]))
        found = []
        for loop, row in sorted(
            zip(self.loops, self.rows, strict=True), key=lambda p: (p[0].amplitude, p[0].frequency)
        ):
            parts = np.zeros((2, len(row)))
            parts[0, :-2], parts[1, -2] = row[:-2], row[-2] / loop.frequency
            (static, eddy), errors = parts @ self.solution, np.sqrt(np.diag(parts @ self.covariance @ parts.T))
            known = (float(static), float(errors[0]), float(eddy), float(errors[1]), *resistance)
            found.append(_row(loop.amplitude, [loop.frequency], known))
        return found


def _of_uneven_amplitudes(loops: Sequence[LoopEnergy], grouped: list[list[LoopEnergy]]) -> bool:
    """Return whether some loops are in no group of one amplitude, and all are enough for ``losses_over_current``."""
    enough = len(loops) >= NEEDED_LOOPS and len(distinct_frequencies(loops)) >= NEEDED_FREQUENCIES
    return enough and sum(map(len, grouped)) < len(loops)


def losses_over_current(loops: Sequence[LoopEnergy], resistances: dict[str, float]) -> LossesOverCurrent:
    """Return the losses of loops whose amplitudes differ over frequency.

    Parameters
    ----------
    loops
        Loops of all recordings.
    resistances
        Resistance used for each recording, in Ω.
    """
    used = [resistances[loop.recording] for loop in loops]
    areas = np.array([loop.area(r) for loop, r in zip(loops, used, strict=True)])
    errors = np.hypot([loop.error for loop in loops], STATIC_LOSS_MISFIT * np.abs(areas))
    off, rows, solution, covariance = 0.0, np.empty(0), np.empty(0), np.empty(0)
    # the flux is that of the resistance once its error is known
    for _ in range(RESISTANCE_ROUNDS):
        flux = np.array([loop.flux(r - off) for loop, r in zip(loops, used, strict=True)])
        powers = [flux[:, 0] ** p for p in STATIC_LOSS_POWERS]
        rows = np.stack([*powers, flux[:, 1], -np.array([loop.squared for loop in loops])], axis=1)
        solution, covariance = _weighted(rows, areas, errors)
        off = float(solution[-1])
    return LossesOverCurrent(tuple(loops), rows, solution, covariance)


def separate(loops: Sequence[LoopEnergy], resistances: dict[str, float]) -> list[SeparationRow]:
    """Return the separation of loop area for every amplitude, or for every loop where their amplitudes differ.

    Parameters
    ----------
    loops
        Loops of all recordings.
    resistances
        Resistance used for each recording, in Ω.
    """
    grouped = groups(loops)
    if _of_uneven_amplitudes(loops, grouped):
        return losses_over_current(loops, resistances).separations()
    separations: list[SeparationRow] = []
    for group in grouped:
        mean = float(np.mean([loop.amplitude for loop in group]))
        scale = np.array([(mean / loop.amplitude) ** 2 for loop in group])
        rows = np.array([[1.0, loop.frequency, -loop.squared * s] for loop, s in zip(group, scale, strict=True)])
        areas = np.array([loop.area(resistances[loop.recording]) for loop in group]) * scale
        errors = np.array([_error(loop, resistances[loop.recording], mean) for loop in group]) * scale
        solution, covariance = _weighted(rows, areas, errors)
        pairs = [x for pair in zip(solution, np.sqrt(np.diag(covariance)), strict=True) for x in pair]
        separations.append(_row(mean, list(distinct_frequencies(group)), [float(x) for x in pairs]))
    return separations


def _row(amplitude: float, frequencies: list[float], parts: Sequence[float]) -> SeparationRow:
    """Return a row of the static loss, the eddy-current loss and the error of R, each before its standard error."""
    names = ("static", "static_error", "eddy", "eddy_error", "resistance_error", "resistance_error_error")
    return SeparationRow(amplitude=amplitude, frequencies=frequencies, **dict(zip(names, parts, strict=True)))


def _weighted(rows: Array, values: Array, errors: Array) -> tuple[Array, Array]:
    """Return weighted least squares and its covariance, widened where the scatter is larger than the errors say."""
    floor = 1e-9 * float(np.max(np.abs(values)))
    weights = 1.0 / np.maximum(errors, floor)
    scaled = rows * weights[:, None]
    # Columns differ by decades; unit columns keep the solution accurate.
    norms = np.linalg.norm(scaled, axis=0)
    solution = np.linalg.lstsq(scaled / norms, values * weights, rcond=None)[0] / norms
    covariance = np.linalg.pinv((scaled / norms).T @ (scaled / norms)) / np.outer(norms, norms)
    freedom = len(values) - rows.shape[1]
    if freedom > 0:
        scatter = float(np.sum(((values - rows @ solution) * weights) ** 2)) / freedom
        covariance = covariance * max(1.0, scatter)
    return solution, covariance
