"""Form and order of every parameter's law of current, chosen on currents held out, against laws that were planted."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mrfit.fit.stage
from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.fit.laws.choice import LawChoice
from mrfit.fit.laws.law_search import FEWEST_STROKES, folds_of
from mrfit.fit.laws.laws_of_current import dependence_of
from mrfit.fit.select import load_recordings
from mrfit.io.schemas.fit import CurrentChoice
from mrfit.io.workspace import Workspace, plain
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence
from tests.fit.benches import drive_channels, planted_segments

SINES = ((0.5, 0.002), (1.0, 0.01), (2.0, 0.008))
FIVE, BETWEEN = (0.0, 0.25, 0.5, 0.75, 1.0), (0.1, 0.6, 0.9)
NOISE = 0.003

Law = Callable[[float], dict[str, float]]


def planted(
    folder: Path,
    model: str,
    law: Law,
    currents: tuple[tuple[float, ...], tuple[float, ...]] = (FIVE, BETWEEN),
    more: Callable[[dict[str, Array]], Array] | None = None,
) -> tuple[Workspace, float]:
    """Logs of a model whose parameters follow a law of current, perhaps with a force more; and the noise's deviation.

    Of the currents the first are trained on, the others held out.
    """
    base, rng = assemble(model), np.random.default_rng(1)
    drive = "displacement" if base.spec.output == "force" else "angle"
    logs = []
    for segment in planted_segments(SINES, (*currents[0], *currents[1]), drive):
        channels = drive_channels(base.spec.output, segment)
        values = law(segment.current)
        theta = np.array([[values.get(p.name, p.start) for p in base.spec.params]])
        dt = 1 / (segment.frequency * 100)
        output = base.simulate(np.stack([channels[n] for n in base.spec.inputs]), theta, dt)[0]
        role = "train" if segment.current in currents[0] else "holdout"
        logs.append((replace(segment, role=role), channels, dt, output + (more(channels) if more else 0.0)))
    noise = NOISE * max(float(np.ptp(output)) for *_, output in logs)
    workspace = Workspace(folder)
    for segment, channels, dt, output in logs:
        measured = {**channels, base.spec.output: output + noise * rng.standard_normal(len(output))}
        name = segment.recording
        workspace.write_recording(Recording(name, name, "0", "none", dt, 0.0, measured, {}, {}, {}))
    workspace.write_segments([s for s, *_ in logs], {})
    return workspace, noise


def fitted(workspace: Workspace, model: str, order: str = "auto", **changes: Any) -> dict[str, Any]:
    settings = mrfit.fit.stage.Settings(
        model, per="all", current_order=order, name=re.sub("[^A-Za-z0-9.]", "_", f"fit-{order}")
    )
    fit = mrfit.fit.stage.run(workspace, replace(settings, **changes))
    if fit.current_choice:
        _check_objections(fit.current_choice)
    return fit


def _check_objections(choice: CurrentChoice) -> None:
    """Of every law that comes nearer than the one that was chosen, table and line say why it was not taken."""
    for row, text in zip(choice.parameters, choice.text[1:], strict=True):
        for other in row.rejected:
            assert bool(other.why) == (other.error is not None and other.error < row.error)
            assert other.why in text or not other.why or f"{other.error:.2f}" == f"{row.error:.2f}"


def held_out(fit: dict[str, Any], noise: float) -> float:
    """RMS error on all held-out currents in units of the noise."""
    return next(m.rmse for m in fit.metrics if (m.role, m.condition) == ("holdout", "all")) / noise


def orders(fit: dict[str, Any]) -> dict[str, Any]:
    return dict(fit.current_dependence.orders if fit.current_dependence else {})


def rotary(i: float) -> dict[str, float]:
    """Rotary-stiffness paper eqs. 20-24: a stiffness from -10 to 47 N*m/rad, and a shift that grows."""
    return {
        "k": -10.41 + 28.48 * i,
        "c": 0.2324 + 2.061 * i,
        "alpha": 0.7702 + 4.971 * i,
        "beta": 18.51,
        "gamma": 0.4547 + 0.2669 * i,
    }


ROTARY = (0.0, 0.5, 1.0, 1.5, 2.0), (0.25, 1.25, 1.75)
POLYNOMIALS: list[tuple[str, Law, dict[str, Any], tuple[tuple[float, ...], tuple[float, ...]]]] = [
    ("bingham", lambda i: {"fy": 100 + 1500 * i - 600 * i * i}, {"fy": 2}, (FIVE, BETWEEN)),
    ("bingham", lambda i: {"fy": 100 * 10.0**i}, {"fy": "log1"}, (FIVE, BETWEEN)),
    ("hysteretic-biviscous", lambda i: {"fy": 100 + 1500 * i - 600 * i * i}, {"fy": "plain2"}, (FIVE, BETWEEN)),
    ("tanh", lambda i: {"fy": 100 + 900 * i, "k": -4e3 + 2e4 * i}, {"fy": 1, "k": 1}, (FIVE, BETWEEN)),
    ("boucwen", lambda i: {"alpha": 100 + 1500 * i - 600 * i * i}, {"alpha": 2}, (FIVE, BETWEEN)),
    ("rotational-erf", rotary, {"k": 1, "c": 1, "alpha": 1, "gamma": 1}, ROTARY),
]


@pytest.mark.parametrize(
    ("model", "law", "expected", "currents"),
    [pytest.param(*row, marks=[pytest.mark.slow] * (row[0] != "bingham")) for row in POLYNOMIALS],
)
def test_the_planted_law_is_chosen_and_predicts_held_out_currents_as_well_as_if_it_were_told(
    tmp_path: Path, model: str, law: Law, expected: dict[str, Any], currents: Any
) -> None:
    workspace, noise = planted(tmp_path, model, law, currents)
    fit = fitted(workspace, model)
    assert orders(fit) == expected
    told = fitted(workspace, model, ",".join(f"{n}={o}" for n, o in expected.items()))
    assert held_out(fit, noise) <= 1.01 * held_out(told, noise)
    assert held_out(fit, noise) == pytest.approx(1.0, abs=0.05)
    assert fit.warnings == []


@pytest.mark.parametrize(
    "model", ["tanh", *(pytest.param(m, marks=pytest.mark.slow) for m in ("hysteretic-biviscous", "rotational-erf"))]
)
def test_parameters_that_do_not_depend_on_current_stay_constant(tmp_path: Path, model: str) -> None:
    workspace, noise = planted(tmp_path, model, lambda i: {})
    fit = fitted(workspace, model)
    assert fit.current_dependence is None
    assert {row.form for row in fit.current_choice.parameters} == {"constant"}
    assert held_out(fit, noise) == pytest.approx(1.0, abs=0.05)


def test_a_yield_force_that_saturates_is_followed_by_a_law_that_does(tmp_path: Path) -> None:
    workspace, noise = planted(tmp_path, "bingham", lambda i: {"fy": 100 + 900 * float(np.tanh(2.0 * i))})
    fit = fitted(workspace, "bingham")
    assert orders(fit) == {"fy": "sat1"}
    assert held_out(fit, noise) == pytest.approx(1.0, abs=0.05)


def test_a_yield_force_that_saturates_otherwise_is_followed_by_what_comes_nearest(tmp_path: Path) -> None:
    workspace, noise = planted(tmp_path, "bingham", lambda i: {"fy": 100 + 900 * (1 - float(np.exp(-i / 0.4)))})
    fit, by_role = fitted(workspace, "bingham"), fitted(workspace, "bingham", "fy=2,C_inf=1")
    assert orders(fit) == {"fy": 3}
    assert held_out(by_role, noise) > 2.5
    assert held_out(fit, noise) < 1.25


def test_laws_beside_a_held_effect_are_those_that_were_planted(tmp_path: Path) -> None:
    """Without it the base errs by more than noise at every current, and its parameters keep the laws of their roles."""
    workspace, _ = planted(tmp_path, "tanh", lambda i: {"fy": 100 + 900 * i}, more=lambda c: 40.0 * c["acceleration"])
    segments = workspace.read_segments()
    recordings = load_recordings(workspace, segments)

    def choice(model: str, held: dict[str, float]) -> LawChoice:
        found = dependence_of(mrfit.fit.stage.Settings(model, per="all"), segments, recordings, held)[1]
        assert found
        return found

    alone, beside = choice("tanh", {}), choice("tanh+inertia", {"inertia.m": 40.0})
    assert beside.dependence and dict(beside.dependence.orders) == {"fy": 1}
    assert not beside.errs and beside.excess == pytest.approx(1.0, abs=0.1)
    assert [c.about.text[0].partition(" by ")[0] for c in (alone, beside)] == [
        "law of current",
        "law of current beside inertia",
    ]
    assert alone.errs and alone.dependence != beside.dependence
    assert beside.theta.shape == (len(FIVE), len(assemble("tanh").spec.params))


def test_a_parameter_that_is_to_be_constant_has_no_law_though_it_depends_on_current(tmp_path: Path) -> None:
    workspace, _ = planted(tmp_path, "tanh", lambda i: {"fy": 100 + 900 * i, "a1": 50 * 4.0**i})
    segments = workspace.read_segments()
    recordings, asked = (
        load_recordings(workspace, segments),
        mrfit.fit.stage.Settings("tanh", per="all"),
    )
    free, held = (dependence_of(asked, segments, recordings, constant=names)[0] for names in ((), ("a1",)))
    assert free and dict(free.orders) == {"fy": 1, "a1": 1}
    assert held and "a1" not in dict(held.orders) and dict(held.orders)["fy"]


def table_3(i: float) -> dict[str, float]:
    """Inverse-tanh paper Table 3: below and above 0.2 A, in N, N*s/m, s/m, 1/m and N/m."""
    if i <= 0.2:
        return {
            "fy": 82.96 + 579.6 * i, "c": 710.0 + 3100.0 * i, "f0": -11.77 - 19.95 * i, "k": 270.0, "a1": 100.0,
            "a2": 65.0,
        }  # fmt: skip
    return {
        "fy": -135.7 + 1817.0 * i - 719.6 * i * i,
        "c": 840.0 + 2669.0 * i + 142.9 * i * i,
        "f0": -11.67 - 29.55 * i + 16.28 * i * i,
        "k": 270.0,
        "a1": 75.0,
        "a2": 80.0,
    }


@pytest.mark.slow
def test_a_law_in_pieces_is_met_at_no_current_and_what_cannot_be_is_said(tmp_path: Path) -> None:
    workspace, _ = planted(tmp_path, "tanh", table_3, ((0.0, 0.2, 0.4, 0.6, 0.8, 1.0), (0.3, 0.7)))
    at_zero = {}
    for order in ("auto", "fy=2,a1=2,c=1"):
        fit = fitted(workspace, "tanh", order)
        at_zero[order] = max(m.relative_rmse for m in fit.metrics if m.role == "train" and m.condition.endswith("-0A"))
        if order == "auto":
            assert [w.kind for w in fit.warnings] == ["current-levels"]
    assert at_zero["auto"] < 0.5 * at_zero["fy=2,a1=2,c=1"]


def test_two_currents_carry_a_straight_line_for_what_differs_and_the_fit_says_that_nothing_checks_it(
    tmp_path: Path,
) -> None:
    law: Law = lambda i: {"fy": 100 + 500 * i, "k": -4e3 + 2e4 * i}  # noqa: E731
    workspace, noise = planted(tmp_path, "tanh", law, ((0.0, 1.0), (0.5,)))
    fit = fitted(workspace, "tanh")
    assert orders(fit) == {"fy": 1, "k": 1}
    assert held_out(fit, noise) == pytest.approx(1.0, abs=0.05)
    [warning] = fit.warnings
    assert warning.kind == "current-levels" and "2 currents (0 A, 1 A)" in warning.text


def test_three_currents_carry_a_parabola(tmp_path: Path) -> None:
    law: Law = lambda i: {"fy": 100 + 1500 * i - 600 * i * i}  # noqa: E731
    workspace, noise = planted(tmp_path, "bingham", law, ((0.0, 0.5, 1.0), (0.25, 0.75)))
    fit = fitted(workspace, "bingham")
    assert orders(fit) == {"fy": 2}
    assert held_out(fit, noise) == pytest.approx(1.0, abs=0.05)
    assert [w.kind for w in fit.warnings] == ["current-levels"]


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        (lambda i: 100 + 900 * float(np.tanh(2.5 * i)), "sat2"),
        pytest.param(lambda i: 80 * float(np.exp(1.7 * i + 0.7 * i**2)), "log2", marks=pytest.mark.slow),
    ],
)
def test_a_law_through_three_currents_has_the_form_that_comes_nearest_without_its_last_coefficient(
    tmp_path: Path, law: Callable[[float], float], expected: str
) -> None:
    workspace, noise = planted(tmp_path, "bingham", lambda i: {"fy": law(i)}, ((0.0, 0.5, 1.0), (0.25, 0.75)))
    fit, usual = fitted(workspace, "bingham"), fitted(workspace, "bingham", "fy=plain2")
    assert orders(fit) == {"fy": expected}
    assert held_out(fit, noise) < 0.5 * held_out(usual, noise)


@pytest.mark.slow
def test_a_base_that_lacks_something_keeps_the_orders_of_its_roles_but_for_what_it_clearly_predicts_better(
    tmp_path: Path,
) -> None:
    """An inertia is missing, so that no fit comes near the noise; the stiffness still turns its sign."""
    workspace, noise = planted(
        tmp_path, "rotational-erf", rotary, ROTARY, lambda channels: 0.05 * channels["angular_acceleration"]
    )
    fit = fitted(workspace, "rotational-erf")
    by_role = fitted(workspace, "rotational-erf", "c=1,alpha=2,beta=2")
    assert held_out(by_role, noise) > 2.0 * held_out(fit, noise)
    assert orders(fit)["k"] == 1
    assert "the model's own error" in fit.current_choice.text[0]


FOUR = (0.0, 0.4, 0.8, 1.2), (0.2, 0.6, 1.0)
GROWING: Law = lambda i: {"fy": 40 + 1500 * i - 400 * i * i, "C_inf": 600 + 500 * i, "C0": 9e3 + 1.6e4 * i}  # noqa: E731


def test_a_law_far_nearer_is_taken_from_two_inner_currents_though_a_mass_is_missing(tmp_path: Path) -> None:
    workspace, noise = planted(
        tmp_path, "hysteretic-biviscous", GROWING, FOUR, lambda channels: 30.0 * channels["acceleration"]
    )
    fit = fitted(workspace, "hysteretic-biviscous")
    assert "the model's own error" in fit.current_choice.text[0]
    told = fitted(workspace, "hysteretic-biviscous", "fy=plain2,C_inf=plain1,C0=plain1")
    far = fitted(workspace, "hysteretic-biviscous", "fy=log2,C_inf=log1,C0=log1")
    assert held_out(fit, noise) < 1.1 * held_out(told, noise) < 0.75 * held_out(far, noise)
    assert orders(fit)["fy"] == "plain2"


def test_laws_that_come_alike_are_those_of_the_roles_where_the_model_errs(tmp_path: Path) -> None:
    law: Law = lambda i: {"fy": 200 + 700 * i - 150 * i * i, "C_inf": 800 + 400 * i}  # noqa: E731
    workspace, _ = planted(tmp_path, "bingham", law, more=lambda channels: 2e4 * channels["displacement"])
    fit = fitted(workspace, "bingham")
    assert orders(fit) == {"fy": 2, "C_inf": 1}
    assert not re.search(r"(log|plain|sat)\d", "".join(fit.current_choice.text[1:]))


@pytest.mark.parametrize(
    ("slow_only", "expected"), [(False, {"fy": 2, "C_inf": 1, "vy": 2}), (True, {"fy": 2, "C_inf": 1})]
)
def test_a_law_of_the_knee_is_taken_only_where_a_stroke_at_every_current_passes_the_knee(
    tmp_path: Path, slow_only: bool, expected: dict[str, Any]
) -> None:
    """A stiffness is missing, so that the laws are those of the roles; the slow stroke stays below the knee."""
    law: Law = lambda i: {"fy": 250 + 900 * i - 200 * i * i, "vy": 0.02, "C_inf": 3e3}  # noqa: E731
    workspace, _ = planted(
        tmp_path, "biviscous", law, ((0.0, 0.5, 1.0), ()), lambda channels: 5e3 * channels["displacement"]
    )
    fast = [s.id for s in workspace.read_segments() if s.current == 0.5 and s.frequency > 0.5]
    if slow_only:
        segments = [replace(s, role="holdout" if s.id in fast else "train") for s in workspace.read_segments()]
        workspace.write_segments(segments, {})
    assert orders(fitted(workspace, "biviscous")) == expected


def test_what_the_user_fixes_or_asks_for_is_not_chosen(tmp_path: Path) -> None:
    law: Law = lambda i: {"fy": 100 + 900 * i, "C_inf": 800 + 600 * i}  # noqa: E731
    workspace, _ = planted(tmp_path, "bingham", law)
    fixed = fitted(workspace, "bingham", fixed=(("C_inf", 1000.0),))
    assert "C_inf" not in orders(fixed) and orders(fixed)["fy"] >= 1
    assert all(row.names != ["C_inf"] for row in fixed.current_choice.parameters)
    asked = fitted(workspace, "bingham", "fy=log2")
    assert orders(asked) == {"fy": "log2"} and asked.current_choice is None


def test_laws_of_a_current_that_never_rests_are_told_as_those_of_roles() -> None:
    dependence = CurrentDependence((("fy", 2), ("c", 1)), 0.0, 2.0)
    moved = SimpleNamespace(choice=None, dependence=dependence)
    said = mrfit.fit.stage._laws_chosen(mrfit.fit.stage.Settings("tanh", per="all"), moved)
    assert said.judged_by == "roles" and "(fy=2,c=1): no currents could be held out" in said.text[0]
    assert (
        mrfit.fit.stage._laws_chosen(mrfit.fit.stage.Settings("tanh", per="all", current_order="fy=2,c=1"), moved)
        is None
    )
    assert (
        mrfit.fit.stage._laws_chosen(
            mrfit.fit.stage.Settings("tanh", per="all"), SimpleNamespace(choice=None, dependence=None)
        )
        is None
    )


def test_the_choice_and_what_was_rejected_are_told_and_the_same_every_time(tmp_path: Path) -> None:
    workspace, _ = planted(tmp_path, "bingham", lambda i: {"fy": 100 + 1500 * i - 600 * i * i})
    fit = fitted(workspace, "bingham")
    rows = {row.names[0]: row for row in fit.current_choice.parameters}
    assert rows["fy"].form == "plain" and rows["fy"].order == 2
    rejected = {(r.form, r.order): r.error for r in rows["fy"].rejected}
    assert rejected["plain", 1] > 3.0 * rows["fy"].error and rejected["log", 2] > 3.0
    assert any(t.startswith("fy: parabola, 1") and "; not taken: " in t for t in fit.current_choice.text)
    again = fitted(workspace, "bingham", name="again")
    assert plain(again.current_choice) == plain(fit.current_choice)


@given(st.lists(st.integers(1, 6), min_size=1, max_size=8))
def test_folds_leave_out_every_condition_that_others_can_predict(conditions: list[int]) -> None:
    places, levels = np.repeat(np.arange(len(conditions)), conditions), len(conditions)
    by_level, by_test = folds_of(places, levels)
    assert len(by_level) == (levels - 2 if levels >= 4 else 0)
    for fold in (*by_level, *by_test):
        assert sorted([*fold.known, *fold.judged]) == list(range(len(places)))
    for fold in by_test:
        assert set(places[fold.known]) == set(range(levels))
    judged = np.concatenate([f.judged for f in by_test]) if by_test else np.empty(0)
    several = [k for k in range(len(places)) if conditions[places[k]] > 1]
    assert sorted(judged) == (several if max(conditions) >= FEWEST_STROKES else [])


def test_of_two_strokes_at_every_current_none_is_left_out() -> None:
    by_level, by_test = folds_of(np.repeat(np.arange(5), 2), 5)
    assert len(by_level) == 3 and by_test == []


def test_folds_shift_from_level_to_level_so_that_a_stroke_left_out_at_one_is_known_at_another() -> None:
    _, by_test = folds_of(np.repeat(np.arange(3), 3), 3)
    assert [(f.judged % 3).tolist() for f in by_test] == [[0, 2, 1], [1, 0, 2], [2, 1, 0]]
