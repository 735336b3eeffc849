"""Parts of the integrator of a driven mass by closed forms, and the names, SPECs and drives around it."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.core import registry
from mrfit.driven import integrator
from mrfit.driven.integrator import PER_SAMPLE
from mrfit.driven.motion import MASS, between_samples, spec_around, split
from mrfit.errors import ConfigError

SIZE = st.floats(-9.0, 9.0)


def python(kernel: Any) -> Any:
    """Return a compiled function as it is written."""
    return kernel.py_func


@given(SIZE, SIZE, SIZE, st.floats(0.25, 4.0))
def test_accelerations_are_foreseen_along_the_parabola_of_the_last_step(
    a: float, b: float, c: float, ratio: float
) -> None:
    def at(s: float) -> float:
        return a + b * s + c * s * s

    # the last step from 0 to 1, the next as long as its ratio to that
    middle, end = python(integrator._foreseen)((at(0.0), at(0.5), at(1.0)), ratio)
    assert middle == pytest.approx(at(1.0 + 0.5 * ratio), abs=1e-9)
    assert end == pytest.approx(at(1.0 + ratio), abs=1e-9)


@given(st.floats(0.1, 5.0), st.floats(0.1, 50.0), st.floats(1.1, 5.0), st.sampled_from([-1.0, 1.0]))
def test_under_a_constant_acceleration_the_speed_turns_where_it_is_zero(
    speed: float, rate: float, longer: float, way: float
) -> None:
    v, a = way * speed, -way * rate
    h = longer * speed / rate
    end = (0.1 + v * h + 0.5 * a * h * h, v + a * h, a)
    place, share = python(integrator._turning)((0.1, v), end, h)
    assert share == pytest.approx(1.0 / longer)
    assert place == pytest.approx(0.1 + way * 0.5 * speed**2 / rate)


@pytest.mark.parametrize("speeds", [(1.0, 0.2), (-1.0, -0.2), (0.0, 1.0), (1.0, 0.0)])
def test_a_speed_that_keeps_its_sign_turns_nowhere(speeds: tuple[float, float]) -> None:
    assert python(integrator._turning)((0.1, speeds[0]), (0.2, speeds[1], 3.0), 0.5) == (0.1, 0.0)


def test_channels_that_do_not_move_with_the_mass_are_linear_between_samples() -> None:
    others, taken = np.array([[0.0, 1.0], [2.0, 1.0], [6.0, 0.0]]), np.full(2, -1.0)
    for place, expected in ((0.0, (0.0, 1.0)), (0.25, (0.5, 1.0)), (1.5, (4.0, 0.5)), (2.0, (6.0, 0.0))):
        python(integrator._write_channels)(others, place, taken)
        assert tuple(taken) == expected
    # of channels that never change there is one row, written at the beginning
    python(integrator._write_channels)(others[:1], 1.5, taken)
    assert tuple(taken) == (6.0, 0.0)


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("tanh", ("tanh", "", "")),
        ("tanh+delay", ("tanh+delay", "", "")),
        ("tanh@force", ("tanh", "force", "displacement")),
        ("tanh+delay@base-acceleration", ("tanh+delay", "base", "acceleration")),
        ("tanh@base-absolute-acceleration", ("tanh", "base", "absolute_acceleration")),
    ],
)
def test_a_written_mass_is_a_model_what_drives_it_and_what_is_predicted(name: str, parts: tuple[str, str, str]) -> None:
    assert split(name) == parts


@pytest.mark.parametrize("name", ["tanh@wind", "tanh@-velocity", "tanh@force-temperature", "tanh@force-absolute"])
def test_a_written_mass_that_is_none_says_what_may_stand_there(name: str) -> None:
    ends = "displacement, velocity, acceleration, absolute-acceleration"
    with pytest.raises(ConfigError, match=f"'{name}': behind @ stands force or base, then -OUTPUT, one of {ends}"):
        split(name)


def test_the_spec_of_a_mass_has_its_drive_first_and_its_mass_last() -> None:
    law = registry.load("model", "tanh").SPEC
    found = spec_around(law, "tanh@base-velocity")
    assert found.inputs == ("base_acceleration",) and found.output == "velocity"
    assert found.params == (*law.params, MASS) and found.name == "tanh@base-velocity"
    assert "= -mass*base_acceleration;" in found.equation and law.equation in found.equation
    pushed = spec_around(law, "tanh@force")
    assert pushed.inputs == ("excitation_force",) and "= excitation_force;" in pushed.equation
    # what is linear in the force is not in the motion
    assert law.linear and not found.linear and found.passive is None and not found.rate_independent
    own = registry.load("model", "hammerstein-wiener").SPEC
    kept = [n for n in own.inputs if n not in ("displacement", "velocity", "acceleration")]
    assert list(spec_around(own, "hammerstein-wiener@force").inputs) == ["excitation_force", *kept]


@pytest.mark.parametrize("samples", [1, 2, 5, 40, 300])
def test_a_straight_drive_is_one_between_its_samples_up_to_both_ends(samples: int) -> None:
    line = 3.0 - 0.5 * np.arange(samples)
    fine = 3.0 - 0.5 * np.arange((samples - 1) * PER_SAMPLE + 1) / PER_SAMPLE
    found = between_samples(line)
    assert found.shape == fine.shape
    # a record shorter than the window is continued again and again
    np.testing.assert_allclose(found, fine, atol=1e-6)
