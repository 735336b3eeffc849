"""C forms of models and effects: printed from their functions, or templates by name with what these share."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from mrfit.core import registry
from mrfit.errors import DataError
from mrfit.export.printer.elements import Element

if TYPE_CHECKING:
    from jinja2 import Environment

TEMPLATES = Path(__file__).with_name("templates")
# Where a form that knows a stroke's middle cannot be the simulation
MIDDLE = "the middle of the stroke is that of the fit's logs, where the simulation takes that of each record"
NAMED = re.compile(r"\bb->(\w+)")


def environment(folder: Path) -> "Environment":
    """Return the environment in which templates of a folder are read; nothing in them is escaped by itself."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    return Environment(
        loader=FileSystemLoader(folder),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def own_form(kind: Literal["model", "effect"], name: str) -> Path | None:
    """Return the file of an item's C form, ``NAME.c.j2``; None if it has none."""
    shipped = TEMPLATES / "c" / f"{kind}s" / f"{name}.c.j2"
    return shipped if shipped.is_file() and not registry.where(kind, name) else None


class Form:
    """A template's macros and settings, rendered for one export.

    Parameters
    ----------
    file
        The template.
    given
        Variables it sees, those of ``c_context.Given``.
    """

    def __init__(self, file: Path, given: Mapping[str, object]) -> None:
        self.module: Any = environment(file.parent).get_template(file.name).make_module(dict(given))

    def text(self, macro: str) -> str:
        """Return what a macro gives, empty where the template has none of this name."""
        found = getattr(self.module, macro, None)
        return str(found()).strip("\n") if found else ""

    def setting(self, name: str, default: Any) -> Any:
        """Return what the template sets."""
        return getattr(self.module, name, default)

    @cached_property
    def uses(self) -> list[str]:
        """The shared blocks it needs."""
        return list(self.setting("uses", []))

    @cached_property
    def shape_names(self) -> set[str]:
        """The base's parameters that shape its hysteresis: while they hold, it is one curve."""
        return set(NAMED.findall(self.text("shape")))


@dataclass(frozen=True)
class PrintedForm:
    """A model or an effect that is printed from its ``law`` or its ``step``, in place of a template."""

    element: Element
    uses: tuple[str, ...] = ()
    shape_names: frozenset[str] = frozenset()

    def text(self, macro: str) -> str:
        """Return what it remembers, as the fields of a struct; all else is printed."""
        return self.element.fields if macro == "state" else ""

    def setting(self, name: str, default: Any) -> Any:
        """Return what the element says of itself; a function has no other settings."""
        own = {"constants": ["x_middle"], "stated": MIDDLE} if self.element.centred else {}
        return own.get(name, default)


def form_of(kind: Literal["model", "effect"], name: str, given: Mapping[str, object]) -> Form:
    """Return the C form of a model or effect.

    Raises
    ------
    DataError
        If it has none.
    """
    file = own_form(kind, name)
    if file is None and kind == "effect":
        raise DataError(
            f"the effect {name} has no C form: it is what the record adds, or is told from the whole record; leave it "
            f"out with --without {name}"
        )
    if file is None:
        raise DataError(f"the model {name} has no C form: give it a step, as docs/export.md shows")
    return Form(file, given)


def blocks_for(wanted: list[str], given: Mapping[str, object]) -> dict[str, Form]:
    """Return by name the shared blocks that some need, those they need themselves before them."""
    found: dict[str, Form] = {}

    def add(name: str) -> None:
        if name not in found:
            form = Form(TEMPLATES / "c" / "blocks" / f"{name}.c.j2", given)
            for other in form.uses:
                add(other)
            found[name] = form

    for name in wanted:
        add(name)
    return found
