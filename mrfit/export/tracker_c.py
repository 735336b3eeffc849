"""A tracker of parameters as templates of C have it, and its estimator in a program."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from mrfit.core.specs import Array
from mrfit.export.c_context import BaseField, EffectFields
from mrfit.export.printer import ir
from mrfit.export.printer.functions import python_of
from mrfit.export.printer.reading import ProgramReader
from mrfit.export.text import field, in_comment, number
from mrfit.export.tracker import TrackedParameter, TrackerPlan
from mrfit.kernels.tracking import begun_estimator, corrected


@dataclass(frozen=True)
class ParameterFields:
    """A tracked parameter: its place and meaning; the fields it goes to, their factors, and whether as logarithms."""

    place: int
    text: str
    targets: list[tuple[str, str, bool]]


@dataclass(frozen=True)
class TrackerFields:
    """The context of a tracker's templates.

    Attributes
    ----------
    parameters
        Those that are tracked.
    filters
        Number of filters.
    state, constants
        Fields of the estimator and of its constants: names, extents, and values of the latter.
    prior, held, differences, means, deviations
        Of the parameters, as initializers.
    standing
        Inputs, and the rates below which the damper stands.
    """

    parameters: list[ParameterFields]
    filters: int
    state: list[tuple[str, str]]
    constants: list[tuple[str, str, str]]
    prior: str
    held: str
    differences: str
    means: str
    deviations: str
    standing: list[tuple[str, str]]


def tracker_fields(plan: TrackerPlan, base: Sequence[BaseField], effects: Sequence[EffectFields]) -> TrackerFields:
    """Return the context of a tracker's templates."""
    state, constants = begun_estimator(plan.prior, plan.filters)._asdict(), plan.constants._asdict()
    values = {name: _initializer(plan.column(name)) for name in ("difference", "value", "deviation")}
    return TrackerFields(
        parameters=[
            ParameterFields(k, in_comment(f"{p.name}, {_meaning(p)}"), list(_targets(p, base, effects)))
            for k, p in enumerate(plan.parameters)
        ],
        filters=plan.filters,
        state=[(name, _extents(value)) for name, value in state.items()],
        constants=[(name, _extents(value), _initializer(value)) for name, value in constants.items()],
        prior=_initializer(plan.prior),
        held=_initializer(plan.held),
        differences=values["difference"],
        means=values["value"],
        deviations=values["deviation"],
        standing=[(field(name), number(rate)) for name, rate in plan.standing],
    )


def _meaning(p: TrackedParameter) -> str:
    return "factor of the fit's values" if p.factor else p.unit


def _targets(
    p: TrackedParameter, base: Sequence[BaseField], effects: Sequence[EffectFields]
) -> Iterator[tuple[str, str, bool]]:
    """Yield the fields to which a parameter goes."""
    for q in base:
        for k in range(q.count):
            if q.first + k in p.places:
                place = f"{q.stored}[{k}]" if q.count > 1 else q.stored
                yield place, number(q.values[k]) if p.factor else "", q.log
    for e in effects:
        for own in e.fields:
            if own.first is not None and own.first in p.places:
                yield f"{e.ident}.{own.field}", "", False


def _extents(value: Array) -> str:
    return "".join(f"[{n}]" for n in value.shape)


def _initializer(value: Array) -> str:
    """Return an array as an initializer."""
    inside = [number(v) for v in value.tolist()] if value.ndim == 1 else map(_initializer, value)
    return f"{{ {', '.join(f'K({v})' if value.ndim == 1 else v for v in inside)} }}"


def print_estimator(reader: ProgramReader, plan: TrackerPlan) -> None:
    """Add the estimator of a tracker to a program."""
    structs: dict[str, Any] = {"estimator": begun_estimator(plan.prior, plan.filters), "plan": plan.constants}
    for name, value in structs.items():
        reader.structs[f"@{name}"] = {n: ir.Kind("array", (), a.shape) for n, a in value._asdict().items()}
    kinds = {
        "t": ir.struct("estimator"),
        "plan": ir.struct("plan"),
        "sensitivity": ir.Kind("array", (), (len(plan.parameters),)),
        "error": ir.REAL,
        "dt": ir.REAL,
        "excited": ir.INT,
    }
    function = python_of(corrected)
    assert function is not None
    reader.function(function, kinds)
