"""Dampers on a sine whose forces, work and stiffness are known in closed form, as a data acquisition records them.

viscous F = C*v; alpha F = C*sgn(v)*|v|^a; bingham F = Fy*sgn(v) + c*v; gas F = bingham + k*d + F0, Fy with the seals'
friction in it; bilinear: elastic K0 up to d_y after every reversal, then K_p.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import gamma

from datasets.rig.stop import Array

KINDS = ("viscous", "alpha", "bingham", "gas", "bilinear")
C, C_ALPHA, ALPHA = 5000.0, 2000.0, 0.4
YIELD, VISCOUS = 300.0, 2000.0
STIFFNESS, GAS = 4000.0, 150.0
ELASTIC, POST, YIELDS_AT = 2e5, 2e4, 0.1
"""Stiffnesses in N/m of the bilinear damper, and its yield displacement over the amplitude."""


@dataclass(frozen=True)
class Rig:
    """A test: Hz, m, samples/s, cycles; noise as a share of force's peak and of the amplitude.

    ``drift`` is what the force's zero has moved by the end, over its peak; ``skew`` samples by which the force is late.
    """

    kind: str
    frequency: float
    rate: float
    amplitude: float = 0.01
    cycles: int = 12
    noise: float = 0.0
    drift: float = 0.0
    skew: float = 0.0
    seed: int = 0

    @property
    def omega(self) -> float:
        """Angular frequency in rad/s."""
        return 2.0 * np.pi * self.frequency

    @property
    def speed(self) -> float:
        """Peak velocity in m/s."""
        return self.amplitude * self.omega

    def force(self, displacement: Array, velocity: Array) -> Array:
        """Return the steady force in N."""
        d, v, sign = displacement, velocity, np.sign(velocity)
        if self.kind == "viscous":
            return C * v
        if self.kind == "alpha":
            return C_ALPHA * sign * np.abs(v) ** ALPHA
        if self.kind == "bilinear":
            reach = YIELDS_AT * self.amplitude
            up = np.minimum(d + self.amplitude - reach, reach)
            down = np.maximum(d - self.amplitude + reach, -reach)
            return POST * d + (ELASTIC - POST) * np.where(v >= 0.0, up, down)
        gas = STIFFNESS * d + GAS if self.kind == "gas" else 0.0
        return YIELD * sign + VISCOUS * v + gas

    def record(self) -> tuple[Array, Array]:
        """Return displacement in m and force in N as recorded, (N,) each."""
        rng = np.random.default_rng(self.seed)
        length = (self.cycles + 0.3) / self.frequency
        time = np.arange(int(length * self.rate)) / self.rate
        phase = self.omega * time + rng.uniform(0.0, 2.0 * np.pi)
        late = phase - self.omega * self.skew / self.rate
        force = self.force(self.amplitude * np.sin(late), self.speed * np.cos(late))
        peak = max(abs(self.truth()["Fmax+"]), abs(self.truth()["Fmax-"]))
        force = force + peak * (self.noise * rng.standard_normal(len(time)) + self.drift * time / length)
        stroke = self.amplitude * (np.sin(phase) + self.noise * rng.standard_normal(len(time)))
        return stroke, force

    def truth(self) -> dict[str, float]:
        """Return the quantities in closed form, SI."""
        d, v, w = self.amplitude, self.speed, self.omega
        ends, gas, extra = (0.0, 0.0), 0.0, 0.0
        if self.kind == "viscous":
            middle, work = C * v, np.pi * C * w * d**2
        elif self.kind == "alpha":
            shape = 4.0 * 2.0**ALPHA * gamma(1.0 + ALPHA / 2.0) ** 2 / gamma(2.0 + ALPHA)
            middle, work = C_ALPHA * v**ALPHA, shape * C_ALPHA * w**ALPHA * d ** (1.0 + ALPHA)
        elif self.kind == "bilinear":
            middle = (ELASTIC - POST) * YIELDS_AT * d
            ends, work, extra = (middle + POST * d, -middle - POST * d), 4.0 * middle * d * (1.0 - YIELDS_AT), POST * d
        else:
            middle, work = YIELD + VISCOUS * v, 4.0 * YIELD * d + np.pi * VISCOUS * w * d**2
            if self.kind == "gas":
                gas, ends = GAS, (GAS + STIFFNESS * d, GAS - STIFFNESS * d)
                extra = float(np.hypot(VISCOUS * v, STIFFNESS * d)) - VISCOUS * v
        stiffness = (ends[0] - ends[1]) / (2.0 * d)
        peak, least = middle + extra + gas, -middle - extra + gas
        found = {
            "F0+": middle + gas,
            "F0-": gas - middle,
            "Fd+": ends[0],
            "Fd-": ends[1],
            "Fmax+": peak,
            "Fmax-": least,
        }
        found |= {"E": work, "K_eff": stiffness, "C_eq": work / (np.pi * w * d**2), "ratio": peak / -least}
        found |= {"efficiency": work / ((peak - least) * 2.0 * d)}
        if stiffness:
            found["xi_eff"] = 2.0 / np.pi * work / (stiffness * 4.0 * d**2)
        if self.kind == "bilinear":
            found |= {"K_0": ELASTIC, "K_p": POST, "d_y": YIELDS_AT * d, "F_y": ELASTIC * YIELDS_AT * d}
        else:
            at, half = np.sqrt(0.75) * d, STIFFNESS if self.kind == "gas" else 0.0
            found |= {"width+": -2.0 * half * at, "width-": 2.0 * half * at, "width v": 0.0, "free travel": 0.0}
        return {name: float(value) for name, value in found.items()}
