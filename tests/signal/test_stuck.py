"""A channel that stands at one number while the test goes on is stuck; rails, offs, holds and ends are no fault."""

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.signal.stuck import NEVER_BY_CHANCE, STUCK, stuck_rows

N, FIRST = 3000, 1400


def moving(noise: float = 0.01, seed: int = 1) -> Array:
    return np.sin(2.0 * np.pi * np.arange(N) / 250.0) + noise * np.random.default_rng(seed).standard_normal(N)


def stuck(values: Array, first: int, count: int, level: float | None = None) -> Array:
    changed = values.copy()
    changed[first : first + count] = values[first] if level is None else level
    return changed


def rows(values: Array, name: str = "force", **others: Array) -> list[tuple[int, int]]:
    found, _ = stuck_rows({name: values, **others}, name)
    return [(r.start, r.stop) for r in found]


def test_a_sound_channel_has_no_stuck_rows() -> None:
    assert rows(moving()) == [] == rows(moving(0.0))


@pytest.mark.parametrize("count", [NEVER_BY_CHANCE + 1, 40, 300])
def test_a_run_of_one_number_in_a_noisy_channel_is_found_to_the_sample(count: int) -> None:
    assert rows(stuck(moving(), FIRST, count)) == [(FIRST, FIRST + count)]


def test_a_run_that_chance_makes_is_none() -> None:
    assert rows(stuck(moving(), FIRST, NEVER_BY_CHANCE - 1)) == []


def test_several_runs_are_found_each() -> None:
    values = stuck(stuck(moving(), 800, 40), 2200, 60)
    assert rows(values) == [(800, 840), (2200, 2260)]


def test_a_shorter_run_beside_it_hides_none() -> None:
    values = stuck(stuck(moving(), 800, NEVER_BY_CHANCE - 1), 2200, 60)
    assert rows(stuck(values, FIRST, 19)) == [(FIRST, FIRST + 19), (2200, 2260)]


@pytest.mark.parametrize(("times", "found"), [(4, True), (6, False)])
def test_a_run_is_none_that_a_rest_may_make_where_neighbours_are_alike_for_long(times: int, found: bool) -> None:
    values = moving()
    for first in np.linspace(100, FIRST - 100, times).astype(int):
        values[first : first + 6] = values[first]
    assert rows(stuck(values, FIRST, 15)) == [(FIRST, FIRST + 15)] * found


def test_a_channel_without_noise_has_to_stand_longer_and_to_jump_or_to_be_left_alone() -> None:
    smooth = moving(0.0)
    assert rows(stuck(smooth, FIRST, STUCK - 2)) == []
    assert rows(stuck(smooth, FIRST, 100)) == [(FIRST, FIRST + 100)]


@pytest.mark.parametrize("level", [None, 0.0])
def test_at_the_beginning_nothing_has_been_switched_on_yet_unless_the_test_goes_on(level: float | None) -> None:
    values = stuck(moving(), 0, 210, level)
    assert rows(values) == [] == rows(values, current=moving(seed=2), temperature=moving(seed=3))
    assert rows(values, displacement=stuck(moving(seed=2), 0, 230)) == []
    assert rows(values, displacement=moving(seed=2)) == [(0, 210)]
    assert rows(values, "current", displacement=moving(seed=2)) == []


def test_at_the_end_the_machine_may_be_off_unless_another_channel_moves() -> None:
    values = stuck(moving(), N - 200, 200)
    assert rows(values) == [] == rows(values, displacement=stuck(moving(seed=2), N - 200, 200))
    assert rows(values, displacement=moving(seed=2)) == [(N - 200, N)]


def test_a_coil_may_be_switched_off_and_a_load_cell_may_not() -> None:
    values = stuck(moving(), FIRST, 200, level=0.0)
    assert rows(values, "current") == [] == rows(values, "voltage")
    assert rows(values, "force") == [(FIRST, FIRST + 200)]
    assert rows(stuck(moving(), FIRST, 200, level=0.5), "current") == [(FIRST, FIRST + 200)]


def switched(code: float = 5e-4) -> Array:
    """Return a current between two levels that are reached over an overshoot, as a coil's controller has them."""
    at = np.arange(N) % 300
    on, off = 2.0 + 0.1 * np.exp(-at / 8.0), 0.3 - 0.05 * np.exp(-(at - 170.0) / 8.0)
    ripple = 2e-3 * np.random.default_rng(4).standard_normal(N)
    quiet = ((at > 90) & (at < 170)) | (at > 260)
    return np.round((np.where(at < 170, on, off) + np.where(quiet, 0.0, ripple)) / code) * code


def test_a_current_that_a_controller_switches_stands_at_its_levels_and_elsewhere_is_stuck() -> None:
    values = switched()
    assert rows(values, "current", displacement=moving()) == []
    assert rows(values, "force", displacement=moving())
    assert rows(stuck(values, FIRST, 60, level=1.1), "current") == [(FIRST, FIRST + 60)]


def test_a_rail_that_is_met_and_left_smoothly_is_none_and_one_with_a_jump_is() -> None:
    clipped = np.minimum(moving(0.0), 0.9)
    assert rows(clipped, displacement=moving(seed=2)) == []
    values = stuck(moving(0.0), 1250, 120, level=1.0)
    assert rows(values) == [(1250, 1370)]


def test_a_channel_that_holds_again_and_again_is_a_command_and_no_fault() -> None:
    held = np.repeat(np.random.default_rng(3).standard_normal(N // 60), 60)
    assert rows(held) == []


def test_within_one_code_of_a_converter_a_channel_stands_too() -> None:
    code = 2.0 / 2**12
    values = np.round(moving(0.002) / code) * code
    flicker = values.copy()
    flicker[FIRST : FIRST + 300] = values[FIRST] + code * (np.arange(300) % 2)
    found, within = stuck_rows({"force": flicker}, "force")
    assert [(r.start, r.stop) for r in found] == [(FIRST, FIRST + 300)] and within == pytest.approx(code)
    assert rows(values) == []
