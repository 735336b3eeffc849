"""Distances from neutral, and when a fit is searched for again."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.discover.evidence import refit as module
from mrfit.discover.evidence.bench import Bench
from mrfit.discover.evidence.refit import Fitter, Refit, paired_z, usual
from mrfit.discover.policy import STANDARD
from mrfit.errors import DataError
from mrfit.search.limits import Limits
from mrfit.search.problem import LeastSquaresProblem
from tests.discover.test_refit import refit


def test_an_effect_at_neutral_is_the_base_with_all_else_as_fitted() -> None:
    found = refit("stribeck", fs=10.0, vs=0.5)
    neutral = found.neutral_theta("stribeck")
    names = [p.name for p in found.cube.params]
    values = dict(zip(names, neutral[0], strict=True))
    assert values["stribeck.fs"] == 0.0
    own = [k for k, n in enumerate(names) if not n.startswith("stribeck.")]
    np.testing.assert_array_equal(neutral[0, own], found.theta[own])
    assert found.values["stribeck.fs"] == pytest.approx(10.0)


def test_the_distance_of_an_effect_is_that_of_its_strengths_in_the_cube_and_not_of_its_shapes() -> None:
    found = refit("stribeck", fs=10.0, vs=0.5)
    (place,) = found.distances("stribeck")
    param = next(p for p in found.cube.params if p.name == "stribeck.fs")
    assert found.cube.params[int(found.cube.free[place])] is param
    assert found.distances("stribeck")[place] == pytest.approx(10.0 / (param.high - param.low))
    (opposed,) = refit("stribeck", fs=0.0, vs=0.5).distances("stribeck").values()
    assert opposed == 0.0


def test_a_clearer_one_of_two_strengths_tells_an_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    found = refit("temperature")
    count = len(found.distances("temperature"))
    asked: list[tuple[int, int]] = []

    def score(uncertainty: Any, place: int, distance: float, numbers: int) -> float:
        asked.append((place, numbers))
        return float(place)

    monkeypatch.setattr(module, "score", score)
    known = Refit(found.effects, found.assembly, found.cube, found.point, [], [], lambda: cast(Any, None))
    assert count > 1 and known.strength("temperature") == max(known.distances("temperature"))
    assert [numbers for _, numbers in asked] == [count] * count


def test_the_error_of_a_role_is_over_all_its_records_alike() -> None:
    found = refit("inertia")
    train, holdout = [np.ones(3), np.full(9, 3.0)], [np.full(4, 2.0)]
    two = Refit(found.effects, found.assembly, found.cube, found.point, train, holdout, found.measure)
    assert two.chi("train") == pytest.approx(np.sqrt((3 + 9 * 9) / 12))
    assert two.chi("holdout") == 2.0


@pytest.mark.parametrize(("odd", "left_out"), [(1, True), (2, True), (3, False)])
def test_the_largest_two_of_a_thousand_errors_count_for_nothing(odd: int, left_out: bool) -> None:
    errors = np.ones(1000)
    errors[:odd] = 100.0
    assert (usual([errors]) == 1.0) is left_out


def test_samples_that_are_not_compared_do_not_dilute_an_error() -> None:
    assert usual([np.full(10, 2.0), np.zeros(90)]) == 2.0
    assert usual([np.zeros(5)]) == 0.0


def test_a_fall_has_the_score_of_its_mean_over_the_scatter_of_white_differences() -> None:
    rng = np.random.default_rng(4)
    before, after = np.sqrt(1.2 + rng.uniform(-1.0, 1.0, 4000)), np.ones(4000)
    fall = before**2 - after**2
    expected = float(fall.sum()) / (float(fall.std()) * np.sqrt(len(fall)))
    assert paired_z([before[:2000], before[2000:]], [after[:2000], after[2000:]]) == pytest.approx(expected, rel=0.3)
    assert paired_z([after], [before]) < 0.0


def fitter(samples: int = 0) -> Fitter:
    bench = cast(Bench, SimpleNamespace(samples=lambda role: samples))
    return Fitter(bench, "tanh", None, {}, {}, lambda effects, point: None)


@pytest.mark.parametrize(("samples", "stride"), [(0, 1), (12_000, 1), (12_001, 2), (24_001, 3)])
def test_no_more_samples_are_screened_than_are_allowed(samples: int, stride: int) -> None:
    assert STANDARD.screened_samples == 12_000
    assert fitter(samples).stride == stride


def test_a_base_of_which_every_simulation_diverges_is_one_line() -> None:
    with pytest.raises(DataError, match=r"every simulation of 'tanh\+inertia' diverged; choose another base model"):
        fitter()._remember(("inertia",), np.zeros(2), np.inf)
    own = fitter()
    own._remember(("inertia",), np.ones(2), 3.0)
    assert own.known["inertia",].tolist() == [1.0, 1.0]


@pytest.mark.parametrize(
    ("budget", "ending", "said"), [(50, "budget", True), (50, "finished", False), (None, "budget", False)]
)
def test_a_first_fit_that_ends_at_its_limit_says_so(
    monkeypatch: pytest.MonkeyPatch, budget: int | None, ending: str, said: bool
) -> None:
    found = SimpleNamespace(point=np.ones(2), cost=1.0, links=[SimpleNamespace(ending=ending)])
    monkeypatch.setattr(module.search, "run", lambda *given: found)
    monkeypatch.setattr(module, "limits_of_base", lambda *given: Limits(budget))
    cube = SimpleNamespace(start=np.ones(2), free=np.arange(2))
    for name, value in (("cube", cube), ("_posed", None), ("_data_driven", np.ones((1, 2))), ("_judged", None)):
        monkeypatch.setattr(Fitter, name, lambda *given, value=value: value)
    own = fitter()
    own.first(0)
    assert own.effort.left_out == ["further starts of the base's fit"] * said


@pytest.mark.parametrize(("start", "again"), [(0.985, True), (0.995, False), (1.5, False)])
def test_an_optimum_is_a_local_one_where_a_start_costs_less_already(start: float, again: bool) -> None:
    """The cost is the mean square; a start has to be lower by a hundredth of it."""

    def residuals(points: Array) -> Array:
        return np.repeat(np.sqrt(points[:, :1]), 7, axis=1)

    posed = cast(LeastSquaresProblem, SimpleNamespace(residuals=residuals))
    assert module._starts_lower(posed, np.array([[2.0], [start]]), np.ones(1)) is again


class _Searched(Exception):
    """A search was asked for."""


@pytest.mark.parametrize(("error", "again"), [(1.04, False), (1.06, True)])
def test_where_only_noise_is_left_nothing_is_searched_for_again(
    monkeypatch: pytest.MonkeyPatch, error: float, again: bool
) -> None:
    def searched(*given: Any) -> Any:
        raise _Searched

    monkeypatch.setattr(Fitter, "_data_driven", searched)
    found = refit("inertia")
    one = Refit(found.effects, found.assembly, found.cube, found.point, [np.full(9, error)], [], found.measure)
    if again:
        with pytest.raises(_Searched):
            fitter().thorough(one)
    else:
        assert fitter().thorough(one) is one
