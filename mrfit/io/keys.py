"""Keys: hashes of what made a result, which tell whether it has to be made again.

A key holds the content of what a stage reads (``content_of``), its settings, and the sources of the code it uses. What
changes none of these makes nothing again: a comment in a channel map, or a file that another stage uses.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from mrfit.core.recording import Recording

# Rooms whose code each stage uses; tests follow the imports
_SHARED = ("core", "io", "kernels", "signal")
_FITTING = (*_SHARED, "simulate", "search", "models", "effects", "optimizers", "fit")
ROOMS: dict[str, tuple[str, ...]] = {
    "ingest": (*_SHARED, "ingest"),
    "flux": (*_SHARED, "flux"),
    "segment": (*_SHARED, "segment"),
    "fit": _FITTING,
    "discover": (*_FITTING, "discover"),
}


def sources(stage: str = "") -> list[Path]:
    """Return the source files of the code a stage uses; of the whole package without a stage."""
    package = Path(__file__).parents[1]
    if not stage:
        return sorted(package.rglob("*.py"))
    # the package's own __init__ names the face, which no stage uses
    own = (p for p in package.glob("*.py") if p.name != "__init__.py")
    return sorted([*own, *(p for room in ROOMS[stage] for p in (package / room).rglob("*.py"))])


@cache
def code_version(stage: str = "") -> str:
    """Return a hash over the sources of a stage, so that results of other code are never taken for this one's."""
    digest = hashlib.sha256(version("mrfit").encode())
    for source in sources(stage):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def digest_of(*parts: object) -> str:
    """Return a hash of JSON-able values alone."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()


def key_of(*parts: object, stage: str = "") -> str:
    """Return a hash of JSON-able inputs and settings together with the version of the code of ``stage``."""
    return digest_of(stage, code_version(stage), *parts)


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


def flux_key(settings: Mapping[str, Any], contents: Mapping[str, str]) -> str:
    """Return the key of flux linkage made with these settings from recordings of these contents, by id."""
    return key_of(settings, contents, stage="flux")


def segment_key(settings: Mapping[str, Any], contents: Mapping[str, str]) -> str:
    """Return the key of segments cut with these settings from recordings of these contents, by id."""
    return key_of(settings, contents, stage="segment")


def fit_key(settings: Mapping[str, Any], contents: Mapping[str, str], segments: Sequence[object]) -> str:
    """Return the key of a fit with these settings; ``jobs`` changes nothing."""
    return key_of({k: v for k, v in settings.items() if k != "jobs"}, contents, segments, stage="fit")


def discovery_key(settings: Mapping[str, Any], contents: Mapping[str, str], segments: Sequence[object]) -> str:
    """Return the key of a discovery with these settings; ``jobs`` changes nothing."""
    return key_of({k: v for k, v in settings.items() if k != "jobs"}, contents, segments, stage="discover")
