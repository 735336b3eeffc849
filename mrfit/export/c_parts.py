"""A fit as the templates of C need it: parameters with their laws of current, effects with their functions."""

import math
import re
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, TypeAlias

import numpy as np

from mrfit.core import registry
from mrfit.core.channels import LEVELS
from mrfit.core.protocols import MovesDrive
from mrfit.export.c_context import (
    BaseField,
    Basis,
    Block,
    Channel,
    Context,
    Curve,
    EffectCode,
    EffectField,
    Given,
    Input,
    Piece,
    Term,
)
from mrfit.export.c_form import TEMPLATES, Form, PrintedForm, blocks_for, form_of, own_form
from mrfit.export.printer.c_text import constants, function_text, small_functions
from mrfit.export.printer.elements import Sight, element
from mrfit.export.printer.reading import Reader
from mrfit.export.printer.tree import Function, Program
from mrfit.export.source import Link, Source, Stretch
from mrfit.export.text import field, identifier, in_comment, number
from mrfit.kernels.branch import curve_of, normal_form
from mrfit.kernels.filters import level
from mrfit.simulate.current_dependence import (
    CurrentDependence,
    Order,
    coordinate,
    count,
    knee_of,
    logarithmic,
)
from mrfit.simulate.current_dependence import form_of as law_form

# Steps a second at which late values are exact, and places beyond those
FASTEST, SPARE = 10_000, 5
# Cells of a curve whose parameters can be set: enough for n from 1 to 10
UP, DOWN = 64, 320
# Names that a function file of MATLAB must not hide
BUILT_IN = frozenset(
    "abs all any erf exp expm1 fix floor hypot isempty log log1p mod numel ones power sign sqrt struct sum tanh "
    "zeros".split()
)
# What an effect's function is given, and how it is called, in their order
ARGUMENTS = (
    ("e", "const @{}_values *e", "&p->{}"),
    ("s", "@{}_state *s", "&s->{}"),
    ("f", "factors *f", "&f"),
    ("u", "const @inputs *u", "u"),
    ("y", "@real y", "y"),
    ("dt", "@real dt", "dt"),
    ("first", "int first", "first"),
)


# Functions of the frame
FRAME = ("values_at", "inner", "changed", "shown", "both", "is_number", "within", "late_of", "factors", "driven")
AnyForm: TypeAlias = Form | PrintedForm


@dataclass(frozen=True)
class Parts:
    """What the templates are rendered with, the C form it came from, and the functions that are printed."""

    context: Context
    base: "AnyForm"
    program: Program


def parts_of(source: Source, tunable: bool = False) -> Parts:
    """Return the context of the C templates.

    Parameters
    ----------
    source
        What is exported.
    tunable
        Whether parameters can be set at run time.

    Raises
    ------
    DataError
        If the model or an effect has no C form.
    """
    dependence = source.dependence
    form, forms, given, reader = _forms(source, tunable)
    blocks = blocks_for([name for one in (form, *forms) for name in one.uses], vars(given))
    roles = sorted({r for link in source.links for r in _roles(link)})
    printed, program = [one.element for one in (form, *forms) if isinstance(one, PrintedForm)], reader.settled()
    own = {f.name for e in printed for f in e.functions}
    helpers = [f for n, f in program.functions.items() if n not in own]
    base = base_fields(source, roles)
    state = form.text("state")
    arguments = _arguments(form.text("body"), bool(state))
    curve = _curve(base) if "curve" in form.uses else None
    effects = [_effect(link, one, source, given.middles) for link, one in zip(source.links, forms, strict=True)]
    scales = any(p.role in roles for p in source.base.params)
    if not scales:
        # parameters without roles have nothing that such an effect could scale
        effects = [e for e in effects if e.slot != "theta"]
    fine = any(e.middles for e in effects)
    inner = ("theta", "add") if fine else ("theta", "add", "output")
    context = Context(
        tunable=tunable,
        p=prefix_of(source.prefix or source.name),
        inputs=[_channel(source, n) for n in source.channels],
        output=Channel(source.spec.output, field(source.spec.output), in_comment(source.spec.output)),
        base=base,
        base_title=in_comment(source.base.title),
        base_state=state,
        base_code=form.text("code") + ("\n\n" if form.text("code") else ""),
        base_body=form.text("body"),
        base_arguments=", ".join(a for _, a, _ in arguments),
        base_call=call_of(form.element.step, "base")
        if isinstance(form, PrintedForm)
        else f"base_step({', '.join(c for _, _, c in arguments)})",
        base_functions=written(form),
        base_rest=call_of(form.element.rest, "base") if isinstance(form, PrintedForm) and form.element.rest else "",
        helpers="\n\n".join(filter(None, [small_functions(program), constants(program), *map(function_text, helpers)])),
        effects=effects,
        block_names=list(blocks),
        blocks=[Block(b.text("types"), b.text("code")) for b in blocks.values()],
        ring=_ring(source, form, forms, tunable),
        fastest=FASTEST,
        curve=curve,
        cells=(UP, DOWN) if curve and tunable else (curve.positive, curve.negative) if curve else None,
        shape=form.text("shape"),
        bases=_bases(dependence),
        low=number(dependence.low) if dependence else "",
        high=number(dependence.high) if dependence else "",
        roles=roles,
        scales=scales,
        count=len(source.theta),
        fine=fine,
        unused_inner=_unused(
            [
                *(c for _, _, c in arguments),
                *_calls(form, "base"),
                *(e.rest_call for e in effects if e.slot in inner),
                *(e.call for e in effects if e.slot in inner),
            ]
        ),
        unused_shown=_unused([e.call + e.rest_call for e in effects if e.slot == "output"]),
    )
    return Parts(context, form, program)


def _forms(source: Source, tunable: bool) -> tuple[AnyForm, list[AnyForm], Given, Reader]:
    """Return the forms of base and effects, what they were given, and what has read those that are printed."""
    given = Given(
        tunable=tunable,
        knows_temperature="temperature" in source.channels,
        inputs=tuple(Input(field(n), n in LEVELS) for n in source.channels),
        middles=_needs_middles(source, tunable),
    )
    name, reader = source.base.name, Reader(own_functions(), f"{prefix_of(source.prefix or source.name)}_")
    varying = {name for name, _ in source.dependence.orders} if source.dependence else set()
    form = form_of("model", name, vars(given)) if own_form("model", name) else None
    forms: list[AnyForm] = []
    for link in source.links:
        ident = field(link.spec.name.replace("-", "_"))
        made = None
        if not own_form("effect", link.spec.name):
            effect = registry.load("effect", link.spec.name)
            made = element(reader, effect, link.spec, Sight(ident, "e", ident, source.channels))
        forms.append(PrintedForm(made) if made else form_of("effect", link.spec.name, vars(given)))
    moves, made = bool(varying or any(k.spec.slot == "theta" for k in source.links)), None
    if form is None or form.shape_names & set(map(field, varying)):
        # a loop whose shape varies is no one curve
        model = registry.load("model", name)
        made = element(reader, model, source.base, Sight("base", "b", "base", source.channels, moves))
    return PrintedForm(made) if made else form or form_of("model", name, vars(given)), forms, given, reader


def _needs_middles(source: Source, tunable: bool) -> bool:
    """Return whether an effect needs, or may need, what is made in the middle between steps."""
    if any(link.spec.slot == "loop" for link in source.links):
        return False
    modules = [(registry.load("effect", link.spec.name), link.theta) for link in source.links]
    return any(isinstance(m, MovesDrive) and (tunable or m.needs_middles(theta)) for m, theta in modules)


def written(form: "AnyForm") -> str:
    """Return the functions of an element that is printed."""
    return "\n\n".join(map(function_text, form.element.functions)) if isinstance(form, PrintedForm) else ""


def call_of(function: Function, ident: str, changes: bool = False) -> str:
    """Return the call of a printed function in the frame; ``changes`` where the inputs are a copy there."""
    given = {"b": "&b", "e": f"&p->{ident}", "s": f"&s->{ident}", "f": "&f", "in": "&u" if changes else "u"}
    return f"{function.name}({', '.join(given.get(a.name, a.name) for a in function.arguments)})"


def _calls(form: "AnyForm", ident: str) -> list[str]:
    return [call_of(f, ident) for f in form.element.functions] if isinstance(form, PrintedForm) else []


def _roles(link: Link) -> tuple[str, ...]:
    """Return the roles whose parameters an effect scales."""
    return tuple(getattr(registry.load("effect", link.spec.name), "ROLES", ())) if link.spec.slot == "theta" else ()


def stated(source: Source) -> list[str]:
    """Return where a causal form cannot be the simulation in Python, as the templates say."""
    form, forms, _, _ = _forms(source, False)
    names = [source.base.name, *(link.spec.name for link in source.links)]
    said = [one.setting("stated", "") for one in (form, *forms)]
    return [f"{name}: {text}" for name, text in zip(names, said, strict=True) if text]


def prefix_of(name: str) -> str:
    """Return what all names of an export begin with, those in C that others see: of a fit's name, unlike a function's.

    Functions of the templates have no prefix; a fit called ``lugre`` must not make another ``lugre_step``.
    """
    prefix = identifier(name)
    taken = prefix in BUILT_IN or any(n.startswith(f"{prefix}_") for n in own_functions())
    return f"{prefix}_fit" if taken else prefix


@cache
def own_functions() -> frozenset[str]:
    """Return the names of all functions in the templates."""
    texts = [p.read_text(encoding="ascii") for p in (TEMPLATES / "c").rglob("*.c.j2")]
    found = {n for text in texts for n in re.findall(r"static [\w@ ]*?(\w+)\(", text)}
    elements = ["base", *(field(e.replace("-", "_")) for e in registry.names("effect"))]
    return frozenset(found | {*FRAME, *(f"{e}_{word}" for e in elements for word in ("step", "rest"))})


def _unused(calls: list[str]) -> str:
    missing = [n for n in ("s", "u", "dt", "first") if not re.search(rf"\b{n}\b", " ".join(calls))]
    return "\n".join(f"    (void){name};" for name in missing)


def _named_in(name: str, body: str) -> bool:
    """Return whether a variable, and not only a field of this name, is used in code."""
    return bool(re.search(rf"(?<![.>\w]){name}\b", re.sub(r"/\*.*?\*/", "", body, flags=re.DOTALL)))


def _arguments(body: str, state: bool) -> list[tuple[str, str, str]]:
    known = (
        ("p", "const @parameters *p", "p"),
        ("s", "@state_base *s", "&s->base"),
        ("b", "const @base_values *b", "&b"),
        ("u", "const @inputs *u", "u"),
        ("dt", "@real dt", "dt"),
        ("first", "int first", "first"),
    )
    return [row for row in known if _named_in(row[0], body) and (row[0] != "s" or state)]


def _channel(source: Source, name: str) -> Channel:
    from mrfit.export.head import channel_text

    low = high = None
    # an acceleration is noise and knows no range
    if name in source.ranges and not name.endswith("acceleration"):
        ends = source.ranges[name]
        room = 1e-6 * max(ends[1] - ends[0], abs(ends[0]), abs(ends[1]))
        low, high = number(ends[0] - room), number(ends[1] + room)
    return Channel(name, field(name), in_comment(channel_text(source, name)), low, high)


def base_fields(source: Source, roles: list[str]) -> list[BaseField]:
    """Return the base's parameters: how they are stored, their values, and the law that gives them at a current."""
    dependence, spec = source.dependence, source.base
    orders: dict[str, Order] = dict(dependence.orders) if dependence else {}
    distinct = list(dict.fromkeys(o for o in orders.values() if o))
    found, first = [], 0
    for p in spec.params:
        order = orders.get(p.name, 0)
        size = count(order) if order else 1
        log = bool(order) and logarithmic(spec, p, order)
        values = source.base_theta[first : first + size]
        name = field(p.name)
        stored = f"ln_{name}" if log else name
        basis = distinct.index(order) if order else -1
        terms = [f"(p->{stored}[{k}] * l{basis}[{k}])" for k in range(size)]
        if size == 1:
            law = f"p->{stored}" if not order else f"p->{stored} * l{basis}[0]"
        else:
            law = " + ".join(terms)
        law = f"exp({law})" if log else law
        law = f"({law}) * f->role_{p.role}" if p.role in roles else law
        clip = bool(order) and not log and p.low > 0.0 and p.name not in spec.linear
        written = [number(v) for v in (np.log(values) if log else values)]
        found.append(
            BaseField(
                name=p.name,
                field=name,
                stored=stored,
                text=in_comment(f"{p.text or p.name}, {p.unit}"),
                count=size,
                log=log,
                first=first,
                values=values.tolist(),
                initial="{ " + ", ".join(written) + " }" if size > 1 else written[0],
                law=law,
                clip=(number(p.low), number(p.high)) if clip else None,
            )
        )
        first += size
    return found


def _bases(dependence: CurrentDependence | None) -> list[Basis]:
    """Return the Lagrange polynomials of each distinct order, as products in C."""
    if dependence is None:
        return []
    found = []
    for order in dict.fromkeys(o for _, o in dependence.orders if o):
        pieces, ends = [], (dependence.low, dependence.high)
        knee = knee_of(law_form(order), ends)
        at = "s" if knee else "i"
        for piece in dependence.pieces(order):
            terms = []
            for k, place in enumerate(piece.columns.tolist()):
                nodes = coordinate(piece.nodes, ends, law_form(order)).tolist()
                factors = [
                    f"(({at} - {number(nodes[j])}) / {number(nodes[k] - nodes[j])})"
                    for j in range(len(nodes))
                    if j != k
                ]
                terms.append(Term(place, " * ".join(factors).replace("- -", "+ ") or "1.0"))
            pieces.append(Piece(number(piece.high), terms))
        found.append(Basis(count(order), pieces, number(knee) if knee else ""))
    return found


def _effect(link: Link, form: AnyForm, source: Source, middles: bool) -> EffectCode:
    spec, ident = link.spec, field(link.spec.name.replace("-", "_"))
    body, slot = form.text("body"), link.spec.slot
    whole = [n for n, _, _ in ARGUMENTS if _named_in(n, body)]
    changes = slot == "input"
    arguments, calls = [], []
    for name, declared, called in ARGUMENTS:
        if name in whole:
            declared = declared.removeprefix("const ") if changes and name == "u" else declared
            arguments.append(declared.format(ident))
            calls.append("&u" if changes and name == "u" else called.format(ident))
    if slot == "loop":
        calls = ["p", f"&p->{ident}", "s", "&u", "dt", "first"]
    first = len(source.theta) - sum(len(k.theta) for k in source.links)
    for other in source.links:
        if other is link:
            break
        first += len(other.theta)
    rows = [
        EffectField(field(p.name), in_comment(f"{p.text or p.name}, {p.unit}"), number(v), k)
        for k, (p, v) in enumerate(zip(spec.params, link.theta.tolist(), strict=True), first)
    ]
    rows += [
        EffectField(name, in_comment(text), number(value), None)
        for name, (text, value) in own_constants(form, source).items()
    ]
    code = EffectCode(
        name=spec.name,
        ident=ident,
        title=in_comment(spec.title),
        slot=slot,
        state=form.text("state"),
        code=form.text("code") + ("\n\n" if form.text("code") else ""),
        body=body,
        before=form.text("before"),
        middles=middles and isinstance(registry.load("effect", spec.name), MovesDrive),
        fields=rows,
        returns="void" if slot in ("input", "theta") else "@real",
        arguments=", ".join(arguments),
        call=f"{ident}_step({', '.join(calls)})",
    )
    if not isinstance(form, PrintedForm):
        return code
    rest = call_of(form.element.rest, ident, changes) if form.element.rest else ""
    return replace(code, functions=written(form), call=call_of(form.element.step, ident, changes), rest_call=rest)


def own_constants(form: AnyForm, source: Source) -> dict[str, tuple[str, float]]:
    """Return what an effect's form takes from the logs, by name: what it is and its value."""
    known = {"x_middle": ("middle of the stroke in the fit's logs, m", "displacement")}
    found = {}
    for name in form.setting("constants", []):
        text, channel = known[name]
        levels = sorted(level(s.inputs[channel]) for s in source.stretches)
        # that of one of the logs, on which the export can then be checked
        found[name] = text, levels[(len(levels) - 1) // 2] if levels else 0.0
    return found


def checkable(source: Source) -> list[Stretch]:
    """Return the logs whose own values are the constants that effects take from all of them."""
    forms = _forms(source, False)[1]
    wanted = {text: value for form in forms for text, value in own_constants(form, source).values()}
    return [s for s in source.stretches if not wanted or level(s.inputs["displacement"]) in wanted.values()]


def _ring(source: Source, form: AnyForm, forms: list[AnyForm], tunable: bool) -> int:
    """Return the number of late values that are kept, 0 if none are."""
    params = [source.base.params, *(k.spec.params for k in source.links)]
    values = [source.base_theta, *(k.theta for k in source.links)]
    longest = [0.0]
    rings = False
    items: list[Any] = [
        registry.load("model", source.base.name),
        *(registry.load("effect", k.spec.name) for k in source.links),
    ]
    for item, own, theta, one in zip(items, params, values, (form, *forms), strict=True):
        if isinstance(one, PrintedForm):
            if one.element.late:
                rings = True
                known = len(theta) == len(own) and not tunable
                longest.append(float(item.longest(tuple(theta if known else [p.high for p in own]))))
            continue
        wanted = one.setting("longest", None)
        rings = rings or wanted is not None
        if isinstance(wanted, float):
            longest.append(wanted)
        elif wanted is not None:
            place = [p.name for p in own].index(wanted)
            known = len(theta) == len(own) and not tunable
            longest.append(float(theta[place]) if known else own[place].high)
    return math.ceil(max(longest) * FASTEST) + SPARE if rings else 0


def _curve(base: list[BaseField]) -> Curve:
    """Return the tables of a Bouc-Wen element whose shape holds."""
    values = {q.name: float(q.values[0]) for q in base}
    if "kappa" in values:
        given = [np.array([values[k]]) for k in ("kappa", "beta", "gamma", "n")]
        z_max, rate, rho = (float(v[0]) for v in normal_form(*given))
    else:
        z_max, rate, rho = 1.0, 1.0 / values["flux_y"], values["rho"]
    found = curve_of(values["n"], rho)
    return Curve(
        up=[[number(c) for c in cell] for cell in found.positive.tolist()],
        down=[[number(c) for c in cell] for cell in found.negative.tolist()],
        positive=len(found.positive),
        negative=len(found.negative),
        rest=[number(v) for v in (found.h_positive, found.h_negative, values["n"], found.end, found.gap, rate, z_max)],
    )
