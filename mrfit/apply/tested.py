"""Motions beyond those that a damper was tested in."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.apply.damper import Damper
from mrfit.core.channels import unit_of
from mrfit.core.specs import Array
from mrfit.fit.extrapolation import SLACK, outside


@dataclass(frozen=True)
class NamedMotion:
    """A motion by name: displacement in m, velocity in m/s (N,), of a torque angle and angular velocity."""

    name: str
    displacement: Array
    velocity: Array


def beyond_tests(damper: Damper, motions: Sequence[NamedMotion]) -> list[str]:
    """Return sentences on the velocity and the stroke, where they exceed what the fit or an effect was found on.

    The stroke is told by half its extent, since its middle has no meaning in another place.
    """
    tested = {name: (low, high) for name, low, high in damper.tested}
    place, rate, _ = damper.motion
    said = []
    for name, reached in (
        (rate, [float(np.max(np.abs(m.velocity))) for m in motions]),
        (place, [0.5 * float(np.ptp(m.displacement)) for m in motions]),
    ):
        if name not in tested or not motions:
            continue
        low, high = tested[name]
        most = max(-low, high) if name == rate else 0.5 * (high - low)
        out = [r > (1.0 + SLACK) * most for r in reached]
        if any(out):
            worst = int(np.argmax(reached))
            unit, kind = unit_of(name), "" if name == rate else "an amplitude of "
            said.append(
                f"The {name.replace('_', ' ')} leaves what the damper was tested in ({kind}{most:.3g} {unit} at most) "
                f"in {sum(out)} of {len(motions)} motions, and reaches {kind}{reached[worst]:.3g} {unit} in "
                f"{motions[worst].name}: what the model gives there is not tested."
            )
    ends = ({place: _ends(m.displacement), rate: _ends(m.velocity)} for m in motions)
    return said + [f"{caution.text}." for caution in outside(damper.model, ends)]


def _ends(values: Array) -> tuple[float, float]:
    return float(values.min()), float(values.max())
