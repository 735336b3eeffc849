"""Ways of a slow test that count, its loss, its spread and its greatest speed."""

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.measure.quasi_static import QuasiStatic, quasi_static

DT, STROKE = 0.01, 0.02


def ways(*ends: float, samples: int = 400) -> Array:
    """Return straight ways between places, so many samples each."""
    return np.concatenate([np.linspace(a, b, samples, endpoint=False) for a, b in zip(ends, ends[1:], strict=False)])


def dry(x: Array, friction: float = 50.0, stiffness: float = 1000.0) -> Array:
    return stiffness * x + friction * np.sign(np.gradient(x))


def found(*ends: float) -> QuasiStatic:
    x = ways(*ends)
    return quasi_static("a", x, dry(x), DT)


@pytest.mark.parametrize(
    ("turn", "count"),
    [
        # back over nine tenths of the range, and over seven of them
        (-0.8 * STROKE, 4),
        (-0.4 * STROKE, 2),
    ],
)
def test_a_way_covers_eight_tenths_of_the_stroke(turn: float, count: int) -> None:
    one = found(-STROKE, STROKE, turn, STROKE, -STROKE)
    assert one.ways == count
    assert one.friction == pytest.approx(50.0, rel=0.01) and one.stiffness == pytest.approx(1000.0, rel=0.01)


def test_a_swing_of_less_than_a_fifth_of_the_stroke_ends_no_way() -> None:
    assert found(-STROKE, 0.0, -0.1 * STROKE, STROKE, -STROKE).ways == 2


def test_the_loss_is_that_of_whole_cycles_alone() -> None:
    # there and back over 40 mm against 50 N; half a cycle more has no loss of its own
    for ends in ((-STROKE, STROKE, -STROKE), (-STROKE, STROKE, -STROKE, STROKE)):
        assert found(*ends).loss == pytest.approx(2.0 * 2.0 * STROKE * 50.0, rel=0.01)
    # ways that do not follow each other make no cycle
    assert np.isnan(found(-STROKE, STROKE, -0.4 * STROKE, 0.9 * STROKE, -STROKE).loss)


def test_the_spread_is_the_greatest_difference_of_a_way_from_the_mean_of_its_direction() -> None:
    x = ways(*(-STROKE, STROKE) * 2)
    force = dry(x)
    force[: len(force) // 3] += 6.0
    # the first of two ways up is 6 N above the other
    assert quasi_static("a", x, force, DT).spread == pytest.approx(3.0, rel=0.02)
    assert quasi_static("a", x, dry(x), DT).spread == pytest.approx(0.0, abs=1e-6)


def test_the_greatest_speed_is_that_of_the_fastest_way() -> None:
    x = np.concatenate([ways(-STROKE, STROKE), ways(STROKE, -STROKE, samples=100), np.full(50, -STROKE)])
    assert quasi_static("a", x, dry(x), DT).peak_speed == pytest.approx(2.0 * STROKE / (100 * DT), rel=0.02)


@pytest.mark.parametrize("ends", [(-STROKE, STROKE), (STROKE, -STROKE), (-STROKE, STROKE, 0.0, STROKE)])
def test_ways_of_one_direction_are_no_test(ends: tuple[float, ...]) -> None:
    with pytest.raises(DataError, match="a: no stroke there and back over 80 % of its range; give a slow cycle"):
        found(*ends)


def test_few_samples_along_a_way_are_joined_by_lines() -> None:
    x = ways(*(-STROKE, STROKE) * 3, samples=25)
    one = quasi_static("a", x, dry(x), DT)
    assert one.stiffness == pytest.approx(1000.0, rel=0.02) and one.friction == pytest.approx(50.0, rel=0.05)
