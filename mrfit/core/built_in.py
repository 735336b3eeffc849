"""The four kinds of items a registry holds, and the names of those that come with mrfit: one item, one file."""

import importlib
import pkgutil
from functools import cache
from typing import Literal

Kind = Literal["model", "effect", "optimizer", "reader"]
KINDS: dict[Kind, str] = {
    "model": "mrfit.models",
    "effect": "mrfit.effects",
    "optimizer": "mrfit.optimizers",
    "reader": "mrfit.ingest.readers",
}


@cache
def own_names(kind: Kind) -> tuple[str, ...]:
    """Return the sorted names of mrfit's own items of a kind: their files' names with hyphens for underscores."""
    package = importlib.import_module(KINDS[kind])
    return tuple(sorted(m.name.replace("_", "-") for m in pkgutil.iter_modules(package.__path__) if not m.ispkg))


def own_module(kind: Kind, name: str) -> str:
    """Return the import name of the module that holds one of mrfit's own items."""
    return f"{KINDS[kind]}.{name.replace('-', '_')}"
