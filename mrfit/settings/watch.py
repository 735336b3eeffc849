"""Settings of a test that is watched while it runs."""

from dataclasses import dataclass
from typing import Annotated

from mrfit.core.setting import Setting
from mrfit.settings.forms import NAMES


@dataclass(frozen=True, slots=True)
class Settings:
    """Rule by which a test has told enough.

    Attributes
    ----------
    within
        Half-width of the 95 % intervals to be reached, in percent of the value.
    parameters
        Parameters that must reach it; empty for all that the test determines.
    least_cycles
        Fewest steady cycles.
    """

    within: Annotated[float, Setting("Half-width of intervals to reach, in percent of the value.", above=0.0)] = 5.0
    parameters: Annotated[
        tuple[str, ...],
        Setting("Parameters that must reach it, by commas; default: all that the test determines.", form=NAMES),
    ] = ()
    least_cycles: Annotated[int, Setting("Fewest steady cycles.", low=2)] = 4
