"""The page of the workspace's files: every document of ``mrfit.io.schemas``, key by key."""

import dataclasses
import importlib
import inspect
import json
import pkgutil
import re
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

import mrfit.io.schemas
from docs.reference.markdown import documented, fenced, plain, table
from mrfit.core.specs import Array
from mrfit.io.schemas.reading import Document, Entry, Part, Stored

# Which file holds a document; the others are parts of a run that was stopped, or are kept with samples
FILES = {
    "About": "W/recordings/ID.parquet (metadata), W/ingest.json",
    "IngestFile": "W/ingest.json",
    "FluxFile": "W/flux.json",
    "SegmentsFile": "W/segments.parquet (metadata)",
    "Fit": "W/fits/NAME/fit.json",
    "SavedFit": "the file that FitResult.save() writes",
    "ReportFile": "W/report/report.json",
    "DiscoveryFile": "W/discover/discovery.json",
    "AdviceFile": "W/advise/advise.json",
    "ModelsFile": "W/compare/compare.json",
    "OptimizersFile": "W/compare/optimizers.json",
    "InvertFile": "W/apply/invert.json",
    "TrackFile": "W/apply/track.json",
    "CurrentFile": "W/apply/current.json",
    "FluxCommandFile": "W/apply/flux-command.json",
    "PredictionFile": "W/predict/NAME.json",
    "SheetFile": "sheet.json of `mrfit measure sheet`, in the folder of --out",
    "BatchFile": "WORK/batch.json of `mrfit batch`",
    "TracksFile": "WORK/track/FIT.json of `mrfit track-parameters`",
    "DriftFile": "drift.json of `mrfit drift`, in the folder of --out",
    "LogRow": "a line of WORK/batch.jsonl",
    "QuarterCarFile": "W/apply/quarter-car.json",
}
ARCHITECTURE = Path(__file__).parents[1] / "architecture.md"


def documents() -> dict[str, type[Any]]:
    """Return every class that is the content of a file, by name."""
    return {n: c for n, c in _classes().items() if issubclass(c, (Document, Stored))}


def page() -> str:
    """Return the page of all documents, and of the parts that they share."""
    whole = documents()
    files = {n: whole[n] for n in FILES}
    parts = {n: c for n, c in _classes().items() if n not in files}
    text = [
        "# Workspace and its files",
        "A workspace is a folder; its name is given by `--work`, and is `mrfit-work` otherwise. Every file is written "
        "under a temporary name and then renamed: a command that is killed leaves the earlier file. A JSON file names "
        "its schema. A key that a file leaves out has its default; a key that mrfit does not know is ignored.",
        fenced(_tree()),
        *(_described(n, c) for n, c in files.items()),
        "## Parts of files",
        *(_described(n, c, "###") for n, c in parts.items()),
    ]
    return "\n\n".join(text) + "\n"


def _tree() -> str:
    """Return the files of a workspace, as the page on the architecture has them."""
    return ARCHITECTURE.read_text(encoding="utf-8").split("The workspace:\n\n```\n")[1].split("\n```")[0]


def _classes() -> dict[str, type[Any]]:
    found: dict[str, type[Any]] = {}
    for info in pkgutil.iter_modules(mrfit.io.schemas.__path__):
        module = importlib.import_module(f"mrfit.io.schemas.{info.name}")
        for name, kind in vars(module).items():
            own = inspect.isclass(kind) and kind.__module__ == module.__name__ and issubclass(kind, (Entry, Part))
            if own and info.name != "reading":
                # one name in two files: the file's comes behind
                found[name if name not in found else f"{name} ({info.name})"] = kind
    return found


def _described(name: str, kind: type[Any], level: str = "##") -> str:
    known = [f"`{s}`" for s in getattr(kind, "known", ())]
    about = [f"File: `{FILES[name]}`." if name in FILES else "", f"Schema: {', '.join(known)}." if known else ""]
    summary, meanings = _doc(kind)
    rows = [[f"`{key}`", plain(hint), default, plain(meanings.get(key, ""))] for key, hint, default in _keys(kind)]
    body = [f"{level} {name}", " ".join(filter(None, about)), documented(summary)]
    return "\n\n".join([*filter(None, body), table(("key", "type", "default", "meaning"), rows) if rows else ""])


def _keys(kind: type[Any]) -> list[tuple[str, str, str]]:
    hints = get_type_hints(kind)
    if dataclasses.is_dataclass(kind):
        return [(f.name, _type(hints[f.name]), _default(f)) for f in dataclasses.fields(kind)]
    return [
        (n, _type(hints[n]), "" if f.is_required() else _shown(f.get_default())) for n, f in kind.model_fields.items()
    ]


def _default(field: "dataclasses.Field[Any]") -> str:
    if field.default is not dataclasses.MISSING:
        return _shown(field.default)
    return "empty" if field.default_factory is not dataclasses.MISSING else ""


def _shown(value: object) -> str:
    empty = value in ("", [], {}, ()) or type(value).__name__ == "PydanticUndefinedType"
    return "empty" if empty else f"`{json.dumps(value)}`"


def _type(hint: Any) -> str:
    """Return a type in the words of JSON."""
    if hint is Array:
        return "list of number"
    if hint is type(None):
        return "null"
    origin, args = get_origin(hint), get_args(hint)
    names = {str: "text", int: "whole number", float: "number", bool: "true or false", dict: "object", Any: "any"}
    if origin is None:
        return names.get(hint, getattr(hint, "__name__", str(hint)))
    if origin in (list, tuple):
        inner = " or ".join(dict.fromkeys(_type(a) for a in args if a is not Ellipsis))
        return f"list of {inner}"
    if origin is dict:
        return f"object of {_type(args[1])}"
    if str(origin).endswith("Literal"):
        return " or ".join(f"'{a}'" for a in args)
    words = list(dict.fromkeys(_type(a) for a in args))
    return " or ".join(w for w in words if not (w == "whole number" and "number" in words))


def _doc(kind: type[Any]) -> tuple[str, dict[str, str]]:
    """Return a docstring without its attributes, and these by name, those of its bases included."""
    meanings: dict[str, str] = {}
    for base in reversed(kind.__mro__[:-1]):
        attributes = inspect.cleandoc(base.__doc__ or "").partition("\nAttributes\n----------\n")[2]
        for names, text in re.findall(r"^(\S.*)\n((?:    .*\n?|\n)+)", attributes, re.MULTILINE):
            meanings |= {name.strip(): " ".join(text.split()) for name in names.split(",")}
    return inspect.cleandoc(kind.__doc__ or "").partition("\nAttributes\n----------\n")[0].strip(), meanings
