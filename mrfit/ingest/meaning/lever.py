"""Angle and torque of a rotary device that a press moves by a lever.

    theta = arcsin(x/L),    T = F*L*cos(theta)

x displacement (m) and F force (N) of the press along its own line, L length of the lever (m), at right angles to that
line where x = 0.
"""

import numpy as np

from mrfit.core.specs import Array
from mrfit.ingest import series
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.meaning.naming import Signal
from mrfit.ingest.refusal import Refusal


def levered(signals: list[Signal], rules: Rules, path: str) -> list[Signal]:
    """Return signals with angle and torque added where the channel map gives a lever and the log has neither.

    Raises
    ------
    Refusal
        If the log has no displacement, or one as long as the lever.
    """
    length = rules.lever
    if length is None:
        return signals
    there = {s.name: s for s in signals}
    stroke, force = there.get("displacement"), there.get("force")
    if stroke is None:
        raise Refusal(path, "the channel map gives a lever, but the log has no displacement", f"correct {rules.where}")

    def angle(x: Array) -> Array:
        with np.errstate(invalid="ignore"):
            return np.arcsin(x / length)

    def torque(x: Array, f: Array) -> Array:
        with np.errstate(invalid="ignore", over="ignore"):
            return f * length * np.sqrt(1.0 - (x / length) ** 2)

    if beyond := series.count(lambda x: np.abs(x) >= length, stroke.values):
        what = f"the displacement is as long as the lever of {length:g} m, or longer, in {beyond} rows"
        raise Refusal(path, what, f"write lever in m in {rules.where}, and check the unit of the displacement")
    added = [Signal("angle", "rad", series.mapped(angle, stroke.values), stroke.index)]
    if force is not None:
        added.append(Signal("torque", "N*m", series.mapped(torque, stroke.values, force.values), force.index))
    return signals + [s for s in added if s.name not in there]
