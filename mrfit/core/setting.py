"""Properties of a field of a settings class, beside its name, type and default.

The option of a command, the key in a pipeline file, the argument in Python and the line in a report follow from it:

    seed: Annotated[int, Setting("Seed of every random choice.", low=0)] = 0
"""

import inspect
import math
import re
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields, is_dataclass
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

from mrfit.core.arguments import one_line

# Default of a field that has none
UNSET: object = object()


@dataclass(frozen=True, slots=True)
class SettingForm:
    """Spelling of a value that people write otherwise than its type says.

    Attributes
    ----------
    option
        Type of the option of a command.
    parse
        Gives the value of an option, called with its name (``--start``) and what was written.
    key
        Type of the key in a pipeline file.
    load
        Gives the value of such a key.
    take
        Gives the value of an argument in Python, called with its name and the argument.
    write
        Gives the option that ``parse`` reads as a value: a default.
    """

    option: object
    parse: Callable[[str, Any], Any]
    key: object
    load: Callable[[Any], Any]
    take: Callable[[str, object], Any]
    write: Callable[[Any], object] = lambda value: value or None


@dataclass(frozen=True, slots=True)
class Setting:
    """Properties of a setting.

    Attributes
    ----------
    help
        One line for the command's help.
    flag
        Name on the command line, with underscores; empty for the field's name.
    short
        One-letter form, as ``-j``.
    key
        Name in a pipeline file; empty for the name on the command line.
    metavar
        What stands for the value in the command's help; None for its type.
    low, high
        Limits, both allowed.
    above
        Limit below, not allowed itself.
    form
        How the value is written; None for as its type says.
    show_default
        Whether the command's help shows the default.
    command_default
        Default on the command line where it is another than in Python.
    in_file
        Whether a pipeline file has it in the table of its stage.
    changes_result
        Whether it can change the result. One that cannot comes last in the command's help and is in no pipeline file.
    names
        Kind of item that it names, which the shell completes: ``model`` or ``optimizer``; empty for none.
    told
        How the page of a report says that it is not at its default: a format of the name and the value, or of the parts
        of each item where the value is a list. None if the page says it elsewhere.
    """

    help: str
    flag: str = ""
    short: str = ""
    key: str = ""
    metavar: str | None = None
    low: float | None = None
    high: float | None = None
    above: float | None = None
    form: SettingForm | None = None
    show_default: bool = True
    command_default: object = UNSET
    in_file: bool = True
    changes_result: bool = True
    names: str = ""
    told: str | None = "{0} {1}"

    def refusal(self, name: str, number: float) -> str:
        """Return a refusal of a number that breaks the limits, under a name; empty where it keeps them."""
        given = f"{number:g}" if isinstance(number, float) else one_line(number)
        if isinstance(number, float) and not math.isfinite(number):
            return f"{name} takes a finite number, not {given}"
        if self.low is not None and number < self.low:
            return f"{name} takes {self.low:g} or more, not {given}"
        if self.high is not None and number > self.high:
            return f"{name} takes {self.high:g} or less, not {given}"
        if self.above is not None and number <= self.above:
            return f"{name} takes a number above {self.above:g}, not {given}"
        return ""


@dataclass(frozen=True, slots=True)
class SettingField:
    """A field of a settings class.

    Attributes
    ----------
    name
        Of the field, which is the argument's in Python.
    kind
        Its type.
    default
        ``UNSET`` if it has none.
    setting
        What it says of itself; None for a field that is for programs alone.
    """

    name: str
    kind: object
    default: object = UNSET
    setting: Setting | None = None

    @property
    def alternatives(self) -> tuple[object, ...]:
        """The types that make up its type."""
        union = get_origin(self.kind) not in (None, Literal, tuple, list, dict)
        return get_args(self.kind) if union else (self.kind,)

    @property
    def choices(self) -> tuple[str, ...]:
        """The words it takes, none if it takes others."""
        return tuple(a for part in self.alternatives if get_origin(part) is Literal for a in get_args(part))

    @property
    def argument(self) -> object:
        """Its type as an argument in Python."""
        return self.setting.form.key if self.setting and self.setting.form else self.kind

    @property
    def optional(self) -> bool:
        """Whether it may be None."""
        return NoneType in self.alternatives


def defined(kind: type[Any]) -> tuple[SettingField, ...]:
    """Return the fields of a settings class in their order."""
    hints = get_type_hints(kind, include_extras=True)
    return tuple(defined_as(f.name, hints[f.name], UNSET if f.default is MISSING else f.default) for f in fields(kind))


def defined_as(name: str, hint: object, default: object = UNSET) -> SettingField:
    """Return the properties of a field or an argument from its annotation."""
    kind, *said = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    return SettingField(name, kind, default, next((s for s in said if isinstance(s, Setting)), None))


def explained(kind: type[Any]) -> dict[str, str]:
    """Return descriptions of a settings class's fields: its docstring of a field alone, else the line of its help."""
    found = {f.name: f.setting.help for f in defined(kind) if f.setting}
    for one in filter(is_dataclass, reversed(kind.__mro__)):
        listed = (inspect.getdoc(one) or "").partition("Attributes\n----------\n")[2]
        for name, text in re.findall(r"^(\w+)\n((?:    .*(?:\n|$))+)", listed, re.MULTILINE):
            found[name] = " ".join(text.split())
    return found


def flag_of(field: SettingField) -> str:
    """Return the name of a field on the command line, with underscores."""
    return (field.setting.flag if field.setting else "") or field.name


def key_of(field: SettingField) -> str:
    """Return the name of a field in a pipeline file."""
    return (field.setting.key if field.setting else "") or flag_of(field)
