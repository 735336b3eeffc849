"""Find models, optimizers, effects and readers by file name: one item, one file, nothing to register."""

import importlib
import pkgutil
from functools import cache
from types import ModuleType

from mrfit.errors import unknown_name

KINDS: dict[str, str] = {
    "model": "mrfit.models",
    "effect": "mrfit.effects",
    "optimizer": "mrfit.optimizers",
    "reader": "mrfit.ingest.readers",
}


@cache
def names(kind: str) -> list[str]:
    """Return the sorted registry names of a kind: its package's file names with hyphens for underscores."""
    package = importlib.import_module(KINDS[kind])
    return sorted(m.name.replace("_", "-") for m in pkgutil.iter_modules(package.__path__) if not m.ispkg)


def load(kind: str, name: str) -> ModuleType:
    """Return the module that defines the named item.

    Raises
    ------
    ConfigError
        If no such item exists; the message lists near matches.
    """
    if name not in names(kind):
        raise unknown_name(kind, name, names(kind))
    return importlib.import_module(f"{KINDS[kind]}.{name.replace('-', '_')}")
