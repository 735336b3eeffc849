"""What is left of tests that a fit has not seen: which are left out together, and refits without them."""

from dataclasses import replace

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.fit.diagnostics.remainders import (
    LEFT_OUT,
    PIECES,
    bends_of,
    borrowed,
    fitted_remainders,
    left_out,
    levels_of,
    refitted,
    units_of,
)
from mrfit.io.schemas.fit import Level, Quantity, Result
from mrfit.search.cube import cube_of
from mrfit.search.parts import SegmentPart
from mrfit.search.problem import LeastSquaresProblem
from mrfit.simulate.assembly import Assembly, assemble
from mrfit.simulate.current_dependence import CurrentDependence
from tests.fit.test_identify import group_of
from tests.fit.toy import block, linear_model, part


def strokes(*kinds: tuple[str, int], samples: int = 100) -> list[SegmentPart]:
    """Return tests by condition and number of cycles."""
    return [part(np.zeros((1, samples)), np.zeros(samples), name, cycles) for name, cycles in kinds]


def test_a_condition_is_left_out_with_all_its_repeats_and_a_motion_without_cycles_alone() -> None:
    units = units_of(strokes(("a", 4), ("road", 0), ("b", 4), ("a", 4), ("road", 0)))
    places = [(u.condition, [k for k, _ in u.members], u.share) for u in units]
    assert places == [("a", [0, 3], 1.0), ("b", [2], 1.0), ("road", [1], 1.0), ("road", [4], 1.0)]


@pytest.mark.parametrize(
    ("kinds", "cuts"),
    [
        ([("road", 0)], [PIECES]),
        ([("road", 0), ("street", 0)], [PIECES // 2] * 2),
        # with a periodic test nine pieces are wanted
        ([("a", 4), ("road", 0)], [PIECES - 1]),
        ([("road", 0), ("street", 0), ("track", 0)], [1, 1, 1]),
    ],
)
def test_few_motions_are_cut_so_that_something_is_left_to_fit(kinds: list[tuple[str, int]], cuts: list[int]) -> None:
    units = [u for u in units_of(strokes(*kinds, samples=103)) if u.condition != "a"]
    for name, count in zip((n for n, cycles in kinds if not cycles), cuts, strict=True):
        own = [u for u in units if u.condition == name]
        assert len(own) == count and sum(u.share for u in own) == pytest.approx(1.0)
        covered = np.concatenate([np.arange(103)[cut] for u in own for _, cut in u.members])
        assert covered.tolist() == list(range(103))


def at_currents(*currents: float | Array) -> tuple[list[SegmentPart], Assembly]:
    """Return tests at currents under a model of velocity and current."""
    assembly, _ = linear_model("", "")
    names = replace(assembly.spec, inputs=("velocity", "current"))
    drives = [np.stack([np.ones(50), np.broadcast_to(i, 50)]) for i in currents]
    return [part(d, np.zeros(50), f"c{k}", 5) for k, d in enumerate(drives)], replace(assembly, spec=names)


def levels(*currents: float | Array) -> list[list[int]]:
    return [[k for k, _ in u.members] for u in levels_of(*at_currents(*currents))]


def test_tests_at_one_current_are_left_out_together() -> None:
    # a level is held within 5 % of the greatest current
    assert levels(0.0, 1.0, 2.0, 0.05, 1.04, 2.0) == [[0, 3], [1, 4], [2, 5]]
    assert levels(0.0, 1.0, 2.0, 0.2) == [[0], [3], [1], [2]]


def test_without_three_held_currents_no_law_of_current_is_judged() -> None:
    assert levels(0.0, 2.0, 2.05) == []
    assert levels(0.0, 1.0, 2.0, np.linspace(0.0, 2.0, 50)) == []
    parts, assembly = at_currents(0.0, 1.0, 2.0)
    assert levels_of(parts, replace(assembly, spec=replace(assembly.spec, inputs=("velocity", "force")))) == []


def posed_linear(rows: int, seed: int) -> tuple[LeastSquaresProblem, Array, Array]:
    rng = np.random.default_rng(seed)
    drive = rng.standard_normal((2, rows))
    target = np.array([0.3, -0.2]) @ drive + 0.1 * rng.standard_normal(rows)
    assembly, cube = linear_model("", "")
    return LeastSquaresProblem([block(drive, target)], np.ones(1), assembly, cube), drive, target


def test_a_refit_without_some_residuals_is_the_least_squares_of_the_others() -> None:
    posed, drive, target = posed_linear(90, 4)
    best = np.linalg.lstsq(drive.T, target, rcond=None)[0]
    groups = np.append(np.arange(90) // 30, -1)
    found = posed.cube.to_theta(refitted(posed, posed.cube.to_points(best[None])[0], groups))
    for g in range(3):
        kept = groups[:-1] != g
        alone = np.linalg.lstsq(drive[:, kept].T, target[kept], rcond=None)[0]
        assert found[g] == pytest.approx(alone, abs=1e-6) and abs(alone - best).max() > 1e-3


def test_a_parameter_that_ended_at_a_bound_is_held_there_in_refits() -> None:
    posed, drive, target = posed_linear(90, 5)
    groups = np.append(np.arange(90) // 45, -1)
    found = posed.cube.to_theta(refitted(posed, np.array([0.6, 1.0]), groups))
    for g in range(2):
        kept = groups[:-1] != g
        rest = target[kept] - drive[1, kept]
        alone = float(drive[0, kept] @ rest / (drive[0, kept] @ drive[0, kept]))
        assert found[g] == pytest.approx([alone, 1.0], abs=1e-6)


def test_what_only_a_test_left_out_had_told_is_let_go_of_in_a_refit_with_bends() -> None:
    """The second parameter acts in the first half alone; held small, it does not stay at what that half had asked."""
    rng = np.random.default_rng(6)
    drive = np.stack([rng.standard_normal(60), np.where(np.arange(60) < 30, rng.standard_normal(60), 0.0)])
    target = np.array([0.3, 0.5]) @ drive
    assembly, cube = linear_model("", "")
    posed = LeastSquaresProblem([block(drive, target)], np.ones(1), assembly, cube)
    groups, point = np.append(np.arange(60) // 30, -1), cube.to_points(np.array([[0.3, 0.5]]))[0]
    bends = np.array([[0.0, 1.0]])
    stays = cube.to_theta(refitted(posed, point, groups))
    goes = refitted(posed, point, groups, bends)
    assert stays[0] == pytest.approx([0.3, 0.5], abs=1e-6)
    assert goes[0, 1] < 0.05
    # where the data tell it, its weight is far too small to move it
    assert cube.to_theta(goes)[1] == pytest.approx([0.3, 0.5], abs=1e-4)


def test_bends_are_the_coefficients_of_a_law_of_current_and_none_of_a_constant() -> None:
    dependence = CurrentDependence((("fy", 2), ("c", 1)), 0.0, 2.0)
    assembly = assemble("tanh", dependence)
    cube = cube_of(assembly.spec, {}, {}, {})
    bends, names = bends_of(assembly, cube), [cube.params[k].name for k in cube.free]
    assert bends.shape == (3, len(names))

    def told(**values: list[float]) -> list[float]:
        at = np.zeros(len(names))
        for name, own in values.items():
            places = [k for k, n in enumerate(names) if n.partition("@")[0] == name]
            at[places] = own
        return (bends @ at).tolist()

    assert told(fy=[4.0, 4.0, 4.0], c=[2.0, 2.0]) == pytest.approx([0.0] * 3, abs=1e-12)
    # of 3 + 2x - x², x from -1 to 1 over the range; the higher order counts ten times
    assert told(fy=[0.0, 3.0, 4.0], c=[1.0, 7.0]) == pytest.approx([2.0, -10.0, 3.0])
    assert bends_of(assemble("tanh"), cube_of(assemble("tanh").spec, {}, {}, {})).size == 0


def test_remainders_are_the_errors_of_a_fit_without_the_test() -> None:
    rng, truth = np.random.default_rng(7), np.array([0.3, -0.2])
    drives = [rng.standard_normal((2, 40)) for _ in range(3)]
    parts = [
        part(d, truth @ d + 0.05 * rng.standard_normal(40) + 0.1 * k * d[0], f"c{k}", 4) for k, d in enumerate(drives)
    ]
    assembly, cube = linear_model("", "")
    best = np.linalg.lstsq(np.hstack(drives).T, np.concatenate([p.output for p in parts]), rcond=None)[0]
    points, rows = left_out(group_of(parts), assembly, cube, cube.to_points(best[None])[0], "none")
    assert points.shape == (3, 2) and [(r.condition, r.role) for r in rows] == [(f"c{k}", LEFT_OUT) for k in range(3)]
    for k, row in enumerate(rows):
        others = [j for j in range(3) if j != k]
        design = np.hstack([drives[j] for j in others]).T
        alone = np.linalg.lstsq(design, np.concatenate([parts[j].output for j in others]), rcond=None)[0]
        error = alone @ drives[k] - parts[k].output
        assert row.quantile == pytest.approx(np.quantile(np.abs(error), 0.95), rel=1e-4)
        assert row.reach == pytest.approx(np.ptp(alone @ drives[k]), rel=1e-4)


def test_one_test_alone_says_nothing_of_others() -> None:
    assembly, cube = linear_model("")
    points, rows = left_out(group_of(strokes(("a", 4))), assembly, cube, np.array([0.5]), "none")
    assert points.shape == (0, 1) and rows == []


def test_a_fit_leaves_rows_by_role_and_only_those_not_fitted_lie_beyond() -> None:
    assembly, _ = linear_model("")
    wide, narrow = np.linspace(-2.0, 2.0, 20)[None], np.linspace(-1.0, 1.0, 20)[None]
    parts = [part(narrow, np.zeros(20), "a"), part(wide, np.zeros(20), "a", role="holdout")]
    rows = fitted_remainders(parts, [p.output + 0.5 for p in parts], assembly)
    assert [(r.role, r.quantile) for r in rows] == [("train", 0.5), ("holdout", 0.5)]
    # an overshoot of 1 over a range of 2, less 5 %
    assert [r.beyond for r in rows] == pytest.approx([0.0, np.log1p(0.45)])
    # one that diverged is no remainder
    assert fitted_remainders(parts[:1], [np.full(20, np.inf)], assembly) == []


def test_of_a_condition_by_itself_the_nearest_others_parameters_tell() -> None:
    assembly, _ = linear_model("")

    def fit_of(condition: str, frequency: float, value: float) -> Result:
        at = Level(frequency=frequency, amplitude=1.0, current=None)
        parameters = [Quantity(name="p0", value=value)]
        return Result(condition=condition, at=at, evaluations=1, parameters=parameters)

    own = part(np.ones((1, 100)), np.full(100, 0.5), "own", 5)
    assert own.segment.frequency == pytest.approx(50.0)
    results = [fit_of("own", 50.0, 0.5), fit_of("far", 5.0, 0.9), fit_of("near", 60.0, 0.75)]
    (row,) = borrowed([own], assembly, results)
    assert (row.condition, row.role) == ("own", LEFT_OUT) and row.quantile == pytest.approx(0.25)
