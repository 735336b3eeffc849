"""Keys: hashes of what made a result, which tell whether it has to be made again.

A key holds the content of what a stage reads (``content_of``), its settings, and the sources of the code it uses, of
plug-ins too. What
changes none of these makes nothing again: a comment in a channel map, or a file that another stage uses.
"""

import hashlib
import json
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from fnmatch import fnmatchcase
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from mrfit.core import registry
from mrfit.core.built_in import Kind
from mrfit.core.recording import Recording, Segment

PACKAGE = Path(__file__).parents[1]
PLUGIN = "plug-in "
"""Beginning of what a plug-in is called among the code of a law."""
# Where each stage begins, and the rooms of which the registry loads files by name; these import all else that it uses
_FITTING = ("fit/stage.py", "models/*.py", "effects/*.py", "optimizers/*.py")
STARTS: dict[str, tuple[str, ...]] = {
    "ingest": ("ingest/stage.py", "ingest/readers/*.py"),
    "flux": ("flux/stage.py",),
    "segment": ("segment/stage.py",),
    "fit": _FITTING,
    "discover": (*_FITTING, "discover/stage.py", "discover/thresholds.toml"),
    "advise": (*_FITTING, "advise/rivalry.py", "advise/parameters.py"),
}
# ``from mrfit.a.b import c, d`` with or without brackets, and ``import mrfit.a.b``, at any depth of a file
_IMPORT = re.compile(
    rb"^[ \t]*(?:from[ \t]+mrfit((?:\.\w+)*)[ \t]+import[ \t]+(\([^)]*\)|[^\n]*)|import[ \t]+mrfit((?:\.\w+)+))",
    re.MULTILINE,
)
_WORD = re.compile(rb"\w+")
# Rooms whose code decides what a model gives for its parameters, and where they meet
_LAW, _SIMULATION = ("models/", "effects/", "kernels/", "simulate/", "driven/"), "simulate/assembly.py"


def sources(stage: str = "") -> list[Path]:
    """Return the source files of the code a stage uses, by following its imports; of the whole package without one."""
    return [PACKAGE / name for name in _names(stage)]


@cache
def _names(stage: str) -> list[str]:
    """Return the same as paths inside of the package."""
    if not stage:
        return sorted(_files())
    return _reached([name for name in _files() if any(_is_like(name, start) for start in STARTS[stage])])


def _reached(starts: Iterable[str]) -> list[str]:
    """Return files and all that they import, directly or through others, sorted."""
    found, left = set[str](), list(starts)
    while left:
        name = left.pop()
        if name not in found:
            found.add(name)
            left += _imported(name)
    return sorted(found)


def _is_like(name: str, pattern: str) -> bool:
    return name.count("/") == pattern.count("/") and fnmatchcase(name, pattern)


@cache
def _imported(name: str) -> list[str]:
    """Return the modules of the package that a file imports; what is no module but a name in one is passed over."""
    found = []
    for module, names, whole in _IMPORT.findall(_source(name)):
        folder = (module or whole).decode()[1:].replace(".", "/")
        inside = [f"{folder}/{word.decode()}.py".lstrip("/") for word in (b"__init__", *_WORD.findall(names))]
        found += [path for path in (f"{folder}.py", *inside) if path in _files()]
    return found


def _source(name: str) -> bytes:
    return (PACKAGE / name).read_bytes()


@cache
def _files() -> frozenset[str]:
    """Return the files of the package, by their paths inside of it."""
    walk = os.walk(PACKAGE)
    found = [os.path.join(folder, n) for folder, _, names in walk for n in names if n.endswith((".py", ".toml"))]
    return frozenset(os.path.relpath(path, PACKAGE).replace(os.sep, "/") for path in found)


@cache
def code_version(stage: str = "") -> str:
    """Return a hash over the sources of a stage, so that results of other code are never taken for this one's."""
    digest = hashlib.sha256(version("mrfit").encode())
    for name in _names(stage):
        digest.update(name.encode())
        digest.update(_source(name))
    return digest.hexdigest()[:16]


@cache
def _file_digest(name: str) -> str:
    return hashlib.sha256(_source(name)).hexdigest()[:16]


def law_code(model: str) -> dict[str, str]:
    """Return a hash of every file, and of every plug-in, that decides what a written model gives for its parameters.

    They are the model's and its effects' own files, the kernels that these call, and what puts them together. Of a
    plug-in, which may call any of them, all kernels are one.
    """
    items = _items_of(model)
    outside = plugins_used(items)
    own = {f"{kind}s/{name.replace('-', '_')}.py" for kind, name in items} & _files()
    reached = _reached([_SIMULATION, *own])
    files = [name for name in reached if name.startswith(_LAW) and not name.endswith("__init__.py")]
    found = {f"mrfit/{name}": _file_digest(name) for name in files}
    if outside:
        found["mrfit/kernels"] = digest_of([_file_digest(n) for n in sorted(_files()) if n.startswith("kernels/")])[:16]
    return found | {f"{PLUGIN}{kind} {name}": digest[:16] for kind, name, digest in outside}


def _items_of(model: str) -> list[tuple[Kind, str]]:
    """Return the model and the effects of a written model."""
    base, effects = registry.elements(model)
    return [("model", base), *(("effect", e) for e in effects)]


def stamp(path: Path) -> tuple[int, ...]:
    """Return a mark by which a process knows that a file has been written again; none where there is no file."""
    try:
        found = path.stat()
    except OSError:
        return ()
    return found.st_mtime_ns, found.st_size, found.st_ino


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file's bytes, read once by a process as long as it is not written again.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    return _digest_since(path, stamp(path))


@cache
def _digest_since(path: Path, _: tuple[int, ...]) -> str:
    with path.open("rb") as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest()


def digest_of(*parts: object) -> str:
    """Return a hash of JSON-able values alone."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()


def key_of(*parts: object, stage: str = "", code: str = "") -> str:
    """Return a hash of JSON-able inputs and settings with the version of the code of ``stage``: this, or ``code``."""
    return digest_of(stage, code or code_version(stage), *parts)


def content_of(recording: Recording, digests: Mapping[str, str]) -> str:
    """Return a hash of all that later stages compute with: samples, units, sample interval, condition and its wording.

    Where a recording came from, what was odd about it and how it was made (``source``, ``sha256``, ``reader``,
    ``start``, ``findings``, ``history`` …) is for people and not in it.

    Parameters
    ----------
    recording
        The recording.
    digests
        Channel -> hash of its samples as float64.
    """
    channels = [(name, recording.units.get(name, ""), digests[name]) for name in recording.channels]
    return digest_of(channels, recording.dt, dict(recording.condition), dict(recording.wording))


def flux_key(settings: Mapping[str, Any], contents: Mapping[str, str], code: str = "") -> str:
    """Return the key of flux linkage made with these settings from recordings of these contents, by id.

    ``code`` is the version of the code that made it, here and below; default: this one.
    """
    return key_of(settings, contents, stage="flux", code=code)


def segment_key(settings: Mapping[str, Any], contents: Mapping[str, str], code: str = "") -> str:
    """Return the key of segments cut with these settings from recordings of these contents, by id."""
    return key_of(settings, contents, stage="segment", code=code)


def segments_digest(segments: Sequence[Segment]) -> str:
    """Return a hash of segments."""
    return digest_of([*map(asdict, segments)])


def fit_key(
    settings: Mapping[str, Any], contents: Mapping[str, str], segments: Sequence[Segment], code: str = ""
) -> str:
    """Return the key of a fit with these settings; ``jobs`` and ``name`` change nothing, a plug-in's source does."""
    named = {n: value for n, value in settings.items() if n != "name"}
    parts = _without_jobs(named), contents, [*map(asdict, segments)]
    return key_of(*parts, *_plugins_of(settings), stage="fit", code=code)


def discovery_key(
    settings: Mapping[str, Any], contents: Mapping[str, str], segments: Sequence[Segment], code: str = ""
) -> str:
    """Return the key of a discovery with these settings, among whose candidates are all effects of plug-ins."""
    tried: list[tuple[Kind, str]] = [("effect", e) for e in registry.names("effect")]
    parts = _without_jobs(settings), contents, [*map(asdict, segments)]
    return key_of(*parts, *_plugins_of(settings, tried), stage="discover", code=code)


def _without_jobs(settings: Mapping[str, Any]) -> object:
    return {name: value for name, value in settings.items() if name != "jobs"}


def plugins_used(items: Iterable[tuple[Kind, str]]) -> list[tuple[str, str, str]]:
    """Return kind, name and hash of the source of those items that are plug-ins'."""
    return [(kind, name, source) for kind, name in items if (source := registry.digest(kind, name))]


def _plugins_of(settings: Mapping[str, Any], more: Iterable[tuple[Kind, str]] = ()) -> list[tuple[str, str, str]]:
    """Return the plug-ins that a fit's or a discovery's settings name, and those among ``more``."""
    written = _items_of(str(settings.get("model", "")))
    optimizers: list[tuple[Kind, str]] = [("optimizer", o) for o in str(settings.get("optimizer", "")).split("-")]
    return plugins_used(dict.fromkeys([*written, *optimizers, *more]))
