"""MATLAB: one function file, which Octave runs too, of the same functions as the exported C."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from mrfit.core import children, temporary
from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.export.c import Difference, called, compared, noise_told, notes_of, tracker_source, user_inputs
from mrfit.export.c_context import Context
from mrfit.export.c_parts import Parts, parts_of
from mrfit.export.compiler import fault
from mrfit.export.head import CAUSALITY, head_lines
from mrfit.export.printer.matlab_text import matlab_text, results
from mrfit.export.source import ExportSource
from mrfit.export.stage import Files
from mrfit.export.templating import TEMPLATES, environment
from mrfit.export.text import ascii_line, in_comment, number, wrapped
from mrfit.export.tracker import TrackerPlan, plan_of
from mrfit.kernels.tracking import begun_estimator
from mrfit.settings.export import Settings

# Value of a field of a struct: text, rows of text, or a struct
Value: TypeAlias = str | list[list[str]] | Mapping[str, "Value"]
# Samples of a segment, and segments, on which Octave compares: it takes a millisecond a step
EXAMPLE_SAMPLES, _SEGMENTS = 400, 3


def files(source: ExportSource, settings: Settings) -> Files:
    """Return the model's file, and that of a tracker.

    Raises
    ------
    DataError
        If the model or an effect has no C form.
    """
    parts = parts_of(source)
    prefix = parts.context.p
    draft = function_file(source, parts, ["not measured yet"])
    difference = _difference(source, parts, draft)
    told = [difference.text, *notes_of(source), CAUSALITY]
    text = function_file(source, parts, told)
    contents = {f"{prefix}.m": text.encode("ascii")}
    if settings.track:
        own, plan = tracker_source(source), plan_of(source, settings.track)
        parts = parts_of(own, plan=plan)
        contents[f"{parts.context.p}.m"] = function_file(own, parts, [noise_told(source, plan)], plan).encode("ascii")
    return Files(contents, (difference.text, *notes_of(source)), difference.largest)


def function_file(source: ExportSource, parts: Parts, told: list[str], plan: TrackerPlan | None = None) -> str:
    """Return the text of a model's file, or of a tracker's."""
    context = parts.context
    driven = parts.program.functions["driven"]
    head = "\n".join(f"%   {ascii_line(line)}".rstrip() for line in wrapped(head_lines(source, told)))
    names = {"s": "s" if plan else "state", "first": "double(first)", "dt": "elapsed"}
    return (
        environment(TEMPLATES / "matlab")
        .get_template("tracker.m.j2" if plan else "function.m.j2")
        .render(
            {**vars(context), **(_tracker(plan) if plan else {})},
            tracker=parts.tracker,
            size=len(plan.parameters) if plan else 0,
            title=in_comment(f"{source.assembly.name}: {source.base.title}"),
            head=head,
            zero=_struct(_at_rest(context)),
            fitted=_struct(_values(context)),
            outputs=[context.output.field, *(names[n] for n in results(driven))],
            driven=[names.get(a.name, a.name) for a in driven.arguments],
            within=called(parts.program)["within"],
            functions=matlab_text(parts.program).replace("@RING", str(context.ring)),
        )
    )


def _tracker(plan: TrackerPlan) -> dict[str, str]:
    """Return the context of a tracker's template beside a model's."""
    begun = begun_estimator(plan.prior, plan.filters)._asdict()
    return {
        "begun": _struct({n: _rows(v) if v.ndim < 3 else f"zeros{v.shape}" for n, v in begun.items()}),
        "constants": _struct({n: _rows(v) for n, v in plan.constants._asdict().items()}),
        "prior": _struct(_rows(plan.prior)),
        "held": _struct(_rows(plan.held)),
        "differences": _struct(_rows(plan.column("difference"))),
        "means": _struct(_rows(plan.column("value"))),
        "deviations": _struct(_rows(plan.column("deviation"))),
    }


def _rows(value: Array) -> list[list[str]]:
    return [[number(v) for v in row] for row in np.atleast_2d(value).tolist()]


def _values(context: Context) -> dict[str, Value]:
    """Return the fitted parameters by the names of the fields they have in C."""
    values: dict[str, Value] = {q.stored: [q.initial] for q in context.base}
    if context.curve:
        values["curve"] = {"cells": context.curve.cells, **context.curve.others}
    return values | {e.ident: {q.field: q.initial for q in e.fields} for e in context.effects}


def _at_rest(context: Context) -> dict[str, Value]:
    """Return the state before the first step, whose values elements fill in as it begins."""
    memory: dict[str, Value] = {}
    for m in context.memories:
        past = {"past": f"zeros(1, {m.past.replace('@RING', str(context.ring))})"} if m.past else {}
        memory[m.ident] = {**dict.fromkeys(m.fields, "0"), **past}
    fine: dict[str, Value] = {"middle": memory, "before": "struct()", "dt": "0"} if context.fine else {}
    return {"started": "0", "last": {context.output.field: "0", "in_range": "0"}, "now": memory, **fine}


def _struct(value: Value) -> str:
    """Return a value as an expression."""
    if isinstance(value, Mapping):
        return f"struct({', '.join(f'{name!r}, {_struct(v)}' for name, v in value.items())})"
    return value if isinstance(value, str) else f"[{'; '.join(', '.join(row) for row in value)}]"


def _difference(source: ExportSource, parts: Parts, text: str) -> Difference:
    octave = children.program("octave-cli") or children.program("octave")
    if not source.stretches:
        return Difference(why_not="the fit's logs are not at hand")
    if octave is None:
        return Difference(why_not="no Octave here to run it")
    return compared(
        replace(source, stretches=source.stretches[:_SEGMENTS]),
        lambda drive, dt: run_octave(octave, parts, text, user_inputs(source, drive), dt)[0],
        EXAMPLE_SAMPLES,
    )


def run_octave(octave: str, parts: Parts, text: str, inputs: Array, dt: float) -> tuple[Array, Array]:
    """Return output and in_range (N,) of the function file for inputs (C, N), simulated by Octave.

    Raises
    ------
    DataError
        If Octave refuses it.
    """
    prefix = parts.context.p
    with temporary.folder("matlab") as place:
        (place / f"{prefix}.m").write_text(text, encoding="ascii")
        simulate = environment(TEMPLATES / "matlab").get_template("simulate.m.j2").render(vars(parts.context))
        (place / "simulate.m").write_text(simulate, encoding="ascii")
        np.savetxt(place / "in.txt", np.column_stack([np.full(inputs.shape[1], dt), *inputs]), fmt="%.17g")
        command = [octave, "--no-gui", "--norc", "--quiet", "--eval", "simulate('in.txt', 'out.txt')"]
        done = children.run(command, place)
        if done.returncode or not (place / "out.txt").is_file():
            raise DataError(f"--to matlab: Octave refuses the function: {fault(done.stderr)}")
        found = np.loadtxt(place / "out.txt", ndmin=2)
    return found[:, 0], found[:, 1]
