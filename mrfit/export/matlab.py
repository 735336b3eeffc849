"""MATLAB: one function file, which Octave runs too; the exported C, translated."""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mrfit.core import children, temporary
from mrfit.core.specs import Array
from mrfit.errors import ConfigError, DataError
from mrfit.export.c import Difference, compared, named, notes_of, user_inputs
from mrfit.export.c_context import Context
from mrfit.export.c_form import TEMPLATES, environment
from mrfit.export.c_parts import Parts, parts_of
from mrfit.export.c_to_matlab import Kind, Translator, Value, struct_of
from mrfit.export.compiler import fault
from mrfit.export.head import CAUSALITY, head_lines
from mrfit.export.printer.c_text import function_text
from mrfit.export.printer.matlab_text import matlab_text
from mrfit.export.printer.tree import Function
from mrfit.export.source import Source
from mrfit.export.stage import Files
from mrfit.export.text import ascii_line, in_comment, number, wrapped
from mrfit.settings.export import Settings

# Values of the macros of the C form
LIMITS = {"TINY": "1e-100", "CLOSE": "1e-12", "HUGE": "1e30"}
# Samples of a segment, and segments, on which Octave compares: it takes a millisecond a step
SAMPLES, SEGMENTS = 400, 3


def files(source: Source, settings: Settings) -> Files:
    """Return one file.

    Raises
    ------
    ConfigError
        If pycparser is not installed.
    DataError
        If the model or an effect has no C form.
    """
    parts = parts_of(source)
    prefix = parts.context.p
    draft = function_file(source, parts, ["not measured yet"])
    difference = _difference(source, parts, draft)
    told = [difference.text, *notes_of(source), CAUSALITY]
    text = function_file(source, parts, told)
    return Files({f"{prefix}.m": text.encode("ascii")}, (difference.text, *notes_of(source)), difference.largest)


def function_file(source: Source, parts: Parts, told: list[str]) -> str:
    """Return the file's text."""
    context, prefix = parts.context, parts.context.p
    translator = Translator(_parsed(_c_text(source, parts)), (f"{prefix}_init", f"{prefix}_step"))
    structs = translator.structs
    printed = matlab_text(parts.program).replace("@RING", str(context.ring))
    head = "\n".join(f"%   {ascii_line(line)}".rstrip() for line in wrapped(head_lines(source, told)))
    return (
        environment(TEMPLATES / "matlab")
        .get_template("function.m.j2")
        .render(
            vars(context),
            title=in_comment(f"{source.assembly.name}: {source.base.title}"),
            head=head,
            zero=structs.zero(Kind(f"{prefix}_state")),
            fitted=struct_of(structs, Kind(f"{prefix}_parameters"), _values(context)),
            functions=f"{translator.text()}\n{printed}",
        )
    )


def _values(context: Context) -> dict[str, Value]:
    """Return the fitted parameters by the names of the fields they have in C."""
    values = dict[str, Value]()
    for q in context.base:
        written = [number(np.log(v) if q.log else v) for v in q.values]
        values[q.stored] = written if q.count > 1 else written[0]
    for e in context.effects:
        values[e.ident] = {q.field: q.initial for q in e.fields}
    if context.curve:
        curve = context.curve
        names = ("h_up", "h_down", "n", "end", "gap", "rate", "z_max")
        values["curve"] = {
            "positive": str(curve.positive),
            "negative": str(curve.negative),
            "up": curve.up,
            "down": curve.down,
            **dict(zip(names, curve.rest, strict=True)),
        }
    return values


def _c_text(source: Source, parts: Parts) -> str:
    """Return header and source of the C form as one text without comments and preprocessor, in double."""
    prefix = parts.context.p
    elements = {f.name: f for f in parts.program.functions.values()}
    effects = [replace(e, functions=_declared(elements, f"{e.ident}_")) for e in parts.context.effects]
    context = replace(parts.context, helpers="", base_functions=_declared(elements, "base_"), effects=effects)
    jinja = environment(TEMPLATES / "c")
    absent: dict[str, None | tuple[str, ...]] = {"motion": None, "two": (), "functions": (), "limits": ()}
    both = "".join(
        jinja.get_template(n).render(vars(context), head="", **absent) for n in ("header.h.j2", "source.c.j2")
    )
    both = re.sub(r"#ifdef \w+_FLOAT.*?#endif", "", both, flags=re.DOTALL)
    up, down = context.cells or (0, 0)
    sizes = {"RING": context.ring, "UP": up, "DOWN": down}
    for name, value in {**LIMITS, **{n: str(v) for n, v in sizes.items()}}.items():
        both = re.sub(rf"@{name}\b", value, both)
    text = named(both, prefix)
    text = re.sub(r"/\*.*?\*/", " ", text, flags=re.DOTALL)
    text = "\n".join(line for line in text.split("\n") if not line.lstrip().startswith("#"))
    # the parameters are written by themselves
    text = re.sub(rf"const {prefix}_parameters {prefix}_fitted = \{{.*?\n\}};", "", text, flags=re.DOTALL)
    return f"typedef double {prefix}_real;\n{text}"


def _declared(functions: Mapping[str, Function], first: str) -> str:
    """Return the declarations of those functions of an element that the frame calls."""
    found = [functions[n] for n in (f"{first}rest", f"{first}step") if n in functions]
    return "\n".join(f"{function_text(f).partition(chr(10) + '{')[0]};" for f in found)


def _parsed(text: str) -> Any:
    try:
        from pycparser import CParser
    except ImportError:
        raise ConfigError("--to matlab needs pycparser; install it with: pip install 'mrfit[matlab]'") from None
    return CParser().parse(text)


def _difference(source: Source, parts: Parts, text: str) -> Difference:
    octave = children.program("octave-cli") or children.program("octave")
    if not source.stretches:
        return Difference(why_not="the fit's logs are not at hand")
    if octave is None:
        return Difference(why_not="no Octave here to run it")
    short = tuple(
        replace(
            s,
            inputs={n: v[:SAMPLES] for n, v in s.inputs.items()},
            measured=s.measured[:SAMPLES],
            simulated=s.simulated[:SAMPLES],
        )
        for s in source.stretches[:SEGMENTS]
    )
    return compared(
        replace(source, stretches=short),
        lambda drive, dt: run_octave(octave, parts, text, user_inputs(source, drive), dt)[0],
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
