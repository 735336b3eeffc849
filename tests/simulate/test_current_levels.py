"""Joint fits over current: which parameters vary, where the search starts, and that planted polynomials come back."""

import itertools
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mrfit.fit.stage
from mrfit.cli.config import read_pipeline
from mrfit.core.recording import Recording
from mrfit.errors import ConfigError, DataError
from mrfit.fit.predict import predict
from mrfit.fit.select import read_dataset
from mrfit.io.schemas.fit import Fit, FitDependence
from mrfit.io.schemas.reading import of_json
from mrfit.io.workspace import Workspace, write_json
from mrfit.models import bingham, boucwen, polynomial, tanh
from mrfit.search.cube import cube_of
from mrfit.search.starts import data_starts, to_points
from mrfit.simulate import current_levels
from mrfit.simulate.assembly import assemble
from mrfit.simulate.at_current import at_current, through
from mrfit.simulate.current_dependence import CurrentDependence
from mrfit.simulate.current_levels import (
    assembly_of,
    default_orders,
    dependence_on_current,
    level_of,
    levels_of,
    piece_warnings,
    recorded_range,
    sign_warnings,
    to_choose,
)
from tests.fit.benches import Bench, planted_segments, write_workspace

LEVELS = (0.0, 0.5, 1.0)
# fy = 100 + 500 i + 400 i² N, C_inf = 800 + 600 i N*s/m, f0 = 12 N
TRUTH = {"fy@0A": 100.0, "fy@0.5A": 450.0, "fy@1A": 1000.0, "C_inf@0A": 800.0, "C_inf@1A": 1400.0, "f0": 12.0}
PLANTED = CurrentDependence((("fy", 2), ("C_inf", 1)), 0.0, 1.0)
SINES = ((2.0, 0.005), (1.0, 0.02))


def a_workspace(folder: Path, levels: tuple[float, ...] = LEVELS, noise: float = 0.01) -> Workspace:
    bench = Bench(assemble("bingham", PLANTED), np.array(list(TRUTH.values())), noise, 3)
    return write_workspace(folder, bench, SINES, levels)


def fitted(workspace: Workspace, **changes: Any) -> dict[str, Any]:
    settings = mrfit.fit.stage.Settings(model="bingham", per="all")
    return mrfit.fit.stage.run(workspace, replace(settings, **changes))


def test_polynomials_of_current_that_were_planted_come_back_within_their_intervals(tmp_path: Path) -> None:
    fit = fitted(a_workspace(tmp_path))
    assert fit.current_dependence == FitDependence(orders={"fy": 2, "C_inf": 1}, low=0.0, high=1.0)
    found = {p.name: p for p in fit.results[0].parameters}
    assert list(found) == list(TRUTH)
    for name, value in TRUTH.items():
        half = (found[name].high - found[name].low) / 2
        assert abs(found[name].value - value) <= 2 * half, name
        assert 2 * half < 0.25 * value, name
    powers = {d.name: d.value for d in fit.results[0].derived}
    assert powers["fy.i1"] == pytest.approx(500.0, rel=0.05)
    assert powers["fy.i2"] == pytest.approx(400.0, rel=0.05)
    noise = next(m for m in fit.metrics if m.condition == "all")
    assert noise.rmse <= 1.05 * noise.noise_floor


def test_a_saved_generalised_fit_predicts_a_current_it_has_not_seen(tmp_path: Path) -> None:
    fit = fitted(a_workspace(tmp_path / "train"))
    write_json(tmp_path / "fit.json", fit)
    other = a_workspace(tmp_path / "other", levels=(0.25, 0.75))
    rows = predict(fit, read_dataset(other)).metrics
    assert rows[-1].role == "predict"
    assert rows[-1].rmse <= 1.05 * rows[-1].noise_floor
    assert assembly_of(fit).spec.names == tuple(TRUTH)


def test_the_first_phase_is_kept_with_the_fit(tmp_path: Path) -> None:
    fit = fitted(a_workspace(tmp_path))
    levels = fit.results[0].per_current
    assert [level["current"] for level in levels] == pytest.approx(LEVELS, abs=1e-9)
    assert [level["fy"] for level in levels] == pytest.approx([100.0, 450.0, 1000.0], rel=0.05)


def test_without_a_dependence_one_set_of_parameters_serves_all_currents(tmp_path: Path) -> None:
    fit = fitted(a_workspace(tmp_path), current_order="0")
    assert fit.current_dependence is None
    assert [p.name for p in fit.results[0].parameters] == ["fy", "C_inf", "f0"]
    assert next(m.nrmse for m in fit.metrics if m.condition == "all") > 0.05


def test_bounds_and_fixed_values_of_a_parameter_go_to_all_its_nodes_or_to_one(tmp_path: Path) -> None:
    fixed = (("C_inf", 900.0), ("fy@0A", 100.0))
    fit = fitted(a_workspace(tmp_path), fixed=fixed, bounds=(("fy", 10.0, 700.0),), current_order="fy=2,C_inf=1")
    found = {p.name: p for p in fit.results[0].parameters}
    assert found["C_inf@0A"].value == found["C_inf@1A"].value == 900.0
    assert found["fy@0A"].fixed and not found["fy@1A"].fixed
    assert found["fy@1A"].bound_high == 700.0 and found["fy@1A"].at_bound


def test_a_fixed_parameter_does_not_vary_by_default() -> None:
    assert default_orders(bingham.SPEC, 3, ["fy"]) == (("C_inf", 1),)
    # held at one current it varies between the others
    assert default_orders(bingham.SPEC, 3, ["fy@0A"]) == default_orders(bingham.SPEC, 3)


def test_default_orders_grow_with_the_levels_and_spare_signed_parameters_and_offsets() -> None:
    assert default_orders(bingham.SPEC, 1) == ()
    assert default_orders(bingham.SPEC, 2) == (("fy", 1), ("C_inf", 1))
    orders = dict(default_orders(tanh.SPEC, 5))
    assert orders == {"fy": 2, "a1": 2, "c": 1}
    assert dict(default_orders(boucwen.SPEC, 5))["beta"] == 1
    coefficients = dict(default_orders(polynomial.SPEC, 5))
    assert coefficients["a0"] == 2 and "v_max" not in coefficients


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"current_order": "5"}, "takes 0 to 4"),
        ({"current_order": "nosuch=1"}, "no parameter 'nosuch'"),
        ({"current_order": "fy=1:0.2"}, "in pieces 1:0.2:2"),
        ({"current_order": "2", "per": "condition"}, "--per all"),
        ({"current_order": "2", "model": "boucwen-flux"}, "predicts flux"),
        ({"bounds": (("nosuch", 0.0, 1.0),)}, "no parameter 'nosuch'"),
    ],
)
def test_an_order_no_data_could_make_right_is_refused_before_any_are_read(
    changes: dict[str, Any], message: str
) -> None:
    settings = replace(mrfit.fit.stage.Settings(model="bingham", per="all"), **changes)
    with pytest.raises(ConfigError, match=message):
        mrfit.fit.stage.check(settings)


def test_an_order_the_levels_do_not_carry_is_refused_with_what_there_is(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"3 needs training tests at 4 currents, there are 3 \(0 A, 0.5 A, 1 A\)"):
        fitted(a_workspace(tmp_path), current_order="3")


# inverse-tanh paper Table 3's form: two orders, a bend or a jump between them, at 0.5 A
PIECES = CurrentDependence((("fy", "1:0.5:2"), ("C_inf", "0/0.55/1")), 0.0, 1.5)
BENT = {"fy@0A": 80.0, "fy@0.5A": 200.0, "fy@1A": 700.0, "fy@1.5A": 850.0}
STEPPED = {"C_inf@0.275A": 700.0, "C_inf@0.55A+": 1300.0, "C_inf@1.5A": 1900.0}
SIX_LEVELS = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5)


def test_pieces_that_were_planted_come_back_and_predict_currents_not_seen(tmp_path: Path) -> None:
    truth = np.array([*BENT.values(), *STEPPED.values(), 12.0])
    bench = Bench(assemble("bingham", PIECES), truth, 0.01, 3)
    workspace = write_workspace(tmp_path / "train", bench, SINES, SIX_LEVELS)
    fit = fitted(workspace, current_order="fy=1:0.5:2,C_inf=0/0.55/1")
    assert fit.current_dependence.orders == {"fy": "1:0.5:2", "C_inf": "0/0.55/1"}
    found = {p.name: p for p in fit.results[0].parameters}
    assert list(found) == [*BENT, *STEPPED, "f0"]
    for name, value in (BENT | STEPPED).items():
        half = (found[name].high - found[name].low) / 2
        assert abs(found[name].value - value) <= 2 * half < 0.3 * value, name
    powers = {d.name: d.value for d in fit.results[0].derived}
    assert powers["fy(0..0.5A).i1"] == pytest.approx(240.0, rel=0.05)
    assert powers["fy(0.5..1.5A).i2"] == pytest.approx(-700.0, rel=0.05)
    assert powers["C_inf(0..0.55A).i0"] == found["C_inf@0.275A"].value
    whole = next(m for m in fit.metrics if m.condition == "all")
    assert whole.rmse <= 1.05 * whole.noise_floor
    write_json(tmp_path / "fit.json", fit)
    stored = of_json(Fit, (tmp_path / "fit.json").read_bytes())
    assert assembly_of(stored).spec.names == tuple(found)
    other = write_workspace(tmp_path / "other", replace(bench, seed=4), SINES, (0.1, 0.6, 1.2))
    assert (row := predict(stored, read_dataset(other)).metrics[-1]).rmse <= 1.05 * row.noise_floor


@pytest.mark.parametrize(
    ("order", "message"),
    [
        ("fy=0/0.7/1", r"fy=0/0.7/1: a piece of order m needs .* there are 3 \(0 A, 0.5 A, 1 A\): move the break"),
        ("fy=1:0.5:2", r"needs training tests at 4 currents, there are 3"),
        ("fy=1:3:1", "3 A is not inside the tested range, 0 to 1 A"),
    ],
)
def test_pieces_the_levels_do_not_carry_are_refused_with_the_piece(tmp_path: Path, order: str, message: str) -> None:
    with pytest.raises(DataError, match=message):
        fitted(a_workspace(tmp_path), current_order=order)


def test_levels_are_the_training_segments_alone() -> None:
    segments = planted_segments(SINES, (0.0, 0.5, 0.505, 2.0))
    segments = [replace(s, role="holdout") if s.current == 2.0 else s for s in segments]
    assert levels_of(segments) == pytest.approx([0.0, 0.5025])
    recordings = {s.recording: _Silent() for s in segments}
    dependence = dependence_on_current("bingham", "auto", segments, recordings, ())  # type: ignore[arg-type]
    assert dependence is not None and dependence.high == pytest.approx(0.5025)
    held_out = ", ".join(dict.fromkeys(s.condition for s in segments if s.role == "holdout"))
    for order in ("fy=2", "fy=0/0.3/1"):
        with pytest.raises(DataError, match=re.escape(f"held out: {held_out} (mrfit segment --holdout none")):
            dependence_on_current("bingham", order, segments, recordings, ())  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("currents", "levels"),
    [
        # 0.02 A, or 3 % of the larger current, from the first of a level
        ((0.0, 0.0199), (0.00995,)),
        ((0.0, 0.0201), (0.0, 0.0201)),
        ((2.0, 2.06), (2.03,)),
        ((2.0, 2.063), (2.0, 2.063)),
        ((2.0, 2.05, 2.1), (2.025, 2.1)),
        ((-2.05, -2.0), (-2.025,)),
        ((-2.07, -2.0), (-2.07, -2.0)),
    ],
)
def test_currents_that_a_supply_holds_alike_are_one_level(
    currents: tuple[float, ...], levels: tuple[float, ...]
) -> None:
    segments = [replace(s, role="train") for s in planted_segments(SINES[:1], currents)]
    assert levels_of(reversed(segments)) == pytest.approx(list(levels))
    assert [level_of(s, levels) for s in segments] == [min(levels, key=lambda i: abs(i - s.current)) for s in segments]


def test_a_segment_without_a_held_current_is_at_no_level() -> None:
    (segment,) = planted_segments(SINES[:1], (1.0,))
    assert np.isnan(level_of(replace(segment, current=np.nan), [1.0])) and np.isnan(level_of(segment, []))


@pytest.mark.parametrize(
    ("model", "text", "levels", "chosen"),
    [
        ("bingham", "auto", (0.0, 1.0), True),
        ("bingham+inertia", "auto", (0.0, 1.0), True),
        ("bingham", "auto", (1.0,), False),
        ("bingham", "1", (0.0, 1.0), False),
        # a coil, whose current is an input
        ("boucwen-flux", "auto", (0.0, 1.0), False),
    ],
)
def test_orders_are_chosen_where_none_is_asked_for_and_two_levels_were_held(
    model: str, text: str, levels: tuple[float, ...], chosen: bool
) -> None:
    segments = [replace(s, role="train") for s in planted_segments(SINES[:1], levels)]
    currents = current_levels.tested_currents(segments, {s.recording: _Silent() for s in segments})  # type: ignore[misc]
    assert to_choose(model, text, currents) is chosen


def test_the_recorded_range_is_over_all_recordings_that_have_a_current() -> None:
    def recording(**channels: Any) -> Recording:
        return Recording("r", "r.csv", "", "delimited", 1e-3, 0.0, channels, {})

    two = {"a": recording(current=np.array([0.5, 2.0])), "b": recording(current=np.array([-1.0, 0.0]))}
    assert recorded_range({**two, "c": recording(force=np.ones(2))}) == (-1.0, 2.0)
    assert np.isnan(recorded_range({"c": recording(force=np.ones(2))})).all()


class _Silent:
    channels: dict[str, Any] = {}


def test_a_current_switched_on_and_off_gives_two_levels_whatever_spikes_the_switch_makes() -> None:
    switched = np.repeat(np.random.default_rng(0).integers(0, 2, 200), 50) * 2.25
    switched[np.arange(2, 10_000, 1000)] = 9.0
    found = _dependence_on(switched)
    assert found is not None
    assert dict(found.orders) == {"fy": 1, "C_inf": 1}
    assert (found.low, found.high) == (0.0, 2.25)


def test_a_current_that_wanders_carries_higher_orders_and_one_at_rest_none() -> None:
    wandering = _dependence_on(1.0 + np.sin(np.arange(10_000) / 300.0))
    assert wandering is not None and dict(wandering.orders)["fy"] == 2
    assert _dependence_on(np.full(10_000, 1.0)) is None


def _dependence_on(current: np.ndarray) -> CurrentDependence | None:
    segment = replace(planted_segments(SINES, (0.0,))[0], recording="r", start=0, stop=len(current), current=np.nan)
    recording = Recording("r", "r.csv", "", "delimited", 1e-3, 0.0, {"current": current}, {"current": "A"})
    return dependence_on_current("bingham", "auto", [replace(segment, role="train")], {"r": recording}, ())


def test_a_polynomial_through_the_levels_is_met_at_the_levels() -> None:
    currents = np.array([0.0, 0.4, 1.0])
    table = np.array([[100.0, 900.0, 5.0], [300.0, 950.0, 6.0], [900.0, 1100.0, 5.5]])
    dependence = CurrentDependence((("fy", 2),), 0.0, 1.0)
    nodes = through(bingham.SPEC, dependence, currents, table)
    assert at_current(bingham.SPEC, dependence, nodes[None, :], currents)[0, 0] == pytest.approx(table[:, 0])
    assert nodes[3:] == pytest.approx([950.0, 5.5])


def test_a_yield_force_that_turns_negative_between_the_currents_is_said() -> None:
    dependence = CurrentDependence((("fy", 2),), 0.0, 1.0)
    # 100 N at 0, 10 at 0.5 and 400 at 1 A: a parabola with its least value at 0.31 A
    dipping, rising = np.array([100.0, 10.0, 400.0, 900.0, -5.0]), np.array([100.0, 200.0, 400.0, 900.0, -5.0])
    [warning] = sign_warnings("bingham", dependence, dipping)
    assert warning.kind == "negative-between" and warning.text.startswith("fy turns negative")
    assert sign_warnings("bingham+inertia", dependence, np.array([*rising, 3.0])) == []
    assert sign_warnings("bingham", CurrentDependence((("fy", "log2"),), 0.0, 1.0), dipping) == []
    assert sign_warnings("bingham", None, dipping[2:]) == []


@pytest.mark.parametrize(
    ("order", "stays", "said"),
    [
        ("1/0.2/2", (0.0, 0.5, 1.2, 2.0), True),  # a line below 0.2 A from the current 0 A alone
        ("1/0.2/2", (0.0, 0.1, 0.5, 1.2, 2.0), False),
        ("1:0.2:2", (0.0, 0.5, 1.2, 2.0), False),  # the pieces meet, so that the one above gives the value at 0.2 A
        ("1:0.2:2", (0.0, 1.2, 2.0), True),
        (2, (0.0, 2.0), False),  # no pieces: the order is another's matter
    ],
)
def test_a_piece_that_a_moving_current_only_passes_through_is_said(order, stays, said) -> None:
    ramps = [np.linspace(a, b, 5) for a, b in itertools.pairwise(stays)]
    moving = np.concatenate([*(np.full(1000, level) for level in stays), *ramps])
    dependence = CurrentDependence((("fy", order),), 0.0, 2.0)
    warnings = piece_warnings(dependence, current_levels.TestedCurrents([], [moving], 0.0, 2.0))
    assert [w.kind for w in warnings] == ["piece-untested"] * said
    assert not said or f"fy={order}" in warnings[0].text
    # held currents are checked as they are read
    assert piece_warnings(dependence, current_levels.TestedCurrents(list(stays), [], 0.0, 2.0)) == []


def test_data_driven_starts_leave_out_what_the_user_gave_and_stay_inside_bounds(tmp_path: Path) -> None:
    workspace = a_workspace(tmp_path)
    settings = mrfit.fit.stage.Settings(model="bingham", per="all")
    prepared = mrfit.fit.stage.prepare(read_dataset(workspace), settings)
    group = mrfit.fit.stage.build_group(
        "all", prepared.groups["all"], prepared.recordings, prepared.assembly, split=False
    )
    [found] = data_starts(group.training, assemble("bingham"), prepared.dependence, ["C_inf"])
    assert set(found) == {"fy@0A", "fy@0.5A", "fy@1A", "f0"}
    assert found["fy@1A"] == pytest.approx(1000.0, rel=0.05)
    cube = cube_of(prepared.assembly.spec, {"fy": (1.0, 500.0)}, {}, {})
    points = to_points(cube, [{}, found])
    assert points.shape == (2, 6) and points.min() >= 0.0 and points.max() <= 1.0
    assert cube.to_theta(points)[1, 2] == pytest.approx(500.0)


def test_a_pipeline_file_holds_order_and_choice_of_segments(tmp_path: Path) -> None:
    text = "[ingest]\nlogs = ['*.csv']\n[[fit]]\nmodel = 'tanh'\nper = 'all'\ncurrent_order = {}\nonly = 'MH'\n"
    for written, meant in (("2", "2"), ("'fy=2,c=1'", "fy=2,c=1"), ("'auto'", "auto")):
        file = tmp_path / "p.toml"
        file.write_text(text.format(written))
        section = read_pipeline(file).fit[0]
        assert (str(section.current_order), section.only) == (meant, "MH")
