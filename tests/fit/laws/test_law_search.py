"""What a law of current costs, which changes are tried, and why one is not taken."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.fit.laws import by_level, choice
from mrfit.fit.laws.by_level import CurrentLaw, Laws, LevelProblem, _own_share, _unseen
from mrfit.fit.laws.choice import LawChoice
from mrfit.fit.laws.law_search import MOST_OPEN, LawSearch, State
from mrfit.io.schemas.fit import CurrentChoice, LawTried
from mrfit.search.problem import LeastSquaresProblem
from mrfit.search.starts import LevelFit
from mrfit.simulate.current_dependence import CurrentDependence
from mrfit.simulate.current_levels import POLYNOMIAL_ROLES
from tests.fit.laws.test_by_level import CURRENTS, PLACES, about_optima
from tests.fit.toy import block, linear_model

WORTH = 100.0


def about(levels: int = 4) -> by_level.Tests:
    """Return what is known of the damper at its first levels, each condition worth as much as any other."""
    known, places = about_optima(1), PLACES[PLACES < levels]
    alike = np.full(len(places), WORTH)
    return replace(
        known,
        currents=CURRENTS[:levels],
        theta=known.theta[:levels],
        places=places,
        worth=alike,
        squares=np.ones(len(places)),
        unseen=np.zeros(len(places)),
    )


def search_of(levels: int = 4, orders: tuple[int, ...] | None = None) -> LawSearch:
    """Return a search over all parameters alone, with laws of the parameters' own form as its reference."""
    known = about(levels)
    count = len(known.free)
    own = ["log" if bent else "plain" for bent in known.bent]
    usual = orders or (0,) * count
    reference = tuple(CurrentLaw(form, order) for form, order in zip(own, usual, strict=True))
    return LawSearch(known, [[k] for k in range(count)], reference, {})


def changed(state: State, group: int, law: CurrentLaw) -> State:
    return (*state[:group], law, *state[group + 1 :])


@pytest.mark.parametrize(("levels", "times", "highest"), [(4, 1.0, 2), (3, 2.0, 2), (2, 2.0, 1)])
def test_an_order_costs_the_logarithms_of_samples_and_of_changes_to_choose_from(
    levels: int, times: float, highest: int
) -> None:
    search = search_of(levels)
    conditions, changes = np.sum(PLACES < levels), len(search.groups) * 3 * highest
    assert search.highest == highest
    assert search.price == pytest.approx(times * np.log(WORTH * conditions) + np.log(changes))


def test_what_differs_from_the_reference_is_paid_for_and_what_no_force_has_twice() -> None:
    search = search_of()
    roles = [search.tests.cube.params[k].role for k in search.tests.free]
    reference = search.reference
    search.deviances[reference] = np.array([1.0, 2.0, 3.0])
    assert search.total(reference) == 6.0
    for group, role in enumerate(roles):
        each = 1.0 if role in POLYNOMIAL_ROLES or not role else 2.0
        own = reference[group].form
        other = "plain" if own == "log" else "sat"
        for law, count in ((CurrentLaw(own, 2), 2), (CurrentLaw(own, 1), 1), (CurrentLaw(other, 1), 2)):
            state = changed(reference, group, law)
            search.deviances[state] = search.deviances[reference]
            assert search.total(state) - 6.0 == pytest.approx(count * each * search.price)
    assert {1.0, 2.0} == {1.0 if r in POLYNOMIAL_ROLES or not r else 2.0 for r in roles}


def test_members_of_a_group_are_paid_for_each() -> None:
    search = search_of()
    together = LawSearch(search.tests, [[0, 1]], search.reference[:1], {})
    state = (CurrentLaw(search.reference[0].form, 1),)
    for one in (together.reference, state):
        together.deviances[one] = np.zeros(3)
    alone = 1.0 if search.tests.cube.params[search.tests.free[0]].role in (*POLYNOMIAL_ROLES, "") else 2.0
    assert together.total(state) == pytest.approx(2 * alone * together.price)
    assert together.laws(state)[:2] == [*state, *state]


def test_neighbours_are_two_orders_off_at_most_or_of_another_form_alone() -> None:
    search = search_of()
    own = search.reference[0].form
    others = [form for form in ("plain", "log", "sat") if form != own]
    near = {s[0] for s in search.neighbours(search.reference, 0)}
    assert near == {CurrentLaw(form, order) for form in (own, *others) for order in (1, 2)}
    state = changed(search.reference, 0, CurrentLaw(own, 1))
    near = {s[0] for s in search.neighbours(state, 0)}
    turned = {CurrentLaw(form, 1) for form in others}
    # there is one constant, whatever is its form
    assert near == {CurrentLaw(own, 0), CurrentLaw(own, 2), *turned}


def plainly(levels: int) -> tuple[LawSearch, list[int]]:
    """Return a search whose parameters all are polynomials of their own, and those that are positive."""
    search = search_of(levels)
    reference = tuple(CurrentLaw("plain", 0) for _ in search.groups)
    low = [search.tests.cube.params[k].low for k in search.tests.free]
    return LawSearch(search.tests, search.groups, reference, {}), [k for k, least in enumerate(low) if least > 0.0]


def test_two_points_tell_no_form_and_a_law_through_all_has_the_one_that_comes_nearest_before() -> None:
    two, three, four = (plainly(levels)[0] for levels in (2, 3, 4))
    # the optima grow exponentially with current
    positive = plainly(3)[1]
    assert len(positive) > 2
    for k in positive:
        assert two.forms(k) == ("plain",) and set(three.forms(k)) == {"plain", "log", "sat"}
        assert (three.own_form(k, 1), three.own_form(k, 2), four.own_form(k, 2)) == ("plain", "log", "plain")
        through = {s[k] for s in three.neighbours(three.reference, k) if s[k].order == 2}
        assert through == {CurrentLaw("log", 2)}


def test_of_three_levels_the_own_form_stays_unless_another_is_three_times_nearer() -> None:
    search, (k, *_) = plainly(3)
    # an exponential is nearer than a line to all but the first, more than three times to the last alone
    for bend, form in ((0.0, "plain"), (0.4, "plain"), (1.0, "log")):
        theta, currents = search.tests.theta.copy(), search.tests.currents
        theta[:, search.tests.free[k]] = 100.0 * (1.0 + currents + bend * currents**2)
        own = LawSearch(replace(search.tests, theta=theta), search.groups, search.reference, {})
        assert own.own_form(k, 2) == form
        assert (own._distance(k, "log") < own._distance(k, "plain")) is (bend > 0.0)


@pytest.mark.parametrize(
    ("more", "alike"),
    [
        ([1.0, -1.0, 0.5], True),
        ([15.0, -5.0, -5.0], True),
        # 13 % worse in one condition, though not in their sum
        ([25.0, -5.0, -5.0], False),
        ([10.0, 11.0, 12.0], False),
        # steadily worse, by 0.3 % in the mean
        ([0.5, 0.6, 0.7], True),
        ([np.inf, 0.0, 0.0], False),
    ],
)
def test_a_law_is_as_good_within_a_standard_error_or_by_next_to_nothing(more: list[float], alike: bool) -> None:
    search = search_of()
    state = changed(search.reference, 0, CurrentLaw("plain", 1))
    search.deviances = {search.reference: np.zeros(3), state: np.array(more)}
    assert search._alike(state, search.reference) is alike


def test_two_conditions_tell_no_standard_error() -> None:
    search = search_of()
    search.deviances = {search.reference: np.zeros(2)}
    assert not search._alike(search.reference, search.reference)


def test_the_error_at_a_level_left_out_is_a_multiple_of_what_its_own_fit_leaves() -> None:
    search = search_of()
    # levels 1 and 2 are left out, of which the second has conditions 3 and 4
    search.tests.squares[:] = [9.0, 9.0, 2.0, 1.0, 2.0, 9.0]
    search.tests.unseen[4] = 1.0
    search.deviances[search.reference] = WORTH * np.log([4.0, 1.0, 9.0])
    found = search.errors(search.reference)
    assert found[[1, 2]] == pytest.approx([2.0, np.sqrt((1.0 * 1.0 + 3.0 * 9.0) / 4.0)])
    assert np.isnan(found[[0, 3]]).all()


@pytest.mark.parametrize(
    ("leaves", "open_", "deviances", "said"),
    [
        (True, True, 0.0, "it falls below the parameter's bound between the currents"),
        (False, True, 0.0, "the tests do not determine it"),
        (False, False, 50.0, "it is worse where single conditions are left out"),
        (False, False, 49.0, "the gain does not pay for the change"),
        (False, False, 0.0, "the gain is within one standard error over conditions"),
    ],
)
def test_a_nearer_law_that_is_not_taken_has_the_first_reason_that_holds(
    leaves: bool, open_: bool, deviances: float, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    search = search_of()
    state = changed(search.reference, 0, CurrentLaw(search.reference[0].form, 1))
    search.deviances = {search.reference: np.array([50.0, 0.0, 0.0]), state: np.array([deviances, 0.0, 0.0])}
    monkeypatch.setattr(LawSearch, "_leaves_bounds", lambda self, s: leaves)
    monkeypatch.setattr(LawSearch, "is_determined", lambda self, s: not open_)
    assert search.objection(state, search.reference) == said


def judged_by(search: LawSearch, monkeypatch: pytest.MonkeyPatch, misfit: Any) -> None:
    """Have a search judge states by a function instead of simulations, and all of them allowed."""

    def score(self: LawSearch, states: Any) -> None:
        self.deviances |= {s: np.full(3, misfit(s) / 3.0) for s in states}

    monkeypatch.setattr(LawSearch, "score", score)
    monkeypatch.setattr(LawSearch, "_leaves_bounds", lambda self, s: False)
    monkeypatch.setattr(LawSearch, "is_determined", lambda self, s: True)


def test_laws_change_one_at_a_time_as_long_as_it_pays_and_not_where_bounds_are_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    search = search_of()
    own = [law.form for law in search.reference]
    much = 10.0 * search.price
    judged_by(search, monkeypatch, lambda s: much * (abs(s[0].order - 2) + abs(s[1].order - 1)) + 0.1 * s[2].order)
    best = search.best([search.reference])
    assert best[:3] == (CurrentLaw(own[0], 2), CurrentLaw(own[1], 1), CurrentLaw(own[2], 0))
    monkeypatch.setattr(LawSearch, "_leaves_bounds", lambda self, s: s[1].order > 0)
    assert search.best([search.reference])[:2] == (CurrentLaw(own[0], 2), CurrentLaw(own[1], 0))


def test_of_laws_alike_the_nearest_to_the_reference_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    search = search_of()
    own = search.reference[0].form
    best = changed(search.reference, 0, CurrentLaw(own, 2))
    # the first order is worth its cost, the second next to nothing
    judged_by(search, monkeypatch, lambda s: {0: 60.0, 1: 0.2, 2: 0.0}[s[0].order])
    search.score([best])
    assert search.nearest(best) == changed(search.reference, 0, CurrentLaw(own, 1))


def test_a_law_that_is_not_determined_gives_way_where_the_data_oppose_it_least(monkeypatch: pytest.MonkeyPatch) -> None:
    search = search_of()
    state = tuple(CurrentLaw(law.form, 1 if k < 2 else 0) for k, law in enumerate(search.reference))
    judged_by(search, monkeypatch, lambda s: 5.0 * (s[0].order == 0) + 3.0 * (s[1].order == 0))
    monkeypatch.setattr(LawSearch, "is_determined", lambda self, s: s[0].order * s[1].order == 0)
    assert [law.order for law in search.determined(state)[:2]] == [1, 0]
    # where no one change is enough, that which leaves least open comes first
    monkeypatch.setattr(LawSearch, "is_determined", lambda self, s: s[0].order + s[1].order == 0)
    opened: list[State] = []
    monkeypatch.setattr(LawSearch, "_openness", lambda self, s: opened.append(s) or float(s[0].order))
    assert [law.order for law in search.determined(state)[:2]] == [0, 0]
    assert len(opened) == 2 and MOST_OPEN == 0.5


def linear_tests(noise: float, currents: Array, strokes: int = 1) -> by_level.Tests:
    """Return what is known of y = p·u at levels of current, with noise that is the same at every level."""
    rng = np.random.default_rng(8)
    drive, error = rng.standard_normal((1, 4000)), noise * rng.standard_normal(4000)
    assembly, cube = linear_model("yield")
    target = 0.4 * drive[0] + error
    best = float(drive[0] @ target / (drive[0] @ drive[0]))
    levels, fits = [], []
    for current in currents:
        one = block(drive, target)
        blocks = [replace(one, segment=replace(one.segment, condition=f"s{k}")) for k in range(strokes)]
        posed = LeastSquaresProblem(blocks, np.ones(strokes), assembly, cube)
        levels.append(LevelProblem(posed, np.full(strokes, noise)))
        fits.append(LevelFit(float(current), noise, np.array([best])))
    return by_level.tests_about(assembly.spec, cube, fits, levels)


@pytest.mark.parametrize("order", [0, 1])
def test_the_standard_error_of_a_stroke_is_that_of_a_regression_over_levels(order: int) -> None:
    known = linear_tests(0.1, np.array([0.0, 1.0, 2.0]))
    found = Laws(known, [[CurrentLaw("plain", order)]], np.arange(3)).standard_errors()[0]
    # of a mean of three, or of the ends and the middle of a line through three
    shares = [1 / 3] * 3 if order == 0 else [5 / 6, 1 / 3, 5 / 6]
    expected = 0.1 * np.sqrt(shares) / (0.4 * np.sqrt(4000))
    assert found == pytest.approx(np.tile(expected, (3, 1)), rel=0.06)


def test_what_is_worth_as_samples_is_noise_by_its_colour_and_own_error_by_strokes() -> None:
    rng = np.random.default_rng(9)
    noise = 0.1 * rng.standard_normal(4000)
    assembly, cube = linear_model("yield")
    posed = LeastSquaresProblem([block(rng.standard_normal((1, 4000)), noise)], np.ones(1), assembly, cube)
    rows = posed.residuals(np.array([[0.5]]))[0, :-1]
    assert LevelProblem(posed, np.array([0.05])).excess(rows) == pytest.approx(2.0, rel=0.03)
    assert LevelProblem(posed, np.array([0.11])).worth(rows) == pytest.approx(4000.0, rel=0.1)
    # of noise that was not measured a thousandth of the output counts: all is the model's own
    assert LevelProblem(posed, np.array([0.0])).excess(rows) == pytest.approx(1e3, rel=0.01)
    assert LevelProblem(posed, np.array([0.0])).worth(rows) == pytest.approx(4.0, rel=1e-3)
    assert [_own_share(e) for e in (0.0, 0.5, 1.0, 2.0)] == [0.0, 0.0, 0.0, 0.75]


def test_a_level_of_one_stroke_is_not_taken_to_be_met_better_than_those_of_several() -> None:
    places, powers = np.array([0, 0, 1, 2]), np.array([1.0, 1.0, 10.0, 1.0])
    # the model leaves 0.3 of the power in the median where there are several strokes
    assert _unseen(places, np.array([0.2, 0.4, 1.0, 5.0]), powers) == pytest.approx([0.1, 0.0, 2.0, 0.0])
    assert _unseen(np.array([0, 1, 2, 3]), np.ones(4), powers).tolist() == [0.0] * 4


def test_the_deviance_is_twice_the_logarithm_of_a_likelihood_ratio_of_as_many_samples() -> None:
    known = linear_tests(0.1, np.array([0.0, 1.0, 2.0]), strokes=2)
    test, theta = 1, np.array([[known.theta[0, 0]], [0.5], [np.nan]])
    found = known.deviance(test, theta)
    own = known.posed[test]
    drive, target = own.blocks[0].drive[0], own.blocks[0].target
    squares = [float(np.sum((t[0] * drive - target) ** 2)) for t in theta[:2]]
    assert found[0] == pytest.approx(0.0, abs=1e-6)
    assert found[1] == pytest.approx(known.worth[test] * np.log(squares[1] / squares[0]), rel=1e-3)
    assert found[2] == np.inf


def test_a_law_leaves_bounds_only_where_a_positive_parameter_falls_below_its_own_between_levels() -> None:
    known = about_optima(1)
    positive = [p.low > 0.0 for p in (known.cube.params[k] for k in known.free)]
    for form, order, expected in (("plain", 2, True), ("sat", 2, True), ("log", 2, False), ("plain", 0, False)):
        for k, low_is_positive in enumerate(positive):
            if form == "log" and not low_is_positive:
                continue
            own = [CurrentLaw("plain", 0)] * len(positive)
            own[k] = CurrentLaw(form, order)
            laws = Laws(known, [own], np.arange(6))
            # high at both ends, far below zero between them
            laws.coefficients[:] = 1e9
            laws.coefficients[0, k : k + order + 1] = [0.0, 0.0, 1e9][: order + 1]
            grid = np.linspace(0.0, 1.0, 65)
            assert bool(laws.leaves_bounds(grid)[0]) is (expected and low_is_positive), (form, k)


@pytest.mark.parametrize(
    ("order", "highest", "found"),
    [
        ("sat2", 1, "plain1"),
        ("sat1", 4, "plain1"),
        ("log3", 1, "log1"),
        ("plain2", 3, "plain2"),
        (3, 2, 2),
        (1, 4, 1),
        (2, 0, 0),
    ],
)
def test_an_order_is_capped_within_its_form_and_one_that_saturates_becomes_a_polynomial(
    order: int | str, highest: int, found: int | str
) -> None:
    assert choice._capped(order, highest) == found


def chosen(met: bool, *orders: tuple[str, int | str]) -> LawChoice:
    dependence = CurrentDependence(orders, 0.0, 2.0) if orders else None
    about_it = CurrentChoice(judged_by="held-out currents", text=[])
    return LawChoice(dependence, about_it, [], [], np.zeros((3, 1)), False, {"fy": 2, "c": 1}, met, 1.0)


def test_laws_of_a_base_that_may_lack_an_effect_are_no_higher_than_its_roles_unless_they_reach_what_was_held_out() -> (
    None
):
    orders = (("fy", 3), ("c", "sat2"), ("k", 4))
    assert chosen(True, *orders).as_base() == CurrentDependence((("fy", 3), ("c", "plain1"), ("k", 4)), 0.0, 2.0)
    assert chosen(False, *orders).as_base() == CurrentDependence((("fy", 2), ("c", "plain1"), ("k", 4)), 0.0, 2.0)
    assert chosen(False).as_base() is None


def test_coefficients_without_a_role_vary_together_behind_the_others() -> None:
    known = about_optima(1)
    params = [known.cube.params[k] for k in known.free]
    bare = [replace(p, role="" if k in (0, 2) else "yield") for k, p in enumerate(params[:4])]
    assert choice._groups(bare, [0, 1, 2, 3]) == [[1], [3], [0, 2]]
    assert choice._groups(bare, [1, 3]) == [[1], [3]]


def test_laws_are_told_in_words_and_those_that_look_alike_are_not_told() -> None:
    assert [choice._words(f, o) for f, o in (("plain", 1), ("log", 2), ("sat", 3), ("log", 0))] == [
        *("straight line", "exponential of a parabola", "cubic of a saturating current", "constant"),
    ]
    assert [choice._shown(e) for e in (1.234, 9.994, 9.996, 123.4, np.inf, None)] == [
        *("1.23", "9.99", "10", "123", "diverges", "diverges"),
    ]
    assert choice._mean(np.array([1.0, np.nan, 4.0])) == pytest.approx(2.0)

    def tried(error: float, why: str = "") -> LawTried:
        return LawTried(form="plain", order=1, error=error, why=why)

    assert choice._rejected([], 1.0) == ""
    assert choice._rejected([tried(1.001)], 1.0) == "; other laws come as near"
    five = [tried(0.9, "it is worse"), *(tried(2.0 + k) for k in range(4))]
    said = choice._rejected([tried(1.001), *five], 1.0)
    assert said.startswith("; not taken: straight line 0.90 (it is worse), straight line 2.00")
    assert said.count("straight line") == choice.TOLD


@pytest.mark.parametrize(
    ("levels", "excess", "error", "unmet"),
    [(4, 1.0, 1.6, True), (4, 1.0, 1.4, False), (4, 1.6, 9.0, False), (3, 1.0, 9.0, False)],
)
def test_a_current_is_not_met_only_where_it_was_held_out_and_the_model_itself_does_not_err(
    levels: int, excess: float, error: float, unmet: bool
) -> None:
    search = search_of(levels)
    search = LawSearch(replace(search.tests, excess=excess), search.groups, search.reference, {})
    errors = np.array([np.nan, 1.0, error, np.nan][:levels])
    assert choice._unmet(search, errors) == (2 if unmet else None)
    kinds = [w.text for w in choice._warnings(search, search.reference, errors)]
    assert len(kinds) == unmet and all("at 0.7 A, held out, the error is 1.6 times" in t for t in kinds)
    varying = changed(search.reference, 0, CurrentLaw("plain", 1))
    unchecked = [w.text for w in choice._warnings(search, varying, errors) if "leave none to hold out" in w.text]
    assert len(unchecked) == (levels == 3)
