"""Modelica: a package with a block that steps the exported C at a fixed period; every model that has a C form."""

from typing import Any

from mrfit.core.channels import unit_of
from mrfit.export.c import Difference, compared, notes_of, rendered, user_inputs
from mrfit.export.c_form import TEMPLATES, environment
from mrfit.export.c_parts import Parts, parts_of
from mrfit.export.causality import costs
from mrfit.export.compiler import compiled, compiler
from mrfit.export.head import CAUSALITY, head_lines
from mrfit.export.source import Source
from mrfit.export.stage import Files, Options
from mrfit.export.text import ascii_line, field, in_comment, number, wrapped

KEYWORDS = (
    "algorithm and annotation block class connect connector constant der discrete each else elseif elsewhen "
    "encapsulated end enumeration equation expandable extends external false final flow for function if import impure "
    "in initial inner input loop model not operator or outer output package parameter partial protected public pure "
    "record redeclare replaceable return stream then time true type when while within"
).split()


def files(source: Source, options: Options) -> Files:
    """Return the package's folder.

    Raises
    ------
    DataError
        If the model or an effect has no C form.
    """
    parts = parts_of(source, tunable=True)
    context = _context(source, parts)
    prefix = context["p"]
    jinja = environment(TEMPLATES / "modelica")
    code = rendered(source, parts, [], costs(source), tunable=True)
    wrapper = jinja.get_template("modelica.h.j2").render(context)
    difference = _difference(source, {f"{prefix}.h": code[f"{prefix}.h"], f"{prefix}.c": code[f"{prefix}.c"]}, context)
    told = [difference.text, *notes_of(source), CAUSALITY]
    head = "\n".join(f"  // {ascii_line(line)}".rstrip() for line in wrapped(head_lines(source, told)))
    package = jinja.get_template("package.mo.j2").render(context, head=head)
    place = f"modelica/{prefix}/Resources/Include/{prefix}"
    contents = {
        f"modelica/{prefix}/package.mo": package.encode("ascii"),
        f"{place}.h": code[f"{prefix}.h"].encode("ascii"),
        f"{place}.c": code[f"{prefix}.c"].encode("ascii"),
        f"{place}_modelica.h": wrapper.encode("ascii"),
    }
    said = f"{difference.text[:-1]}; of the C behind the block, no Modelica compiler has run."
    return Files(contents, (said, *notes_of(source)), difference.largest)


def _context(source: Source, parts: Parts) -> dict[str, Any]:
    taken = {*KEYWORDS, "period", "state", "held", "seen", "in_range", "Model", "State", "step"}
    taken |= {field(n) for n in (*source.channels, source.spec.output)}
    params = []
    for p, value in zip(source.spec.params, source.theta.tolist(), strict=True):
        params.append(
            {"field": _unlike(field(p.name), taken), "unit": p.unit, "value": number(value), "text": _string(p.text)}
        )
    inputs = [{**c, "unit": unit_of(c["name"]), "text": _string(c["text"])} for c in parts.context["inputs"]]
    return {
        **parts.context,
        "title": _string(f"{source.assembly.name}: {source.base.title}"),
        "params": params,
        "inputs": inputs,
        "output": {**parts.context["output"], "unit": unit_of(source.spec.output)},
        "period": number(source.stretches[0].dt) if source.stretches else "0.001",
    }


def _string(text: str) -> str:
    """Return text inside a string of Modelica."""
    return in_comment(text).replace("\\", "\\\\").replace('"', '\\"')


def _unlike(name: str, taken: set[str]) -> str:
    """Return a name that is not taken, and take it: values either side of a jump have names that differ in a sign."""
    found, k = name, 2
    while found in taken:
        found, k = f"{name}_{k}", k + 1
    taken.add(found)
    return found


def _difference(source: Source, code: dict[str, str], context: dict[str, Any]) -> Difference:
    if not source.stretches:
        return Difference(why_not="the fit's logs are not at hand")
    if compiler() is None:
        return Difference(why_not="no C compiler here")
    prefix, jinja = context["p"], environment(TEMPLATES / "modelica")
    # the wrapper includes the model's source
    given = {
        f"{prefix}.h": code[f"{prefix}.h"],
        f"{prefix}_modelica.h": jinja.get_template("modelica.h.j2").render(context).replace('.c"', '_model.h"'),
        f"{prefix}_model.h": code[f"{prefix}.c"],
        "driver.c": jinja.get_template("driver.c.j2").render(context),
    }
    with compiled(given, len(source.channels), ("-O2",)) as program:
        return compared(source, lambda drive, dt: program.run(user_inputs(source, drive), dt)[0])
