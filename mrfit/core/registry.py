"""Find models, effects, optimizers and readers by name: mrfit's own, one file each, and those of plug-ins."""

import importlib
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Literal, overload

from mrfit.core import plugins
from mrfit.core.built_in import KINDS as KINDS
from mrfit.core.built_in import Kind, own_module, own_names
from mrfit.errors import MrfitError, unknown_name

if TYPE_CHECKING:
    from mrfit.core.protocols import Effect, Model, Optimizer, Reader


def names(kind: Kind) -> list[str]:
    """Return the sorted names of all items of a kind.

    Raises
    ------
    ConfigError
        If two of them have one name, or a plug-in cannot be loaded.
    """
    return sorted([*own_names(kind), *plugins.found(kind)])


@overload
def load(kind: Literal["model"], name: str) -> "Model": ...
@overload
def load(kind: Literal["effect"], name: str) -> "Effect": ...
@overload
def load(kind: Literal["optimizer"], name: str) -> "Optimizer": ...
@overload
def load(kind: Literal["reader"], name: str) -> "Reader": ...
@overload
def load(kind: Kind, name: str) -> "Model | Effect | Optimizer | Reader": ...
def load(kind: Kind, name: str) -> Any:
    """Return the named item: a module, or the object that a plug-in made.

    Raises
    ------
    ConfigError
        If no such item exists, the message lists near matches; if two have this name; if a plug-in cannot be loaded.
    """
    outside = plugins.found(kind)
    if name in outside:
        return outside[name].load()
    if name not in own_names(kind):
        raise unknown_name(kind, name, names(kind))
    return importlib.import_module(own_module(kind, name))


def elements(model: str) -> tuple[str, list[str]]:
    """Return the base and the effects of a written model, which are no words on the mass that it carries, behind @."""
    base, *effects = model.partition("@")[0].split("+")
    return base, effects


def equations_of_effects(model: str) -> list[str]:
    """Return the equations of the effects of a written model, each behind its name; none of a plug-in not loaded."""
    found = []
    for name in elements(model)[1]:
        with suppress(MrfitError):
            found.append(f"{name}: {load('effect', name).SPEC.equation}")
    return found


def where(kind: Kind, name: str) -> str:
    """Return the origin of a plug-in's item, in words; an empty string for mrfit's own, and for unknown names."""
    outside = plugins.found(kind)
    return outside[name].where if name in outside else ""


def digest(kind: Kind, name: str) -> str:
    """Return a hash of the source of a plug-in's item; an empty string for mrfit's own, and for unknown names."""
    outside = plugins.found(kind)
    return outside[name].digest() if name in outside else ""
