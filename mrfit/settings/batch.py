"""Settings of a batch, beside those of ingest and of the fit."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from mrfit.core.setting import Setting
from mrfit.settings.forms import PATH
from mrfit.settings.shared import Resistance


@dataclass(frozen=True)
class Settings:
    """Settings of a batch: what it keeps of every log.

    Attributes
    ----------
    like
        Pattern on the names of logs, whatever the case of letters; several by commas.
    table
        Table of all logs (Parquet); with it no log has a workspace. None for a workspace each, and the table beside.
    report
        Whether every workspace has a report.
    sheet
        Whether every workspace has a damper's test sheet.
    resistance
        Coil resistance in ohm, ``auto`` to estimate it, None as the logs say.
    """

    like: Annotated[str, Setting("Only logs whose names match, as '*.csv'; several by commas.", metavar="PATTERN")] = (
        "*"
    )
    table: Annotated[
        Path | None,
        Setting("One table (Parquet) for all logs, and no workspaces.", metavar="FILE", form=PATH, show_default=False),
    ] = None
    report: Annotated[bool, Setting("Write a report into every workspace.")] = False
    sheet: Annotated[bool, Setting("Write a damper's test sheet into every workspace.")] = False
    resistance: Resistance = None
