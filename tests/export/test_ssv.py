"""Draws of parameters: their widths are those of the intervals, their correlation that of least squares."""

import math
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from mrfit.export.source import ExportSource
from mrfit.export.ssv import NAMESPACE, correlation, drawn, files, intervals, one_by_one, parameter_set
from mrfit.io.schemas.fit import Quantity
from mrfit.settings.export import Settings
from tests.export.rigs import rig

NORMAL = 1.959963984540054


@pytest.fixture(scope="module")
def plain() -> ExportSource:
    """A line of force over velocity, and what yields: fy sign(v) + C v + f0, of which nothing is hidden."""
    return rig("bingham", seconds=0.3)


def with_rows(source: ExportSource, **rows: Quantity) -> ExportSource:
    """Return a fit with intervals of parameters by name; others were held."""
    (result,) = source.content.results
    made = [rows.get(p.name, replace(p, low=p.value, high=p.value, fixed=True)) for p in result.parameters]
    return replace(source, content=replace(source.content, results=[replace(result, parameters=made)]))


def row(source: ExportSource, name: str, low: float | None, high: float | None) -> Quantity:
    value = float(source.theta[source.spec.names.index(name)])
    return Quantity(name=name, value=value, low=low, high=high)


def test_a_width_is_that_of_a_logarithm_where_the_parameter_has_such_a_scale(plain: ExportSource) -> None:
    scales = {p.name: p.scale for p in plain.spec.params}
    assert scales["fy"] == "log" and scales["f0"] == "linear"
    given = with_rows(plain, fy=row(plain, "fy", 80.0, 125.0), f0=row(plain, "f0", -3.0, 5.0))
    found = dict(zip(plain.spec.names, intervals(given), strict=True))
    assert found["fy"] == (pytest.approx(math.log(125.0 / 80.0) / 2.0 / NORMAL), True)
    assert found["f0"] == (pytest.approx(8.0 / 2.0 / NORMAL), False) and found["C_inf"] is None
    # no logarithm of an interval down to 0
    down = with_rows(plain, fy=row(plain, "fy", 0.0, 200.0))
    assert intervals(down)[plain.spec.names.index("fy")] == (pytest.approx(200.0 / 2.0 / NORMAL), False)


@pytest.mark.parametrize(("low", "high"), [(None, 5.0), (1.0, None), (5.0, 5.0), (6.0, 5.0)])
def test_an_interval_with_an_open_end_or_without_width_is_none(
    plain: ExportSource, low: float | None, high: float | None
) -> None:
    given = with_rows(plain, fy=row(plain, "fy", low, high))
    assert not any(intervals(given)) and not one_by_one(given)
    # without logs there is no other way to draw than one by one, and nothing to draw
    blind = replace(given, stretches=())
    assert one_by_one(blind)
    np.testing.assert_array_equal(drawn(blind, Settings(draws=3)), np.tile(plain.theta, (3, 1)))


def test_the_correlation_is_that_of_least_squares_on_the_logs(plain: ExportSource) -> None:
    free = [plain.spec.names.index(n) for n in ("fy", "C_inf", "f0")]
    widths, logs = np.array([0.02, 0.03, 2.0]), np.array([True, True, False])
    found = correlation(plain, free, widths, logs)
    # the model is linear: columns of its Jacobian are its outputs at one parameter alone
    drive = plain.drive(plain.stretches[0])
    columns = []
    for k in free:
        theta = np.zeros_like(plain.theta)
        theta[k] = plain.theta[k] or 1.0
        columns.append(plain.assembly.simulate(drive, theta[None], 1e-3)[0])
    covariance = np.linalg.inv(np.array(columns) @ np.array(columns).T)
    sizes = np.sqrt(np.diag(covariance)) * np.sign(plain.theta[free])
    np.testing.assert_allclose(found, covariance / np.outer(sizes, sizes), atol=5e-3)
    assert abs(found[0, 1]) > 0.5
    np.testing.assert_array_equal(correlation(replace(plain, stretches=()), free, widths, logs), np.eye(3))


def test_draws_have_the_widths_and_the_correlation(plain: ExportSource) -> None:
    value = dict(zip(plain.spec.names, plain.theta.tolist(), strict=True))
    given = with_rows(
        plain,
        fy=row(plain, "fy", value["fy"] / 1.04, value["fy"] * 1.04),
        C_inf=row(plain, "C_inf", value["C_inf"] / 1.06, value["C_inf"] * 1.06),
    )
    sets = drawn(given, Settings(draws=4000, seed=1))
    names = plain.spec.names
    fy, c = (np.log(sets[:, names.index(n)] / value[n]) for n in ("fy", "C_inf"))
    # 4000 draws tell a standard deviation to 1.1 %
    assert np.std(fy) == pytest.approx(math.log(1.04) / NORMAL, rel=0.04)
    assert np.std(c) == pytest.approx(math.log(1.06) / NORMAL, rel=0.04)
    assert abs(np.mean(fy)) < 0.06 * np.std(fy)
    free = [names.index(n) for n in ("fy", "C_inf")]
    widths = np.array([math.log(1.04), math.log(1.06)]) / NORMAL
    wanted = correlation(given, free, widths, np.array([True, True]))[0, 1]
    assert np.corrcoef(fy, c)[0, 1] == pytest.approx(wanted, abs=0.05)
    assert np.all(sets[:, names.index("f0")] == value["f0"])
    np.testing.assert_array_equal(drawn(given, Settings(draws=4000, seed=1)), sets)
    assert np.any(drawn(given, Settings(draws=4000, seed=2)) != sets)


def test_draws_are_held_at_bounds_and_a_value_beyond_them_is_a_bound_itself(plain: ExportSource) -> None:
    blind = replace(plain, stretches=())
    param = next(p for p in plain.spec.params if p.name == "f0")
    k = plain.spec.names.index("f0")
    wide = param.high - param.low
    for value in (0.0, 1.5 * param.high):
        theta = plain.theta.copy()
        theta[k] = value
        own = replace(blind, theta=theta)
        given = with_rows(own, f0=Quantity(name="f0", value=value, low=value - 4.0 * wide, high=value + 4.0 * wide))
        found = drawn(given, Settings(draws=400))[:, k]
        assert (found.min(), found.max()) == (min(param.low, value), max(param.high, value))


def test_a_set_has_its_units_once_and_its_values_to_the_last_digit() -> None:
    values = [("a", "N*s/m", 0.1 + 0.2), ("b<", "N", -1e-300), ("c", "N", 5.0), ("t", "degC", 1.0)]
    root = ElementTree.fromstring(parameter_set("own", "what", values, ["head"]))
    space = {"ssv": NAMESPACE, "ssc": "http://ssp-standard.org/SSP1/SystemStructureCommon"}
    rows = root.findall("ssv:Parameters/ssv:Parameter", space)
    assert [p.get("name") for p in rows] == ["a", "b<", "c", "t"]
    assert [float(p[0].get("value", "")) for p in rows] == [v for *_, v in values]
    assert [p[0].get("unit") for p in rows] == ["N*s/m", "N", "N", "degC"]
    units = root.findall("ssv:Units/ssc:Unit", space)
    assert [u.get("name") for u in units] == ["N*s/m", "N", "degC"]
    assert dict(units[0][0].attrib) == {"kg": "1", "s": "-1"} and units[2][0].get("offset") == "273.15"
    assert root.get("version") == "1.0" and root.get("name") == "own"


def test_files_are_numbered_as_wide_as_their_count_and_say_what_was_held(plain: ExportSource) -> None:
    blind = replace(plain, stretches=())
    given = with_rows(blind, f0=row(blind, "f0", -3.0, 5.0))
    made = files(given, Settings(draws=2, seed=5, prefix="own"))
    assert list(made.contents) == ["bingham.ssv", "ssv/bingham_001.ssv", "ssv/bingham_002.ssv"]
    assert made.said[0] == "2 draws of 1 parameters, seed 5; 2 held" and made.error == 0.0
    assert "The band of the output is not known" in made.said[-1]
    text = made.contents["ssv/bingham_002.ssv"].decode()
    assert "Draw 2 of 2." in text and "Held: fy, C_inf" in text and made.earlier == "ssv/bingham_[0-9]*.ssv"
    many = files(given, Settings(draws=1200))
    assert "ssv/bingham_0001.ssv" in many.contents and "ssv/bingham_1200.ssv" in many.contents
