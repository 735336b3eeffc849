"""Specifications of registry entries: parameters, models, effects, optimizers, readers."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrfit.core.arguments import check_arguments
from mrfit.core.invariance import Invariance as Invariance

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
Steps = float | Array
"""Time between samples in s: one number, or of samples at uneven times that before each (N,), the first not read."""

Values = tuple[float, ...]
"""Inputs or parameters of one moment, in the order of a SPEC."""
Ends = tuple[Values, Values]
"""Those at a step's beginning and at its end."""
State = tuple[float, ...]
"""What a device remembers between two steps."""


@check_arguments
@dataclass(frozen=True, slots=True)
class Param:
    """A named, bounded, unit-bearing model parameter.

    Attributes
    ----------
    name
        Symbol as in the cited source (``Lc``, ``kappa``, ``fy``).
    unit
        SI unit, in pint's spelling; ``1`` for a pure number.
    low, high
        Bounds within which a fit searches; both finite, ``low < high``.
    start
        Start value, inside the bounds.
    scale
        ``log`` where the value may range over decades (needs ``low > 0``), else ``linear``.
    role
        What the parameter does, for effects that make parameters of a role vary: ``yield``, ``viscous``, ``stiffness``,
        ``knee`` (the velocity at which it yields, or its inverse), ``hysteresis``, ``offset``, ``inductance``,
        ``saturation`` (of a core's flux), ``coercive`` (current) or empty.
    text
        What it means, in a few words.
    fixed
        Not fitted, but held at the greatest value that ``start_values`` gives for the training logs: a choice of
        scale, which no data determine. It is fitted where the user gives bounds or a start of their own.
    needs
        Of an effect: the channel without which it does nothing. It is held at its start in a model that does not take
        this channel.
    symbol
        LaTeX math, where the name does not spell it as ``C_inf`` spells C with the index ∞.
    """

    name: str
    unit: str
    low: float
    high: float
    start: float
    scale: Literal["linear", "log"] = "linear"
    role: str = ""
    text: str = ""
    fixed: bool = False
    needs: str = ""
    symbol: str = ""


@dataclass(frozen=True, slots=True)
class DerivedQuantity:
    """A quantity computed from the parameters that the data may determine where single parameters they do not."""

    name: str
    unit: str
    text: str = ""
    role: str = ""


class PassiveRange(NamedTuple):
    """Name of a parameter, and low and high end of the range in which a model cannot release energy."""

    name: str
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class ModelSpec:
    """A model's self-description, beside its ``response(drive, theta, dt)``.

    Attributes
    ----------
    name
        Registry name; the file name with hyphens.
    title
        One line.
    equation
        The equations in plain text.
    reference
        Source with equation number.
    inputs
        Channel names in the order of the rows of ``drive``.
    output
        Channel name of the response.
    params
        Parameters in the order of the columns of ``theta``.
    linear
        Names of parameters in which the response is jointly linear (affine), the others held.
    rate_independent
        Whether the response depends on the path of its first input only, not on time.
    derived
        What the module's ``derived(theta)`` returns, if it has one: (P, K) -> (P, D).
    passive
        Range of a parameter within which the model cannot release energy, where its bounds are wider.
    caution
        What is to be said of every fit with it, as a warning; empty for nothing.
    free_offset
        Whether each record's output has an unknown constant: an integrated flux does, a load cell's force not.
    co_energy
        Whether output times rate of input is the co-energy, so that the loop is traversed in the opposite
        sense: flux over current.
    jumps
        Inputs at whose change of sign the response jumps, as Coulomb friction does at that of velocity.
    rests_at
        Input at whose mean a memory that lasts for many cycles is as from rest, if the model has one: a simulation of a
        periodic test begins there.
    """

    name: str
    title: str
    equation: str
    reference: str
    inputs: tuple[str, ...]
    output: str
    params: tuple[Param, ...]
    linear: tuple[str, ...] = ()
    rate_independent: bool = False
    derived: tuple[DerivedQuantity, ...] = ()
    passive: PassiveRange | None = None
    caution: str = ""
    free_offset: bool = False
    co_energy: bool = False
    jumps: tuple[str, ...] = ()
    rests_at: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Parameter names in the order of ``theta``'s columns."""
        return tuple(p.name for p in self.params)

    @property
    def start(self) -> Array:
        """Start values, shape (K,)."""
        return np.array([p.start for p in self.params])

    def theta(self, values: Mapping[str, float]) -> Array:
        """Return the parameter vector (K,) of values by name; a held one that is not among them is at its start.

        A fit of an earlier version may lack a parameter that its model only holds.
        """
        return np.array([values.get(p.name, p.start) if p.fixed else values[p.name] for p in self.params])


@dataclass(frozen=True, slots=True)
class Stage:
    """One stage of a staged identification: the parameters that one kind of test shows by itself.

    A model that is identified so has ``STAGES``, in their order, beside its SPEC.

    Attributes
    ----------
    name
        The part of the model, in a few words.
    test
        Kind of test: ``constant-speed`` strokes and ``sine`` strokes at a held current, ``current-step`` for any test
        under a current that moves, ``heating`` for one during which the temperature moves.
    parameters
        Patterns on the names of the parameters, those of effects (``force-filter.*``) included.
    """

    name: str
    test: Literal["constant-speed", "sine", "current-step", "heating"]
    parameters: tuple[str, ...]


Response = Callable[[Array, Array, float], Array]
"""response(drive (C, N), theta (P, K), dt in s) -> (P, N): a whole batch of parameter vectors in one call.

Causal, deterministic, inputs untouched; every row equals the one a batch of one gives. State starts from rest at
sample 0. A simulation that diverges returns non-finite values instead of raising.
"""


Sensitivities = Callable[[Array, Array, float, Index], Array]
"""sensitivities(drive (C, N), theta (P, K), dt in s, columns (Q,)) -> (P, 1 + Q, N): exact derivatives.

Row 0 is the response, row 1 + q its derivative with respect to theta[:, columns[q]]. A model whose derivatives cost
less than as many simulations has it beside its ``response``.
"""


@dataclass(frozen=True, slots=True)
class ReducedModel:
    """A model in the fewest parameters that give all its responses: a search meets no direction without effect.

    A model in whose own parameters several vectors give one response, or in which what could enter linearly does not,
    has a ``REDUCED`` beside its SPEC.

    Attributes
    ----------
    spec
        Its parameters, with bounds within which to search before the model's own; inputs and output are the model's.
    response
        Its batched response.
    reduce
        Maps the model's parameters (P, K) to these (P, R).
    restore
        Maps these (P, R) to parameters (P, K) of the same response, which may lie outside the model's bounds.
    rough
        Less exact and faster response, or None.
    sensitivities
        Response and its exact derivatives, or None.
    """

    spec: ModelSpec
    response: Response
    reduce: Callable[[Array], Array]
    restore: Callable[[Array], Array]
    rough: Response | None = None
    sensitivities: Sensitivities | None = None


@dataclass(frozen=True, slots=True)
class Breaks:
    """Distinction of an effect from any law.

    Attributes
    ----------
    invariance
        What it breaks.
    sign
        1 where only strengths above zero are physical, -1 where only those below, 0 where both are.
    relaxation
        Whether it can be told beside a viscous relaxation of free size; an effect that one imitates cannot.
    early
        Whether a record that is early, as by a filter in the motion's channel, looks the same to first order.
    alike
        Effects that no test of this kind tells from it: it is named as one of a set.
    unexamined
        Effects that break the same and cannot be examined: with one that a base taken as exact names it is a set.
    """

    invariance: Invariance
    sign: Literal[-1, 0, 1] = 0
    relaxation: bool = True
    early: bool = False
    alike: tuple[str, ...] = ()
    unexamined: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Programme:
    """Tests that an experiment asks for, as far as a list of tests shows them; 0 asks for nothing.

    Attributes
    ----------
    frequencies
        Of one amplitude and current.
    ratio
        Of the highest of these frequencies to the lowest.
    amplitudes
        At one frequency and current.
    currents
        At one frequency and amplitude.
    speeds
        At one current.
    waveform
        Of these tests; empty for any that is periodic.
    """

    frequencies: int = 0
    ratio: float = 1.0
    amplitudes: int = 0
    currents: int = 0
    speeds: int = 0
    waveform: str = ""


@dataclass(frozen=True, slots=True)
class Form:
    """One of several laws by which an effect may act, among which a fit chooses by evidence.

    Attributes
    ----------
    name
        In a few words, as ``polynomial of order 2``.
    effect
        Registry name of the effect that has it.
    held
        Its parameters that this form holds at their neutral values.
    """

    name: str
    effect: str
    held: tuple[str, ...] = ()


SLOTS = ("input", "loop", "theta", "add", "output", "record")
"""Slots of effects in the order in which they act."""


@dataclass(frozen=True, slots=True)
class EffectSpec:
    """An effect's self-description; one link of the chain round a base model.

    Beside it the module holds the function of its slot, θ the effect's own parameters, Q of them:

    - ``input``: ``transform(channels {name: (N,)}, theta (Q,), dt) -> {name: (N,)}``, the channels it changes;
    - ``loop``: ``closed(simulate, channel (N,), theta (Q,), dt) -> (N,)``, the output where its first input depends on
      it; ``simulate(channel (N,)) -> (N,)`` is the model inside the loop;
    - ``theta``: ``factors(channels, theta (P, Q), dt) -> {role: (P, N) or (P, 1)}``, factors on parameters of a role;
    - ``add``: ``term(channels, theta (P, Q), dt) -> (P, N)``, added to the output;
    - ``output``: ``shape(output (P, N), channels, theta (P, Q), dt) -> (P, N)``;
    - ``record``: ``error(channels, theta (P, Q), dt) -> (P, N)``, added to the output by the instruments that record
      it. An effect of the slot ``input`` may have it too.

    Attributes
    ----------
    name
        Registry name; the file name with hyphens.
    title, equation, reference
        One line each.
    slot
        Where in the chain it acts.
    outputs
        Model outputs it can act on: ``flux``, ``current``, ``force``, ``torque``.
    inputs
        Channels it needs.
    params
        Its parameters; bounds hold the neutral value.
    neutral
        Values at which it vanishes, one for each parameter.
    aliases
        Effects it is mistaken for.
    experiment
        Which test tells it from these; several, each with what it shows, with semicolons between them.
    asks
        For each of these what is asked for, None where a list of tests does not show it; fewer where the rest does not.
    proposed
        Whether discovery may propose it; not where it is a block for building a known model from.
    steady
        Whether its strength is the same from a record's first sample to its last; not where it knows time or
        temperature.
    moves
        Inputs that must move for it to be seen, each with the least range in its unit.
    breaks
        How it can be told from any law; None for an effect that a law could make as well.
    forms
        Laws among which a fit may choose, its own first; empty where there is one.
    starts
        Values of its parameters from which a fit by many starts begins too, where a search from the neutral ones may
        end in another minimum.
    within
        Channels with the least and greatest value (SI) at which it was found; empty where it holds everywhere.
    turn
        When it acts among the effects of its slot, the lowest first; those of one turn act in the order of their names.
    """

    name: str
    title: str
    equation: str
    reference: str
    slot: Literal["input", "loop", "theta", "add", "output", "record"]
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    params: tuple[Param, ...]
    neutral: tuple[float, ...]
    aliases: tuple[str, ...] = ()
    experiment: str = ""
    asks: tuple[Programme | None, ...] = ()
    proposed: bool = True
    steady: bool = True
    moves: tuple[tuple[str, float], ...] = ()
    breaks: Breaks | None = None
    forms: tuple[Form, ...] = ()
    starts: tuple[tuple[float, ...], ...] = ()
    within: tuple[tuple[str, float, float], ...] = ()
    turn: int = 0

    @property
    def place(self) -> tuple[int, int, str]:
        """Key by which the effects of a chain are sorted into the order in which they act."""
        return SLOTS.index(self.slot), self.turn, self.name


@dataclass(frozen=True, slots=True)
class Option:
    """A constant of an optimizer that the user may change.

    Attributes
    ----------
    name
        Symbol as in the cited source (``b``, ``N_d``), or a plain word.
    default
        Value where the user names none.
    low, high
        What it may be, both included.
    text
        What it means, in a few words.
    whole
        Whether it is a whole number.
    """

    name: str
    default: float
    low: float
    high: float
    text: str
    whole: bool = False


Options = Mapping[str, float]
"""The value of every option of an optimizer, by name."""


@dataclass(frozen=True, slots=True)
class OptimizerSpec:
    """An optimizer's self-description, beside its ``minimise(objective, rng, options)``.

    Attributes
    ----------
    name
        Registry name: one word, no hyphen, since chains are written with hyphens.
    title
        One line.
    reference
        Where the algorithm comes from.
    kind
        ``global`` searches the whole cube, ``local`` refines from the objective's best point, ``start`` takes what the
        data give as it is and can only begin a chain.
    reads
        Source of a start: characteristic points of the ``loops``, or means of fits to the ``conditions``.
    budget
        Evaluations (simulated parameter vectors) it asks for when the user names none, as a function of the dimension
        and its options.
    options
        What the user may change of it.
    coordinates
        ``parameters`` where its moves depend on where the origin lies: it then sees the parameters themselves, in
        physical units; all others see the unit cube.
    ends
        Whether a global search has a rule of its own that should end it before its evaluations are used up.
    """

    name: str
    title: str
    reference: str
    kind: Literal["global", "local", "start"]
    budget: Callable[[int, Options], int]
    options: tuple[Option, ...] = ()
    coordinates: Literal["cube", "parameters"] = "cube"
    ends: bool = False
    reads: Literal["loops", "conditions"] = "loops"

    @property
    def defaults(self) -> dict[str, float]:
        """The value of every option where the user names none."""
        return {o.name: o.default for o in self.options}


@dataclass(frozen=True, slots=True)
class ReaderSpec:
    """A file reader's self-description, beside its ``sniff(head)`` and ``read(source)``.

    Attributes
    ----------
    name
        Registry name.
    title
        Instrument family and format.
    blocks
        Whether ``read`` reads the lines of ``source.block`` alone where there is one. A text log longer than a few
        blocks is given to it so, and to a reader that cannot as a whole.
    fragile
        Whether it reads in a process of its own, since its library crashes on some damaged files.
    libraries
        Modules that a fragile reader loads while it reads: their memory is not counted as the file's.
    """

    name: str
    title: str
    blocks: bool = False
    fragile: bool = False
    libraries: tuple[str, ...] = ()
