"""Which parameters are drawn over a quantity, joined where nothing else differs, and with which bands."""

from dataclasses import replace

import numpy as np
import pytest

from mrfit.errors import DataError
from mrfit.io.schemas.fit import Band, Fit, Level, Profile, Quantity, Result
from mrfit.report import parameter_figure
from mrfit.report.parameter_figure import _levels, parameters, quantity_of
from mrfit.report.profile_figure import TALLEST, has_profiles, profiles
from mrfit.report.svg import style
from tests.fit.benches import planted_segments

Tests = list[tuple[str, float | None, float | None, float | None]]


def fit_of(tests: Tests, name: str = "a") -> Fit:
    """A fit of conditions, whose yield force is a hundred times its current and whose offset is held."""
    results = []
    for condition, frequency, amplitude, current in tests:
        value = 100.0 * (current or 0.0)
        fy = Quantity(name="fy", value=value, unit="N", text="yield force", low=value - 1.0, high=value + 1.0)
        held = Quantity(name="f0", value=0.0, unit="N", fixed=True)
        at = Level(frequency=frequency, amplitude=amplitude, current=current)
        results.append(Result(condition=condition, at=at, evaluations=1, parameters=[fy, held]))
    return Fit(name=name, model="bingham", optimizer="lsq", output="force", results=results, metrics=[])


SLOW: Tests = [("s2", 1.0, 0.01, 2.0), ("s0", 1.0, 0.01, 0.0), ("s1", 1.01, 0.0102, 1.0)]
FAST: Tests = [("f0", 3.0, 0.01, 0.0), ("f2", 3.0, 0.01, 2.0)]


def lines(fit: Fit, over: str, **temperatures: float) -> dict[str, list[tuple[str, list[float], list[float]]]]:
    (one,) = planted_segments(((1.0, 0.01),), (1.0,))
    segments = [replace(one, condition=name, temperature=t) for name, t in temperatures.items()]
    found = parameter_figure._lines([fit], segments, over)
    return {n: [(x.label, x.places, [q.value for q in x.quantities]) for x in own] for n, own in found.items()}


def test_conditions_that_differ_in_the_quantity_alone_are_joined_in_its_order() -> None:
    # a rig does not keep frequency and amplitude exactly
    assert lines(fit_of(SLOW), "current") == {"fy": [("", [0.0, 1.0, 2.0], [0.0, 100.0, 200.0])]}
    found = lines(fit_of([*SLOW, *FAST]), "current")
    assert found == {"fy": [("1 Hz", [0.0, 1.0, 2.0], [0.0, 100.0, 200.0]), ("3 Hz", [0.0, 2.0], [0.0, 200.0])]}
    # a current that moves is no level, and a condition alone is no line
    moving: Tests = [("m", 1.0, 0.01, None), ("n", 5.0, 0.01, 1.0)]
    assert lines(fit_of([*SLOW, *moving]), "current") == lines(fit_of(SLOW), "current")
    assert lines(fit_of(moving), "current") == {}


def test_lines_are_told_apart_by_what_differs_among_them() -> None:
    labels = [label for label, *_ in lines(fit_of([*SLOW, *FAST]), "frequency")["fy"]]
    assert labels == ["2 A", "0 A"]
    wide: Tests = [("w0", 3.0, 0.02, 0.0), ("w2", 3.0, 0.02, 2.0)]
    labels = [label for label, *_ in lines(fit_of([*SLOW, *FAST, *wide]), "current")["fy"]]
    assert labels == ["1 Hz, amplitude 0.01", "3 Hz, amplitude 0.01", "3 Hz, amplitude 0.02"]


def test_a_temperature_is_the_mean_of_a_conditions_segments_that_know_it() -> None:
    tests: Tests = [("cold", 1.0, 0.01, 1.0), ("warm", 1.0, 0.01, 1.0), ("unknown", 1.0, 0.01, 1.0)]
    assert lines(fit_of(tests), "temperature", warm=60.0, cold=20.0, unknown=float("nan")) == {
        "fy": [("", [20.0, 60.0], [100.0, 100.0])]
    }


def test_levels_are_apart_by_more_than_what_a_rig_errs() -> None:
    assert _levels([1.0, None, 1.04, 2.0, 1.0, 0.0]) == pytest.approx([0.0, (1.0 + 1.0 + 1.04) / 3, 2.0])
    assert _levels([1.0, 1.06]) == [1.0, 1.06]
    # each within 5 % of the one before it, but not of the first
    assert _levels([1.0, 1.04, 1.08]) == pytest.approx([1.02, 1.08])


def joint() -> Fit:
    current = [0.0, 1.0, 1.0, 2.0]
    value, half = np.array([0.0, 100.0, 150.0, 200.0]), 5.0
    ends = [(value + k * half).tolist() for k in (-1.0, 1.0, -2.0, 2.0)]
    names = ("low", "high", "low_everywhere", "high_everywhere")
    band = Band(name="fy", current=current, value=value.tolist(), **dict(zip(names, ends, strict=True)))
    nodes = [
        Quantity(name=f"fy@{i:g}A", value=100.0 * i, unit="N", text=f"yield force at {i:g} A", low=90.0 * i)
        for i in (0.0, 2.0)
    ]
    alone = Quantity(name="c", value=9.0, unit="N*s/m")
    result = Result(condition="all", evaluations=1, parameters=[*nodes, alone], bands=[band])
    return Fit(name="joint", model="tanh", optimizer="lsq", per="all", output="force", results=[result], metrics=[])


def test_of_a_joint_fit_the_curve_is_the_models_parted_at_a_jump_and_its_nodes_have_bars() -> None:
    fit = joint()
    assert quantity_of(fit, []) == "current" and quantity_of(fit_of([("a", 1.0, 0.01, 1.0)]), []) == ""
    assert quantity_of(fit_of([("a", 1.0, 0.01, 1.0), ("b", 2.0, 0.01, 1.0)]), []) == "frequency"
    with style():
        canvas = parameters([fit], [], "current", 3.5)
    (axes,) = [a for a in canvas.axes if a.get_title(loc="left")]
    assert axes.get_title(loc="left") == "Yield force, fy (N)"
    curves = [line.get_xydata().tolist() for line in axes.lines if line.get_linewidth() == 0.9]
    assert curves == [[[0.0, 0.0], [1.0, 100.0]], [[1.0, 150.0], [2.0, 200.0]]]
    bands = sorted(p.get_paths()[0].vertices[:, 1].min() for p in axes.collections if len(p.get_paths()) == 1)
    assert bands[:2] == [-10.0, -5.0]
    assert canvas.get_supxlabel() == "Current (A)"


def test_what_has_no_several_values_cannot_be_drawn() -> None:
    with pytest.raises(DataError, match="a: no parameter has several values over current; fit per condition"):
        parameters([fit_of([("a", 1.0, 0.01, 1.0)])], [], "current", 3.5)
    with pytest.raises(DataError, match="a: no profile likelihood was computed; fit with --intervals profile"):
        profiles([fit_of(SLOW)], 3.5)
    assert not has_profiles(fit_of(SLOW))


def test_a_profile_is_a_parabola_through_what_was_computed_and_a_line_at_its_quantile() -> None:
    values = np.array([3.0, -2.0, 0.0, 1.0, 2.0])
    profile = Profile(name="fy", values=values.tolist(), rises=np.abs(values).tolist(), quantile=2.0)
    quantity = Quantity(name="fy", value=0.0, unit="N", text="yield force", low=-2.0, high=None)
    result = Result(condition="all", evaluations=1, parameters=[quantity], profiles=[profile])
    fit = Fit(name="p", model="bingham", optimizer="lsq", output="force", results=[result], metrics=[])
    assert has_profiles(fit)
    with style():
        canvas = profiles([fit], 3.5)
    (axes,) = [a for a in canvas.axes if a.lines]
    curve = next(line for line in axes.lines if len(line.get_xdata()) > 50)
    x, y = np.asarray(curve.get_xdata()), np.asarray(curve.get_ydata())
    assert y == pytest.approx(x**2, abs=1e-6) and x[0] == -2.0 and x[-1] == 3.0
    flat = [line.get_ydata()[0] for line in axes.lines if line.get_linestyle() == "--" or line.get_linewidth() == 0.7]
    assert flat == [4.0] and axes.get_ylim() == pytest.approx((0.0, 4.0 * TALLEST))
    # of an open end no mark is drawn
    assert [line.get_xdata()[0] for line in axes.lines if line.get_linewidth() == 0.6] == [-2.0]
