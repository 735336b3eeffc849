"""The exported model as functions of a typed tree: run without a compiler, it is the simulation in Python."""

from collections import defaultdict
from typing import Any

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.export.c_parts import base_fields, parts_of
from mrfit.export.source import ExportSource
from mrfit.simulate.current_dependence import CurrentDependence, orders_of
from tests.export.printer.interpreter import Interpreter
from tests.export.rigs import rig

LOW, HIGH = 0.2, 1.4


def memory() -> Any:
    return defaultdict(memory)


class ExportedFunctions:
    """The functions of a fit's export, and its parameters by the names of their fields."""

    def __init__(self, source: ExportSource) -> None:
        self.source, parts = source, parts_of(source)
        self.program, context = parts.program, parts.context
        self.fitted: dict[str, Any] = {
            q.stored: [float(v) for v in q.initial] if q.count > 1 else float(q.initial[0]) for q in context.base
        }
        self.fitted |= {e.ident: {q.field: float(q.initial) for q in e.fields} for e in context.effects}

    def call(self, name: str, **given: Any) -> Any:
        function = self.program.functions[name]
        return Interpreter(self.program).call(function, [given[a.name] for a in function.arguments])[0]

    def at(self, current: float) -> dict[str, float]:
        """Return the base's parameters at a current."""
        found: dict[str, float] = {}
        self.call("values_at", p=self.fitted, f={}, current=current, b=found)
        return found

    def nodes(self, name: str) -> tuple[list[float], list[float]]:
        """Return the currents at which a parameter has values, in A, and these values."""
        rows = zip(self.source.spec.names, self.source.theta.tolist(), strict=True)
        own = {n.partition("@")[2].removesuffix("A"): v for n, v in rows if n.partition("@")[0] == name}
        return [float(n) for n in own], [*own.values()]


@pytest.mark.parametrize(
    "model",
    [
        "tanh+asymmetry+temperature",
        "dahl+gas-spring+force-offset",
        "lugre+gain-drift",
        "hw-static+current-saturation+residual-magnetism",
    ],
)
def test_a_step_of_the_tree_is_one_of_the_simulation(model: str) -> None:
    source = rig(model, seconds=0.04)
    own, state, log, got = ExportedFunctions(source), memory(), source.stretches[0], list[float]()
    for k in range(len(log.measured)):
        inputs = {n: float(log.inputs[n][k]) for n in source.channels}
        given = {"p": own.fitted, "s": state, "in": inputs, "dt": log.dt if k else 0.0, "first": int(k == 0)}
        got.append(own.call("driven", **given))
    wanted = source.simulate(source.drive(log), log.dt)
    np.testing.assert_allclose(got, wanted, atol=1e-9 * np.ptp(wanted))


@pytest.fixture(scope="module")
def depending() -> ExportedFunctions:
    """A model with parameters that are a parabola, the exponential of a line, and lines in two pieces."""
    spec = registry.load("model", "boucwen").SPEC
    orders = orders_of(spec, "alpha=plain2,kappa=log1,c=1:0.5:1,n=plain1")
    return ExportedFunctions(rig("boucwen", CurrentDependence(orders, LOW, HIGH), seconds=0.05))


@pytest.mark.parametrize("current", [0.2, 0.31, 0.8, 1.1, 1.4])
def test_parameters_go_through_their_values_as_the_polynomials_that_were_fitted(
    depending: ExportedFunctions, current: float
) -> None:
    found = depending.at(current)
    own, values = depending.nodes("alpha")
    assert len(own) == 3
    assert found["alpha"] == pytest.approx(np.polyval(np.polyfit(own, values, 2), current), rel=1e-9)
    own, values = depending.nodes("kappa")
    assert found["kappa"] == pytest.approx(np.exp(np.interp(current, own, np.log(values))), rel=1e-9)
    own, values = depending.nodes("c")
    assert len(own) == 3 and own[1] == 0.5
    assert found["c"] == pytest.approx(np.interp(current, own, values), rel=1e-9)


def test_beyond_the_currents_that_were_tested_parameters_are_held(depending: ExportedFunctions) -> None:
    for far, end in ((-3.0, LOW), (0.1, LOW), (1.5, HIGH), (50.0, HIGH)):
        assert depending.at(far) == depending.at(end)
    assert depending.at(0.5) != depending.at(LOW)


def test_a_parameter_that_a_line_takes_out_of_its_bounds_is_held_there() -> None:
    spec = registry.load("model", "boucwen").SPEC
    n = next(p for p in spec.params if p.name == "n")
    dependence = CurrentDependence(orders_of(spec, "n=plain2"), LOW, HIGH)
    source = rig("boucwen", dependence, seconds=0.05)
    names = [k for k in source.spec.names if k.startswith("n@")]
    # a parabola from one bound to the other, and back, leaves both on its way
    steep = rig("boucwen", dependence, 0.05, changes=dict(zip(names, (n.low, n.low, n.high), strict=True)))
    own = ExportedFunctions(steep)
    inside, below = own.at(HIGH)["n"], own.at(0.5)["n"]
    currents, values = own.nodes("n")
    assert np.polyval(np.polyfit(currents, values, 2), 0.5) < n.low
    assert below == n.low and inside == pytest.approx(n.high, rel=1e-12)
    fields = {q.name: q for q in base_fields(steep, [])}
    assert fields["n"].clip == (n.low, n.high) and fields["alpha"].clip is None


@pytest.mark.parametrize(
    ("value", "answer"),
    [(0.0, 1), (-1e29, 1), (1e29, 1), (1e31, 0), (-1e31, 0), (float("nan"), 0), (float("inf"), 0), (-float("inf"), 0)],
)
def test_what_is_a_number(depending: ExportedFunctions, value: float, answer: int) -> None:
    assert depending.call("is_number", x=value) == answer


def test_inputs_are_within_as_far_as_the_logs_go_and_an_acceleration_always_is() -> None:
    source = rig("tanh+inertia", seconds=0.2)
    own, ends = ExportedFunctions(source), source.ranges
    assert "acceleration" in ends
    middle = {n: 0.5 * (low + high) for n, (low, high) in ends.items() if n in source.channels}

    def within(**changed: float) -> int:
        return int(own.call("within", **{"in": {**middle, **changed}}))

    assert within() == 1
    for name in ("displacement", "velocity"):
        low, high = ends[name]
        assert within(**{name: low}) == within(**{name: high}) == 1
        for factor in (1e-5, 1.0):
            away = factor * (high - low)
            assert within(**{name: low - away}) == within(**{name: high + away}) == 0
        assert within(**{name: float("nan")}) == 0
    assert within(acceleration=1e6) == 1
