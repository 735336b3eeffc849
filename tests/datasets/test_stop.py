import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from datasets.rig.stop import StopLaw

LAW = StopLaw(np.array([0.1, 0.3, 0.9]), np.array([2.0, 1.0, 0.5]))
inputs = st.lists(st.floats(-2, 2), min_size=2, max_size=12)


def test_one_stop_is_elastic_then_plastic():
    law = StopLaw(np.array([0.5]), np.array([2.0]))
    assert law.path(np.array([0.2, 0.5, 3.0, 2.8, 0.0])) == pytest.approx([0.4, 1.0, 1.0, 0.6, -1.0])


@given(inputs, st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))
@settings(max_examples=20, deadline=None)
def test_a_minor_loop_closes_and_is_wiped_out(before, corner, inner):
    extreme = np.array([*before, 2.0, -2.0])
    corner, inner = max(corner, inner), min(corner, inner)
    plain = LAW.path(np.array([*extreme, corner, 2.0]))
    looped = LAW.path(np.array([*extreme, corner, inner, corner, 2.0]))
    assert looped[-2] == pytest.approx(plain[-2], abs=1e-12)
    assert looped[-1] == pytest.approx(plain[-1], abs=1e-12)


@given(inputs)
@settings(max_examples=20, deadline=None)
def test_a_closed_path_never_gives_energy_back(corners):
    # the second run round a closed path starts where it ends
    once = np.concatenate([np.linspace(a, b, 200) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)])
    x = np.concatenate([[corners[0]], once, once, once])
    force = LAW.path(x)
    lap = slice(1 + 2 * len(once), None)
    work = np.trapezoid(force[lap], x[lap])
    assert work > -1e-9


def test_the_loop_of_a_stop_has_its_closed_form_area():
    law = StopLaw(np.array([0.3]), np.array([2.0]))
    x = np.concatenate([np.linspace(0, 1, 3001), np.linspace(1, -1, 6001)[1:], np.linspace(-1, 1, 6001)[1:]])
    force = law.path(x)[3000:]
    # a parallelogram: 4 w r (X - r)
    assert np.trapezoid(force, x[3000:]) == pytest.approx(4 * 2.0 * 0.3 * (1 - 0.3), rel=1e-6)
