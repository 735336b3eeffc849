"""Names that the shell completes: items of the registries and fits of the workspace, none of which is loaded."""

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from mrfit.core.built_in import Kind

STRATEGIES = ("auto", "staged")
"""Searches that are no optimizers, and are written like these."""
Complete = Callable[[str], list[str]]


def item(written: str) -> list[str]:
    """Return the names of all items that begin so."""
    from mrfit.core import registry

    return _beginning(written, {name for kind in registry.KINDS for name in registry.names(kind)} | {*STRATEGIES})


def model(written: str) -> list[str]:
    """Return the models that begin so, the effects that may follow behind a +."""
    base, plus, effect = written.rpartition("+")
    return [f"{base}+{name}" for name in _of("effect", effect)] if plus else _of("model", written)


def optimizer(written: str) -> list[str]:
    """Return the optimizers that begin so, those that may follow in a chain behind a hyphen."""
    chain, hyphen, last = written.rpartition("-")
    more = [] if hyphen else _beginning(last, STRATEGIES)
    return sorted([f"{chain}{hyphen}{name}" for name in _of("optimizer", last)] + more)


def fit(context: typer.Context, written: str) -> list[str]:
    """Return the finished fits of the workspace that begin so."""
    work = Path(context.params.get("work") or os.environ.get("MRFIT_WORK") or "mrfit-work")
    return _beginning(written, (path.parent.name for path in work.glob("fits/*/fit.json")))


def _of(kind: "Kind", written: str) -> list[str]:
    from mrfit.core import registry

    return _beginning(written, registry.names(kind))


def _beginning(written: str, names: Iterable[str]) -> list[str]:
    return sorted(name for name in names if name.startswith(written))


OF: dict[str, Complete] = {"model": model, "optimizer": optimizer}
"""By what a setting says its value names."""
