"""Descriptions of an FMU, read as XML: variables by their references, starts, units, what is calculated."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from mrfit.core.specs import EffectSpec
from mrfit.export.c_parts import parts_of
from mrfit.export.fmi_description import build_description, model_description, start_of, variables_of
from mrfit.export.source import ExportSource
from mrfit.export.tracker import TrackedParameter, TrackerPlan
from mrfit.simulate.current_dependence import CurrentDependence
from tests.export.rigs import rig

MODEL = "tanh+temperature+inertia"


@pytest.fixture(scope="module")
def source() -> ExportSource:
    return rig(MODEL, CurrentDependence((("fy", 1),), 0.3, 1.5), seconds=0.05)


def plan_of_two() -> TrackerPlan:
    """Two parameters that are tracked; what a tracker knows of them is of no account here."""
    tracked = tuple(
        TrackedParameter(n, unit, 1.0, 0.1, 1.0, 0.0, 10.0, (k,), False)
        for k, (n, unit) in enumerate((("fy", "1"), ("c", "N*s/m")))
    )
    return TrackerPlan(tracked, np.eye(2), np.zeros((2, 2)), 1.0, 0.0, ())


def described(source: ExportSource, fmi: int, plan: TrackerPlan | None = None) -> ElementTree.Element:
    return ElementTree.fromstring(model_description(source, parts_of(source), "{7}", ["head"], fmi, plan))


@pytest.mark.parametrize(
    ("name", "ends", "start"),
    [
        ("current", (0.3, 1.5), 0.3),
        ("current", (-2.0, -0.5), -0.5),
        ("current", (-1.0, 1.0), 0.0),
        ("temperature", (30.0, 80.0), 30.0),
        ("velocity", (0.2, 0.4), 0.0),
    ],
)
def test_a_level_starts_where_the_fit_has_seen_it_and_a_motion_at_0(
    source: ExportSource, name: str, ends: tuple[float, float], start: float
) -> None:
    (log,) = source.stretches
    inputs = {**log.inputs, name: np.linspace(*ends, len(log.measured))}
    own = replace(source, stretches=(replace(log, inputs=inputs),))
    if name == "current":
        # of a model without a dependence the range is that of the logs alone
        bare = rig("hw-static", seconds=0.05)
        own = replace(
            bare,
            stretches=(
                replace(
                    bare.stretches[0],
                    inputs={**bare.stretches[0].inputs, **{name: np.linspace(*ends, len(bare.stretches[0].measured))}},
                ),
            ),
        )
    assert start_of(own, name) == start


def test_what_no_log_has_seen_starts_at_a_room_s_temperature_or_at_0(source: ExportSource) -> None:
    blind = replace(source, stretches=())
    assert start_of(blind, "temperature") == 25.0 and start_of(blind, "velocity") == 0.0


def test_variables_are_inputs_output_and_parameters_counted_through(source: ExportSource) -> None:
    found = variables_of(source)
    count = len(source.channels)
    assert [v.reference for v in found] == list(range(count + 2 + len(source.theta)))
    assert [v.name for v in found[:count]] == list(source.channels)
    assert [(v.name, v.causality, v.variability) for v in found[count : count + 2]] == [
        ("force", "output", "continuous"),
        ("in_range", "output", "discrete"),
    ]
    assert [v.boolean for v in found].index(True) == count + 1 and sum(v.boolean for v in found) == 1
    assert [v.name for v in found[count + 2 :]] == list(source.spec.names)
    assert [float(v.start) for v in found[count + 2 :]] == source.theta.tolist()
    # what is calculated has no start
    assert [v.start for v in found[count : count + 2]] == ["", ""]


def test_a_tracker_takes_the_output_and_gives_estimates_and_covariances_in_place_of_parameters(
    source: ExportSource,
) -> None:
    found = variables_of(source, plan_of_two())
    count = len(source.channels)
    assert [v.reference for v in found] == list(range(len(found)))
    assert [(v.name, v.causality) for v in found[count:]] == [
        ("measured_force", "input"),
        ("force", "output"),
        ("in_range", "output"),
        ("moving", "output"),
        ("fy", "output"),
        ("c", "output"),
        ("cov(fy,fy)", "output"),
        ("cov(fy,c)", "output"),
        ("cov(c,c)", "output"),
    ]
    assert found[count].start == "0.0" and found[count].unit == "N" and found[-4].unit == "N*s/m"
    assert [v.name for v in found if v.boolean] == ["in_range", "moving"]


def test_the_second_version_counts_outputs_from_1_and_names_its_sources(source: ExportSource) -> None:
    root = described(source, 2)
    assert (root.get("fmiVersion"), root.get("guid"), root.get("instantiationToken")) == ("2.0", "{7}", None)
    files = [f.get("name") for f in root.findall("CoSimulation/SourceFiles/File")]
    assert files == [f"{parts_of(source).context.p}.c", "fmi2.c"]
    assert root.find("CoSimulation").get("canGetAndSetFMUstate") == "true"  # type: ignore[union-attr]
    rows = root.findall("ModelVariables/ScalarVariable")
    for kind in ("Outputs", "InitialUnknowns"):
        places = [int(u.get("index", "0")) for u in root.findall(f"ModelStructure/{kind}/Unknown")]
        assert [rows[k - 1].get("name") for k in places] == ["force", "in_range"]
    typed = {row.get("name"): row[0] for row in rows}
    assert typed["in_range"].tag == "Boolean" and typed["force"].tag == "Real"
    calculated = [row.get("name") for row in rows if row.get("initial") == "calculated"]
    assert calculated == ["force", "in_range"] and typed["force"].get("start") is None
    assert typed["velocity"].get("unit") == "m/s" and typed["velocity"].get("start") == "0.0"


def test_the_third_version_names_references_and_has_a_time(source: ExportSource) -> None:
    root = described(source, 3)
    assert (root.get("fmiVersion"), root.get("instantiationToken"), root.get("guid")) == ("3.0", "{7}", None)
    rows = {row.get("name"): row for row in root.find("ModelVariables")}  # type: ignore[union-attr]
    time = rows["time"]
    assert (time.get("causality"), time.get("unit"), time.get("initial")) == ("independent", "s", None)
    references = [row.get("valueReference") for row in rows.values()]
    assert len(set(references)) == len(references) and time.get("valueReference") == str(len(rows) - 1)
    for kind in ("Output", "InitialUnknown"):
        given = [row.get("valueReference") for row in root.findall(f"ModelStructure/{kind}")]
        assert given == [rows[n].get("valueReference") for n in ("force", "in_range")]
    assert rows["in_range"].tag == "Boolean" and rows["velocity"].tag == "Float64"
    assert root.find("CoSimulation").get("canGetAndSetFMUState") == "true"  # type: ignore[union-attr]


@pytest.mark.parametrize("fmi", [2, 3])
def test_every_unit_that_a_variable_has_is_defined_once_and_a_number_has_none(source: ExportSource, fmi: int) -> None:
    root = described(source, fmi)
    defined = [u.get("name") for u in root.findall("UnitDefinitions/Unit")]
    used = {e.get("unit") for e in root.find("ModelVariables").iter()} - {None}  # type: ignore[union-attr]
    assert len(set(defined)) == len(defined) and set(defined) == used | {"s"} and "1" not in defined
    second = root.find("UnitDefinitions/Unit[@name='m/s^2']/BaseUnit")
    assert second is not None and dict(second.attrib) == {"m": "1", "s": "-2"}


def test_the_experiment_has_the_step_of_the_logs_or_a_millisecond(source: ExportSource) -> None:
    (log,) = source.stretches
    finer = replace(source, stretches=(replace(log, dt=2.5e-4),))
    for given, step in ((finer, 2.5e-4), (replace(source, stretches=()), 1e-3)):
        experiment = described(given, 2).find("DefaultExperiment")
        assert experiment is not None and float(experiment.get("stepSize", "0")) == step


def test_the_sources_of_the_third_version_say_how_they_are_compiled() -> None:
    root = ElementTree.fromstring(build_description("front"))
    assert root.get("fmiVersion") == "3.0"
    assert root.find("BuildConfiguration").get("modelIdentifier") == "front"  # type: ignore[union-attr]
    listed = root.find("BuildConfiguration/SourceFileSet")
    assert listed is not None and listed.get("language") == "C99"
    assert [f.get("name") for f in listed] == ["front.c", "fmi3.c"]


def test_an_effect_s_parameter_has_its_unit_and_text(source: ExportSource) -> None:
    from mrfit.core import registry

    spec: EffectSpec = registry.load("effect", "inertia").SPEC
    (param,) = spec.params
    (row,) = [v for v in variables_of(source) if v.name == f"inertia.{param.name}"]
    assert row.unit == param.unit == "kg" and param.text in row.text
