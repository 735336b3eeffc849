"""The cube maps bounds to 0 and 1 and back without loss."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.core.specs import ModelSpec, Param
from mrfit.errors import ConfigError
from mrfit.search.cube import cube_of

SPEC = ModelSpec(
    name="toy",
    title="",
    equation="",
    reference="",
    inputs=("current",),
    output="flux",
    params=(Param("a", "1", -2.0, 3.0, 0.5), Param("b", "H", 1e-4, 1e2, 1e-1, "log")),
)


@given(st.lists(st.floats(0, 1), min_size=2, max_size=2))
def test_points_survive_the_way_to_parameters_and_back(point: list[float]) -> None:
    cube = cube_of(SPEC, {}, {}, {})
    theta = cube.to_theta(np.array([point]))
    assert np.allclose(cube.to_points(theta)[0], point, atol=1e-12)
    assert np.all((theta >= [-2.0, 1e-4]) & (theta <= [3.0, 1e2]))


def test_corners_are_the_bounds_and_log_parameters_halve_in_the_logarithm() -> None:
    cube = cube_of(SPEC, {}, {}, {})
    theta = cube.to_theta(np.array([[0.0, 0.0], [1.0, 1.0], [0.5, 0.5]]))
    assert np.allclose(theta, [[-2.0, 1e-4], [3.0, 1e2], [0.5, 1e-1]], rtol=1e-12)


def test_a_parameter_of_which_nothing_is_said_is_no_copy_and_a_start_beyond_its_bounds_is_moved() -> None:
    assert all(own is given for own, given in zip(cube_of(SPEC, {}, {}, {}).params, SPEC.params, strict=True))
    first = SPEC.params[0]
    beyond = replace(SPEC, params=(replace(first, start=2.0 * first.high), *SPEC.params[1:]))
    assert cube_of(beyond, {}, {}, {}).params[0].start == first.high


def test_fixed_parameters_keep_their_value_and_leave_the_search() -> None:
    cube = cube_of(SPEC, {}, {}, {"a": 7.0})
    assert cube.to_theta(np.array([[0.25]]))[0, 0] == 7.0
    assert list(cube.free) == [1]


CHOSEN = replace(SPEC, params=(*SPEC.params, Param("scale", "1", 0.1, 10.0, 1.0, fixed=True)))


@pytest.mark.parametrize(
    ("bounds", "start", "fixed", "free"),
    [
        ({}, {}, {}, [0, 1]),
        ({"scale": (0.5, 2.0)}, {}, {}, [0, 1, 2]),
        ({}, {"scale": 2.0}, {}, [0, 1, 2]),
        ({}, {}, {"scale": 3.0}, [0, 1]),
    ],
)
def test_what_a_model_fixes_is_searched_only_where_the_user_says_so(
    bounds: dict[str, tuple[float, float]], start: dict[str, float], fixed: dict[str, float], free: list[int]
) -> None:
    cube = cube_of(CHOSEN, bounds, start, fixed)
    assert list(cube.free) == free
    # only what nobody chose is left to the data
    assert [p.fixed for p in cube.params] == [False, False, not (bounds or start or fixed)]


@pytest.mark.parametrize(
    ("bounds", "start", "fixed", "words"),
    [
        ({"zz": (0.0, 1.0)}, {}, {}, "no parameter 'zz'; it has a, b"),
        ({"a": (2.0, 1.0)}, {}, {}, "rising"),
        ({"b": (0.0, 1.0)}, {}, {}, "logarithmic"),
        ({}, {"a": 9.0}, {}, "outside its bounds"),
        ({}, {}, {"a": 1.0, "b": 1.0}, "at least one free"),
    ],
)
def test_wrong_settings_name_the_parameter_and_the_remedy(
    bounds: dict[str, tuple[float, float]], start: dict[str, float], fixed: dict[str, float], words: str
) -> None:
    with pytest.raises(ConfigError, match=words):
        cube_of(SPEC, bounds, start, fixed)
