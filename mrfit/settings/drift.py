"""Settings of a comparison of fits."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from mrfit.core.setting import Setting
from mrfit.settings.forms import NAMES, PATH


@dataclass(frozen=True)
class Settings:
    """Choices of a comparison of fits of units, or of one unit over its life.

    Attributes
    ----------
    over
        Covariates that parameters may follow: ``cycles``, ``energy``, ``temperature``, ``date``, ``frequency``,
        ``amplitude``, ``current``, or a column of numbers of a table.
    unit
        Pattern on the names of logs in which ``{unit}`` stands for the unit; empty: every log is a unit.
    covariates
        Table (CSV) with a column ``log`` and columns of numbers; None for none.
    at
        Motion and current at which the force is compared, as ``HZ:M:A``; empty for none.
    fit
        Name of the fit in every workspace; empty where each has one.
    draws, seed
        Number of units drawn from the population as SSP parameter sets, and the seed they are drawn with.
    """

    over: Annotated[tuple[str, ...], Setting("Covariates, as cycles,temperature.", metavar="NAME,…", form=NAMES)] = ()
    unit: Annotated[
        str, Setting("Pattern on names of logs that names the unit, as '*/{unit}_*'; default: every log is one.")
    ] = ""
    covariates: Annotated[
        Path | None,
        Setting("Table (CSV) of covariates with a column 'log'.", metavar="FILE", form=PATH, show_default=False),
    ] = None
    at: Annotated[str, Setting("Compare the force at a sine and a current, as 1:0.01:0.5.", metavar="HZ:M:A")] = ""
    fit: Annotated[str, Setting("Name of the fit in every workspace; default: the only one.", names="fit")] = ""
    draws: Annotated[int, Setting("Units drawn from the population, as SSP parameter sets.", low=0)] = 0
    seed: Annotated[int, Setting("Seed of these draws.", low=0)] = 0
