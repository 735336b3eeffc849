"""A voltage-driven coil whose iron is a Bouc-Wen law, with effects that can be switched on: the coil side of the rig.

The magnetising current j carries the flux linkage lambda = (1 + g(t)) S(A Lc j + h z) + w, h = (1 - A) Lc / D,
S(y) = y / sqrt(1 + (y / knee)^2), with dz/dj = kappa - |z|^n (beta + gamma sign(z dj)). The circuit is
e = (R(T) + R_out) i + d lambda/dt, i = j + (d lambda/dt)/R_eddy. Stepped by Runge-Kutta, all runs side by side.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

import numpy as np

from datasets.rig.boucwen import FluxBoucWen
from datasets.rig.coil import CoilRun
from datasets.rig.stop import Array

COPPER = 0.00393
COOLING = 90.0
AFTEREFFECT_TIME = 0.12
VIBRATION = 3.7


@dataclass(frozen=True, slots=True)
class FluxCoil:
    """Resistance and amplifier in ohm, and the iron."""

    iron: FluxBoucWen
    resistance: float = 2.1
    output_resistance: float = 0.12


def base_coil(rng: np.random.Generator) -> FluxCoil:
    """Return a coil of about 20 mH whose loop is 4 to 5 % of the range at 5 A, and whose inductance stays positive."""
    turnover = 0.35 * rng.uniform(0.8, 1.25)
    linear = 0.020 * rng.uniform(0.85, 1.15)
    kappa = 1.0 / turnover
    share = rng.uniform(0.5, 0.7)
    A = 1.2
    return FluxCoil(
        FluxBoucWen(
            A=A,
            Lc=linear / A,
            kappa=kappa,
            beta=kappa / 3,
            gamma=kappa * 2 / 3,
            n=float(rng.uniform(1.2, 1.6)),
            D=(1 - A) / A * kappa / -share,
        ),
        resistance=round(2.1 * float(rng.uniform(0.9, 1.1)), 3),
    )


@dataclass(frozen=True, slots=True)
class Effects:
    """Magnitudes of the physical effects; the defaults are their absence."""

    eddy: float = inf
    saturation: float = inf
    heating: float = 0.0
    aftereffect: float = 0.0
    vibration: float = 0.0

    @classmethod
    def of(cls, magnitudes: Mapping[str, float]) -> "Effects":
        """Pick the physical ones out of magnitudes by canonical name."""
        known = {
            "eddy-current": "eddy",
            "saturation": "saturation",
            "resistance-heating": "heating",
            "magnetic-aftereffect": "aftereffect",
            "gap-vibration": "vibration",
        }
        return cls(**{known[name]: value for name, value in magnitudes.items() if name in known})


@dataclass(frozen=True, slots=True)
class _State:
    """Magnetising current, z, coil temperature rise, after-effect flux; each (runs,)."""

    j: Array
    z: Array
    rise: Array
    slow: Array

    def plus(self, rate: "_State", step: Array) -> "_State":
        return _State(
            self.j + step * rate.j, self.z + step * rate.z, self.rise + step * rate.rise, self.slow + step * rate.slow
        )


class _Circuit:
    """The coil's state equation under one set of effects."""

    def __init__(self, coil: FluxCoil, effects: Effects):
        iron = coil.iron
        self.coil, self.effects = coil, effects
        self.linear, self.hysteretic = iron.A * iron.Lc, (1 - iron.A) * iron.Lc / iron.D

    def gap(self, time: Array) -> tuple[Array, Array]:
        """Return 1 + g and dg/dt of the vibrating air gap."""
        w, g = 2 * np.pi * VIBRATION, self.effects.vibration
        return 1.0 + g * np.sin(w * time), g * w * np.cos(w * time)

    def static_flux(self, state: _State) -> Array:
        linked = self.linear * state.j + self.hysteretic * state.z
        saturated: Array = linked / np.sqrt(1.0 + (linked / self.effects.saturation) ** 2)
        return saturated

    def flux(self, state: _State, time: Array) -> Array:
        linked: Array = self.gap(time)[0] * self.static_flux(state) + state.slow
        return linked

    def resistance(self, rise: Array) -> Array:
        warm: Array = self.coil.resistance * (1.0 + COPPER * rise)
        return warm

    def rates(self, state: _State, time: Array, emf: Array) -> tuple[_State, Array, Array]:
        """Return the state's rate, d lambda/dt and the coil's current."""
        warm = self.resistance(state.rise)
        loop = warm + self.coil.output_resistance
        flux_rate = (emf - loop * state.j) / (1.0 + loop / self.effects.eddy)
        current = state.j + flux_rate / self.effects.eddy
        scale, scale_rate = self.gap(time)
        still = self.static_flux(state)
        slow_rate = (self.effects.aftereffect * self.linear * state.j - state.slow) / AFTEREFFECT_TIME
        push = flux_rate - slow_rate - scale_rate * still
        slope_z = self.coil.iron.slope(state.z, push)
        unsaturated = 1.0 - (still / self.effects.saturation) ** 2
        slope = scale * unsaturated**1.5 * (self.linear + self.hysteretic * slope_z)
        j_rate = push / slope
        heat = self.effects.heating * warm * current**2 - state.rise / COOLING
        return _State(j_rate, slope_z * j_rate, heat, slow_rate), flux_rate, current


def solve(coil: FluxCoil, effects: Effects, emf: Array, step: Array, keep: int) -> CoilRun:
    """Solve the circuit from rest.

    Parameters
    ----------
    coil, effects
        The truth.
    emf
        Amplifier EMF at every half step, shape (runs, 2 steps + 1), V.
    step
        Solver step of each run, shape (runs,), s.
    keep
        Every keep-th step is returned.
    """
    circuit = _Circuit(coil, effects)
    zero = np.zeros(len(emf))
    state = _State(zero, zero, zero, zero)
    rows = []
    for n in range((emf.shape[1] - 1) // 2 + 1):
        time = n * step
        rate, flux_rate, current = circuit.rates(state, time, emf[:, 2 * n])
        if n % keep == 0:
            rows.append((circuit.resistance(state.rise) * current + flux_rate, current, circuit.flux(state, time)))
        if 2 * n + 2 < emf.shape[1]:
            state = _runge_kutta(circuit, (state, rate), time, emf[:, 2 * n : 2 * n + 3], step)
    voltage, currents, flux = (np.array(column).T for column in zip(*rows, strict=True))
    return CoilRun(voltage, currents, flux, emf[:, :: 2 * keep])


def _runge_kutta(circuit: _Circuit, here: tuple[_State, _State], time: Array, emf: Array, step: Array) -> _State:
    state, one = here
    half = 0.5 * step
    two = circuit.rates(state.plus(one, half), time + half, emf[:, 1])[0]
    three = circuit.rates(state.plus(two, half), time + half, emf[:, 1])[0]
    four = circuit.rates(state.plus(three, step), time + step, emf[:, 2])[0]
    mean = _State(
        *((getattr(one, f) + 2 * getattr(two, f) + 2 * getattr(three, f) + getattr(four, f)) / 6 for f in _FIELDS)
    )
    return state.plus(mean, step)


_FIELDS = ("j", "z", "rise", "slow")
