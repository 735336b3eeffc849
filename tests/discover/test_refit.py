"""The paired score allows for correlated residuals; a shape at its bound is the limit of an effect's form."""

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.discover.evidence.gather import library_effect
from mrfit.discover.evidence.refit import Refit, paired_z, usual
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.questions import Fit
from mrfit.discover.selection.rules import limits
from mrfit.search.cube import cube_of
from mrfit.simulate.assembly import assemble


def refit(effect: str, **values: float) -> Refit:
    """Return a fit of bingham with an effect whose parameters ended at these values, the others at their start."""
    assembly = assemble(f"bingham+{effect}")
    cube = cube_of(assembly.spec, {}, {}, {})
    own = {f"{effect}.{name}": value for name, value in values.items()}
    theta = np.array([[own.get(p.name, p.start) for p in cube.params]])
    return Refit((effect,), assembly, cube, cube.to_points(theta)[0], [], [], lambda: pytest.fail("not asked for"))


def ended(found: Refit, rival: str) -> int:
    """Return how many shape parameters of a fit's effect ended where it may be its rival."""
    (effect,) = found.effects
    row = Fit(0, found.effects, 1.0, 1.0, shapes={effect: found.shapes(effect)})
    return limits(row, effect, library_effect(registry.load("effect", rival).SPEC), STANDARD)


def test_a_stribeck_velocity_at_its_bound_is_the_limit_of_coulomb_friction() -> None:
    assert ended(refit("stribeck", fs=10.0, vs=0.5), "coulomb-friction") == 1
    assert ended(refit("stribeck", fs=10.0, vs=0.02), "coulomb-friction") == 0


def test_the_limit_of_a_form_is_none_of_an_effect_that_it_is_not_mistaken_for() -> None:
    assert ended(refit("coulomb-friction", fc=10.0, v_r=1e-5), "inertia") == 0


def test_a_shape_that_both_rivals_have_tells_nothing_of_either() -> None:
    assert ended(refit("coulomb-friction", fc=10.0, v_r=1e-5), "stribeck") == 0
    assert ended(refit("coulomb-friction", fc=10.0, v_r=1e-5), "delay") == 1


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_dead_time_alone_and_lag_alone_are_forms_like_any_other(share: float) -> None:
    assert ended(refit("delay", tau=1e-3, s=share), "inertia") == 0


def test_equal_errors_score_nothing_and_a_real_fall_scores_much() -> None:
    rng = np.random.default_rng(1)
    noise = rng.standard_normal(4000)
    extra = 0.3 * np.sin(np.arange(4000) / 30)
    assert paired_z([noise], [noise]) == 0.0
    assert paired_z([noise + extra], [noise]) > 5


def test_a_fall_in_correlated_noise_scores_less_than_in_white_noise_of_the_same_size() -> None:
    rng = np.random.default_rng(2)
    white = rng.standard_normal(6000)
    slow = np.convolve(rng.standard_normal(6200), np.ones(100), "valid")[:6000]
    slow /= slow.std()
    extra = 0.2 * np.sin(np.arange(6000) / 200)
    assert paired_z([slow + extra], [slow]) < 0.5 * paired_z([white + extra], [white])


def test_chance_falls_are_rarely_clear() -> None:
    rng = np.random.default_rng(3)
    scores = []
    for _ in range(200):
        before, after = (np.convolve(rng.standard_normal(1100), np.ones(20), "valid") for _ in range(2))
        scores.append(paired_z([before], [after]))
    assert np.mean(np.abs(scores) > 1.96) < 0.12


def test_one_sample_on_the_wrong_side_of_a_jump_is_no_error_of_a_record_and_what_lasts_is() -> None:
    rng = np.random.default_rng(9)
    noise = [rng.standard_normal(800), rng.standard_normal(900)]
    plain = usual(noise)
    assert plain == pytest.approx(1.0, abs=0.05)
    noise[1][400] = 74.0
    assert usual(noise) == pytest.approx(plain, rel=0.01)
    assert np.sqrt(np.mean(np.concatenate(noise) ** 2)) > 2.0
    noise[1][300:320] += 20.0  # an end of the stroke that is met twice
    assert usual(noise) > 1.8
