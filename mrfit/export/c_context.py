"""The context of templates: a fit's parameters, effects and channels as fields of structs."""

from dataclasses import dataclass

from mrfit.simulate.current_dependence import Order


@dataclass(frozen=True)
class ChannelField:
    """An input or the output; ``ends`` is what the fit has seen of it, None where that is not judged."""

    name: str
    field: str
    text: str
    ends: tuple[float, float] | None = None


@dataclass(frozen=True)
class BaseField:
    """A parameter of the base.

    Attributes
    ----------
    name, field, text
        Its own name, that in C, and what it is.
    stored
        The field that has its ``count`` values, or their logarithms if ``log``; ``first``: place among all parameters.
    values, initial
        These values, and what initializes the field.
    order, clip
        How it depends on current, and the bounds it is held within, None for none.
    role
        The role by which effects scale it, empty if none does.
    """

    name: str
    field: str
    text: str
    stored: str
    count: int
    log: bool
    first: int
    values: list[float]
    initial: list[str]
    order: Order
    clip: tuple[float, float] | None
    role: str


@dataclass(frozen=True)
class EffectField:
    """A parameter or constant of an effect; ``first``: place among all parameters, None of a constant."""

    field: str
    text: str
    initial: str
    first: int | None


@dataclass(frozen=True)
class EffectFields:
    """The parameters of an effect."""

    name: str
    ident: str
    title: str
    fields: list[EffectField]


@dataclass(frozen=True)
class Memory:
    """Memory of an element: fields, and the number of places of its past, empty without one."""

    ident: str
    fields: list[str]
    past: str


@dataclass(frozen=True)
class CurveTable:
    """The branch curve of a loop whose shape holds: cells, the other fields of its struct, and rows."""

    cells: list[list[str]]
    others: dict[str, str]
    rows: int


@dataclass(frozen=True)
class Context:
    """The context of templates, by the names they have there.

    Attributes
    ----------
    tunable
        Whether parameters can be set at run time.
    p
        Prefix of all names.
    inputs, output, base, effects, memories
        Channels, parameters, and what elements remember.
    ring, fastest
        Number of late values that are kept, enough at so many steps a second.
    curve
        Of a base that reads one.
    roles
        Roles whose parameters effects scale.
    count
        Number of all parameters.
    fine
        Whether the model also runs along the middles between steps.
    """

    tunable: bool
    p: str
    inputs: list[ChannelField]
    output: ChannelField
    base: list[BaseField]
    effects: list[EffectFields]
    memories: list[Memory]
    ring: int
    fastest: int
    curve: CurveTable | None
    roles: list[str]
    count: int
    fine: bool
