"""Settings of the ingest stage."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from mrfit.core.setting import Setting
from mrfit.errors import ConfigError
from mrfit.settings.forms import NUMBERS, PATH, SIZE, Pairs
from mrfit.settings.shared import Jobs, Resistance

BLOCK = 8 << 20
"""Bytes of a log read at once."""


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings to read logs.

    Attributes
    ----------
    map
        Channel map; None looks for ``mrfit.toml`` beside each log and in its parents up to the folder given.
    resistance
        Coil resistance in ohm, kept with every recording; ``auto`` or None leave it to the flux stage.
    pattern
        Conditions in file names, as ``{amplitude:mm}mm{frequency:Hz}Hz{current:A}A``; before the map's.
    low_pass
        Limits in Hz of zero-phase low-passes by channel, after those of the channel map; ``*`` for every channel.
    jobs
        Files read at the same time.
    block
        Bytes of a log read at once; a log of more than eight blocks is read block by block, its numbers kept on disk in
        the workspace meanwhile, and gives what it would give if read as a whole.
    max_memory
        Most bytes of memory that a file may take once unpacked; None for half of what is free.
    """

    map: Annotated[Path | None, Setting("Channel map (TOML); default: mrfit.toml beside the log.", form=PATH)] = None
    resistance: Resistance = None
    pattern: Annotated[
        str | None,
        Setting(
            "Conditions in file names, as '{frequency:Hz}Hz-{current:A}A', of any quantity; * is any text.",
            metavar="PATTERN",
            show_default=False,
        ),
    ] = None
    low_pass: Annotated[
        Pairs,
        Setting(
            "Low-pass a logged channel without delay, as force=20; *=20 is every channel.",
            metavar="CHANNEL=HZ",
            form=NUMBERS,
        ),
    ] = ()
    jobs: Jobs = 2
    block: int = BLOCK
    max_memory: Annotated[
        float | None,
        Setting(
            "Most memory that a log may take once unpacked, as 500MB or 2GB; default: half of what is free.",
            metavar="SIZE",
            form=SIZE,
            show_default=False,
        ),
    ] = None

    def __post_init__(self) -> None:
        if self.block < 1:
            raise ConfigError(f"block takes 1 byte or more, not {self.block}")
