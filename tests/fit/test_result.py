"""Every reason to distrust a result has a name, and conditions with the same reason share one wording."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mrfit.core.specs import DerivedQuantity, ModelSpec, Param, PassiveRange
from mrfit.fit.diagnostics.bootstrap import BootstrapInterval
from mrfit.fit.diagnostics.uncertainty import Uncertainty, quantile_95
from mrfit.fit.result import (
    NO_LIMITS,
    conditioning,
    derived_rows,
    metric_rows,
    parameter_rows,
    passivity_rows,
    simulate_block,
    warnings_of,
    with_intervals,
    work_drive,
)
from mrfit.io.schemas.determined import State
from mrfit.io.schemas.fit import MetricRow, Passivity, Quantity, Repeats, ResidualTest, Result
from mrfit.search.cube import Cube
from mrfit.search.parts import Blocks, SegmentPart
from mrfit.signal.noise_floor import NoiseFloor
from mrfit.simulate.assembly import Assembly
from tests.fit.toy import DT, block, linear_model, part

PARAMETER = Quantity(name="n", value=1.5, low=1.0, high=2.0)
TESTED = ResidualTest(
    channel="current",
    condition="a",
    correlation=0.1,
    lag=3,
    limit=0.2,
    dependent=0,
    conditions=1,
    independent=True,
)
SOUND = Result(
    condition="a",
    parameters=[PARAMETER],
    evaluations=500,
    starts=[1.0, 1.0],
    agreeing=2,
    passivity=[Passivity(condition="a", loop_area=0.1, passive=True)],
    residual_tests=[TESTED],
)
TRAINING = MetricRow(condition="all", role="train", samples=9, nrmse=0.01, rmse=3.0, noise_floor=1.0, fit_percent=96.0)
METRICS = [TRAINING]
APART = Repeats(condition="a", segments=2, difference=9.0, noise_floor=1.0, moved=5.0, agree=False)


def kinds(change: dict[str, Any], metrics: list[MetricRow] = METRICS) -> list[str]:
    return [w.kind for w in warnings_of(replace(SOUND, **change), metrics)]


def test_a_sound_result_has_no_warning() -> None:
    assert kinds({}) == []


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        ({"parameters": [replace(PARAMETER, at_bound=True)]}, "at-bound"),
        ({"parameters": [replace(PARAMETER, identifiable=False)]}, "not-identifiable"),
        ({"nonfinite": 3}, "non-finite"),
        ({"budget_spent": True}, "budget-spent"),
        ({"agreeing": 1}, "starts-disagree"),
        ({"passivity": [Passivity(condition="a", loop_area=-0.1, passive=False)]}, "not-passive"),
        ({"repeats": [APART]}, "repeats-disagree"),
        ({"residual_tests": [replace(TESTED, independent=False)]}, "input-residual"),
    ],
)
def test_each_fault_has_its_warning(change: dict[str, Any], kind: str) -> None:
    assert kinds(change) == [kind]


def test_what_is_read_instead_tells_of_what_is_not_determined() -> None:
    names = ("c.i0", "c(0..1A).i1", "alpha.i1", "yield_force")
    derived = [replace(PARAMETER, name=name, low=1.49, high=1.51) for name in names]
    unknown = replace(PARAMETER, name="alpha@0A", identifiable=False)
    parameters = [unknown, replace(PARAMETER, name="c@0A")]
    (warning,) = warnings_of(replace(SOUND, parameters=parameters, derived=derived), METRICS)
    assert warning.text == "the data do not determine alpha@0A one by one; read alpha.i1, yield_force instead"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"dependent": 1}, "correlated with current (correlation 0.90 at 3 samples, by chance 0.20): the model"),
        (
            {"dependent": 2, "conditions": 5},
            "correlated with current in 2 of 5 conditions, most on a (correlation 0.90",
        ),
        (
            {"conditions": 5, "condition": "all"},
            "correlated with current, over all 5 conditions together (correlation 0.90",
        ),
    ],
)
def test_the_condition_in_which_the_residual_goes_most_with_an_input_is_said(
    change: dict[str, Any], words: str
) -> None:
    row = replace(TESTED, correlation=0.9, independent=False, **change)
    (warning,) = warnings_of(replace(SOUND, residual_tests=[row]), METRICS)
    assert words in warning.text


def test_an_error_that_grows_on_held_out_data_is_a_warning() -> None:
    held = replace(TRAINING, role="holdout", nrmse=0.02, rmse=6.0)
    assert kinds({}, [*METRICS, held]) == ["holdout-worse"]
    # a smaller range alone, or more noise alone, is none
    assert kinds({}, [*METRICS, replace(held, rmse=3.0)]) == []
    assert kinds({}, [*METRICS, replace(held, noise_floor=2.0)]) == []
    # without a floor the range has to do
    assert kinds({}, [*METRICS, replace(held, noise_floor=float("nan"))]) == ["holdout-worse"]


@pytest.mark.parametrize(("condition", "expected"), [("a", []), ("b", ["holdout-worse"])])
def test_errors_in_parts_of_one_test_are_compared_as_they_are(condition: str, expected: list[str]) -> None:
    held = replace(TRAINING, role="holdout", nrmse=0.02, noise_floor=float("nan"))
    rows = [replace(TRAINING, condition="a"), replace(held, condition=condition)]
    assert kinds({}, [*METRICS, held, *rows]) == expected


def test_an_error_no_less_than_a_constants_is_a_warning() -> None:
    assert kinds({}, [replace(TRAINING, fit_percent=4.0)]) == ["explains-nothing"]
    assert kinds({}, [replace(TRAINING, fit_percent=-20.0)]) == ["explains-nothing"]
    assert kinds({}, [replace(TRAINING, fit_percent=6.0)]) == []
    # of a constant output, or a simulation that diverged, there is none
    assert kinds({}, [replace(TRAINING, fit_percent=float("nan"))]) == []


def derived_row(value: float, width: float, role: str = "", ranges: Mapping[str, float] = NO_LIMITS) -> Quantity:
    """The row of a quantity 3·a of a parameter a between -10 and 10, whose interval in the cube is so wide."""
    place = (value / 3.0 + 10.0) / 20.0
    params = (Param("a", "N", -10.0, 10.0, 0.0),)
    spec = ModelSpec(
        "m", "m", "", "", ("velocity",), "force", params, derived=(DerivedQuantity("three", "N", role=role),)
    )
    assembly = Assembly("m", spec, lambda *_: np.empty(0), lambda theta: 3.0 * theta, lambda *_: {})
    spread = width / 60.0 / 2.0 / 1.96
    found = Uncertainty(np.array([[spread**2]]), np.eye(1), np.array([False]), np.array([spread]), np.ones(1), 1e9)
    (row,) = derived_rows(assembly, Cube(spec.params, np.array([0])), np.array([place]), found, ranges)
    return row


@pytest.mark.parametrize(("role", "state"), [("offset", State.WELL), ("", State.POORLY)])
def test_a_derived_offset_near_zero_is_judged_by_the_range_that_it_adds_to(role: str, state: State) -> None:
    assert derived_row(1.0, 9.0, role, {"N": 500.0}).determined is state
    assert derived_row(1.0, 11.0, role, {"N": 500.0}).determined is State.POORLY


@pytest.mark.parametrize(
    ("value", "width", "determined"),
    [(28.0, 55.0, True), (29.0, 61.0, False), (1.0, 14.0, True), (1.0, 16.0, False), (-2.0, 55.0, False)],
)
def test_a_derived_quantity_is_determined_by_the_rule_of_parameters(
    value: float, width: float, determined: bool
) -> None:
    row = derived_row(value, width)
    assert row.identifiable == determined
    assert (row.low is not None) == determined == (row.high is not None)
    if determined:
        assert row.high - row.low == pytest.approx(width, rel=1e-3)


@pytest.mark.parametrize("change", [{"budget_spent": True}, {"nonfinite": 1}])
def test_wording_does_not_depend_on_counts(change: dict[str, Any]) -> None:
    texts = {
        w.text
        for n in (500, 900)
        for w in warnings_of(
            replace(SOUND, **{**change, "evaluations": n, "nonfinite": change.get("nonfinite", 0) * n}), METRICS
        )
    }
    assert len(texts) == 1


@pytest.mark.parametrize(("out_of_time", "remedy"), [(False, "--budget"), (True, "--seconds")])
def test_what_ended_a_search_is_what_to_raise(out_of_time: bool, remedy: str) -> None:
    (warning,) = warnings_of(replace(SOUND, budget_spent=True, out_of_time=out_of_time), METRICS)
    assert warning.text.endswith(f"raise {remedy}")


def test_what_would_keep_a_model_passive_is_said_where_it_is_known() -> None:
    active = replace(SOUND, passivity=[Passivity(condition="a", loop_area=-0.1, passive=False)])
    texts = [warnings_of(active, METRICS, passive)[0].text for passive in (PassiveRange("A", 1.0, 1.5), None)]
    assert texts[0] == f"{texts[1]}; it cannot with --bounds A=1:1.5"


@pytest.mark.parametrize(("spent", "remedy"), [(False, "--seed"), (True, "raise --budget")])
def test_starts_that_disagree_ask_for_more_of_what_ran_out(spent: bool, remedy: str) -> None:
    said = warnings_of(replace(SOUND, agreeing=1, budget_spent=spent, out_of_time=False), METRICS)
    assert remedy in next(w.text for w in said if w.kind == "starts-disagree")


def test_a_search_without_starts_cannot_disagree() -> None:
    assert kinds({"starts": None, "agreeing": 0}) == []


@pytest.mark.parametrize(("low", "high", "known"), [(1.5, 2.5, True), (1.5, None, True), (None, None, False)])
def test_other_intervals_replace_those_there_are_and_one_end_is_something(
    low: float | None, high: float | None, known: bool
) -> None:
    fixed = replace(PARAMETER, name="A", fixed=True)
    rows = with_intervals([PARAMETER, fixed], {"n": BootstrapInterval(low, high), "A": BootstrapInterval(0.0, 1.0)})
    assert (rows[0].low, rows[0].high, rows[0].identifiable) == (low, high, known)
    assert rows[1] == fixed


NOISELESS = NoiseFloor(0.0, "cycles", 0.0, 0.0)


def sine_parts(*roles: tuple[str, str], samples: int = 400, cycles: int = 4) -> list[SegmentPart]:
    """Parts of a damper of 2 N*s/m on x = sin φ, by condition and role; the input is the stroke's rate."""
    phase = 2.0 * np.pi * cycles * np.arange(samples) / samples
    rate = 2.0 * np.pi * cycles / (samples * DT)
    velocity = rate * np.cos(phase)
    return [part(velocity[None], 2.0 * velocity, name, cycles, role) for name, role in roles]


def of_inputs(*names: str, output: str = "force", co_energy: bool = False) -> Assembly:
    assembly, _ = linear_model(*[""] * len(names))
    return replace(assembly, spec=replace(assembly.spec, inputs=names, output=output, co_energy=co_energy))


@pytest.mark.parametrize(
    ("inputs", "output", "drive"),
    [
        (("velocity", "displacement"), "force", [5.0, 7.0]),
        # the integral of what differs from the mean
        (("velocity",), "force", [-DT, 0.0]),
        (("current",), "force", None),
        (("current",), "flux", [1.0, 3.0]),
        (("angular_velocity",), "torque", [-DT, 0.0]),
    ],
)
def test_work_is_done_against_the_stroke_or_what_its_rate_adds_up_to(
    inputs: tuple[str, ...], output: str, drive: list[float] | None
) -> None:
    rows = np.array([[1.0, 3.0], [5.0, 7.0]])[: len(inputs)]
    found = work_drive(block(rows, np.zeros(2)), of_inputs(*inputs, output=output))
    assert drive is None if found is None else found == pytest.approx(drive)


def test_a_dashpot_takes_in_the_area_of_its_ellipse_each_cycle_and_a_pushing_one_is_not_passive() -> None:
    (one,) = sine_parts(("a", "train"))
    # ∮ c·ẋ dx of x = sin ωt is π·c·ω
    area = np.pi * 2.0 * 2.0 * np.pi * 4 / (400 * DT)
    assembly, output = of_inputs("velocity"), np.asarray(one.output)
    rows = [passivity_rows([one.block], [sign * output], assembly)[0] for sign in (1.0, -1.0)]
    assert [r.loop_area for r in rows] == pytest.approx([area, -area], rel=1e-3)
    assert [r.passive for r in rows] == [True, False]
    # of a co-energy the loop is traversed the other way
    (turned,) = passivity_rows([one.block], [output], of_inputs("velocity", co_energy=True))
    assert turned.loop_area == pytest.approx(-area, rel=1e-3) and not turned.passive
    # a spring does no work over a cycle, but for rounding
    (spring,) = passivity_rows([one.block], [np.asarray(work_drive(one.block, assembly))], assembly)
    assert spring.passive
    assert passivity_rows([part(np.ones((1, 50)), np.ones(50)).block], [np.ones(50)], assembly) == []


def test_errors_of_a_role_are_those_of_all_its_samples_and_not_the_mean_of_its_conditions() -> None:
    parts = [*sine_parts(("a", "train"), ("a", "train"), ("b", "holdout")), *sine_parts(("c", "train"), samples=800)]
    errors = (1.0, 3.0, 9.0, 2.0)
    simulated = [np.asarray(p.output) + e for p, e in zip(parts, errors, strict=True)]
    floors = [replace(NOISELESS, value=f) for f in (0.5, 1.5, 4.0, 1.0)]
    rows = metric_rows(Blocks(parts), floors, simulated, of_inputs("velocity"))
    assert [(r.role, r.condition, r.samples) for r in rows] == [
        *(("train", "a", 800), ("train", "c", 800), ("train", "all", 1600)),
        *(("holdout", "b", 400), ("holdout", "all", 400)),
    ]
    found = {(r.role, r.condition): (r.rmse, r.noise_floor) for r in rows}
    assert found["train", "a"] == pytest.approx((np.sqrt(5.0), np.sqrt(1.25)))
    # weighted by samples: 400 of each of the first two, 800 of the last
    assert found["train", "all"] == pytest.approx((np.sqrt(4.5), np.sqrt(1.125)))
    assert found["holdout", "all"] == pytest.approx((9.0, 4.0))


def test_samples_that_are_not_compared_have_no_error() -> None:
    (one,) = sine_parts(("a", "train"))
    lost = np.zeros(400, dtype=bool)
    lost[[10, 11, 200]] = True
    wrong = np.asarray(one.output) + np.where(lost, 1e6, 1.0)
    (row, _) = metric_rows(Blocks([replace(one, lost=lost)]), [NOISELESS], [wrong], of_inputs("velocity"))
    assert (row.samples, row.rmse) == (397, pytest.approx(1.0))


def test_the_unknown_constant_of_a_flux_record_is_told_and_in_the_output() -> None:
    assembly, _ = linear_model("")
    floating = replace(assembly, spec=replace(assembly.spec, free_offset=True))
    row = np.linspace(-1.0, 1.0, 40)
    one = block(row[None], 0.5 * row + 3.0)
    output, constant = simulate_block(one, floating, np.array([0.5]))
    assert constant == pytest.approx(3.0) and output == pytest.approx(one.target)
    assert simulate_block(one, assembly, np.array([0.5]))[1] == pytest.approx(0.0, abs=1e-12)


def uncertain(variances: list[float], open_: list[bool], degrees: float = 1e9) -> Uncertainty:
    size = len(variances)
    kept = np.diag(np.where(open_, 0.0, variances))
    return Uncertainty(kept, np.eye(size), np.array(open_), np.sqrt(variances), np.ones(size), degrees)


PARAMS = (
    Param("fy", "N", 1.0, 100.0, 10.0, "log"),
    Param("f0", "N", -10.0, 10.0, 0.0, role="offset"),
    Param("D", "m", 1.0, 2.0, 1.5, fixed=True),
)


def test_rows_of_parameters_have_intervals_on_the_scale_of_their_search_that_may_pass_a_bound() -> None:
    cube = Cube(PARAMS, np.array([0, 1]))
    quantile = quantile_95(1e9)
    rows = parameter_rows(cube, np.array([0.9, 0.5]), uncertain([0.1**2, 0.2**2], [False, False]), {"N": 500.0})
    fy, f0, held = rows
    ends = np.exp(np.log(100.0) * (0.9 + 0.1 * quantile * np.array([-1.0, 1.0])))
    assert (fy.low, fy.high) == pytest.approx(tuple(ends)) and ends[1] > 100.0
    assert (f0.low, f0.high, f0.added_to) == (pytest.approx(-4.0 * quantile), pytest.approx(4.0 * quantile), 500.0)
    assert (held.fixed, held.low, held.value, held.high) == (True, 1.5, 1.5, 1.5) and fy.added_to is None


@pytest.mark.parametrize(
    ("spread", "place", "known", "ended"),
    [(0.25, 0.5, True, False), (0.26, 0.5, False, False), (0.1, 5e-5, True, True), (0.1, 1.0 - 2e-4, True, False)],
)
def test_an_interval_as_wide_as_the_bounds_is_none_and_an_end_at_one_is_said(
    spread: float, place: float, known: bool, ended: bool
) -> None:
    found = uncertain([spread**2, 1e-6], [False, False])
    (row, *_) = parameter_rows(Cube(PARAMS, np.array([0, 1])), np.array([place, 0.5]), found)
    assert (row.identifiable, row.at_bound) == (known, ended)
    assert (row.low is not None) is known is (row.high is not None)


def test_open_directions_are_told_by_the_parameters_that_count_in_them() -> None:
    turned = np.array([[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]]).T
    found = Uncertainty(np.zeros((3, 3)), turned, np.array([False, True, False]), np.ones(3), np.ones(3), 9.0)
    params = (*PARAMS[:2], replace(PARAMS[2], fixed=False))
    told = conditioning(Cube(params, np.array([0, 1, 2])), found)
    assert (told.rank, told.parameters) == (2, 3) and told.null_directions == [{"fy": -0.6, "f0": 0.8}]
