"""A damper none of the models is: a plug of fluid held by chains of particles, in series with a leak.

The piston moves x, the plug w. Leak and plug carry the same force:

    F = C0(i)*(dx/dt - dw/dt) = fy(i)*s(w/g(i)) + C(i)*dw/dt/sqrt(1 + |dw/dt|/v1)

s is a set of stop operators in w: chains yield one after the other, each over a stroke of its own, which may grow with
the current by a factor g. So there are a pre-yield dashpot, a pre-yield spring, a hysteresis in displacement, and a
viscosity that thins with speed.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from datasets.rig.stop import Array, StopLaw

NEWTON_STEPS = 5
Dependence = Callable[[Array], Array]


def chains() -> StopLaw:
    """Return seven equal chains that yield over 20 to 300 micrometres; together they carry 1."""
    thresholds = np.geomspace(20e-6, 300e-6, 7)
    return StopLaw(thresholds, np.full(len(thresholds), 1.0 / len(thresholds)) / thresholds)


@dataclass(frozen=True, slots=True)
class Plug:
    """Yield force (N), viscosity at standstill and of the leak (N*s/m) over the current, and the speed of thinning.

    ``growth`` is the factor on the strokes of the law over the current.
    """

    yield_force: Dependence
    post_yield: Dependence
    pre_yield: Dependence
    shear_speed: float = 0.25
    law: StopLaw = field(default_factory=chains)
    growth: Dependence = np.ones_like

    def force(self, position: Array, current: Array, step: Array) -> Array:
        """Return the force in N, shape (runs, samples), by implicit Euler.

        Parameters
        ----------
        position
            Piston stroke in m, shape (runs, samples).
        current
            Current that the fluid sees in A, shape (runs, samples) or (runs, 1).
        step
            Interval in s, shape (runs,).
        """
        held = np.broadcast_to(current, position.shape)
        fy, c, c0, grown = (f(held) for f in (self.yield_force, self.post_yield, self.pre_yield, self.growth))
        state = self.law.rest(len(position))
        moved = np.diff(position, axis=1)
        force = np.zeros_like(position)
        slip = moved[:, 0].copy()
        for n in range(moved.shape[1]):
            here = fy[:, n + 1], c[:, n + 1], c0[:, n + 1], grown[:, n + 1]
            slip = self._slip(state, moved[:, n], slip, step, here)
            state = self.law.advance(state, slip / here[3])
            force[:, n + 1] = here[2] * (moved[:, n] - slip) / step
        return force

    def _slip(self, state: Array, moved: Array, slip: Array, step: Array, here: tuple[Array, Array, Array]) -> Array:
        """Return how far the plug moves in a step, by Newton on the monotone balance of leak and plug."""
        fy, c, c0, grown = here
        for _ in range(NEWTON_STEPS):
            speed = slip / step
            thinned = np.sqrt(1.0 + np.abs(speed) / self.shear_speed)
            ahead = self.law.advance(state, slip / grown)
            gap = fy * self.law.output(ahead) + c * speed / thinned - c0 * (moved - slip) / step
            viscous = c / thinned * (1.0 - 0.5 * np.abs(speed) / (self.shear_speed * thinned**2))
            slip = slip - gap / (fy * self.law.slope(ahead) / grown + (viscous + c0) / step)
        return slip
