"""The one place that reads the JSON of a workspace, which anyone may have edited.

A file is checked as a whole as it is read, so that no later code meets a value of a wrong type. What a document does
not name is passed over; what a file leaves out has the document's default, or is a fault. ``plain`` is the
inverse: documents to what JSON can hold.
"""

import json
import math
import re
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, field, fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, Self, TypeVar, dataclass_transform

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from mrfit.errors import DataError
from mrfit.io.escapes import encodable
from mrfit.io.faults import plain_fault


class Part(BaseModel):
    """A part of a file; numbers are finite, and no text is taken for a number."""

    model_config = ConfigDict(strict=True, extra="allow", allow_inf_nan=False, protected_namespaces=())


class Stored(Part):
    """A whole file; ``known`` lists the schemas that can be read, where the file names one."""

    known: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> Self:
        """Return the content of a file, as JSON has it, checked."""
        return cls.model_validate_json(json.dumps(dict(content)))


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(field,))
@dataclass(frozen=True, kw_only=True)
class Entry:
    """A part of a document, a frozen dataclass whose fields are the keys of its JSON, in their order.

    It is checked where it is read, not where it is made: what a stage computes may be an array's element or not finite,
    which JSON has as a plain number or null.
    """

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(strict=True, extra="ignore", allow_inf_nan=False)

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True, kw_only=True)(cls)

    @property
    def absent(self) -> Collection[str]:
        """Fields that its JSON leaves out."""
        return ()

    def written(self, told: bool = False) -> list[str]:
        """Return the fields that its file has; those besides that a command tells, where ``told``."""
        kept = [f for f in fields(self) if not f.metadata.get("sparse") or getattr(self, f.name)]
        return [f.name for f in kept if f.name not in self.absent and (told or not f.metadata.get("told"))]


def plain(value: object) -> Any:
    """Return ``value`` as JSON can hold it: documents as objects, arrays as lists, non-finite numbers as null."""
    if isinstance(value, str):
        return encodable(value)
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Entry):
        return {name: plain(getattr(value, name)) for name in value.written()}
    if is_dataclass(value) and not isinstance(value, type):
        return plain(asdict(value))
    if isinstance(value, Mapping):
        return {encodable(str(k)): plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple, set)):
        return [plain(v) for v in value]
    # arrays and numbers of numpy
    return plain(value.tolist()) if hasattr(value, "tolist") else value


class Document(Entry):
    """Result of a stage, and its file; ``known`` lists the schemas that can be read, by default the own one."""

    known: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if own := vars(cls).get("schema"):
            cls.known = (own,)


def told(default: Any) -> Any:
    """Return a field that a command tells of a run and no file holds; a function gives a default of its own to each."""
    return _field(default, "told")


def sparse(default: Any) -> Any:
    """Return a field that JSON leaves out where it holds nothing; a function gives a default of its own to each."""
    return _field(default, "sparse")


def _field(default: Any, mark: str) -> Any:
    made: dict[str, Any] = {"default_factory": default} if callable(default) else {"default": default}
    return field(**made, metadata={mark: True})


# A number that is written as it was given: 1 and 1.0 stay what they are
Number = int | float
File = TypeVar("File", bound=Stored | Document)
Kind = TypeVar("Kind")


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


def of_json(kind: type[Kind], text: str | bytes) -> Kind:
    """Return the content of JSON, checked.

    Raises
    ------
    pydantic.ValidationError
        If a value is missing or of a wrong type.
    """
    found: Kind = _adapter(kind).validate_json(text)  # type: ignore[arg-type]
    return found


def of_row(kind: type[Kind], row: Mapping[str, object]) -> Kind:
    """Return the content of a row of a table, checked as ``of_json`` does."""
    # in JSON, of which strict reading makes documents
    return of_json(kind, json.dumps(dict(row), default=str))


class UnknownSchema(DataError):
    """A file is of a schema that this mrfit does not know: it may be of a later one."""


def parsed(path: Path, text: str | bytes, kind: type[File], remedy: str) -> File:
    """Return the text of a file, checked.

    Raises
    ------
    DataError
        If it is of an unknown schema, no JSON, or a value is missing or of a wrong type; the message names the file
        and the value, and ends with ``remedy``.
    """
    _check_schema(path, text, kind.known)
    try:
        return of_json(kind, text)
    except ValidationError as error:
        raise DataError(f"{path}: damaged, or another mrfit's: {plain_fault(error)}; {remedy}") from error


def load(path: Path, kind: type[File], remedy: str) -> File | None:
    """Return a file, checked; None if it is not there.

    Raises
    ------
    DataError
        As ``parsed`` does, and if it cannot be read.
    """
    try:
        return parsed(path, path.read_bytes(), kind, remedy)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror or error}); {remedy}") from error


def reusable(path: Path, kind: type[File]) -> File | None:
    """Return the result of an earlier run of a command; None where it is missing or damaged, so that it is made again.

    Raises
    ------
    UnknownSchema
        It may be of a later mrfit and worth more than what this one would make.
    """
    try:
        text = path.read_bytes()
    except OSError:
        return None
    _check_schema(path, text, kind.known)
    try:
        return of_json(kind, text)
    except ValidationError:
        return None


def _check_schema(path: Path, text: str | bytes, known: tuple[str, ...]) -> None:
    try:
        whole = json.loads(text)
    except (ValueError, RecursionError):
        return  # said by pydantic
    named = whole.get("schema") if isinstance(whole, Mapping) else None
    if known and named is not None and named not in known:
        shown = re.sub(r"\s+", " ", str(named))[:60]
        raise UnknownSchema(
            f"{path}: of the schema '{shown}', which this mrfit does not know (it reads {', '.join(known)}); use "
            "the mrfit that wrote it, or another workspace"
        )
