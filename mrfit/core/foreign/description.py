"""The TOML file that makes a model of somebody else's C function or FMU: its channels, parameters and library.

    name = "two-lines"
    inputs = ["velocity"]
    output = "force"

    [c]
    library = "two_lines.so"          # beside this file
    function = "two_lines"

    [parameters.fy]
    unit = "N"
    low = 1.0
    high = 1e4
    start = 500.0
    scale = "log"

Instead of ``[c]``, ``[fmu]`` with ``file``, and ``variables`` where the FMU's names are others than those of the
channels and parameters.
"""

import tomllib
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from mrfit.core.foreign.c_function import c_function_model
from mrfit.core.foreign.fmu import fmu_model
from mrfit.core.foreign.model import ForeignModel
from mrfit.core.specs import ModelSpec, Param
from mrfit.errors import ConfigError


class _DescriptionTable(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ParameterTable(_DescriptionTable):
    """``[parameters.NAME]``: the fields of ``Param``."""

    unit: str
    low: float
    high: float
    start: float
    scale: Literal["linear", "log"] = "linear"
    role: str = ""
    text: str = ""
    fixed: bool = False


class CTable(_DescriptionTable):
    """``[c]``: the shared library, relative to the file, and the function in it."""

    library: str
    function: str


class FmuTable(_DescriptionTable):
    """``[fmu]``: the FMU, relative to the file, and its names of channels and parameters that have others."""

    file: str
    variables: dict[str, str] = {}


class Description(_DescriptionTable):
    """The whole file; either ``[c]`` or ``[fmu]``."""

    name: str
    title: str = ""
    equation: str = ""
    reference: str = ""
    inputs: list[str] = Field(min_length=1)
    output: str
    linear: list[str] = []
    rate_independent: bool = False
    jumps: list[str] = []
    parameters: dict[str, ParameterTable] = Field(min_length=1)
    c: CTable | None = None
    fmu: FmuTable | None = None

    def spec(self) -> ModelSpec:
        """Return the model's SPEC."""
        return ModelSpec(
            name=self.name,
            title=self.title or self.name,
            equation=self.equation,
            reference=self.reference,
            inputs=tuple(self.inputs),
            output=self.output,
            params=tuple(Param(name, **dict(p)) for name, p in self.parameters.items()),
            linear=tuple(self.linear),
            rate_independent=self.rate_independent,
            jumps=tuple(self.jumps),
        )


def read_model(path: Path) -> ForeignModel:
    """Return the model that a TOML file describes.

    Raises
    ------
    ConfigError
        If the file is no TOML, a key is missing, unknown or of the wrong kind, or its library cannot be used.
    """
    try:
        found = Description.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: is not valid TOML: {error}") from None
    except ValidationError as error:
        raise ConfigError(f"{path}: {_fault(error)}") from None
    for name, p in found.parameters.items():
        if not p.low < p.high or not p.low <= p.start <= p.high or (p.scale == "log" and p.low <= 0.0):
            needs = "low < high, start between them" + (" and low > 0" if p.scale == "log" else "")
            raise ConfigError(
                f"{path}: [parameters.{name}] needs {needs} (low {p.low}, high {p.high}, start {p.start})"
            )
    if unknown := [n for n in found.linear if n not in found.parameters]:
        raise ConfigError(f"{path}: linear names '{unknown[0]}', which is no parameter")
    if found.c and not found.fmu:
        return c_function_model(found.spec(), path.parent / found.c.library, found.c.function)
    if found.fmu and not found.c:
        return fmu_model(found.spec(), path.parent / found.fmu.file, found.fmu.variables)
    raise ConfigError(f"{path}: needs either a [c] or an [fmu] table, which says what to run")


def _fault(error: ValidationError) -> str:
    fault: Any = error.errors(include_url=False)[0]
    key = ".".join(str(part) for part in fault["loc"])
    if fault["type"] == "missing":
        return f"the key {key} is missing"
    if fault["type"] == "extra_forbidden":
        return f"unknown key {key}"
    return f"{key}: {fault['msg'].lower()} (got {str(fault['input'])[:60]!r})"
