"""A voltage-driven coil with iron: u = R i + d(lambda)/dt, i = i_an(lambda) + stops(lambda) + (d lambda/dt)/R_eddy.

The hysteresis law is magnetic: the current that a flux linkage needs is a saturating anhysteretic curve
a sinh(lambda/b) plus stop operators in lambda. An amplifier of EMF e and output resistance R_out drives it.
"""

from dataclasses import dataclass, field
from math import inf

import numpy as np

from datasets.rig.stop import Array, StopLaw

NEWTON_STEPS = 3


def default_hysteresis() -> StopLaw:
    """Return eight stops between 1 and 45 mWb that together need 0.18 A: the loop's width is 5 to 15 % of its range."""
    thresholds = np.geomspace(0.001, 0.045, 8)
    share = np.linspace(1.0, 1.6, 8)
    return StopLaw(thresholds, 0.18 * share / share.sum() / thresholds)


@dataclass(frozen=True, slots=True)
class Coil:
    """Coil, iron and amplifier; SI units. ``eddy`` is the parallel loss resistance in ohm (inf: no eddy currents)."""

    resistance: float = 2.1
    knee_current: float = 1.62
    knee_flux: float = 0.0502
    hysteresis: StopLaw = field(default_factory=default_hysteresis)
    eddy: float = inf
    output_resistance: float = 0.12

    def magnetising_current(self, flux: Array, state: Array) -> Array:
        """Return i_an + stops in A, without the eddy branch."""
        current: Array = self.knee_current * np.sinh(flux / self.knee_flux) + self.hysteresis.output(state)
        return current


def other_coil(rng: np.random.Generator) -> Coil:
    """Return a coil of its own kind: resistance, knee and hysteresis moved by up to 10 %."""
    law = default_hysteresis()
    return Coil(
        resistance=round(2.1 * float(rng.uniform(0.9, 1.1)), 3),
        knee_current=1.62 * float(rng.uniform(0.9, 1.1)),
        knee_flux=0.0502 * float(rng.uniform(0.9, 1.1)),
        hysteresis=StopLaw(law.thresholds, law.weights * float(rng.uniform(0.8, 1.2))),
    )


@dataclass(frozen=True, slots=True)
class CoilRun:
    """What happened, without any instrument: arrays (runs, samples) of coil voltage, current, flux, EMF."""

    voltage: Array
    current: Array
    flux: Array
    emf: Array


def solve(coil: Coil, emf: Array, step: Array, keep: int) -> CoilRun:
    """Solve the circuit by the implicit trapezoidal rule, all runs side by side.

    Parameters
    ----------
    coil
        The truth.
    emf
        Amplifier EMF at every solver step, shape (runs, steps), V; all runs start at rest with zero flux.
    step
        Solver step of each run, shape (runs,), s.
    keep
        Every keep-th solver step is returned.
    """
    runs, steps = emf.shape
    loop = coil.resistance + coil.output_resistance
    loss = 1.0 + loop / coil.eddy
    flux, state = np.zeros(runs), coil.hysteresis.rest(runs)
    rate = (emf[:, 0] - loop * coil.magnetising_current(flux, state)) / loss
    kept = [(flux, rate, coil.magnetising_current(flux, state))]
    for n in range(1, steps):
        flux, state, current = _trapezoid(coil, (flux, state, rate), emf[:, n], step)
        rate = (emf[:, n] - loop * current) / loss
        if n % keep == 0:
            kept.append((flux, rate, current))
    fluxes, rates, currents = (np.array(column).T for column in zip(*kept, strict=True))
    total = currents + rates / coil.eddy
    return CoilRun(coil.resistance * total + rates, total, fluxes, emf[:, ::keep])


def _trapezoid(coil: Coil, before: tuple[Array, Array, Array], emf: Array, step: Array) -> tuple[Array, Array, Array]:
    """Return flux, stop state and magnetising current one step on, by Newton on the monotone step equation."""
    flux, state, rate = before
    loop = coil.resistance + coil.output_resistance
    half = step / (2.0 * (1.0 + loop / coil.eddy))
    target = flux + 0.5 * step * rate + half * emf
    new = flux + step * rate
    for _ in range(NEWTON_STEPS):
        moved = coil.hysteresis.advance(state, new - flux)
        gap = new + half * loop * coil.magnetising_current(new, moved) - target
        slope = coil.knee_current / coil.knee_flux * np.cosh(new / coil.knee_flux) + coil.hysteresis.slope(moved)
        new = new - gap / (1.0 + half * loop * slope)
    moved = coil.hysteresis.advance(state, new - flux)
    return new, moved, coil.magnetising_current(new, moved)


def tune(coil: Coil, frequency: Array, amplitude: Array) -> Array:
    """Return the EMF amplitudes (runs,) at which the steady current peaks at ``amplitude``, as a lab turns the knob."""
    emf = amplitude * np.hypot(coil.resistance + coil.output_resistance, 2 * np.pi * frequency * 0.02)
    for _ in range(8):
        phase = 2 * np.pi * np.arange(1501) / 500
        run = solve(coil, emf[:, None] * np.sin(phase), 1.0 / (500 * frequency), keep=1)
        emf = emf * amplitude / np.abs(run.current[:, 1000:]).max(axis=1)
    return emf
