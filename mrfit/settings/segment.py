"""Settings of the segment stage."""

from dataclasses import dataclass
from typing import Annotated

from mrfit.core.setting import Setting


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings to cut recordings into segments.

    Attributes
    ----------
    drive
        Channel that defines the condition, or None to find it.
    min_cycles
        Fewest steady cycles of a periodic segment; 1 counts as 2, since one cycle shows no steadiness.
    holdout
        ``auto``, ``none``, ``quantity=value`` as ``frequency=2``, patterns on condition names as ``sine-2Hz-*``, or
        ``after=SECONDS`` into each recording.
    blocks
        Cycles of each block into which steady stretches are cut, conditions of their own; 0 for whole stretches.
    settle
        Steady cycles by which the model settles before those that are compared.
    tolerance
        Departure of the drive from its mean cycle, in shares of its amplitude, that ends a steady stretch.
    """

    drive: Annotated[str | None, Setting("Channel that defines the condition; default: found.")] = None
    min_cycles: Annotated[int, Setting("Fewest steady cycles; a test of fewer is one stretch.", low=1)] = 2
    holdout: Annotated[
        str, Setting("Held out: auto, none, conditions by current=3 or a pattern on names, or after=SECONDS.")
    ] = "auto"
    blocks: Annotated[
        int, Setting("Cut steady stretches into blocks of so many cycles, each a condition: its drift.", low=0)
    ] = 0
    settle: int = 1
    tolerance: float = 0.02
