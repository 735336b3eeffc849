"""Dependence on current against direct evaluation, and against the parabolas of inverse-tanh paper Table 3."""

import numpy as np
import pint
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.dependence import CurrentDependence, at_current, coefficients, expanded, orders_of
from mrfit.errors import ConfigError, DataError
from mrfit.models import bingham, tanh
from mrfit.specs import ModelSpec

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


@given(st.integers(1, 4), st.floats(-5, 5), st.floats(0.1, 10))
def test_values_at_the_nodes_are_the_parameters(order: int, low: float, extent: float) -> None:
    dependence = CurrentDependence((("fy", order),), low, low + extent)
    basis = dependence.basis(order, dependence.nodes(order))
    assert np.allclose(basis, np.eye(order + 1), atol=1e-9)
    between = dependence.basis(order, np.linspace(low, low + extent, 17))
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


@pytest.mark.parametrize(
    ("text", "said"),
    [("5", "0 to 4"), ("fy=-1", "0 to 4"), ("two", "two"), ("fz=1", "fz"), ("fy", "fy"), ("", "0 to 4")],
)
def test_wrong_orders_are_refused_with_what_was_read(text: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        orders_of(bingham.SPEC, text)


def test_one_current_is_refused_with_the_remedy() -> None:
    with pytest.raises(DataError, match=r"at 1\.5 A: add tests at other currents"):
        CurrentDependence((("fy", 1),), 1.5, 1.5)
    assert not CurrentDependence((("fy", 0),), 1.5, 1.5).varies
