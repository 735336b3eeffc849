"""Tables of a fit: linear between breakpoints, the middle of a loop, the current that gives an output."""

import csv
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.export.lookup import Axis, LookupTable, drive_of, files, forward, inverted, of_inverse
from mrfit.settings.export import Settings
from mrfit.simulate.current_dependence import CurrentDependence
from tests.export.rigs import rig


def table(*axes: Array, values: Array | None = None) -> LookupTable:
    names = ("velocity", "current", "temperature")
    found = np.random.default_rng(1).normal(size=[len(a) for a in axes]) if values is None else values
    return LookupTable("force", tuple(Axis(n, np.asarray(a, float)) for n, a in zip(names, axes, strict=False)), found)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_table_is_linear_between_uneven_breakpoints_and_held_beyond(count: int) -> None:
    axes = [np.array([-1.0, -0.2, 0.0, 0.5, 2.0]), np.array([0.0, 0.3, 1.0]), np.array([10.0, 60.0])][:count]
    one = table(*axes)
    points = np.random.default_rng(2).uniform(-3.0, 80.0, (200, count)) * [1.0, 0.04, 1.0][:count]
    held = np.clip(points, [a[0] for a in axes], [a[-1] for a in axes])
    wanted = RegularGridInterpolator(axes, one.values)(held)
    np.testing.assert_allclose(one(*points.T), wanted, rtol=1e-12, atol=1e-12)
    grid = np.meshgrid(*axes, indexing="ij")
    np.testing.assert_allclose(one(*(g.ravel() for g in grid)), one.values.ravel(), rtol=1e-12)


def test_an_axis_of_one_breakpoint_does_not_matter() -> None:
    one = table(np.array([0.0, 1.0]), np.array([0.7]), values=np.array([[2.0], [4.0]]))
    np.testing.assert_allclose(one(np.array([0.5, 9.0]), np.array([-5.0, 5.0])), [3.0, 4.0])


def test_the_drive_of_a_table_is_a_velocity_even_where_the_model_derives_it() -> None:
    assert drive_of(rig("tanh+inertia", seconds=0.05)) == "velocity"
    assert drive_of(rig("rotational-erf", seconds=0.05)) == "angular_velocity"
    assert drive_of(rig("boucwen-flux", seconds=0.05)) == "current"


def test_breakpoints_are_closest_in_the_middle_of_the_drive_and_even_over_current() -> None:
    source = rig("biviscous", CurrentDependence((("fy", 1),), 0.1, 1.5), seconds=0.3)
    velocity, current = forward(source).axes
    low, high = source.ranges["velocity"]
    assert velocity.at[[0, 30, 60]] == pytest.approx([low, 0.5 * (low + high), high], abs=1e-12)
    steps = np.diff(velocity.at)
    assert np.all(np.diff(steps[:30]) < 0.0) and np.all(np.diff(steps[30:]) > 0.0)
    # sinh(3 x) is 10 times as steep at its ends as in the middle
    assert 8.0 < steps[0] / steps[30] < math.cosh(3.0)
    np.testing.assert_allclose(np.diff(current.at), np.ptp(current.at) / 16.0, rtol=1e-9)
    assert (current.at[0], current.at[-1]) == source.ranges["current"]


def test_a_current_that_rests_has_one_breakpoint_and_no_inverse() -> None:
    source = rig("hw-static", seconds=0.3)
    (log,) = source.stretches
    still = {**log.inputs, "current": np.full(len(log.measured), 0.6)}
    resting = replace(source, stretches=(replace(log, inputs=still),))
    own = forward(resting)
    assert [a.name for a in own.axes] == ["velocity", "current"] and own.axes[1].at.tolist() == [0.6]
    assert inverted(resting, own) is None
    made = files(resting, Settings())
    assert not any("inverse.csv" in name for name in made.contents) and len(made.said) == 2


def test_a_table_needs_logs() -> None:
    source = replace(rig("biviscous", seconds=0.05), stretches=())
    with pytest.raises(DataError, match="^biviscous: its logs are not at hand, and with them the ranges"):
        forward(source)


def test_a_stroke_gives_the_sine_its_frequency() -> None:
    # F = c v + k x: on a sine both branches lie k x either side of c v, whatever the frequency
    source = rig("dahl", seconds=0.5, changes={"fy": 1e-6})
    own = forward(source)
    values = dict(zip(source.spec.names, source.theta.tolist(), strict=True))
    wanted = values["c"] * own.axes[0].at + values["f0"]
    np.testing.assert_allclose(own.values, wanted, atol=1e-3 * np.abs(own.values).max())


def test_the_inverse_is_the_first_current_that_gives_the_output_else_the_nearest() -> None:
    source = rig("biviscous", CurrentDependence((("fy", 1),), 0.0, 2.0), seconds=0.05)
    velocity, current = np.array([-1.0, 0.0, 1.0]), np.linspace(0.0, 2.0, 5)
    # 100 N/A times the sign, nothing at rest
    own = table(velocity, current, values=100.0 * np.outer([-1.0, 0.0, 1.0], current))
    inverse = inverted(source, own)
    assert inverse is not None and [a.name for a in inverse.axes] == ["velocity", "force"]
    assert inverse.axes[1].at[[0, -1]].tolist() == [-200.0, 200.0] and len(inverse.axes[1].at) == 41
    asked = np.array([50.0, 200.0, -10.0])
    np.testing.assert_allclose(inverse(np.ones(3), asked), [0.5, 2.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(inverse(-np.ones(3), -asked), [0.5, 2.0, 0.0], atol=1e-9)


def test_states_of_a_table_are_found_again_and_outputs_that_no_current_gives_are_counted() -> None:
    source = rig("biviscous", CurrentDependence((("fy", 1),), 0.0, 2.0), seconds=0.05)
    v, i = np.array([-1.0, 1.0]), np.linspace(0.0, 2.0, 5)
    own = table(v, i, values=100.0 * i + 10.0 * v[:, None])
    inverse = inverted(source, own)
    assert inverse is not None
    off, share = of_inverse(source, own, inverse)
    assert off * source.output_range < 3.0
    # of 220 N a velocity has 200 N; what lies within 2 % of the range of their ends makes up for what is lost there
    assert share == pytest.approx(200.0 / 220.0, abs=0.02)


def test_the_inverse_keeps_the_order_of_axes_where_there_is_a_temperature() -> None:
    source = rig("biviscous", CurrentDependence((("fy", 1),), 0.0, 2.0), seconds=0.05)
    axes = np.array([-1.0, 1.0]), np.linspace(0.0, 2.0, 5), np.array([20.0, 70.0])
    v, i, t = np.meshgrid(*axes, indexing="ij")
    own = table(*axes, values=100.0 * i * (1.0 + (t - 20.0) / 50.0) + 10.0 * v)
    inverse = inverted(source, own)
    assert inverse is not None and [a.name for a in inverse.axes] == ["velocity", "force", "temperature"]
    # at 70 degrees half of the current gives as much
    found = inverse(np.array([1.0, 1.0]), np.array([110.0, 110.0]), np.array([20.0, 70.0]))
    np.testing.assert_allclose(found, [1.0, 0.5], atol=2e-3)


def test_of_an_output_that_rises_and_falls_the_lowest_current_is_taken() -> None:
    source = rig("biviscous", CurrentDependence((("fy", 1),), 0.0, 2.0), seconds=0.05)
    hill = np.array([0.0, 100.0, 0.0])
    own = table(np.array([0.0, 1.0]), np.array([0.0, 1.0, 2.0]), values=np.stack([hill, hill]))
    inverse = inverted(source, own)
    assert inverse is not None
    np.testing.assert_allclose(inverse(np.zeros(2), np.array([50.0, 100.0])), [0.5, 1.0], atol=0.02)


def test_a_table_over_the_current_alone_is_inverted_over_the_flux_alone() -> None:
    source = rig("boucwen-flux", seconds=0.3)
    own = forward(source)
    assert [a.name for a in own.axes] == ["current"] and own.name == "flux"
    inverse = inverted(source, own)
    assert inverse is not None and [a.name for a in inverse.axes] == ["flux"]
    inside = own.axes[0].at[5:-5]
    np.testing.assert_allclose(inverse(own(inside)), inside, atol=0.02 * np.ptp(own.axes[0].at))


def test_the_file_of_a_table_has_its_axes_units_and_rows_in_their_order() -> None:
    source = rig("biviscous", CurrentDependence((("fy", 1),), 0.1, 1.5), seconds=0.1)
    made, own = files(source, Settings(prefix="front")), forward(source)
    assert sorted(made.contents) == [
        f"biviscous_{end}" for end in ("inverse.csv", "lookup.c", "lookup.csv", "lookup.h")
    ]
    lines = made.contents["biviscous_lookup.csv"].decode().splitlines()
    head, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    assert head == ["velocity [m/s]", "current [A]", "force [N]"] and len(rows) == own.values.size
    values = np.array(rows, float)
    np.testing.assert_allclose(own(*values[:, :2].T), values[:, 2], rtol=1e-6, atol=1e-6)
    # what was measured stands at the head and is told
    plain = " ".join(" ".join(line.removeprefix("#").split()) for line in lines if line.startswith("#"))
    assert all(" ".join(line.split()) in plain for line in made.said) and len(made.said) == 3
