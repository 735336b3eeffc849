"""Pipeline files: one TOML file says which logs, which model, which optimizer and what is reported."""

import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from mrfit.errors import ConfigError
from mrfit.fit.diagnostics.trust import Intervals
from mrfit.io.faults import plain_fault
from mrfit.search.limits import PATIENCE

Seed = Annotated[int, Field(ge=0)]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class IngestSection(_Section):
    """``[ingest]``: which logs, and how to read them."""

    logs: list[str] = Field(min_length=1)
    map: str | None = None
    resistance: float | Literal["auto"] | None = None
    pattern: str | None = None
    max_memory: str | None = None


class FluxSection(_Section):
    """``[flux]``: how flux linkage is reconstructed."""

    drift: Literal["cycle", "linear", "none"] = "cycle"
    rule: Literal["trapezoid", "simpson"] = "trapezoid"


class SegmentSection(_Section):
    """``[segment]``: how logs are cut by test condition."""

    drive: str | None = None
    min_cycles: int = Field(default=2, ge=1)
    holdout: str = "auto"


class FitSection(_Section):
    """``[[fit]]``: one fit; a file may hold several."""

    model: str
    opt: str = "auto"
    opt_set: dict[str, float | dict[str, float]] = {}
    per: Literal["condition", "all"] = "condition"
    name: str = ""
    seed: Seed = 0
    budget: int | None = Field(default=None, ge=1)
    seconds: float | None = Field(default=None, gt=0)
    stall: float = Field(default=PATIENCE, ge=0.01, le=1.0)
    weight: Literal["none", "floor", "range"] = "none"
    bounds: dict[str, tuple[float, float]] = {}
    start: dict[str, float] = {}
    fixed: dict[str, float] = {}
    current_order: str | int = "auto"
    only: str = ""
    intervals: Intervals = "hac"

    @property
    def options(self) -> tuple[tuple[str, float], ...]:
        """Options of the optimizers; ``mwoa.b = 1.2`` is a table in a table for TOML."""
        tables = ((n, v if isinstance(v, dict) else {"": v}) for n, v in self.opt_set.items())
        return tuple((f"{name}.{own}".rstrip("."), value) for name, table in tables for own, value in table.items())


class DiscoverSection(_Section):
    """``[discover]``: look for what a model lacks, after the fits."""

    model: str
    current_order: str | int = "auto"
    start: dict[str, float] = {}
    seed: Seed = 0


class PipelineFile(_Section):
    """The whole file; ``[ingest]`` and at least one of ``[[fit]]`` and ``[discover]`` must be there."""

    work: str = "mrfit-work"
    ingest: IngestSection
    flux: FluxSection = FluxSection()
    segment: SegmentSection = SegmentSection()
    fit: list[FitSection] = []
    discover: DiscoverSection | None = None

    @model_validator(mode="after")
    def _something_to_do(self) -> Self:
        if not self.fit and self.discover is None:
            raise ValueError("add a [[fit]] or a [discover] table")
        return self


def read_toml(path: Path, what: str = "a pipeline file") -> dict[str, Any]:
    """Return a TOML file's content; ``what`` says what kind of file was wanted.

    Raises
    ------
    ConfigError
        If the file is missing or is no TOML; the message has the line.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read ({error.strerror}); give the path of {what}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: is not valid TOML: {error}") from error


def read_pipeline(path: Path) -> PipelineFile:
    """Return a pipeline file, validated.

    Raises
    ------
    ConfigError
        If a key is unknown or a value is of the wrong kind; the message names the key and what it takes.
    """
    try:
        return PipelineFile.model_validate(read_toml(path))
    except ValidationError as error:
        raise ConfigError(f"{path}: {plain_fault(error, PipelineFile)}") from error
