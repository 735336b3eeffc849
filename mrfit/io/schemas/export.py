"""What ``mrfit export`` tells of what it wrote."""

from dataclasses import dataclass

from mrfit.io.schemas.reading import Entry


@dataclass(frozen=True, kw_only=True)
class Format(Entry):
    """What was written in a format; ``error`` as a share of the output's range, None where it was not measured."""

    format: str
    files: list[str]
    said: list[str]
    error: float | None


@dataclass(frozen=True, kw_only=True)
class Exported(Entry):
    """What the command tells of an export."""

    fit: str
    model: str
    folder: str
    formats: list[Format]
