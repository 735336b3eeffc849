"""Settings of ``mrfit apply``."""

from dataclasses import dataclass
from typing import Annotated

from mrfit.core.setting import Setting


@dataclass(frozen=True, slots=True)
class Supply:
    """What the current's supply can do.

    Attributes
    ----------
    most
        Greatest command over the greatest current tested.
    least
        Least command in A, or None for the least current tested.
    rate
        Greatest change of the command in A/s, or None for any.
    voltage, resistance, inductance
        Greatest voltage in V, or None for any; the coil's resistance in ohm and inductance in H, by which it limits the
        rate.
    """

    most: Annotated[float, Setting("Greatest command over the greatest current tested.", low=1.0)] = 1.2
    least: Annotated[float | None, Setting("Least command in A; default: the least current tested.")] = None
    rate: Annotated[float | None, Setting("Greatest change of the command in A/s.", low=1e-9)] = None
    voltage: Annotated[float | None, Setting("Greatest voltage in V; needs --inductance.", low=1e-9)] = None
    resistance: Annotated[float, Setting("Coil resistance in ohm, with --voltage.", low=0.0)] = 0.0
    inductance: Annotated[float, Setting("Coil inductance in H, with --voltage.", low=0.0)] = 0.0
