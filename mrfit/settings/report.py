"""Settings of the report stage."""

from dataclasses import dataclass
from typing import Annotated

from mrfit.core.setting import Setting
from mrfit.settings.forms import LISTED
from mrfit.settings.shared import Jobs


@dataclass(frozen=True)
class Settings:
    """Settings of a report.

    Attributes
    ----------
    fits
        Names of fits; empty for all finished ones. They are shown the best first.
    short
        Whether to write two A4 pages on the best of them instead.
    jobs
        Worker processes; does not change the result.
    """

    fits: Annotated[tuple[str, ...], Setting("Fit to report; default: all.", flag="fit", key="fits", form=LISTED)] = ()
    short: Annotated[bool, Setting("Two A4 pages on the best fit, report/short.html, instead.")] = False
    jobs: Jobs = 1
