"""What an effect has to show: a gain on held-out conditions, and a clear parameter or nearly all that was left."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from mrfit.discover.refit import Refit
from mrfit.discover.trials import CLEAR, judge, leaves_too_much
from mrfit.fit.diagnostics.uncertainty import Uncertainty
from mrfit.search.cube import cube_of
from mrfit.simulate.assembly import assemble


def fitted(effects: tuple[str, ...], chi: float, errors_of_neutral: float = np.inf, seed: int = 1) -> Refit:
    """Return a fit whose errors are chi times the noise; its delay is so many standard errors from neutral."""
    assembly = assemble("+".join(["tanh", *effects]))
    cube = cube_of(assembly.spec, {}, {}, {})
    point = np.full(len(cube.free), 0.75)
    errors = [chi * np.random.default_rng(seed).standard_normal(2000)]

    def measure() -> Uncertainty:
        # a delay runs from -low to low, so that 0.75 of the cube is a quarter of it from neutral
        width = 1.96 * 0.25 / errors_of_neutral
        return cast(Uncertainty, SimpleNamespace(bounded_half_width=lambda direction: width))

    return Refit(effects, assembly, cube, point, errors, errors, measure)


def test_a_clear_parameter_and_a_gain_are_proof_and_either_alone_is_not() -> None:
    base = fitted((), 3.0)
    assert judge("delay", base, fitted(("delay",), 2.0, 2 * CLEAR), base).passes
    unclear = judge("delay", base, fitted(("delay",), 2.0, 0.5 * CLEAR), base)
    assert not unclear.passes and "2.0 standard errors" in unclear.reason
    useless = judge("delay", base, fitted(("delay",), 3.0, 100.0), base)
    assert not useless.passes and "does not lower the error" in useless.reason


def test_what_takes_nearly_all_far_above_the_noise_needs_no_clear_parameter() -> None:
    far, near = fitted((), 10.0), fitted((), 1.2)
    assert judge("delay", far, fitted(("delay",), 1.5, 1.5), far).passes
    assert not judge("delay", near, fitted(("delay",), 1.01, 1.5), near).passes


def test_the_first_effect_needs_fewer_standard_errors_if_it_takes_half_the_gap() -> None:
    base, before = fitted((), 10.0), fitted(("inertia",), 5.0)
    assert judge("delay", base, fitted(("delay",), 6.0, 3.5), base).passes
    assert not judge("delay", base, fitted(("delay",), 8.0, 3.5), base).passes
    assert not judge("delay", before, fitted(("delay", "inertia"), 3.0, 3.5), base).passes


def test_an_effect_at_neutral_takes_nothing_however_much_lower_the_error_is() -> None:
    base = fitted((), 10.0)
    assert not judge("delay", base, fitted(("delay",), 1.5, 0.3), base).passes


def test_a_look_alike_of_what_is_in_must_take_more() -> None:
    base, before = fitted((), 10.0), fitted(("inertia",), 3.0)
    after = fitted(("delay", "inertia"), 2.6, 100.0)
    assert judge("delay", before, after, base).passes
    assert not judge("delay", before, after, base, {"inertia"}).passes


def test_an_effect_that_does_not_help_is_never_asked_for_its_interval() -> None:
    base = fitted((), 3.0)
    useless = fitted(("delay",), 3.0, 0.0)
    with pytest.raises(ZeroDivisionError):
        useless.strength("delay")
    assert not judge("delay", base, useless, base).passes


@pytest.mark.parametrize(
    ("before", "after", "too_much"), [(10.0, 3.0, True), (10.0, 2.0, False), (3.0, 1.6, False), (3.0, 1.8, True)]
)
def test_the_nearer_the_noise_the_more_of_the_gap_may_be_left(before: float, after: float, too_much: bool) -> None:
    assert leaves_too_much(fitted((), before), fitted(("delay",), after)) is too_much
