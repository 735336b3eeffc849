"""Settings of ``mrfit apply``."""

from dataclasses import dataclass
from typing import Annotated

from mrfit.core.arguments import check_arguments
from mrfit.core.setting import Setting
from mrfit.errors import ConfigError


@check_arguments
@dataclass(frozen=True, slots=True)
class Amplifier:
    """Limits of coil and amplifier.

    Attributes
    ----------
    most
        Greatest command as a ratio to the greatest current tested; the inverse-tanh paper has 1.2.
    least
        Least command in A, or None for the least current tested; below 0 for an amplifier that drives the current back.
    rate
        Greatest change of the command in A/s, or None for any.
    voltage
        Greatest voltage in V, or None for any, with resistance (ohm) and inductance (H): L*di/dt = u - R*i.
    resistance, inductance
        Of the coil.
    """

    most: Annotated[
        float,
        Setting(
            "Greatest command as a ratio to the greatest current tested; 1.2: 20 % more.", low=1e-9, metavar="RATIO"
        ),
    ] = 1.2
    least: Annotated[float | None, Setting("Least command in A; default: the least current tested.")] = None
    rate: Annotated[float | None, Setting("Greatest change of the command in A/s.", low=1e-9)] = None
    voltage: Annotated[float | None, Setting("Greatest voltage in V; needs --inductance.", low=1e-9)] = None
    resistance: Annotated[float, Setting("Coil resistance in ohm, with --voltage.", low=0.0)] = 0.0
    inductance: Annotated[float, Setting("Coil inductance in H, with --voltage.", low=0.0)] = 0.0

    def __post_init__(self) -> None:
        if self.voltage is not None and self.inductance <= 0.0:
            raise ConfigError("--voltage limits the current's rate through the coil's inductance: add --inductance")


@check_arguments
@dataclass(frozen=True, slots=True)
class CoilDrive:
    """A coil's resistance, and limits of what drives it.

    Attributes
    ----------
    resistance
        Of the coil in ohm.
    voltage, current
        Greatest voltage in V and current in A, either sign, or None for any.
    """

    resistance: Annotated[float, Setting("Coil resistance in ohm.", low=0.0)]
    voltage: Annotated[float | None, Setting("Greatest voltage in V, either sign.", low=1e-9)] = None
    current: Annotated[float | None, Setting("Greatest current in A, either sign.", low=1e-9)] = None
