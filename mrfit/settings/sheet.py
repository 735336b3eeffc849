"""Settings of a damper's test sheet."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from mrfit.core.setting import Setting
from mrfit.settings.forms import PATH, TEXTS
from mrfit.settings.shared import Jobs


@dataclass(frozen=True)
class Settings:
    """Settings of a test sheet.

    Attributes
    ----------
    limits
        File of limits (TOML); None for no verdicts.
    unit_from
        Pattern on the paths of logs in which ``{unit}`` stands for the unit's name, as ``*/{unit}_*.csv``; empty for
        one unit.
    about
        What was tested, as ``serial=17``, for the head of the sheet.
    central
        Central part of the stroke in percent in which the peak force is looked for.
    width_at
        Speed in m/s at which the width of the loop is taken; None for half of the greatest.
    slow
        Speed in m/s up to which a test is slow: friction and gas force are read off it.
    skew
        Seconds by which the force is recorded later than the displacement; corrected.
    rebound
        Sign of the velocity of rebound (extension).
    jobs
        Processes that read and measure logs, where there are dozens of these.
    """

    limits: Annotated[
        Path | None, Setting("File of limits (TOML): verdicts.", metavar="FILE", form=PATH, show_default=False)
    ] = None
    unit_from: Annotated[
        str, Setting("Pattern on paths that names the unit, as '*/{unit}_*.csv'.", metavar="PATTERN")
    ] = ""
    about: Annotated[
        tuple[tuple[str, str], ...], Setting("What was tested, as serial=17.", metavar="KEY=VALUE", form=TEXTS)
    ] = ()
    central: Annotated[
        float, Setting("Central part of the stroke in percent, for peak forces.", low=1.0, high=100.0)
    ] = 100.0
    width_at: Annotated[
        float | None, Setting("Speed in m/s of the loop's width; default: half of the greatest.", above=0.0)
    ] = None
    slow: Annotated[float, Setting("Speed in m/s up to which a test is slow.", above=0.0)] = 0.005
    skew: Annotated[float, Setting("Seconds by which the force is recorded late; corrected.")] = 0.0
    rebound: Annotated[Literal["positive", "negative"], Setting("Sign of the velocity of rebound.")] = "positive"
    jobs: Jobs = 1
