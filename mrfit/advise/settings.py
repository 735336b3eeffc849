"""Settings of an advice."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

Goal = Literal["rivals", "parameters"]


@dataclass(frozen=True)
class Settings:
    """What to advise on.

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

    goal: Goal = "rivals"
    fit: str = ""
    rig: Path | None = None
    seed: int = 0
