"""A formula in SI: what is said is what was found, in the units of the channels, with intervals."""

import re

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.discover.formula.factors import FACTOR_KINDS, Term
from mrfit.discover.formula.proposal import HeldOutErrors, Proposal, force_of
from mrfit.discover.formula.rows import FormulaRows
from mrfit.discover.formula.standing import Certainty, Formula
from mrfit.discover.formula.wording import box_of, of_the_law_at_rest, proposed, text_of
from mrfit.discover.policy import STANDARD
from tests.discover.formula.plain import SCALES, formula, rows_of, term

U = np.linspace(-0.7, 0.8, 31)
SAMPLES: dict[str, Array] = {n: U for n in "xvaiTtL"}


def rows(made: str = "force") -> FormulaRows:
    return rows_of([SAMPLES], made=made)


def evaluated(text: str, values: dict[str, Array]) -> Array:
    """Return what a formula as it is said gives at values in SI."""
    python = re.sub(r"\|([^|]+)\|", r"abs(\1)", text.replace("^", "**"))
    names = {"abs": np.abs, "sgn": np.sign, "max": np.maximum, "tanh": np.tanh, "exp": np.exp}
    return np.asarray(eval(python, {"__builtins__": {}}, names | values))


def in_si(scaled: dict[str, Array]) -> dict[str, Array]:
    return {n: SCALES[n].origin + SCALES[n].size * u for n, u in scaled.items()}


@pytest.mark.parametrize("variable", ["x", "v"])
@pytest.mark.parametrize("kind", FACTOR_KINDS)
def test_what_is_said_is_the_force_that_was_found_but_for_a_mean_that_only_a_law_knows(
    kind: str, variable: str
) -> None:
    for constants in FACTOR_KINDS[kind].grid[-2:]:
        own = formula([term((variable, kind, *constants))], [0.3])
        found = force_of(rows(), own, SAMPLES) * SCALES["L"].size
        said = evaluated(text_of(rows(), own), in_si(SAMPLES))
        away = said - found
        # places and coefficients are said with four digits
        atol = 5e-3 * np.ptp(found)
        if FACTOR_KINDS[kind].varying:
            away -= away.mean()
        np.testing.assert_allclose(away, 0.0, atol=atol)


def test_terms_add_with_their_signs() -> None:
    own = formula([term(("x", "line"), ("i", "line")), term(("a", "line")), term(("t", "size"))], [0.3, -0.2, 0.1])
    said = text_of(rows(), own)
    assert said.count(" ") == 2 and not said.startswith("+") and " -" in said and " +" in said
    np.testing.assert_allclose(
        evaluated(said, in_si(SAMPLES)), force_of(rows(), own, SAMPLES) * SCALES["L"].size, rtol=1e-3
    )


def test_a_gain_is_said_over_the_law_where_it_is_zero() -> None:
    """L' (1 + theta (g - m)) is L (1 + k g) with L the law at g = 0."""
    own = formula([term(("x", "square"), ("L", "line"))], [0.4])
    mean = float(np.mean(U**2))
    np.testing.assert_allclose(of_the_law_at_rest(rows(), own), 1.0 / (1.0 - 0.4 * mean))
    whole = U * (1.0 + 0.4 * (U**2 - mean))
    at_rest = U * (1.0 - 0.4 * mean)
    law_in_si = {"L": at_rest * SCALES["L"].size, "x": in_si(SAMPLES)["x"]}
    added = evaluated(text_of(rows(), own), law_in_si)
    np.testing.assert_allclose(law_in_si["L"] + added, whole * SCALES["L"].size, atol=0.1)


def test_only_gains_on_the_law_are_taken_to_where_it_is_at_rest() -> None:
    both = formula([term(("x", "square"), ("L", "line")), term(("x", "line"))], [0.4, 0.2])
    factors = of_the_law_at_rest(rows(), both)
    assert factors[0] > 1.0 and factors[1] == 1.0
    # a law that a gain would take all of is no law to divide by
    strong = formula([term(("x", "square"), ("L", "line"))], [50.0])
    assert of_the_law_at_rest(rows(), strong)[0] == pytest.approx(1.0 / STANDARD.formula_least_scale)


@pytest.mark.parametrize(
    ("made", "unit"),
    [
        (term(("x", "line")), "N/m"),
        (term(("x", "square")), "N/m^2"),
        (term(("v", "size")), "N*s/m"),
        (term(("a", "line")), "N*s^2/m"),
        (term(("i", "line")), "N/A"),
        (term(("t", "line")), "N/s"),
        (term(("v", "odd-power", 0.5)), "N*s^0.5/m^0.5"),
        (term(("x", "bump", 0.0, 0.3), ("v", "side", 0.1)), "N"),
        (term(("x", "gas-column", 0.3, 1.3)), "N"),
        (term(("x", "line"), ("v", "line")), "N*s/m^2"),
        (term(("x", "square"), ("L", "line")), "1/m^2"),
        (term(("T", "line"), ("L", "line")), "1/degC"),
    ],
)  # fmt: skip
def test_a_coefficient_has_the_unit_that_makes_a_force_of_its_term(made: Term, unit: str) -> None:
    (coefficient,) = proposed(proposal(formula([made], [0.1]))).coefficients
    assert coefficient.unit == unit


def test_coefficients_of_a_torque_have_its_unit() -> None:
    own = proposal(formula([term(("v", "size"))], [0.1]), made="torque")
    (coefficient,) = proposed(own).coefficients
    assert coefficient.unit == "N*m*s/rad"
    assert proposed(own).box[0].channel == "angular_velocity"


def proposal(own: Formula, errors: float = 0.01, made: str = "force", **more: object) -> Proposal:
    sure = Certainty(np.full(len(own.theta), errors), 0.9)
    return Proposal(own, "", sure, rows=rows(made), **more)  # type: ignore[arg-type]


def test_an_interval_knows_scatter_accuracy_and_what_other_laws_move() -> None:
    theta, error, shift = -0.3, 0.02, 0.015
    own = proposal(formula([term(("x", "line"))], [theta]), error, shifts=np.array([shift]))
    (coefficient,) = proposed(own).coefficients
    over = SCALES["L"].size / SCALES["x"].size
    half = np.sqrt((2.2 * error) ** 2 + (0.04 * theta) ** 2 + (2.0 * shift) ** 2)
    assert coefficient.value == pytest.approx(theta * over)
    assert coefficient.low is not None and coefficient.high is not None
    assert coefficient.low == pytest.approx((theta - half) * over)
    assert coefficient.high == pytest.approx((theta + half) * over)
    assert coefficient.name == "f1: (x-0.006)"
    (plain,) = proposed(proposal(formula([term(("x", "line"))], [theta]), error)).coefficients
    assert plain.low is not None and plain.low > coefficient.low


def test_a_gain_and_its_interval_are_taken_to_the_law_at_rest_alike() -> None:
    own = formula([term(("x", "square"), ("L", "line"))], [0.4])
    (coefficient,) = proposed(proposal(own)).coefficients
    assert coefficient.low is not None and coefficient.high is not None
    half = np.hypot(2.2 * 0.01, 0.04 * 0.4)
    assert (coefficient.high - coefficient.low) / (2.0 * coefficient.value) == pytest.approx(half / 0.4)


def test_what_is_not_proposed_has_its_reason_and_no_text() -> None:
    own = formula([term(("x", "line"))], [0.1])
    for found in (Proposal(own, "too small", Certainty(np.ones(1), 0.0), rows=rows()), Proposal(None, "too small")):
        entry = proposed(found)
        assert (entry.reason, entry.text, entry.coefficients) == ("too small", "", ())


def test_the_entry_of_a_formula_tells_its_standing() -> None:
    own = formula([term(("x", "line"))], [0.3], kept=0.7, cancelled=4.0)
    told = proposed(proposal(own, held_out=HeldOutErrors(0.05, 0.03, 0.01)))
    assert (told.kept, told.left, told.law, told.after) == (0.7, 0.25, 0.05, 0.03)
    assert told.closed == pytest.approx((0.05**2 - 0.03**2) / (0.05**2 - 0.01**2))
    assert told.clear == pytest.approx(30.0)
    endless = proposed(proposal(own, errors=0.0))
    assert (endless.clear, endless.law, endless.closed) == (STANDARD.largest_score, None, None)


def test_readings_that_are_said_alike_are_told_once() -> None:
    own = formula([term(("v", "above", 2.0))], [0.3])
    same, other = formula([term(("v", "above", 2.00001))], [0.3]), formula([term(("v", "below", 2.0))], [0.3])
    entry = proposed(proposal(own, alike=(same, other, other)))
    assert entry.alike == (text_of(rows(), other),)
    assert [r.text for r in entry.readings] == [entry.text, *entry.alike]
    (factor,) = entry.readings[1].terms[0].factors
    assert (factor.variable, factor.kind, factor.constants) == ("v", "below", (2.0,))


def test_the_box_has_the_ranges_of_the_inputs_in_the_order_of_the_grammar_and_not_of_the_law() -> None:
    own = formula([term(("t", "line"), ("L", "line")), term(("a", "line"), ("x", "line"))], [0.1, 0.1])
    two = rows_of([{n: U[:10] for n in "xvaiTtL"}, {n: U[10:] for n in "xvaiTtL"}])
    box = box_of(two, own)
    assert [(b.symbol, b.channel, b.unit) for b in box] == [
        ("x", "displacement", "m"), ("a", "acceleration", "m/s^2"), ("t", "time", "s"),
    ]  # fmt: skip
    assert (box[0].low, box[0].high) == pytest.approx((0.006 - 0.7 * 0.02, 0.006 + 0.8 * 0.02))
