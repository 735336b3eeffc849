"""Bands over current hold what they say: checked against draws from a known covariance and the intervals of nodes."""

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.fit.diagnostics.bands import bands, currents_of, simultaneous
from mrfit.fit.diagnostics.uncertainty import Uncertainty, quantile_95
from mrfit.fit.result import parameter_rows
from mrfit.search.cube import cube_of
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence


def known(covariance: Array, degrees: float = 1e6, open_: int = 0) -> Uncertainty:
    values, vectors = np.linalg.eigh(covariance)
    order = np.argsort(values)
    size = len(values)
    still = np.arange(size) >= size - open_
    return Uncertainty(
        covariance=covariance,
        directions=vectors[:, order],
        open=still,
        spreads=np.sqrt(np.maximum(values[order], 0.0)),
        singular_values=np.ones(size),
        degrees=degrees,
    )


def covariance_of(size: int, scale: float) -> Array:
    rng = np.random.default_rng(3)
    root = rng.standard_normal((size, size))
    return scale**2 * (root @ root.T) / size


LAWS = [(("fy", 2), ("c", 1)), (("fy", "1:0.7:2"), ("c", 1)), (("fy", "1/0.7/2"),), (("fy", 3), ("c", "log2"))]


@pytest.mark.parametrize("orders", LAWS, ids=lambda o: " ".join(f"{n}={m}" for n, m in o))
def test_bands_hold_as_many_draws_of_the_covariance_as_they_say(orders) -> None:
    dependence = CurrentDependence(orders, 0.0, 2.0)
    assembly = assemble("tanh", dependence)
    cube = cube_of(assembly.spec, {}, {}, {})
    point = np.full(len(cube.free), 0.5)
    uncertainty = known(covariance_of(len(point), 1e-4), degrees=400.0)
    rng = np.random.default_rng(11)
    # Student's t: a normal vector over the root of an independent mean square
    drawn = rng.multivariate_normal(np.zeros(len(point)), uncertainty.covariance, 4000)
    drawn /= np.sqrt(rng.chisquare(400.0, len(drawn)) / 400.0)[:, None]
    moved = assembly.recipe and bands(assembly, cube, point, uncertainty)
    assert {b.name for b in moved} == {n for n, _ in orders}
    from mrfit.simulate.at_current import at_current
    from mrfit.simulate.current_levels import base_of

    spec = base_of("tanh").spec
    for band in moved:
        k = spec.names.index(band.name)
        curves = at_current(spec, dependence, cube.to_theta(point + drawn), np.array(band.current))[:, k]
        pointwise = (curves >= band.low) & (curves <= band.high)
        whole = np.all((curves >= band.low_everywhere) & (curves <= band.high_everywhere), axis=1)
        assert pointwise.mean(axis=0) == pytest.approx(0.95, abs=0.012)
        assert 0.942 <= whole.mean() <= 0.975
        assert np.all(pointwise, axis=1).mean() < 0.945


def test_at_a_node_the_pointwise_band_is_the_interval_of_its_value() -> None:
    dependence = CurrentDependence((("fy", 2), ("c", 1)), 0.0, 2.0)
    assembly = assemble("tanh", dependence)
    cube = cube_of(assembly.spec, {}, {}, {})
    point = np.full(len(cube.free), 0.4)
    uncertainty = known(covariance_of(len(point), 2e-3), degrees=50.0)
    rows = {q.name: q for q in parameter_rows(cube, point, uncertainty)}
    for band in bands(assembly, cube, point, uncertainty):
        for current, name in ((0.0, f"{band.name}@0A"), (2.0, f"{band.name}@2A")):
            at = band.current.index(current)
            assert band.low[at] == pytest.approx(rows[name].low, rel=1e-6)
            assert band.high[at] == pytest.approx(rows[name].high, rel=1e-6)
            assert band.low_everywhere[at] < band.low[at]


def test_a_curve_that_cannot_turn_has_the_width_of_a_single_value() -> None:
    uncertainty = known(np.array([[4.0]]), degrees=30.0)
    straight = np.linspace(0.1, 3.0, 41)[:, None]
    assert simultaneous(straight, uncertainty, [slice(0, 41)]) == pytest.approx(quantile_95(30.0), rel=1e-6)
    # of two that do not touch, each is left in half as many cases
    assert simultaneous(straight, uncertainty, [slice(0, 20), slice(20, 41)]) > 1.05 * quantile_95(30.0)


def test_a_parameter_that_jumps_is_given_on_both_sides_and_one_that_meets_once() -> None:
    jumping = currents_of(CurrentDependence((("fy", "1/0.7/2"),), 0.0, 2.0), "1/0.7/2")
    meeting = currents_of(CurrentDependence((("fy", "1:0.7:2"),), 0.0, 2.0), "1:0.7:2")
    assert len(jumping) == 2 and jumping[0][-1] == 0.7 < jumping[1][0] == pytest.approx(0.7)
    assert len(meeting) == 1 and np.count_nonzero(meeting[0] == 0.7) == 1 and np.all(np.diff(meeting[0]) > 0.0)


def test_where_the_data_leave_a_node_open_there_is_no_band() -> None:
    dependence = CurrentDependence((("fy", 1),), 0.0, 2.0)
    assembly = assemble("tanh", dependence)
    cube = cube_of(assembly.spec, {}, {}, {})
    size = len(cube.free)
    variances = np.full(size, 1e-6)
    at = [cube.params[int(k)].name for k in cube.free].index("fy@2A")
    variances[at] = 0.0
    opened = Uncertainty(np.diag(variances), np.eye(size), np.arange(size) == at, np.ones(size), np.ones(size), 100.0)
    (band,) = bands(assembly, cube, np.full(size, 0.5), opened)
    assert band.low[0] is not None and band.low[-1] is None and band.high_everywhere[-1] is None
    assert bands(assemble("tanh"), cube, np.full(size, 0.5), opened) == []
