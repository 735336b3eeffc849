"""A formula is found where there is one, with its coefficient, and none where there is none."""

from dataclasses import replace

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.discover.formula.factors import FACTOR_KINDS, FUNCTIONS, Factor, Term
from mrfit.discover.formula.grammar import grammar, mirrored
from mrfit.discover.formula.proposal import HeldOutErrors, lost_beside_other_laws, propose, rows_beside
from mrfit.discover.formula.rows import Scale
from mrfit.discover.formula.standing import Certainty, measured
from mrfit.discover.formula.wording import _factor, proposed
from mrfit.discover.invariance.base import Base, none
from mrfit.discover.invariance.setting import setting_of
from mrfit.discover.policy import STANDARD
from tests.discover.formula.cases import CENTRE, SIZE, WIDTH, bump, found, gain, parted, rebound
from tests.discover.formula.plain import formula


def test_friction_at_one_place_of_the_stroke_is_found_with_its_size_place_and_width() -> None:
    search = found(bump)
    assert search.why == "" and search.formula and search.rows and search.held_out
    (term,) = search.formula.terms
    assert term.structure == ("v side", "x bump")
    centre, width = (c * search.rows.scales["x"].size for c in term.factors[0].constants)
    assert (centre, width) == (pytest.approx(CENTRE, rel=0.02), pytest.approx(WIDTH, rel=0.02))
    entry = proposed(search)
    (coefficient,) = entry.coefficients
    assert coefficient.low < SIZE < coefficient.high and coefficient.unit == "N"
    assert search.held_out.closed > 0.95
    assert {r.channel for r in entry.box} == {"displacement", "velocity"}


def test_a_resistance_of_one_direction_has_its_mirror_image_and_its_even_part_as_readings() -> None:
    search = found(rebound)
    assert search.formula and search.why == ""
    entry = proposed(search)
    said = [entry.text, *entry.alike]
    assert any(s.endswith("*max(0,v)^2") for s in said) and any(s.endswith("*max(0,-v)^2") for s in said)
    (coefficient,) = entry.coefficients
    assert coefficient.unit == "N*s^2/m^2" and coefficient.low < 1250.0 < coefficient.high


def test_a_gain_of_the_place_is_over_the_laws_force_where_the_gain_is_zero() -> None:
    search = found(gain)
    assert search.formula and search.rows and search.why == ""
    (term,) = search.formula.terms
    assert term.structure == ("L line", "x square")
    (coefficient,) = proposed(search).coefficients
    assert coefficient.unit == "1/m^2"
    assert coefficient.value == pytest.approx(800.0, rel=0.01)


@pytest.mark.parametrize("seed", range(3))
def test_nothing_is_proposed_where_the_law_is_all_there_is(seed: int) -> None:
    search = found(seed=seed)
    assert search.why and proposed(search).text == ""


def test_a_formula_that_a_base_has_itself_is_none() -> None:
    learn, held = parted(bump)
    terms = tuple(bump(r.channels, np.zeros(len(r.speed)))[:, None] / SIZE for r in [*learn, *held])
    assert propose(learn, held, Base(terms), STANDARD).why


def test_one_sided_forms_and_their_mirror_images_leave_the_same_beside_any_law() -> None:
    learn, _ = parted(rebound)
    rows = rows_beside(setting_of(learn, none(learn).terms, [], STANDARD))
    one = measured(rows, (Term((Factor("v", "above", (2.0,)),)),))
    for other in mirrored(one.terms[0]):
        assert measured(rows, (other,)).error == pytest.approx(one.error, rel=0.02)


def test_every_term_is_finite_and_none_is_odd_in_the_velocity_alone() -> None:
    u = np.linspace(-1.6, 1.6, 101)
    for term in grammar("xvaiTtL"):
        assert np.isfinite(term.of(dict.fromkeys("xvaiTtL", u), 0.1)).all()
        if {f.variable for f in term.factors} <= set("vi"):
            values = {"v": u, "i": np.full(len(u), 0.7)}
            turned = term.of({**values, "v": -u})
            assert np.abs(turned + term.of(values)).max() > 1e-3


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (Factor("x", "size-from", (-0.25,)), "|x-0.001|"),
        (Factor("x", "square-from", (0.5,)), "(x-0.016)^2"),
        (Factor("x", "size", ()), "|(x-0.006)|"),
    ],
)
def test_a_place_is_said_from_where_the_stroke_is_measured(factor: Factor, said: str) -> None:
    """The search has 0 at the middle of the stroke, 6 mm, and 20 mm for 1."""
    assert _factor(factor, Scale(0.006, 0.02), False) == said


def test_factors_are_their_closed_forms() -> None:
    u = np.linspace(-1.0, 1.0, 41)

    def of(kind: str, *constants: float) -> Array:
        return FUNCTIONS[kind](u, *constants)

    assert set(FUNCTIONS) == set(FACTOR_KINDS)
    np.testing.assert_allclose(of("gas-column", 0.5, 1.0), u / (1.0 - 0.5 * u))
    np.testing.assert_allclose(of("dead-zone", 0.4), u - np.clip(u, -0.4, 0.4), atol=1e-15)
    np.testing.assert_allclose(of("over", 0.3) - of("under", 0.3), u - 0.3, atol=1e-15)
    np.testing.assert_allclose(of("above", 2.0) - of("below", 2.0), of("odd-square"), atol=1e-15)
    np.testing.assert_allclose(of("thermal", 1e-7), -u, atol=1e-6)


def test_a_constant_that_a_law_may_make_is_not_said() -> None:
    gas, warm = Factor("x", "gas-column", (0.5, 1.3)), Factor("T", "thermal", (0.5,))
    assert Term((gas,)).mean_is_lawful(gas)
    assert Term((warm, Factor("v", "line"))).mean_is_lawful(warm)
    for other in (Factor("x", "line"), Factor("v", "size"), Factor("i", "line")):
        assert not Term((warm, other)).mean_is_lawful(warm)


@pytest.mark.parametrize(
    ("errors", "closed"),
    [
        (HeldOutErrors(0.05, 0.03, 0.01), 16 / 24),
        # below the noise by chance it closes all, and no more
        (HeldOutErrors(0.05, 0.005, 0.01), 1.0),
        (HeldOutErrors(0.05, 0.06, 0.01), -11 / 24),
        (HeldOutErrors(0.009, 0.003, 0.01), 0.0),
    ],
)
def test_what_a_formula_closes_is_a_share_of_the_squared_error_beyond_noise(
    errors: HeldOutErrors, closed: float
) -> None:
    assert errors.closed == pytest.approx(closed)


@pytest.mark.parametrize(
    ("clear", "kept", "size", "lost"),
    [
        # half of what is asked for, 0.25, or 0.08 of a plain one
        (7.9, 0.126, 0.1, ""),
        (7.9, 0.124, 0.1, "a law may have it: beside it 12 % are left to take"),
        (8.1, 0.041, 0.1, ""),
        (8.1, 0.039, 0.1, "a law may have it: beside it 4 % are left to take"),
        (8.1, -0.5, 0.1, "a law may have it: beside it 0 % are left to take"),
        # its largest force may change by a fifth
        (8.1, 0.5, 0.119, ""),
        (8.1, 0.5, 0.081, ""),
        (8.1, 0.5, 0.121, "a law changes its force by 21 %"),
        (8.1, 0.5, 0.079, "a law changes its force by 21 %"),
    ],
)
def test_a_formula_has_to_stand_beside_laws_of_other_forms(clear: float, kept: float, size: float, lost: str) -> None:
    line = Term((Factor("x", "line"),))
    own, sure = formula([line], [1.0], size=0.1), Certainty(np.array([1.0 / clear]), 0.9)
    others = {"a law": formula([line], [1.0], kept=kept, size=size)}
    assert lost_beside_other_laws(own, sure, others, STANDARD) == lost


def test_too_few_rows_are_told_and_not_searched() -> None:
    whole = parted(bump)[0][0]
    short = replace(whole, channels={n: c[:60] for n, c in whole.channels.items()}, output=whole.output[:60])
    proposal = propose([short, short], [], None, STANDARD)
    assert proposal.formula is None and proposal.terms == ()
    assert "rows are too few to tell" in proposal.why
