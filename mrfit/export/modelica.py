"""Modelica: a package with a block that steps the exported C at a fixed period; every model that has a C form."""

from dataclasses import dataclass

from mrfit.core.channels import unit_of
from mrfit.export.c import Difference, compared, notes_of, rendered, user_inputs
from mrfit.export.c_parts import Parts, parts_of
from mrfit.export.causality import costs
from mrfit.export.compiler import compiled, compiler
from mrfit.export.head import CAUSALITY, head_lines
from mrfit.export.source import ExportSource
from mrfit.export.stage import Files
from mrfit.export.templating import TEMPLATES, environment
from mrfit.export.text import MODELICA_WORDS, ascii_line, field, in_comment, number, wrapped
from mrfit.export.units import modelica_unit
from mrfit.settings.export import Settings


@dataclass(frozen=True)
class BlockParameter:
    """A parameter of the block."""

    field: str
    unit: str
    value: str
    text: str


@dataclass(frozen=True)
class Connector:
    """An input or the output of the block."""

    field: str
    unit: str
    text: str


@dataclass(frozen=True)
class ModelicaBlock:
    """Context of the package beside that of the C templates; ``period`` is in s."""

    title: str
    params: list[BlockParameter]
    inputs: list[Connector]
    output: Connector
    period: str


def files(source: ExportSource, settings: Settings) -> Files:
    """Return the package's folder.

    Raises
    ------
    DataError
        If the model or an effect has no C form.
    """
    parts = parts_of(source, tunable=True)
    block = _block(source, parts)
    context = {**vars(parts.context), **vars(block)}
    prefix = parts.context.p
    jinja = environment(TEMPLATES / "modelica")
    code = rendered(source, parts, [], costs(source))
    wrapper = jinja.get_template("modelica.h.j2").render(context)
    difference = _difference(source, parts, block, code, wrapper)
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
    said = f"{difference.text[:-1]}; of the C behind the block, which no Modelica tool has called yet."
    return Files(contents, (said, *notes_of(source)), difference.largest)


def _block(source: ExportSource, parts: Parts) -> ModelicaBlock:
    taken = {*MODELICA_WORDS, "period", "state", "held", "seen", "in_range", "Model", "State", "step"}
    taken |= {field(n) for n in (*source.channels, source.spec.output)}
    params = [
        BlockParameter(_unlike(field(p.name), taken), modelica_unit(p.unit), number(value), _string(p.text))
        for p, value in zip(source.spec.params, source.theta.tolist(), strict=True)
    ]
    output = parts.context.output
    return ModelicaBlock(
        title=_string(f"{source.assembly.name}: {source.base.title}"),
        params=params,
        inputs=[Connector(c.field, modelica_unit(unit_of(c.name)), _string(c.text)) for c in parts.context.inputs],
        output=Connector(output.field, modelica_unit(unit_of(output.name)), output.text),
        period=number(source.stretches[0].dt) if source.stretches else "0.001",
    )


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


def _difference(
    source: ExportSource, parts: Parts, block: ModelicaBlock, code: dict[str, str], wrapper: str
) -> Difference:
    if not source.stretches:
        return Difference(why_not="the fit's logs are not at hand")
    if compiler() is None:
        return Difference(why_not="no C compiler here")
    prefix = parts.context.p
    driver = environment(TEMPLATES / "modelica").get_template("driver.c.j2")
    # the wrapper includes the model's source
    given = {
        f"{prefix}.h": code[f"{prefix}.h"],
        f"{prefix}_modelica.h": wrapper.replace('.c"', '_model.h"'),
        f"{prefix}_model.h": code[f"{prefix}.c"],
        "driver.c": driver.render(vars(parts.context), params=block.params),
    }
    with compiled(given, options=("-O2",)) as program:
        return compared(source, lambda drive, dt: program.run(user_inputs(source, drive), dt)[0])
