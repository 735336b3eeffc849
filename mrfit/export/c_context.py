"""What the C templates are rendered with: a fit's parameters, effects and channels as text of C."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Channel:
    """An input or the output; ``low`` to ``high`` is what the fit has seen of it, None where that is not judged."""

    name: str
    field: str
    text: str
    low: str | None = None
    high: str | None = None


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
    law, clip
        What gives the parameter at a current, and the bounds it is held within, None for none.
    """

    name: str
    field: str
    text: str
    stored: str
    count: int
    log: bool
    first: int
    values: list[float]
    initial: str
    law: str
    clip: tuple[str, str] | None


@dataclass(frozen=True)
class Term:
    """A Lagrange polynomial as a product in C, and the place of the value that it multiplies."""

    place: int
    product: str


@dataclass(frozen=True)
class Piece:
    """Terms of the currents up to ``high``."""

    high: str
    terms: list[Term]


@dataclass(frozen=True)
class Basis:
    """Lagrange polynomials of one order: through how many nodes, and their pieces.

    ``knee`` is that of a current that saturates, empty where they are of the current itself.
    """

    count: int
    pieces: list[Piece]
    knee: str


@dataclass(frozen=True)
class Input:
    """A channel that a user sets, as forms see it: its field, and whether it is one that is held at levels."""

    field: str
    level: bool


@dataclass(frozen=True)
class Given:
    """What every form sees of an export.

    Attributes
    ----------
    tunable
        See ``Context``.
    knows_temperature
        Whether the user gives a temperature.
    inputs
        The channels that the user sets.
    middles
        Whether an effect needs, or may need, what is made in the middle between steps.
    """

    tunable: bool
    knows_temperature: bool
    inputs: tuple[Input, ...]
    middles: bool


@dataclass(frozen=True)
class EffectField:
    """A parameter or constant of an effect; ``first``: place among all parameters, None of a constant."""

    field: str
    text: str
    initial: str
    first: int | None


@dataclass(frozen=True)
class EffectCode:
    """An effect: what its template gives, and how its function is declared and called.

    ``before`` is the body of a second function, empty without one: it changes the inputs, behind effects of them;
    ``middles`` whether it needs the output in the middle between steps too. ``functions`` has all of them where they
    are printed, ``rest_call`` calls the one of those that prepares its state before the first step.
    """

    name: str
    ident: str
    title: str
    slot: str
    state: str
    code: str
    body: str
    before: str
    middles: bool
    fields: list[EffectField]
    returns: str
    arguments: str
    call: str
    functions: str = ""
    rest_call: str = ""


@dataclass(frozen=True)
class Block:
    """Code that several forms share."""

    types: str
    code: str


@dataclass(frozen=True)
class Curve:
    """Tables of a Bouc-Wen element whose shape holds.

    Attributes
    ----------
    up, down
        Cells above and below 0; ``positive`` and ``negative`` of them.
    rest
        The other fields of its struct in C: ends of the cells, n, end, gap, rate, largest hysteretic variable.
    """

    up: list[list[str]]
    down: list[list[str]]
    positive: int
    negative: int
    rest: list[str]


@dataclass(frozen=True)
class Context:
    """What the C templates are rendered with, by the names they have there.

    Attributes
    ----------
    tunable
        Whether parameters can be set at run time.
    p
        Prefix of all names.
    inputs, output, effects, bases
        Channels, effects, and polynomials of current between ``low`` and ``high``.
    base, base_title, base_state, base_code, base_body, base_arguments, base_call
        The base: its parameters, what its template gives, how its function is declared and called.
    base_functions, base_rest, helpers
        The base's functions where they are printed, the call of that which prepares its state, and what they all call.
    block_names, blocks
        Shared code.
    ring, fastest
        Number of late values that are kept, enough at so many steps a second.
    curve, cells, shape
        Tables of a hysteresis whose shape holds, places for cells of such tables, and the code that gives the shape.
    roles, scales
        Roles whose parameters effects scale, and whether there are such parameters.
    count
        Number of all parameters.
    fine
        Whether the model also runs along the middles between steps.
    unused_inner, unused_shown
        Statements that name arguments without a use.
    """

    tunable: bool
    p: str
    inputs: list[Channel]
    output: Channel
    base: list[BaseField]
    base_title: str
    base_state: str
    base_code: str
    base_body: str
    base_arguments: str
    base_call: str
    base_functions: str
    base_rest: str
    helpers: str
    effects: list[EffectCode]
    block_names: list[str]
    blocks: list[Block]
    ring: int
    fastest: int
    curve: Curve | None
    cells: tuple[int, int] | None
    shape: str
    bases: list[Basis]
    low: str
    high: str
    roles: list[str]
    scales: bool
    count: int
    fine: bool
    unused_inner: str
    unused_shown: str
