"""Report of ``mrfit export`` on the files it wrote."""

from dataclasses import field

from mrfit.io.schemas.reading import Entry


class Format(Entry):
    """Files written in a format; ``error`` as a share of the output's range, None where it was not measured."""

    format: str
    files: list[str]
    said: list[str]
    error: float | None


class Exported(Entry):
    """Report of the command on an export.

    ``failed`` has the formats that could not be made, and why; ``outdated`` what is no longer as it was fitted.
    """

    fit: str
    model: str
    folder: str
    formats: list[Format]
    failed: dict[str, str] = field(default_factory=dict)
    outdated: list[str] = field(default_factory=list)
