"""A fit as the exported model has it: its elements and what is around them as functions, and the fields of structs."""

import math
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Literal

import numpy as np

from mrfit.core import registry
from mrfit.core.protocols import HasCurve, MovesDrive
from mrfit.core.specs import EffectSpec, ModelSpec
from mrfit.errors import DataError
from mrfit.export.c_context import BaseField, ChannelField, Context, CurveTable, EffectField, EffectFields, Memory
from mrfit.export.frame import FRAME_FUNCTIONS, Frame, ModelPart
from mrfit.export.printer import ir
from mrfit.export.printer.elements import CURVE, Element, Sight, element
from mrfit.export.printer.functions import python_of
from mrfit.export.printer.reading import ProgramReader
from mrfit.export.printer.values import group
from mrfit.export.source import EffectLink, ExportSource, LogStretch
from mrfit.export.text import MODELICA_WORDS, field, identifier, in_comment, number
from mrfit.export.tracker import TrackerPlan
from mrfit.export.tracker_c import TrackerFields, print_estimator, tracker_fields
from mrfit.kernels.branch import curve_of, prepared
from mrfit.kernels.filters import level
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import Order, count, logarithmic

# Steps a second at which late values are exact, and places beyond those
FASTEST, SPARE = 10_000, 5
# Rows for cells of a curve whose parameters can be set, above and below 0: enough for n from 1 to 10
CELLS_ABOVE, CELLS_BELOW = 64, 320
# Where a form that knows a stroke's middle cannot be the simulation
OTHER_MIDDLE = "the middle of the stroke is that of the fit's logs, where the simulation takes that of each record"
# Names that a function file of MATLAB must not hide
BUILT_IN = frozenset(
    "abs all any ceil diag double erf exp expm1 fix floor hypot isempty isfinite isnan log log1p max min mod nthroot "
    "numel ones power rem repmat reshape round sign size sqrt struct sum tanh zeros "
    "catch classdef global otherwise parfor persistent spmd try unwind_protect".split()
)


@dataclass(frozen=True)
class Parts:
    """The context of templates, all functions of the model, and the tracker beside it if there is one.

    Of a driven mass the functions are those of its law, whose own context is ``law``.
    """

    context: Context
    program: ir.Program
    tracker: TrackerFields | None = None
    law: Context | None = None


def parts_of(source: ExportSource, tunable: bool = False, plan: TrackerPlan | None = None) -> Parts:
    """Return the exported model.

    Parameters
    ----------
    source
        What is exported.
    tunable
        Whether parameters can be set at run time.
    plan
        Of a tracker, whose parameters move at every step.

    Raises
    ------
    DataError
        If the model or an effect has no C form.
    """
    if source.is_driven:
        return _around(source, parts_of(law_of(source), tunable))
    prefix = prefix_of(source.prefix or source.name)
    reader = ProgramReader(own_functions(), f"{prefix}_")
    scaled = {p.role for p in source.base.params}
    # parameters without roles have nothing that such an effect could scale
    links = [k for k in source.links if k.spec.slot != "theta" or scaled & {*_roles(k)}]
    roles = sorted({r for link in links for r in _roles(link)})
    model, fine = registry.load("model", source.base.name), _needs_middles(source, tunable)
    varying = {name for name, _ in source.dependence.orders} if source.dependence else set[str]()
    varying |= plan.bases if plan else set()
    curved = isinstance(model, HasCurve) and not varying & {*model.SHAPE}
    curve = _curve(model, source, tunable) if curved else None
    reader.structs[CURVE.tag] = _curve_kinds(curve.rows if curve else 0)
    sight = Sight("base", "b", source.channels, bool(varying or roles or plan), shaping=not curved)
    base = ModelPart("base", "base", _printed(reader, "model", source.base.name, sight))
    frame = Frame(reader.program, base, fine)
    fields, parts = base_fields(source, roles), list[ModelPart]()
    frame.values(fields, source.dependence)
    for link in sorted(links, key=lambda k: k.spec.slot == "loop"):
        if link.spec.slot == "loop":
            frame.inner(parts, roles)
        ident = _ident(link.spec.name)
        sight = Sight(ident, "e", source.channels, tried=frame.tried if link.spec.slot == "loop" else None)
        parts.append(ModelPart(ident, link.spec.slot, _printed(reader, "effect", link.spec.name, sight)))
    if not any(k.spec.slot == "loop" for k in links):
        frame.inner(parts, roles)
    if tunable and curve:
        frame.curve(*_curve_calls(reader, model, source), reader.structs[CURVE.tag])
    inputs = [_channel(source, n) for n in source.channels]
    parts = [next(p for p in parts if p.ident == _ident(k.spec.name)) for k in links]
    frame.driven(parts, inputs)
    frame.checks(inputs)
    if plan:
        print_estimator(reader, plan)
    elements = [base, *parts]
    context = Context(
        tunable=tunable,
        p=prefix,
        inputs=inputs,
        output=ChannelField(source.spec.output, field(source.spec.output), in_comment(source.spec.output)),
        base=fields,
        effects=[_effect(link, part.element, source) for link, part in zip(links, parts, strict=True)],
        memories=[Memory(p.ident, p.element.state, p.element.past) for p in elements if p.element.rest],
        ring=_ring(source, elements, [None, *links], tunable),
        fastest=FASTEST,
        curve=curve,
        roles=roles,
        count=len(source.theta),
        fine=fine,
    )
    tracker = tracker_fields(plan, fields, context.effects) if plan else None
    return Parts(context, reader.settled(), tracker)


def law_of(source: ExportSource) -> ExportSource:
    """Return the law on which a driven mass hangs, under a name of its own; its logs have no inputs of it."""
    law = assemble(source.law_name, source.dependence)
    prefix = f"{prefix_of(source.prefix or source.name)}_law"
    return replace(source, assembly=law, theta=source.theta[:-1], stretches=(), prefix=prefix)


def _around(source: ExportSource, law: Parts) -> Parts:
    """Return a driven mass on a law that has a C form."""
    output = ChannelField(source.spec.output, field(source.spec.output), in_comment(source.spec.output))
    inputs, prefix = [_channel(source, n) for n in source.channels], prefix_of(source.prefix or source.name)
    own = replace(law.context, p=prefix, inputs=inputs, output=output, count=len(source.theta))
    return replace(law, context=own, law=law.context)


def _ident(name: str) -> str:
    return field(name.replace("-", "_"))


def _printed(reader: ProgramReader, kind: Literal["model", "effect"], name: str, sight: Sight) -> Element:
    """Return a model or an effect as it is printed.

    Raises
    ------
    DataError
        If it has no C form.
    """
    item = registry.load(kind, name)
    made = element(reader, item, item.SPEC, sight)
    if made is None and kind == "effect":
        raise DataError(
            f"the effect {name} has no C form: it is what the record adds, or is told from the whole record; leave it "
            f"out with --without {name}"
        )
    if made is None:
        raise DataError(f"the model {name} has no C form: give it a step, as docs/export.md shows")
    return made


def _needs_middles(source: ExportSource, tunable: bool) -> bool:
    """Return whether an effect needs, or may need, what is made in the middle between steps."""
    if any(link.spec.slot == "loop" for link in source.links):
        return False
    modules = [(registry.load("effect", link.spec.name), link.theta) for link in source.links]
    return any(isinstance(m, MovesDrive) and (tunable or m.needs_middles(theta)) for m, theta in modules)


def _roles(link: EffectLink) -> tuple[str, ...]:
    """Return the roles whose parameters an effect scales."""
    return tuple(getattr(registry.load("effect", link.spec.name), "ROLES", ())) if link.spec.slot == "theta" else ()


def _knows_middle(link: EffectLink) -> bool:
    """Return whether an effect sees the stroke less its middle."""
    return bool(getattr(registry.load("effect", link.spec.name), "CENTRED", ()))


def stated(source: ExportSource) -> list[str]:
    """Return remarks on effects whose causal form cannot be the simulation in Python."""
    return [f"{link.spec.name}: {OTHER_MIDDLE}" for link in source.links if _knows_middle(link)]


def prefix_of(name: str) -> str:
    """Return the prefix of an export's public names: of a fit's name, unlike a function's.

    Functions of the model have no prefix; a fit called ``delay`` must not make another ``delay_step``.
    """
    prefix = identifier(name)
    taken = prefix in BUILT_IN | MODELICA_WORDS or any(n.startswith(f"{prefix}_") for n in own_functions())
    return f"{prefix}_fit" if taken else prefix


@cache
def own_functions() -> frozenset[str]:
    """Return the names of functions that every model may have."""
    elements = ["base", *map(_ident, registry.names("effect"))]
    words = ("step", "rest", "moved", "longest")
    return frozenset({*FRAME_FUNCTIONS, *(f"{e}_{word}" for e in elements for word in words)})


def _channel(source: ExportSource, name: str) -> ChannelField:
    from mrfit.export.head import channel_text

    ends = None
    # an acceleration is noise and knows no range
    if name in source.ranges and not name.endswith("acceleration"):
        low, high = source.ranges[name]
        room = 1e-6 * max(high - low, abs(low), abs(high))
        ends = low - room, high + room
    return ChannelField(name, field(name), in_comment(channel_text(source, name)), ends)


def base_fields(source: ExportSource, roles: list[str]) -> list[BaseField]:
    """Return the base's parameters: how they are stored, their values, and how they depend on current."""
    dependence, spec = source.dependence, source.base
    orders: dict[str, Order] = dict(dependence.orders) if dependence else {}
    found, first = [], 0
    for p in spec.params:
        order = orders.get(p.name, 0)
        size = count(order) if order else 1
        log = bool(order) and logarithmic(spec, p, order)
        values = source.base_theta[first : first + size]
        clip = bool(order) and not log and p.low > 0.0 and p.name not in spec.linear
        found.append(
            BaseField(
                name=p.name,
                field=field(p.name),
                stored=f"ln_{field(p.name)}" if log else field(p.name),
                text=in_comment(f"{p.text or p.name}, {p.unit}"),
                count=size,
                log=log,
                first=first,
                values=values.tolist(),
                initial=[number(v) for v in (np.log(values) if log else values)],
                order=order,
                clip=(p.low, p.high) if clip else None,
                role=p.role if p.role in roles else "",
            )
        )
        first += size
    return found


def _effect(link: EffectLink, printed: Element, source: ExportSource) -> EffectFields:
    """Return an effect's parameters, and what it takes from the logs."""
    first = len(source.theta) - sum(len(k.theta) for k in source.links)
    first += sum(len(k.theta) for k in source.links[: source.links.index(link)])
    rows = [
        EffectField(field(p.name), in_comment(f"{p.text or p.name}, {p.unit}"), number(v), k)
        for k, (p, v) in enumerate(zip(link.spec.params, link.theta.tolist(), strict=True), first)
    ]
    if printed.centred:
        text = in_comment("middle of the stroke in the fit's logs, m")
        rows.append(EffectField("x_middle", text, number(_middle_of(source)), None))
    return EffectFields(link.spec.name, _ident(link.spec.name), in_comment(link.spec.title), rows)


def _middle_of(source: ExportSource) -> float:
    """Return the middle of the stroke of one of the logs, on which the export can then be checked."""
    levels = sorted(level(s.inputs["displacement"]) for s in source.stretches)
    return levels[(len(levels) - 1) // 2] if levels else 0.0


def checkable(source: ExportSource) -> list[LogStretch]:
    """Return the logs whose own values are the constants that effects take from all of them."""
    if not any(map(_knows_middle, source.links)):
        return list(source.stretches)
    middle = _middle_of(source)
    return [s for s in source.stretches if level(s.inputs["displacement"]) == middle]


def _ring(source: ExportSource, parts: list[ModelPart], links: list[EffectLink | None], tunable: bool) -> int:
    """Return the number of late values that are kept, 0 if none are."""
    longest = list[float]()
    for part, link in zip(parts, links, strict=True):
        if part.element.late:
            spec, theta = (link.spec, link.theta) if link else (source.base, source.base_theta)
            known = len(theta) == len(spec.params) and not tunable
            item: Any = registry.load("effect" if link else "model", spec.name)
            ends = [tuple(theta)] if known else _ends(spec)
            longest.append(max(float(item.longest(values)) for values in ends))
    return math.ceil(max(0.0, *longest) * FASTEST) + SPARE if longest else 0


def _ends(spec: ModelSpec | EffectSpec) -> list[tuple[float, ...]]:
    """Return parameters at their upper bounds, but for none and for each in turn, which is at its lower."""
    high = [p.high for p in spec.params]
    return [tuple(high), *((*high[:k], p.low, *high[k + 1 :]) for k, p in enumerate(spec.params))]


def _curve(model: Any, source: ExportSource, tunable: bool) -> CurveTable:
    """Return the branch curve of a base whose shape holds."""
    fields = base_fields(source, [])
    found = curve_of(*model.loop(tuple(float(q.values[0]) for q in fields)))
    cells = [[number(c) for c in cell] for cell in found.cells.tolist()]
    if tunable:
        gap = [["0.0"] * 6] * (CELLS_ABOVE - found.above)
        cells = [*cells[: found.above], *gap, *cells[found.above :]]
        found = found._replace(first=CELLS_ABOVE)
    others = {
        name: str(v) if isinstance(v, int) else number(v) for name, v in found._asdict().items() if name != "cells"
    }
    return CurveTable(cells, others, CELLS_ABOVE + CELLS_BELOW if tunable else len(cells))


def _curve_kinds(rows: int) -> dict[str, ir.Kind]:
    """Return the kinds of the curve's fields."""
    kinds = {"cells": ir.Kind("array", (), (rows, 6)), "above": ir.INT, "first": ir.INT, "below": ir.INT}
    return kinds | dict.fromkeys(("h_above", "h_below", "end", "gap", "z_max", "rate", "n", "rho"), ir.REAL)


def _curve_calls(reader: ProgramReader, model: Any, source: ExportSource) -> tuple[ir.Call, ir.Call]:
    """Return the calls that give a curve's shape of the parameters ``b``, and its cells of that."""
    theta = [ir.Member(ir.Name("b", ir.struct("base_values")), field(p.name)) for p in source.base.params]
    made = reader.function(model.loop, {"theta": group(theta).kind})
    used = {id(a) for a in made.function.arguments}
    own = tuple(v for v, a in zip(theta, made.given, strict=True) if id(a) in used)
    kinds = reader.structs[CURVE.tag]
    n, rho, cells = (ir.Member(ir.Name("curve", CURVE), name, kinds[name]) for name in ("n", "rho", "cells"))
    values = (n, rho, cells, ir.whole(CELLS_ABOVE), ir.whole(CELLS_ABOVE + CELLS_BELOW))
    names = ("n", "rho", "cells", "first", "last")
    plain = python_of(prepared)
    assert plain is not None
    function = reader.function(plain, dict(zip(names, (v.kind for v in values), strict=True))).function
    return ir.Call(made.function.name, own, ir.NOTHING, True), ir.Call(function.name, values, ir.NOTHING, True)
