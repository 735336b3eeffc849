"""Functions that a model, an effect, an optimizer or a reader may define: all that mrfit looks for, in one place.

An item is anything that has these attributes: a module, as each of mrfit's own is, or an object. The first protocol of
a kind is what it must have; those behind it are optional, and an item has one where it defines its names.

``drive`` (C, N) holds the input channels in the order of the SPEC, ``theta`` (P, K) a batch of parameter vectors,
``dt`` the sample interval in s; ``channels`` maps names to samples (N,). All values are in SI.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np

from mrfit.core.built_in import Kind
from mrfit.core.specs import (
    Array,
    EffectSpec,
    Index,
    ModelSpec,
    OptimizerSpec,
    Options,
    ReaderSpec,
    ReducedModel,
    Stage,
)


@runtime_checkable
class Model(Protocol):
    """A model: its SPEC and the response of a whole batch of parameter vectors."""

    SPEC: ModelSpec

    def response(self, drive: Array, theta: Array, dt: float) -> Array:
        """Return the output (P, N).

        Causal, deterministic, inputs untouched; every row equals the one a batch of one gives. State starts from rest
        at sample 0. A simulation that diverges returns non-finite values instead of raising. ``theta`` (P, K, N) has
        parameters that vary along the samples: a model of a force or torque takes it if its parameters are to depend on
        a current that moves, or effects of the slot ``theta`` are to act on it.
        """


@runtime_checkable
class HasStartValues(Protocol):
    """A model that finds start values in data."""

    def start_values(self, drive: Array, output: Array, dt: float) -> dict[str, float]:
        """Return start values by parameter name, within the bounds, of any finite data; ``output`` is (N,)."""


@runtime_checkable
class HasFarStarts(Protocol):
    """A model that knows of minima which a search hardly finds from its start values."""

    def far_starts(self, drive: Array, output: Array, dt: float) -> list[dict[str, float]]:
        """Return start values in each of them, as ``start_values`` does."""


@runtime_checkable
class HasDerived(Protocol):
    """A model with quantities computed from its parameters, ``SPEC.derived``."""

    def derived(self, theta: Array) -> Array:
        """Return the derived quantities (P, D)."""


@runtime_checkable
class HasRoughResponse(Protocol):
    """A model with a less exact and faster response, which a search may use far from its end."""

    def rough_response(self, drive: Array, theta: Array, dt: float) -> Array:
        """Return the output (P, N), nearly."""


@runtime_checkable
class HasSensitivities(Protocol):
    """A model whose exact derivatives cost less than as many simulations."""

    def sensitivities(self, drive: Array, theta: Array, dt: float, columns: Index) -> Array:
        """Return (P, 1 + Q, N): the response, then its derivatives with respect to theta[:, columns]."""


@runtime_checkable
class HasReduced(Protocol):
    """A model in whose own parameters several vectors give one response."""

    REDUCED: ReducedModel


@runtime_checkable
class HasStages(Protocol):
    """A model that is identified part by part, each on the tests that show it alone."""

    STAGES: tuple[Stage, ...]


@runtime_checkable
class Effect(Protocol):
    """An effect: its SPEC, and the function of the slot that the SPEC names, which is one of those below."""

    SPEC: EffectSpec


@runtime_checkable
class ChangesInput(Protocol):
    """An effect of the slot ``input``."""

    SPEC: EffectSpec

    def transform(self, channels: Mapping[str, Array], theta: Array, dt: float) -> dict[str, Array]:
        """Return the channels it changes (N,), of one parameter vector (Q,)."""


@runtime_checkable
class ClosesLoop(Protocol):
    """An effect of the slot ``loop``."""

    SPEC: EffectSpec

    def closed(self, simulate: Callable[[Array], Array], channel: Array, theta: Array, dt: float) -> Array:
        """Return the output (N,) where the first input depends on it; ``simulate(channel)`` is the model inside."""


@runtime_checkable
class ScalesParameters(Protocol):
    """An effect of the slot ``theta``."""

    SPEC: EffectSpec

    def factors(self, channels: Mapping[str, Array], theta: Array, dt: float) -> dict[str, Array]:
        """Return factors (P, N) or (P, 1) on the parameters of each role."""


@runtime_checkable
class AddsTerm(Protocol):
    """An effect of the slot ``add``."""

    SPEC: EffectSpec

    def term(self, channels: Mapping[str, Array], theta: Array, dt: float) -> Array:
        """Return the part (P, N) that is added to the output."""


@runtime_checkable
class ShapesOutput(Protocol):
    """An effect of the slot ``output``."""

    SPEC: EffectSpec

    def shape(self, output: Array, channels: Mapping[str, Array], theta: Array, dt: float) -> Array:
        """Return the changed output (P, N)."""


@runtime_checkable
class HasLaw(Protocol):
    """A model or effect without memory, as a function of numbers that compiled loops call and that is printed as C.

    Its arguments are the inputs and then the parameters, in the order of the SPEC; docs/plugins.md has the subset.
    """

    law: Callable[..., Any]


@runtime_checkable
class HasStep(Protocol):
    """A model or effect with memory, as one step of it that compiled loops call and that is printed as C.

    ``rest(now, theta)`` returns the state, a tuple of numbers, of a device that has stood still; ``step(state, before,
    now, theta, dt)`` the output and the next state, inputs and parameters linear over the step of dt s.
    """

    rest: Callable[..., Any]
    step: Callable[..., Any]


@runtime_checkable
class HasCurve(Protocol):
    """A model whose hysteresis is one curve while the parameters named in ``SHAPE`` hold.

    ``loop(theta)`` returns the curve's greatest state, rate, sharpness and ratio; ``step_on_curve(state, before, now,
    theta, dt, curve)`` does along it what ``step`` does. That is then printed as C, in place of ``step``.
    """

    SHAPE: tuple[str, ...]
    loop: Callable[..., Any]
    step_on_curve: Callable[..., Any]


@runtime_checkable
class HasRoles(Protocol):
    """An effect of the slot ``theta`` with a ``law``, which returns a tuple of factors."""

    ROLES: tuple[str, ...]
    """Of each factor, the role of the parameters that it acts on."""


@runtime_checkable
class ReadsPast(Protocol):
    """An element with a ``step`` that needs signals as they were some time ago.

    The step takes a last argument ``past`` for the functions of ``kernels.past``, which read the signals kept there.
    """

    LATE: int
    """Number of the state's first values that are kept after every step, each a signal."""

    def longest(self, theta: tuple[float, ...]) -> float:
        """Return the time in s for which earlier values are needed."""


@runtime_checkable
class KeepsNumbers(Protocol):
    """An element with a ``step`` that works something out once and looks it up as long as it holds.

    The step takes ``past`` too, whose items from ``kernels.past.RESERVED`` on are its own. They are -1 at first. A step
    may be thrown away, so what is kept there has to say what it holds for, and must not change a result.
    """

    OWN: int
    """How many numbers it keeps."""


@runtime_checkable
class SeesCentred(Protocol):
    """An element that takes channels less their middle, which is a constant of an exported model."""

    CENTRED: tuple[str, ...]
    """The channels."""


@runtime_checkable
class HoldsParameters(Protocol):
    """A model whose parameters cannot vary along the samples, as one that somebody else's code simulates."""

    CONSTANT_PARAMETERS: bool


@runtime_checkable
class NeedsRise(Protocol):
    """An effect of the slot ``loop`` that is an equation only where the output of the model inside rises."""

    RISING: bool
    """Whether it has to rise with the first input; a fit in which it falls says so."""


@runtime_checkable
class MovesDrive(Protocol):
    """An effect of the slot ``output`` may be this too: what it shows now was made by what drove the model before."""

    SPEC: EffectSpec

    def moved(self, channels: Mapping[str, Array], theta: Array, dt: float) -> dict[str, Array]:
        """Return the channels (N,) that made the output of every sample, of one parameter vector (Q,)."""

    def needs_middles(self, theta: Array) -> bool:
        """Return whether, of one parameter vector (Q,), ``shape`` is to be given outputs in the middle between samples.

        It then gets (P, 2N - 1) at half the interval, and no channels.
        """


@runtime_checkable
class ErrsInRecord(Protocol):
    """An effect of the slot ``record``; one of the slot ``input`` may be this too."""

    SPEC: EffectSpec

    def error(self, channels: Mapping[str, Array], theta: Array, dt: float) -> Array:
        """Return the part (P, N) that the instruments add to the output."""


@runtime_checkable
class Optimizer(Protocol):
    """An optimizer: its SPEC and its search."""

    SPEC: OptimizerSpec

    def minimise(self, objective: Any, rng: np.random.Generator, options: Options) -> None:
        """Evaluate points of the unit cube until done; the objective remembers the best.

        ``objective`` (mrfit.optimizers.cost.objective.Objective) has ``dimension``, ``remaining`` evaluations,
        ``best_point`` (K,), ``best_cost``, ``costs(points (P, K)) -> (P,)`` and ``residuals(point (K,)) -> (M,)``. It
        counts evaluations, and ends the search by an exception, to be let through, where the budget is spent. All
        randomness comes from ``rng``.
        """


@runtime_checkable
class Reader(Protocol):
    """A reader of log files."""

    SPEC: ReaderSpec

    def sniff(self, head: Any) -> bool:
        """Whether a file is this reader's, by its beginning: ``head.raw``, ``lines``, ``path``.

        The head is a mrfit.ingest.text.head.Head. A reader has to know its own marks and no others': a file that
        two readers claim is read by neither.
        """

    def read(self, source: Any) -> Any:
        """Return the list of runs (mrfit.ingest.table.Table) in a file (mrfit.ingest.table.Source)."""


@runtime_checkable
class JoinsParts(Protocol):
    """A reader of an instrument that writes one record into several files."""

    def part(self, head: Any) -> str | None:
        """Return the text that the files of one record share, or None if the file is a record by itself."""

    def join(self, tables: Any) -> Any:
        """Return the tables of all parts as one record's."""


@runtime_checkable
class ReadsRows(Protocol):
    """A reader of binary files that can be read a few rows at a time."""

    def extent(self, source: Any) -> tuple[int, int]:
        """Return the number of rows and of columns."""

    def read_blocks(self, source: Any, size: int) -> Iterator[Any]:
        """Yield the tables of one stretch of rows after another, of about ``size`` bytes."""


@runtime_checkable
class TellsHeadings(Protocol):
    """A reader of text logs that may hold several headers, each above a block of rows."""

    def heading(self, head: Any) -> Any:
        """Return the statements of the first header of these lines on the rows below it; None if there is none."""


SLOT_FUNCTIONS: Mapping[str, str] = {
    "input": "transform",
    "loop": "closed",
    "theta": "factors",
    "add": "term",
    "output": "shape",
    "record": "error",
}
"""The function that an effect of each slot has."""
SPECS: Mapping[Kind, type] = {
    "model": ModelSpec,
    "effect": EffectSpec,
    "optimizer": OptimizerSpec,
    "reader": ReaderSpec,
}


def kind_of(spec: object) -> Kind | None:
    """Return the kind of item that has this SPEC; None if it is no SPEC."""
    return next((kind for kind, made in SPECS.items() if isinstance(spec, made)), None)


def required(spec: object) -> tuple[str, ...]:
    """Return the functions that an item with this SPEC must have."""
    if isinstance(spec, EffectSpec):
        return (SLOT_FUNCTIONS[spec.slot],) if spec.slot in SLOT_FUNCTIONS else ()
    return {ModelSpec: ("response",), OptimizerSpec: ("minimise",), ReaderSpec: ("sniff", "read")}.get(type(spec), ())
