"""The criterion against closed forms: springs and masses, refits, time, information."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.advise.criterion import DifferenceInformation, added, determinant_gain, half_widths, triangle, without
from mrfit.core.specs import Array

STIFFNESS, FIRST, AMPLITUDE = 3.0, 2.0, 0.7
PHASE = 2 * np.pi * np.arange(64) / 64


def sine(w: float, amplitude: float, cycles: int = 1) -> tuple[Array, Array, Array]:
    phase = np.tile(PHASE, cycles)
    return amplitude * np.sin(phase), amplitude * w * np.cos(phase), -amplitude * w**2 * np.sin(phase)


def mass_against_spring(w: float, amplitude: float, cycles: int = 1, first: int = 1) -> float:
    """Distance where a spring is true and a viscous damper with a mass is refitted; the data are of one frequency."""
    x, v, a = sine(FIRST, AMPLITUDE, first)
    # the mass that imitates the spring on the data
    mass = -STIFFNESS / FIRST**2
    known = DifferenceInformation.of(np.stack([v, a], axis=1), (STIFFNESS * x - mass * a)[:, None])
    x, v, a = sine(w, amplitude, cycles)
    return float(added(known, np.stack([v, a], axis=1), (STIFFNESS * x - mass * a)[:, None])[0])


@given(st.floats(0.5, 8.0), st.floats(0.1, 2.0), st.integers(1, 4))
def test_a_mass_is_told_from_a_spring_by_the_difference_of_the_squared_frequencies(w, amplitude, cycles):
    before, after = (n * len(PHASE) * a**2 / 2 for n, a in ((1, AMPLITUDE), (cycles, amplitude)))
    # the least over m of before*(k + m*w0^2)^2 + after*(k + m*w^2)^2
    squared = STIFFNESS**2 * before * after * (w**2 - FIRST**2) ** 2 / (before * FIRST**4 + after * w**4)
    assert mass_against_spring(w, amplitude, cycles) == pytest.approx(np.sqrt(squared), rel=1e-6, abs=1e-5)


def test_the_same_frequency_again_tells_nothing_whatever_its_amplitude():
    assert mass_against_spring(FIRST, 5.0, cycles=10) < 1e-5
    assert mass_against_spring(2.5 * FIRST, 0.5) > 5.0


@pytest.mark.parametrize("times", [4, 9])
def test_distance_grows_with_the_square_root_of_time_where_the_data_fix_the_rival(times):
    # data so long that a refit of the rival moves nothing
    once, longer = (mass_against_spring(2 * FIRST, 0.01, cycles=n, first=1000) for n in (1, times))
    assert longer / once == pytest.approx(np.sqrt(times), rel=1e-3)


@given(st.integers(0, 2**32 - 1), st.integers(1, 5), st.integers(8, 40))
def test_what_a_refit_of_the_base_absorbs_has_no_distance(seed, parameters, samples):
    rng = np.random.default_rng(seed)
    first, second = rng.standard_normal((2, samples, parameters))
    moved = rng.standard_normal((parameters, 3))
    known = DifferenceInformation.of(first, first @ moved)
    assert added(known, second, second @ moved) == pytest.approx(np.zeros(3), abs=1e-5)
    # another move on the test than on the data is no refit
    assert np.all(added(known, second, second @ (moved + 1.0)) > 1e-3)


@given(st.integers(0, 2**32 - 1))
def test_reduced_data_tell_what_all_rows_together_tell(seed):
    rng = np.random.default_rng(seed)
    jacobian, apart = rng.standard_normal((30, 4)), rng.standard_normal((30, 2))
    parts = (
        DifferenceInformation.of(jacobian[:12], apart[:12])
        .and_(jacobian[12:20], apart[12:20])
        .and_(jacobian[20:], apart[20:])
    )
    left = apart - jacobian @ np.linalg.lstsq(jacobian, apart)[0]
    assert parts.left() == pytest.approx(np.sum(left**2, axis=0))


def test_a_direction_that_no_data_determine_takes_nothing_away():
    known = DifferenceInformation.of(np.zeros((5, 2)), np.ones((5, 1)))
    assert known.left() == pytest.approx([5.0])


def test_a_constant_of_every_record_tells_nothing():
    rng = np.random.default_rng(0)
    columns = rng.standard_normal((20, 3))
    assert without(columns + 7.0, np.ones((20, 1))) == pytest.approx(columns - columns.mean(axis=0))
    assert without(columns, np.empty((20, 0))) is columns


@given(st.floats(0.1, 10.0), st.floats(0.1, 10.0), st.floats(0.1, 10.0))
def test_information_on_one_parameter_adds(before, gained, prior):
    root, jacobian, bounds = np.array([[before]]), np.array([[gained]]), np.array([prior])
    whole = prior**-2 + before**2 + gained**2
    assert determinant_gain(root, jacobian, bounds) == pytest.approx(0.5 * np.log(whole / (prior**-2 + before**2)))
    assert half_widths([root, jacobian], bounds) == pytest.approx([whole**-0.5])


def test_a_triangle_has_the_information_of_its_rows():
    jacobian = np.random.default_rng(1).standard_normal((9, 3))
    assert triangle(jacobian).T @ triangle(jacobian) == pytest.approx(jacobian.T @ jacobian)
