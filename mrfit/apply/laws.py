"""Forces that a controller may ask for: of the motion alone, or sample by sample from a file."""

from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array
from mrfit.errors import ConfigError

# Greatest number of a law, in its unit: far above what any damper gives, and its force is finite
LARGEST_OF_LAW = 1e12


@dataclass(frozen=True)
class Law:
    """F = c*v + k*x, or a skyhook's F = c*(v + v_base) where this brakes; ``stiffness`` may be negative.

    Attributes
    ----------
    name
        What it is called in tables.
    damping, stiffness
        c in N*s/m and k in N/m (of a torque N*m*s/rad and N*m/rad).
    skyhook
        Whether the damping is that towards an inertial frame: the base's velocity is added to the damper's, and a force
        that would push is zero.

    Source: inverse-tanh paper eq. 11; D. Karnopp, M. Crosby, R. Harwood, J. Eng. Ind. 96 (1974) 619.
    """

    name: str
    damping: float
    stiffness: float = 0.0
    skyhook: bool = False

    def force(self, x: Array, v: Array, base_velocity: Array | None = None) -> Array:
        """Return the desired force of displacement (m) and velocity (m/s) of the damper."""
        if not self.skyhook:
            return np.asarray(self.damping * v + self.stiffness * x)
        body = v + (0.0 if base_velocity is None else base_velocity)
        wanted = self.damping * body + self.stiffness * x
        return np.asarray(np.where(wanted * v > 0.0, wanted, 0.0))


def law_words(output: str) -> str:
    """Return the meaning of the letters of written laws; ``output`` is a force or a torque."""
    c, k = ("N·s/m", "N/m") if output == "force" else ("N·m·s/rad", "N·m/rad")
    return f"c·v + k·x, c in {c}, k in {k}; skyhook for c: only where this brakes"


def law_of(text: str) -> Law:
    """Return the law of a written form: ``c=2e4``, ``k=5e4,c=1e4``, ``skyhook=2e4``.

    Raises
    ------
    ConfigError
        If it is none.
    """
    written = [item.partition("=")[::2] for item in text.split(",")]
    values: dict[str, float] = {}
    for name, value in written:
        try:
            values[name.strip()] = float(value)
        except ValueError:
            values["?"] = 0.0
    known = set(values) <= {"c", "k", "skyhook"} and ("skyhook" in values) != ("c" in values)
    if not known or len(values) < len(written) or not all(abs(v) <= LARGEST_OF_LAW for v in values.values()):
        raise ConfigError(f"--law takes c=N*s/m, k=N/m,c=N*s/m or skyhook=N*s/m, not '{text}'")
    skyhook = "skyhook" in values
    return Law(text, values["skyhook" if skyhook else "c"], values.get("k", 0.0), skyhook)
