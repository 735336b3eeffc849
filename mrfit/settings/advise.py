"""Settings of an advice."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from mrfit.core.setting import Setting
from mrfit.settings.forms import PATH
from mrfit.settings.shared import Seed


@dataclass(frozen=True)
class Settings:
    """Settings of an advice.

    Attributes
    ----------
    goal
        ``rivals``: the test that separates what the last discovery left standing; ``parameters``: the one that narrows
        the intervals of a fit most.
    fit
        Name of that fit.
    rig
        TOML file with the table ``[rig]``; None for ``mrfit.toml`` here or beside the logs.
    seed
        Of every random choice.
    """

    goal: Annotated[
        Literal["rivals", "parameters"],
        Setting("Separate what a discovery left standing, or narrow the intervals of a fit."),
    ] = "rivals"
    fit: Annotated[str, Setting("Fit whose intervals are to be narrower.", show_default=False)] = ""
    rig: Annotated[
        Path | None,
        Setting("TOML file with the rig's limits, [rig]; default: mrfit.toml here or beside the logs.", form=PATH),
    ] = None
    seed: Seed = 0
