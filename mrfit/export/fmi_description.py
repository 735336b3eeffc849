"""modelDescription.xml of FMI 2.0 and 3.0, and buildDescription.xml of 3.0."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version

from mrfit.core.channels import unit_of
from mrfit.export.c_parts import Parts
from mrfit.export.head import channel_text
from mrfit.export.source import ExportSource
from mrfit.export.text import field, number
from mrfit.export.tracker import TrackerPlan
from mrfit.export.units import base_units
from mrfit.export.xml import XmlElement, xml


@dataclass(frozen=True)
class Variable:
    """A variable of the description; ``start`` is empty where it is calculated."""

    name: str
    reference: int
    causality: str
    variability: str
    text: str
    unit: str = ""
    start: str = ""
    boolean: bool = False


def start_of(source: ExportSource, name: str) -> float:
    """Return an input's start value: 0, or the nearest to it that the fit has seen of what is held at a level."""
    if name not in ("temperature", "current") or name not in source.ranges:
        return 25.0 if name == "temperature" else 0.0
    low, high = source.ranges[name]
    return min(max(0.0, low), high)


def variables_of(source: ExportSource, plan: TrackerPlan | None = None) -> list[Variable]:
    """Return inputs, outputs and parameters, or of a tracker estimates, in the order of their value references."""
    found = list[Variable]()
    for k, name in enumerate(source.channels):
        start, text = number(start_of(source, name)), channel_text(source, name)
        found.append(Variable(field(name), k, "input", "continuous", text, unit_of(name), start))
    output, text = source.spec.output, channel_text(source, source.spec.output)
    if plan:
        name = f"measured_{field(output)}"
        found.append(Variable(name, len(found), "input", "continuous", f"measured: {text}", unit_of(output), "0.0"))
    found.append(Variable(field(output), len(found), "output", "continuous", text, unit_of(output)))
    seen = "whether all inputs lie within their ranges in the fit's logs"
    found.append(Variable("in_range", len(found), "output", "discrete", seen, boolean=True))
    if plan:
        moving = "whether parameters are taken to move"
        found.append(Variable("moving", len(found), "output", "discrete", moving, boolean=True))
        estimates = [(p.name, p.unit, f"estimate of {p.name}") for p in plan.parameters]
        estimates += [(f"cov({a},{b})", "", f"covariance of estimates of {a} and {b}") for a, b in plan.pairs]
        found += [Variable(n, k, "output", "discrete", t, u) for k, (n, u, t) in enumerate(estimates, len(found))]
        return found
    for p, value in zip(source.spec.params, source.theta.tolist(), strict=True):
        text = p.text or p.name
        found.append(Variable(p.name, len(found), "parameter", "tunable", text, p.unit, number(value)))
    return found


def model_description(
    source: ExportSource, parts: Parts, token: str, head: Sequence[str], fmi: int, plan: TrackerPlan | None = None
) -> bytes:
    """Return modelDescription.xml."""
    variables = variables_of(source, plan)
    shared = {
        "modelName": source.name,
        "description": f"{source.assembly.name}: {source.base.title}",
        "generationTool": f"mrfit {version('mrfit')}",
        "variableNamingConvention": "flat",
    }
    identifier = parts.context.p
    units = _units(variables)
    step = number(source.stretches[0].dt) if source.stretches else "0.001"
    experiment = XmlElement("DefaultExperiment", {"startTime": "0.0", "stopTime": "1.0", "stepSize": step})
    can = {"modelIdentifier": identifier, "canHandleVariableCommunicationStepSize": "true"}
    if fmi == 2:
        files = XmlElement("SourceFiles", {}, [XmlElement("File", {"name": n}) for n in (f"{identifier}.c", "fmi2.c")])
        simulation = XmlElement("CoSimulation", can | {"canGetAndSetFMUstate": "true"}, [files])
        own = {"fmiVersion": "2.0", "guid": token}
        listed = [_variables_2(variables), _structure_2(variables)]
    else:
        simulation = XmlElement("CoSimulation", can | {"canGetAndSetFMUState": "true"})
        own = {"fmiVersion": "3.0", "instantiationToken": token}
        listed = [_variables_3(variables), _structure_3(variables)]
    return xml(XmlElement("fmiModelDescription", own | shared, [simulation, units, experiment, *listed]), head)


def _units(variables: Sequence[Variable]) -> XmlElement:
    # the time's unit too
    names = dict.fromkeys(v.unit for v in variables if v.unit and v.unit != "1") | {"s": None}
    return XmlElement(
        "UnitDefinitions",
        {},
        [XmlElement("Unit", {"name": u}, [XmlElement("BaseUnit", dict(base_units(u)))]) for u in names],
    )


def _typed(variable: Variable) -> dict[str, str]:
    given = {"unit": variable.unit} if variable.unit and variable.unit != "1" else {}
    return given | ({"start": variable.start} if variable.start else {})


def _named(variable: Variable) -> dict[str, str]:
    return {
        "name": variable.name,
        "valueReference": str(variable.reference),
        "description": variable.text,
        "causality": variable.causality,
        "variability": variable.variability,
    }


def _initial(variable: Variable) -> dict[str, str]:
    return {"initial": "calculated"} if variable.causality == "output" else {}


def _variables_2(variables: Sequence[Variable]) -> XmlElement:
    kinds = (XmlElement("Boolean" if v.boolean else "Real", _typed(v)) for v in variables)
    rows = [XmlElement("ScalarVariable", _named(v) | _initial(v), [k]) for v, k in zip(variables, kinds, strict=True)]
    return XmlElement("ModelVariables", {}, rows)


def _variables_3(variables: Sequence[Variable]) -> XmlElement:
    rows = [
        XmlElement("Boolean" if v.boolean else "Float64", {**_named(v), **_initial(v), **_typed(v)}) for v in variables
    ]
    time = Variable("time", len(variables), "independent", "continuous", "time of the simulation", "s")
    units = XmlElement("Float64", {**_named(time), "unit": "s"})
    return XmlElement("ModelVariables", {}, [*rows, units])


def _structure_2(variables: Sequence[Variable]) -> XmlElement:
    # counted from 1 in the order of the variables
    places = [str(k) for k, v in enumerate(variables, 1) if v.causality == "output"]
    unknowns = [XmlElement("Unknown", {"index": place}) for place in places]
    return XmlElement(
        "ModelStructure", {}, [XmlElement("Outputs", {}, unknowns), XmlElement("InitialUnknowns", {}, unknowns)]
    )


def _structure_3(variables: Sequence[Variable]) -> XmlElement:
    references = [str(v.reference) for v in variables if v.causality == "output"]
    rows = [XmlElement(name, {"valueReference": r}) for name in ("Output", "InitialUnknown") for r in references]
    return XmlElement("ModelStructure", {}, rows)


def build_description(prefix: str) -> bytes:
    """Return buildDescription.xml: how the sources are compiled."""
    code = XmlElement(
        "SourceFileSet", {"language": "C99"}, [XmlElement("SourceFile", {"name": n}) for n in (f"{prefix}.c", "fmi3.c")]
    )
    root = XmlElement(
        "fmiBuildDescription",
        {"fmiVersion": "3.0"},
        [XmlElement("BuildConfiguration", {"modelIdentifier": prefix}, [code])],
    )
    return xml(root, ["How the sources of this FMU are compiled"])
