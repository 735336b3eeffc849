"""The head of an export says what it is of, and only that; what a causal drive costs is measured or not known."""

from dataclasses import replace
from typing import Any

import pytest

from mrfit.core.specs import Array
from mrfit.export.causality import DEFAULT, costs
from mrfit.export.head import channel_text, error_text, head_lines
from mrfit.export.motion import derived_of, motion_of
from mrfit.export.source import ExportSource
from mrfit.io.schemas.fit import MetricRow
from mrfit.simulate.current_dependence import CurrentDependence
from tests.export.rigs import rig


@pytest.fixture(scope="module")
def plain() -> ExportSource:
    return rig("tanh")


def text(source: ExportSource) -> str:
    return "\n".join(head_lines(source, ["measured"]))


def metric(**given: Any) -> MetricRow:
    return MetricRow(**{"condition": "all", "role": "train", "samples": 9, "rmse": 1.5, "nrmse": 0.01234, **given})


def test_a_head_names_model_fit_equations_units_and_errors(plain: ExportSource) -> None:
    said = text(plain)
    assert said.startswith("tanh: Hyperbolic") and "from the fit tanh, parameters of 'all'" in said
    assert "SHA-256 of its logs not known" in said and "key none" in said and said.endswith("measured")
    assert "  velocity in m/s, " in said and "force in N" in said and "(output)" in said
    assert "held out: RMSE 1 N, 1 % of the range" in said
    assert "polynomials through these" not in said and "is not known, and not part" not in said


def test_what_a_model_has_besides_is_said_where_it_has_it() -> None:
    depending = rig("tanh+current-lag", CurrentDependence((("fy", 1),), 0.25, 1.5))
    said = text(depending)
    assert "the current is held within 0.25 to 1.5 A" in said and "  with current-lag: " in said
    assert "Left out of the fit's model: delay" in text(replace(depending, without=("delay",)))
    assert "Errors of the fit, delay included, against the logs:" in text(replace(depending, without=("delay",)))
    assert "Errors of the fit against the logs:" in text(depending)
    assert "The constant of a record's flux is not known" in text(rig("boucwen-flux"))


def test_errors_are_those_of_the_condition_else_of_all(plain: ExportSource) -> None:
    rows = [metric(condition="sine", rmse=3.0), metric(rmse=7.0)]
    pooled = replace(plain, content=replace(plain.content, metrics=rows))
    assert "RMSE 7 N" in text(pooled) and "RMSE 3 N" not in text(pooled)
    assert "RMSE 3 N" in text(replace(pooled, condition="sine"))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({}, "training: RMSE 1.5 N, 1.23 % of the range"),
        ({"nrmse": None, "role": "predict"}, "prediction: RMSE 1.5 N"),
        ({"rmse": None, "role": "holdout"}, "held out: not known"),
    ],
)
def test_an_error_in_words(given: dict[str, Any], said: str) -> None:
    assert error_text(metric(**given), "force") == said


def test_a_channel_has_the_range_of_the_logs_or_none(plain: ExportSource) -> None:
    low, high = plain.ranges["velocity"]
    assert channel_text(plain, "velocity") == f"velocity in m/s, {low:.6g} to {high:.6g}"
    assert channel_text(plain, "temperature") == "temperature in degC, range not known"


@pytest.mark.parametrize("ends", [(-0.004, 9.0), (0.5, 0.6)])
def test_the_range_of_current_is_that_of_the_law_and_of_the_smoothed_logs(ends: tuple[float, float]) -> None:
    tested = rig("tanh").ranges.get("current")
    source = rig("tanh", CurrentDependence((("fy", 1),), *ends))
    low, high = min(v.min() for v in _currents(source)), max(v.max() for v in _currents(source))
    assert tested is None and source.ranges["current"] == (min(low, ends[0]), max(high, ends[1]))


def _currents(source: ExportSource) -> list[Array]:
    return [one.inputs["current"] for one in source.stretches]


@pytest.mark.parametrize(
    ("model", "channel", "orders"),
    [
        ("tanh", "displacement", {1: "velocity"}),
        ("tanh+inertia", "displacement", {1: "velocity", 2: "acceleration"}),
        ("rotational-erf", "angle", {1: "angular_velocity"}),
        ("boucwen-flux", "", {}),
    ],
)
def test_rates_are_derived_of_the_stroke_or_the_angle(model: str, channel: str, orders: dict[int, str]) -> None:
    source = rig(model)
    assert derived_of(source) == (channel, orders)
    motion = motion_of(source, 0.002)
    assert (motion is None) is not bool(orders)
    if motion is not None:
        assert motion.targets == [orders[k] for k in sorted(orders)] and motion.tau == "0.002"


def test_the_later_a_derived_rate_the_more_it_costs_and_the_best_is_chosen(plain: ExportSource) -> None:
    found = costs(plain)
    assert found.derived is not None and found.tau == min(found.derived, key=found.derived.__getitem__)
    assert found.derived[0.01] > found.derived[0.001] and found.raw == pytest.approx(0.0, abs=1e-12)
    assert "inputs as recorded instead of smoothed change the output by" in found.lines[0]
    assert f"tau is {1e3 * found.tau:g} ms." in found.lines[1]


def test_without_logs_or_without_a_stroke_the_cost_is_not_known(plain: ExportSource) -> None:
    none = costs(replace(plain, stretches=()))
    assert none.tau == DEFAULT and "the fit's logs are not at hand" in none.lines[0]
    stretch = plain.stretches[0]
    smoothed = costs(replace(plain, stretches=(replace(stretch, raw={}),)))
    assert smoothed.raw is None and "(smoothed)" in smoothed.lines[0]
    bingham = rig("bingham")
    one = bingham.stretches[0]
    assert "displacement" not in one.inputs
    unknown = costs(replace(bingham, stretches=(replace(one, raw={}),)))
    assert unknown.lines == ("What a derived velocity costs is not known: no displacement in the logs.",)


def test_a_model_of_a_coil_has_no_rate_to_derive() -> None:
    found = costs(rig("boucwen-flux"))
    assert found.derived is None and found.tau == DEFAULT and len(found.lines) == 1
