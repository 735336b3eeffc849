"""Dependence on current against direct evaluation, and against the parabolas of inverse-tanh paper Table 3."""

import numpy as np
import pint
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.core.specs import ModelSpec
from mrfit.errors import ConfigError, DataError
from mrfit.models import bingham, hammerstein_wiener, tanh
from mrfit.simulate.assembly import assemble
from mrfit.simulate.at_current import REMEMBERED_SAMPLES, at_current, basis, through
from mrfit.simulate.current_dependence import (
    CurrentDependence,
    coefficients,
    expanded,
    orders_of,
)

LOW, HIGH = 0.2, 1.0
# inverse-tanh paper Table 3 from 0.2 to 1 A, in N and N*s/m: coefficients of i^0, i^1, i^2
TABLE_3 = {"fy": (-135.7, 1817.0, -719.6), "c": (840.0, 2669.0, 142.9), "f0": (-11.67, -29.55, 16.28)}
QUADRATIC = CurrentDependence(tuple((name, 2) for name in TABLE_3), LOW, HIGH)


def table_3_at_nodes(dependence: CurrentDependence) -> np.ndarray:
    """Return theta (1, K') of tanh whose current dependence is that of the table; k, a1 and a2 constant."""
    constant = {"k": 270.0, "a1": 75.0, "a2": 80.0}
    values: list[float] = []
    for name in tanh.SPEC.names:
        if name in TABLE_3:
            values += [float(np.polynomial.polynomial.polyval(i, TABLE_3[name])) for i in dependence.nodes(2)]
        else:
            values.append(constant[name])
    return np.array([values])


def test_parabolas_of_paper_004_come_back_at_every_current() -> None:
    current = np.linspace(LOW, HIGH, 50)
    found = at_current(tanh.SPEC, QUADRATIC, table_3_at_nodes(QUADRATIC), current)
    assert found.shape == (1, 6, 50)
    for name, powers in TABLE_3.items():
        expected = np.polynomial.polynomial.polyval(current, powers)
        assert np.allclose(found[0, tanh.SPEC.names.index(name)], expected, rtol=1e-12)
    assert (found[0, tanh.SPEC.names.index("k")] == 270.0).all()


def test_coefficients_of_paper_004_are_the_derived_quantities() -> None:
    found = coefficients(tanh.SPEC, QUADRATIC, table_3_at_nodes(QUADRATIC))[0]
    derived = expanded(tanh.SPEC, QUADRATIC).derived
    assert len(derived) == len(found) == 9
    by_name = {d.name: value for d, value in zip(derived, found, strict=True)}
    for name, powers in TABLE_3.items():
        for power, value in enumerate(powers):
            assert by_name[f"{name}.i{power}"] == pytest.approx(value, rel=1e-9)
    units = {d.name: d.unit for d in derived}
    registry = pint.UnitRegistry()
    assert registry(units["c.i2"]) == registry("N*s/m/A^2")


def test_a_parameter_that_does_not_enter_linearly_is_interpolated_by_its_logarithm() -> None:
    dependence = CurrentDependence((("a1", 1),), 0.0, 2.0)
    theta = np.array([[500.0, 40.0, 160.0, 0.0, 1000.0, 0.0, 0.0]])
    found = at_current(tanh.SPEC, dependence, theta, np.array([0.0, 1.0, 2.0]))
    assert np.allclose(found[0, 1], [40.0, 80.0, 160.0])
    shown = expanded(tanh.SPEC, dependence).derived
    assert [(d.name, d.unit) for d in shown] == [("a1.i0", "1"), ("a1.i1", "1/A^1")]
    assert coefficients(tanh.SPEC, dependence, theta)[0] == pytest.approx([np.log(40.0), np.log(2.0)])


# Table 3 from 0 to 0.2 A, and the fits at single currents in Table 2 that it was made from
BELOW = {"fy": (82.96, 579.6), "c": (710.0, 3100.0), "f0": (-11.77, -19.95), "a1": (100.0,), "a2": (65.0,)}
ABOVE = TABLE_3 | {"a1": (75.0,), "a2": (80.0,)}
TABLE_2_CURRENTS = np.array([0.0, 0.2, 0.4, 0.6, 0.8, 1.0])
TABLE_2 = {
    "fy": [83.0, 198.9, 472.7, 705.7, 847.1, 965.3],
    "c": [710.0, 1330.0, 2010.0, 2550.0, 2910.0, 3720.0],
}
PIECEWISE = CurrentDependence(
    (("fy", "1/0.2/2"), ("c", "1/0.2/2"), ("f0", "1/0.2/2"), ("a1", "0/0.2/0"), ("a2", "0/0.2/0")), 0.0, 1.0
)


def whole_table_3() -> np.ndarray:
    """Return theta (1, K') of tanh for both columns of Table 3; k constant."""
    values: list[float] = []
    orders = dict(PIECEWISE.orders)
    for name in tanh.SPEC.names:
        for piece, table in zip(PIECEWISE.pieces(orders[name]) if name in orders else (), (BELOW, ABOVE), strict=False):
            values += np.polynomial.polynomial.polyval(piece.nodes, table[name]).tolist()
        values += [270.0] if name == "k" else []
    return np.array([values])


def test_table_3_of_paper_004_is_met_in_both_pieces_and_in_the_force() -> None:
    whole = assemble("tanh", PIECEWISE)
    assert [n for n in whole.spec.names if n[0] == "c"] == ["c@0A", "c@0.2A-", "c@0.2A+", "c@0.6A", "c@1A"]
    assert [n for n in whole.spec.names if n[:2] == "a1"] == ["a1@0.1A", "a1@0.6A"]
    t = np.arange(400) * 2.5e-3
    x, v = 0.01 * np.sin(2 * np.pi * t), 0.02 * np.pi * np.cos(2 * np.pi * t)
    for current in (0.0, 0.1, 0.2, 0.2001, 0.5, 1.0):
        table = {
            k: float(np.polynomial.polynomial.polyval(current, p))
            for k, p in (BELOW if current <= 0.2 else ABOVE).items()
        }
        drive = np.stack(
            [{"displacement": x, "velocity": v, "current": np.full(400, current)}[n] for n in whole.spec.inputs]
        )
        expected = table["fy"] * np.tanh(table["a1"] * v + table["a2"] * x) + table["c"] * v + 270.0 * x + table["f0"]
        assert whole.simulate(drive, whole_table_3(), 2.5e-3)[0] == pytest.approx(expected, rel=1e-10, abs=1e-9)


def test_coefficients_of_table_3_are_reported_piece_by_piece() -> None:
    found = coefficients(tanh.SPEC, PIECEWISE, whole_table_3())[0]
    derived = {d.name: value for d, value in zip(expanded(tanh.SPEC, PIECEWISE).derived, found, strict=True)}
    assert len(derived) == 3 * 5 + 2 * 2
    for name, powers in TABLE_3.items():
        assert [derived[f"{name}(0..0.2A).i{k}"] for k in range(2)] == pytest.approx(BELOW[name], rel=1e-9)
        assert [derived[f"{name}(0.2..1A).i{k}"] for k in range(3)] == pytest.approx(powers, rel=1e-9)
    assert [derived["a1(0..0.2A).i0"], derived["a1(0.2..1A).i0"]] == [100.0, 75.0]


def test_pieces_through_the_fits_of_table_2_are_those_of_table_3() -> None:
    theta = np.tile(tanh.SPEC.start, (6, 1))
    for name, values in TABLE_2.items():
        theta[:, tanh.SPEC.names.index(name)] = values
    nodes = through(tanh.SPEC, PIECEWISE, TABLE_2_CURRENTS, theta)
    found = coefficients(tanh.SPEC, PIECEWISE, nodes[None, :])[0]
    derived = {d.name: value for d, value in zip(expanded(tanh.SPEC, PIECEWISE).derived, found, strict=True)}
    for name in TABLE_2:
        # as far as the four digits that Table 2 prints determine them
        assert [derived[f"{name}(0..0.2A).i{k}"] for k in range(2)] == pytest.approx(BELOW[name], rel=1e-3)
        assert [derived[f"{name}(0.2..1A).i{k}"] for k in range(3)] == pytest.approx(TABLE_3[name], rel=1e-3)


@given(st.floats(0.0, 1.0))
def test_pieces_that_meet_are_continuous_at_the_break_and_pass_through_their_nodes(share: float) -> None:
    dependence = CurrentDependence((("fy", "1:0.2:2:0.7:0"),), 0.0, 1.0)
    assert dependence.labels("1:0.2:2:0.7:0") == ["0A", "0.2A", "0.45A", "0.7A"]
    values = np.array([80.0, 200.0, 500.0, 640.0])
    around = np.array([0.2 - 1e-9, 0.2 + 1e-9, 0.7 - 1e-9, 0.7 + 1e-9, 0.7 + 0.3 * share])
    found = values @ basis(dependence, "1:0.2:2:0.7:0", around)
    assert found == pytest.approx([200.0, 200.0, 640.0, 640.0, 640.0], rel=1e-6)
    assert values @ basis(dependence, "1:0.2:2:0.7:0", np.array([0.2 * share])) == pytest.approx(80.0 + 120.0 * share)


@given(st.integers(1, 4), st.floats(-5, 5), st.floats(0.1, 10))
def test_values_at_the_nodes_are_the_parameters(order: int, low: float, extent: float) -> None:
    dependence = CurrentDependence((("fy", order),), low, low + extent)
    rows = basis(dependence, order, dependence.nodes(order))
    assert np.allclose(rows, np.eye(order + 1), atol=1e-9)
    between = basis(dependence, order, np.linspace(low, low + extent, 17))
    assert np.allclose(between.sum(axis=0), 1.0)


def test_current_outside_the_tested_range_is_held_at_its_end() -> None:
    theta = table_3_at_nodes(QUADRATIC)
    outside = at_current(tanh.SPEC, QUADRATIC, theta, np.array([-1.0, LOW, HIGH, 9.0]))
    assert np.array_equal(outside[:, :, 0], outside[:, :, 1])
    assert np.array_equal(outside[:, :, 2], outside[:, :, 3])


def test_constant_current_gives_one_value_per_vector() -> None:
    theta = table_3_at_nodes(QUADRATIC)
    constant = at_current(tanh.SPEC, QUADRATIC, theta, np.full(30, 0.7))
    assert constant.shape == (1, 6)
    varying = at_current(tanh.SPEC, QUADRATIC, theta, np.linspace(0.7, 0.8, 5))
    assert np.allclose(constant[0], varying[0, :, 0], rtol=1e-13)


def test_expanded_parameters_stand_at_their_nodes_with_the_bounds_of_the_parameter() -> None:
    spec = expanded(bingham.SPEC, CurrentDependence((("fy", 2), ("f0", 1)), 0.0, 3.0))
    assert spec.names == ("fy@0A", "fy@1.5A", "fy@3A", "C_inf", "f0@0A", "f0@3A")
    assert spec.inputs == ("velocity", "current")
    original = bingham.SPEC.params[0]
    for p in spec.params[:3]:
        assert (p.unit, p.low, p.high, p.start, p.scale, p.role) == (
            original.unit,
            original.low,
            original.high,
            original.start,
            original.scale,
            original.role,
        )
    assert set(spec.linear) == set(spec.names)


def test_a_model_that_knows_current_keeps_one_current_input() -> None:
    spec = ModelSpec("m", "", "", "", ("current", "velocity"), "force", bingham.SPEC.params)
    assert expanded(spec, CurrentDependence((("fy", 1),), 0.0, 1.0)).inputs == ("current", "velocity")


def test_one_number_goes_to_all_parameters_but_offsets() -> None:
    assert dict(orders_of(bingham.SPEC, "2")) == {"fy": 2, "C_inf": 2}
    assert orders_of(bingham.SPEC, "0") == ()


def test_orders_are_read_by_name() -> None:
    assert orders_of(bingham.SPEC, "fy=3, f0=1,C_inf=0") == (("fy", 3), ("f0", 1))
    assert orders_of(bingham.SPEC, "fy=1 : 0.2 : 2, C_inf=0/0.5/1") == (("fy", "1:0.2:2"), ("C_inf", "0/0.5/1"))
    assert dict(orders_of(bingham.SPEC, "1/0.2/1")) == {"fy": "1/0.2/1", "C_inf": "1/0.2/1"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("5", "0 to 4"),
        ("fy=-1", "0 to 4"),
        ("two", "two"),
        ("fz=1", "fz"),
        ("fy", "fy"),
        ("", "0 to 4"),
        ("fy=1:0.2", "1:0.2:2"),
        ("fy=1:0.2/2", "in pieces"),
        ("fy=5:0.2:2", "0 to 4"),
        ("fy=1:low:2", "a break is a current in A"),
        ("fy=1:0.5:1:0.2:1", "that rise"),
        ("fy=1:nan:1", "that rise"),
        ("fy=0:0.2:0", "write 0/0.2/0"),
    ],
)
def test_wrong_orders_are_refused_with_what_was_read(text: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        orders_of(bingham.SPEC, text)


def test_one_current_is_refused_with_the_remedy() -> None:
    with pytest.raises(DataError, match=r"at 1\.5 A: add tests at other currents"):
        CurrentDependence((("fy", 1),), 1.5, 1.5)
    assert not CurrentDependence((("fy", 0),), 1.5, 1.5).varies


def test_a_break_outside_the_tested_range_is_refused() -> None:
    with pytest.raises(DataError, match="fy=1:2:1: 2 A is not inside the tested range, 0 to 1 A"):
        CurrentDependence((("fy", "1:2:1"),), 0.0, 1.0)


def test_either_form_can_be_asked_for_and_keeps_a_parameter_inside_its_bounds() -> None:
    current = np.linspace(0.0, 2.0, 41)
    theta = np.array([[100.0, 400.0, 1600.0, 50.0, 0.5, 50.0, 0.0, 1000.0, 0.0, 0.0]])
    forms = CurrentDependence((("fy", "log2"), ("a1", "plain2")), 0.0, 2.0)
    found = at_current(tanh.SPEC, forms, theta, current)[0]
    assert found[0] == pytest.approx(100.0 * 4.0**current)
    # the parabola through 50, 0.5 and 50 stays at its least value 0.5, the bound
    assert found[1] == pytest.approx(np.maximum(0.5 + 49.5 * (current - 1.0) ** 2, 0.5))
    dipping = at_current(tanh.SPEC, forms, np.array([[*theta[0, :3], 50.0, 0.5, 0.6, *theta[0, 6:]]]), current)[0, 1]
    assert dipping.min() == 0.5
    shown = [d.text for d in expanded(tanh.SPEC, forms).derived]
    assert [text.split(" of ")[2] for text in shown] == [*["ln(fy)"] * 3, *["a1"] * 3]
    assert expanded(tanh.SPEC, forms).linear == ("c", "k", "f0")
    nodes = through(tanh.SPEC, forms, current, found.T)
    assert nodes[:6] == pytest.approx(theta[0, :6], rel=1e-6)
    assert coefficients(tanh.SPEC, forms, theta)[0, :3] == pytest.approx([np.log(100.0), np.log(4.0), 0.0], abs=1e-12)


def test_a_law_of_a_saturating_current_is_monotone_bounded_and_a_polynomial_of_tanh() -> None:
    current = np.linspace(-1.0, 5.0, 61)
    forms = CurrentDependence((("fy", "sat1"), ("c", "sat2")), 0.0, 2.0)
    theta = np.array([[100.0, 900.0, 50.0, 0.0, 600.0, 900.0, 1000.0, 0.0, 0.0]])
    found = at_current(tanh.SPEC, forms, theta, current)[0]
    # the knee is at half the greatest current, 1 A; beyond the range tested the current is held
    bent = np.tanh(np.clip(current, 0.0, 2.0))
    assert found[0] == pytest.approx(100.0 + 800.0 * bent / np.tanh(2.0))
    assert np.all(np.diff(found[0]) >= 0.0) and found[0].min() == 100.0 and found[0].max() == pytest.approx(900.0)
    fitted = np.polyfit(bent, found[3], 2)
    assert np.polyval(fitted, bent) == pytest.approx(found[3])
    assert [found[3][np.argmin(abs(current - i))] for i in (0.0, 1.0, 2.0)] == pytest.approx([600.0, 900.0, 1000.0])
    assert expanded(tanh.SPEC, forms).linear == ("fy@0A", "fy@2A", "c@0A", "c@1A", "c@2A", "k", "f0")
    assert through(tanh.SPEC, forms, current, found.T)[:2] == pytest.approx([100.0, 900.0])
    slope = coefficients(tanh.SPEC, forms, theta)[0, 1]
    assert slope == pytest.approx(800.0 / np.tanh(2.0))
    [text] = [d.text for d in expanded(tanh.SPEC, forms).derived if d.name == "fy.i1"]
    assert text == "coefficient of (1 A*tanh(i/1 A))^1 of fy"


def test_forms_are_written_before_the_order() -> None:
    assert orders_of(tanh.SPEC, "fy=log2,c=plain1:0.5:2,k=plain1") == (
        ("fy", "log2"),
        ("c", "plain1:0.5:2"),
        ("k", "plain1"),
    )
    assert dict(orders_of(tanh.SPEC, "log1")) == {"fy": "log1", "a1": "log1", "a2": 1, "c": "log1", "k": 1}
    assert orders_of(tanh.SPEC, "fy=log0") == ()
    with pytest.raises(ConfigError, match="k may be negative, so it has no logarithm"):
        orders_of(tanh.SPEC, "k=log1")
    with pytest.raises(ConfigError, match="'plain', 'log' or 'sat' before it"):
        orders_of(tanh.SPEC, "fy=exp2")


def test_polynomials_of_records_that_are_remembered_are_those_computed_and_cannot_be_changed() -> None:
    dependence = CurrentDependence((("fy", "1:0.7:2"), ("C_inf", 3)), 0.0, 2.0)
    first, other = np.linspace(-0.5, 2.5, 300), np.linspace(0.0, 2.0, 300)
    for order in ("1:0.7:2", 3):
        known = [basis(dependence, order, one) for one in (first, other, first)]
        assert np.array_equal(known[0], known[2]) and not np.array_equal(known[0], known[1])
        # too long to be remembered
        computed = basis(dependence, order, np.tile(first, REMEMBERED_SAMPLES))
        assert np.array_equal(computed[:, :300], known[0])
        with pytest.raises(ValueError, match="read-only"):
            known[0][:] = 0.0


def test_names_have_the_digits_that_tell_nodes_apart() -> None:
    assert CurrentDependence((("fy", 1),), 0.0, 1.00475).labels(1) == ["0A", "1.005A"]
    assert CurrentDependence((("fy", 2),), 1.00471, 1.00479).labels(2) == ["1.00471A", "1.00475A", "1.00479A"]
    # the mean of a current that is off, and one that is small
    assert CurrentDependence((("fy", 1),), -2.681e-05, 2.0).labels(1) == ["0A", "2A"]
    assert CurrentDependence((("fy", 1),), 6e-4, 2.0).labels(1) == ["0.0006A", "2A"]
    assert CurrentDependence((("fy", 1),), -1e-5, 1e-3).labels(1) == ["-1e-05A", "0.001A"]


def test_one_order_for_all_is_refused_where_the_current_is_an_input() -> None:
    with pytest.raises(ConfigError, match="has the current as an input .* --current-order c_pre=1"):
        orders_of(hammerstein_wiener.SPEC, "1")
    assert orders_of(hammerstein_wiener.SPEC, "0") == ()
    assert orders_of(hammerstein_wiener.SPEC, "c_pre=1") == (("c_pre", 1),)
