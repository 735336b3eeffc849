"""No function of the package hands on what a stage came to as an untyped dictionary, but where JSON begins."""

import importlib
import inspect
import pkgutil
import typing
from collections.abc import Callable, Iterator, Mapping, MutableMapping

import pytest

import mrfit

# Where JSON, TOML or a foreign file's own words begin and end
BOUNDARY = {
    "mrfit.io.workspace",  # documents to JSON: plain, to_json
    "mrfit.io.outdated",  # settings as a file has them, of which a key is made as they stand
    "mrfit.api.fitting",  # FitResult.to_json
    "mrfit.api.advice",  # Advice.to_json
    "mrfit.api.discovery",  # Discovery.to_json
    "mrfit.io.schemas.discovery",  # discovery.json, written and read
    "mrfit.api.comparison",  # Comparison.to_json, OptimizerComparison.to_json
    "mrfit.api.options",  # keyword arguments of the public functions
    "mrfit.io.toml_file",  # pipeline files, TOML
    "mrfit.cli.project",  # the project file, TOML, as click takes it
    "mrfit.cli.catalog",  # the catalog of data sets, TOML, and its answer in JSON
    "mrfit.cli.pipeline",  # what --json prints
    "mrfit.cli.output",
    "mrfit.ingest.containers.hdf",  # variables of a Matlab file
    "mrfit.ingest.readers.matlab",
    "mrfit.ingest.readers.parquet",  # metadata of a Parquet file
    "mrfit.ingest.readers.json_log",  # header and records of a JSON log
    "mrfit.ingest.readers.tdms",  # properties of a TDMS file
}


def modules() -> Iterator[str]:
    for found in pkgutil.walk_packages(mrfit.__path__, "mrfit."):
        if not found.name.endswith("__main__"):
            yield found.name


def functions(module: str) -> Iterator[tuple[str, Callable[..., object]]]:
    """Yield the functions, methods and properties defined in a module."""
    whole = importlib.import_module(module)
    for name, item in vars(whole).items():
        item = inspect.unwrap(item) if callable(item) else item
        if inspect.isfunction(item) and item.__module__ == module:
            yield name, item
        elif inspect.isclass(item) and item.__module__ == module:
            for own, member in vars(item).items():
                member = getattr(member, "fget", None) or getattr(member, "__func__", member)
                member = getattr(member, "func", member)
                if inspect.isfunction(member) and member.__module__ == module:
                    yield f"{name}.{own}", member


def is_untyped(annotation: object) -> bool:
    """Whether an annotation is, or holds, a mapping from text to anything."""
    origin, parts = typing.get_origin(annotation), typing.get_args(annotation)
    mapping = origin in (dict, Mapping, MutableMapping)
    if mapping and parts[0] is str and parts[1] in (typing.Any, object):
        return True
    if annotation in (dict, Mapping, MutableMapping):
        return True
    # what a function takes is not what it returns
    inner = parts[-1:] if origin is Callable else parts
    return any(is_untyped(part) for part in inner)


def returned(function: Callable[..., object]) -> object:
    written = function.__annotations__.get("return")
    if not isinstance(written, str):
        return written
    names = {**vars(typing), **vars(importlib.import_module("collections.abc")), **function.__globals__}
    try:
        return eval(written, names)  # names that are imported for types only are no dictionaries
    except NameError:
        return None


def offenders(module: str) -> list[str]:
    return [f"{module}.{name}" for name, function in functions(module) if is_untyped(returned(function))]


@pytest.mark.parametrize(
    ("annotation", "untyped"),
    [
        (dict[str, typing.Any], True),
        (dict[str, object], True),
        (list[Mapping[str, typing.Any]] | None, True),
        (tuple[int, dict[str, typing.Any]], True),
        (Iterator[dict], True),
        (dict[str, float], False),
        (Callable[[dict[str, typing.Any]], int], False),
        (dict[str, list[str]], False),
    ],
)
def test_what_counts_as_untyped(annotation: object, untyped: bool) -> None:
    assert is_untyped(annotation) == untyped


def test_no_function_returns_an_untyped_dictionary() -> None:
    judged = [m for m in modules() if m not in BOUNDARY]
    assert len(judged) > 200
    assert [found for module in judged for found in offenders(module)] == []


def test_the_boundary_lists_no_module_in_vain() -> None:
    assert {m for m in BOUNDARY if not offenders(m)} <= {"mrfit.io.workspace"}
