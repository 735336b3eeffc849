"""A group of segments as blocks, weights and generators, and steps on all samples of long ones."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.fit.identify import (
    SUMS_PER_CYCLE,
    UNCERTAINTY_SAMPLES,
    FitGroup,
    _finest,
    build_group,
    found_point,
    group_rng,
    linearise,
    measured_output,
    weights_of,
)
from mrfit.fit.refined import refined
from mrfit.search.cube import Cube, cube_of
from mrfit.search.parts import Blocks, SegmentPart
from mrfit.search.result import ChainLink, SearchResult
from mrfit.signal.noise_floor import NoiseFloor
from mrfit.simulate.assembly import Assembly, assemble
from tests.fit.benches import Bench, planted_segments, record
from tests.fit.toy import DT, block, linear_model, part

FLOOR = NoiseFloor(2.0, "cycles", 2.0, 2.0)


def group_of(parts: list[SegmentPart], chosen: list[int] | None = None, floors: tuple[float, ...] = ()) -> FitGroup:
    """Return a group of parts, all of them searched unless some are chosen."""
    known = [replace(FLOOR, value=f) for f in floors] or [FLOOR] * len(parts)
    group = FitGroup("all", [], Blocks(parts), known, list(range(len(parts))) if chosen is None else chosen)
    return replace(group, search=list(group.training))


def found_at(point: list[float]) -> SearchResult:
    link = ChainLink("lsq", "local", 100, 100, 9.0, "finished", "", ())
    return SearchResult(np.array(point), 9.0, 100, 0, None, (link,))


@given(st.lists(st.floats(1e-6, 1e6), min_size=1, max_size=6))
def test_weights_have_a_mean_of_one_and_are_as_the_inverse_of_noise_down_to_a_share_of_the_largest(
    floors: list[float],
) -> None:
    blocks = [block(np.zeros((1, 3)), np.arange(3.0))] * len(floors)
    found = weights_of(blocks, floors, "floor")
    assert np.mean(found) == pytest.approx(1.0)
    counted = np.maximum(floors, 1e-3 * max(floors))
    assert found * counted == pytest.approx(np.full(len(floors), found[0] * counted[0]))
    assert weights_of(blocks, floors, "none").tolist() == [1.0] * len(floors)


def test_weights_by_range_are_as_the_inverse_of_the_output_whatever_the_noise() -> None:
    blocks = [block(np.zeros((1, 3)), scale * np.array([-1.0, 0.0, 1.0]) + 7.0) for scale in (1.0, 4.0)]
    assert weights_of(blocks, [1.0, 100.0], "range") == pytest.approx([1.6, 0.4])
    # a record that does not move is no reason to divide by zero
    assert np.isfinite(weights_of([block(np.zeros((1, 3)), np.ones(3))], [0.0], "range")).all()


def test_the_generator_of_a_group_is_its_own_and_the_seeds() -> None:
    first = group_rng(3, "sine-1Hz").random(4).tolist()
    assert group_rng(3, "sine-1Hz").random(4).tolist() == first
    assert group_rng(4, "sine-1Hz").random(4).tolist() != first != group_rng(3, "sine-2Hz").random(4).tolist()


def test_the_share_that_was_searched_is_of_the_samples_that_are_fitted() -> None:
    sizes = ((100, "train"), (300, "train"), (50, "holdout"), (600, "train"))
    parts = [part(np.zeros((1, n)), np.zeros(n), role=role) for n, role in sizes]
    assert group_of(parts).share == 1.0
    group = group_of(parts, [1, 2], (1.0, 2.0, 3.0, 4.0))
    assert group.share == pytest.approx(0.3)
    assert group.fitted == [0, 1, 3] and group.training_floors == [2.0]
    assert [s.samples for s in group.judged.segments] == [300, 50] and len(group.training) == 1


@pytest.fixture(scope="module")
def planted() -> tuple[Assembly, dict[str, Recording]]:
    assembly = assemble("bingham")
    bench, rng = Bench(assembly, np.array([300.0, 900.0, 0.0]), 0.01, 1), np.random.default_rng(1)
    return assembly, {s.recording: record(bench, s, rng) for s in planted_segments(((1.0, 0.01),), (0.0, 1.0))}


def test_a_group_without_training_is_refused_and_one_that_is_split_has_some(
    planted: tuple[Assembly, dict[str, Recording]],
) -> None:
    assembly, recordings = planted
    held = [replace(s, role="holdout") for s in planted_segments(((1.0, 0.01),), (0.0, 1.0))]
    with pytest.raises(DataError, match="sine: no training segment; run `mrfit segment --holdout none`"):
        build_group("sine", held, recordings, assembly, split=False)
    group = build_group("sine", held, recordings, assembly, split=True)
    # the last third of eight cycles, by whole cycles
    assert [(s.role, s.cycles) for s in group.full.segments] == [("train", 6), ("holdout", 2)] * 2
    assert [s.id for s in group.training.segments] == [s.id for s in held] and len(group.search) == 2
    assert group.ahead == 0
    assert build_group("sine", held, recordings, assemble("bingham+delay"), split=True).ahead == 1


@pytest.mark.parametrize(("model", "advice"), [("boucwen-flux", "`mrfit flux`"), ("bingham", "force = {column = …")])
def test_a_log_without_the_output_is_told_what_to_do(model: str, advice: str) -> None:
    log = Recording("r", "r.csv", "", "none", DT, 0.0, {"current": np.zeros(3)}, {})
    with pytest.raises(DataError, match="r.csv: no ") as error:
        measured_output(log, assemble(model))
    assert advice in str(error.value)


def test_sums_over_neighbours_leave_every_cycle_of_a_piece_enough_of_them() -> None:
    def piece(samples_per_cycle: int, kept: bool) -> SegmentPart:
        one = part(np.zeros((1, 1)), np.zeros(1), cycles=1)
        own = replace(one.segment, frequency=1.0 / (samples_per_cycle * DT))
        return replace(one, segment=own, kept=kept)

    assert _finest([piece(20 * SUMS_PER_CYCLE, False), piece(7 * SUMS_PER_CYCLE, False)]) == 7
    assert _finest([piece(20 * SUMS_PER_CYCLE, False), piece(7 * SUMS_PER_CYCLE, True)]) == 20
    assert _finest([piece(SUMS_PER_CYCLE // 2, False)]) == 1
    # samples without cycles blur nothing
    assert _finest([part(np.zeros((1, 9)), np.zeros(9))]) == UNCERTAINTY_SAMPLES


def test_a_linearised_fit_of_a_linear_model_is_its_design_and_its_residual() -> None:
    rng = np.random.default_rng(1)
    drives, truth = [rng.standard_normal((2, n)) for n in (60, 90)], np.array([0.3, -0.2])
    noise = [s * rng.standard_normal(d.shape[1]) for s, d in zip((0.1, 0.4), drives, strict=True)]
    parts = [part(d, truth @ d + e, f"c{k}") for k, (d, e) in enumerate(zip(drives, noise, strict=True))]
    assembly, cube = linear_model("", "")
    found = linearise(group_of(parts, floors=(0.1, 0.4)), assembly, cube, cube.to_points(truth[None])[0], "floor")
    assert found.share == 1.0 and found.periods == [0.0, 0.0]
    for k, factor in enumerate((1.6, 0.4)):
        # the cube's unit is the width of the bounds, 2
        assert found.jacobians[k] == pytest.approx(factor * 2.0 * drives[k].T, rel=1e-6, abs=1e-9)
        assert found.residuals[k] == pytest.approx(-factor * noise[k], abs=1e-12)


def test_where_a_search_ended_is_kept_with_the_first_point_that_diverged_in_si() -> None:
    _, cube = linear_model("", "")
    kept = found_point(replace(found_at([0.5, 0.25]), nonfinite=3, first_nonfinite=np.array([1.0, 0.0])), cube)
    assert kept.first_nonfinite == {"p0": 1.0, "p1": -1.0} and (kept.point, kept.nonfinite) == ([0.5, 0.25], 3)
    assert kept.starts is None and found_point(found_at([0.5, 0.25]), cube).first_nonfinite is None


def planted_parts(counts: tuple[int, ...], noise: float, seed: int = 2) -> list[SegmentPart]:
    rng = np.random.default_rng(seed)
    made = []
    for k, count in enumerate(counts):
        drive = rng.standard_normal((2, count))
        made.append(part(drive, np.array([0.3, -0.2]) @ drive + noise * rng.standard_normal(count), f"c{k}"))
    return made


@pytest.mark.parametrize("weight", ["none", "floor"])
def test_steps_on_all_pieces_end_at_the_least_squares_of_all_and_not_of_those_searched(weight: str) -> None:
    parts = planted_parts((40, 50, 60), 0.5)
    # the pieces of one segment have one name and one floor; the first piece was searched
    parts[1] = replace(parts[1], segment=replace(parts[1].segment, id=parts[0].segment.id))
    held = part(np.ones((2, 30)), np.full(30, 9.0), "held", role="holdout")
    assembly, cube = linear_model("", "")
    group = group_of([*parts, held], [0, 2, 3], (0.5, 0.5, 0.1, 0.5))
    found = refined(group, assembly, cube, found_at([0.9, 0.1]), weight)
    factors = (1.0, 1.0, 1.0) if weight == "none" else (1.0 / 3.0, 1.0 / 3.0, 5.0 / 3.0)
    design = np.hstack([f * p.drive.values for f, p in zip(factors, parts, strict=True)]).T
    target = np.concatenate([f * p.output for f, p in zip(factors, parts, strict=True)])
    best = np.linalg.lstsq(design, target, rcond=None)[0]
    assert cube.to_theta(found.point[None])[0] == pytest.approx(best, abs=1e-7)
    assert found.cost == pytest.approx(np.sqrt(np.mean((design @ best - target) ** 2)))
    # a look at the start, the step, and one more that is not worth its time
    assert found.nfev == 100 + 2 * 5


def test_no_step_is_taken_from_the_optimum_nor_along_what_moves_no_output() -> None:
    rng = np.random.default_rng(3)
    row = rng.standard_normal(80)
    target = 0.4 * row + 0.3 * rng.standard_normal(80)
    assembly, cube = linear_model("", "")
    group = group_of([part(np.stack([row, row]), target)])
    sum_of = float(row @ target / (row @ row))
    there = cube.to_points(np.array([[sum_of + 0.25, -0.25]]))[0].tolist()
    same = refined(group, assembly, cube, found_at(there), "none")
    assert same.point.tolist() == there and same.nfev == 105
    moved = cube.to_theta(refined(group, assembly, cube, found_at([0.9, 0.5]), "none").point[None])[0]
    assert moved.sum() == pytest.approx(sum_of, abs=1e-7)
    assert moved[0] - moved[1] == pytest.approx(0.8, abs=1e-7)


def bending(scale: float) -> tuple[Assembly, Cube]:
    """arctan(scale·p)·u: far from the optimum a Gauss–Newton step goes much too far."""
    assembly, _ = linear_model("")

    def simulate(drive: Array, theta: Array, dt: float) -> Array:
        return np.arctan(scale * theta) * drive[:1]

    whole = replace(assembly, simulate=simulate)
    return whole, cube_of(whole.spec, {}, {}, {})


def test_a_step_that_goes_too_far_is_halved_and_never_ends_higher() -> None:
    assembly, cube = bending(10.0)
    group = group_of([part(np.ones((1, 20)), np.full(20, 0.01))])
    start = 0.75  # p = 0.5
    found = refined(group, assembly, cube, found_at([start]), "none")
    assert found.cost < math.atan(5.0) - 0.01
    assert found.cost == pytest.approx(abs(math.atan(10.0 * (2.0 * found.point[0] - 1.0)) - 0.01))


def test_steps_end_at_the_bounds() -> None:
    assembly, cube = linear_model("")
    row = np.linspace(1.0, 2.0, 50)
    found = refined(group_of([part(row[None], 3.0 * row)]), assembly, cube, found_at([0.5]), "none")
    assert found.point.tolist() == [1.0]
