"""Settings of an export."""

from dataclasses import dataclass
from typing import Annotated

from mrfit.core.setting import Setting
from mrfit.settings.forms import NAMES


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of the formats of an export.

    Attributes
    ----------
    fmi
        Version of the standard of an FMU, 2 or 3.
    prefix
        What the names of files, and of functions in C, begin with; empty for the name of the fit.
    draws, seed
        Number of parameter sets of ``ssv``, and the seed they are drawn with.
    track
        Parameters that a tracker beside the model in C, FMU or MATLAB follows.
    """

    fmi: Annotated[int, Setting("Version of FMI of an FMU: 2 or 3.", low=2, high=3)] = 2
    prefix: Annotated[str, Setting("Beginning of names of files and C functions; default: the fit's name.")] = ""
    draws: Annotated[int, Setting("Parameter sets drawn for ssv.", low=1)] = 100
    seed: Annotated[int, Setting("Seed of these draws.", low=0)] = 0
    track: Annotated[
        tuple[str, ...],
        Setting("Parameters that a tracker (c, fmu, matlab) follows, as fy,c.", metavar="NAME,…", form=NAMES),
    ] = ()
