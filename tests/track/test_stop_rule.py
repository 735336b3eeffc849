"""The stop rule of a test without a fit: when it looks, what is enough, and how many cycles it will need."""

import math
from collections.abc import Iterator
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

from mrfit.api.recordings import Recording
from mrfit.core.recording import Recording as CoreRecording
from mrfit.errors import DataError
from mrfit.io.schemas.determined import POOR, SLIGHT
from mrfit.io.schemas.fit import Quantity
from mrfit.settings.watch import Settings
from mrfit.track.watch import CYCLES_BETWEEN, DRIFT, LookAtTest, _share, replayed, steady_cycles, watch

MODULE = import_module("mrfit.track.watch")
# Samples of a cycle
CYCLE = 50


def record(cycles: int) -> Recording:
    t = np.arange(CYCLE * cycles) / CYCLE
    x, v = 0.01 * np.sin(2 * np.pi * t), 0.02 * np.pi * np.cos(2 * np.pi * t)
    return Recording.from_arrays(dt=1.0 / CYCLE, name="test", displacement=x, velocity=v, force=900.0 * v)


def quantity(half: float | None, value: float = 100.0, name: str = "fy", **more: float | bool) -> Quantity:
    ends = (None, None) if half is None else (value - half, value + half)
    return Quantity(name=name, value=value, unit="N", low=ends[0], high=ends[1], **more)  # type: ignore[arg-type]


@pytest.fixture
def shrinking(monkeypatch: pytest.MonkeyPatch) -> float:
    """Let a fit have a half-width of 20/sqrt(cycles) %, and halves of a test be too short for one."""

    def fitted(one: CoreRecording, model: str) -> list[Quantity]:
        cycles = one.samples / CYCLE
        if one.samples < whole[0]:
            raise DataError("too short")
        whole[0] = one.samples
        return [quantity(20.0 / math.sqrt(cycles)), quantity(None, 5.0, "f0")]

    whole = [0]
    monkeypatch.setattr(MODULE, "_fitted", fitted)
    monkeypatch.setattr(MODULE, "steady_cycles", lambda one: (one.samples // CYCLE, float(CYCLE)))
    return 20.0


def looks(most: int, **rule: float | int | tuple[str, ...]) -> list[LookAtTest]:
    whole = record(most)

    def growing() -> Iterator[CoreRecording]:
        for n in range(1, most + 1):
            yield replace(whole, channels={name: v[: n * CYCLE] for name, v in whole.channels.items()})

    return list(watch(growing(), "tanh", Settings(**rule)))  # type: ignore[arg-type]


def test_it_looks_at_the_fewest_cycles_and_then_after_a_twentieth_more(shrinking: float) -> None:
    seen = [one.cycles for one in looks(50, within=0.1, parameters=("fy",), least_cycles=6)]
    assert seen[:3] == [6, 7, 8] and CYCLES_BETWEEN == 0.05
    # from 40 cycles on a twentieth is two of them
    assert [n for n in seen if n >= 38] == [38, 39, 40, 42, 44, 46, 48, 50]


def test_it_stops_at_the_second_look_whose_intervals_are_narrow_enough(shrinking: float) -> None:
    seen = looks(40, within=6.0, parameters=("fy",))
    # with the drift that is expected before any is seen: h^2 + (1.96*DRIFT*asked)^2 is that asked for, squared
    enough = (shrinking / 6.0) ** 2 / (1.0 - (1.96 * DRIFT) ** 2)
    assert seen[-1].cycles == math.ceil(enough) + 1 and seen[-1].reached
    assert not any(one.reached for one in seen[:-1])
    # the one before had it by itself
    assert seen[-2].values[0].reached and not seen[-3].values[0].reached
    assert seen[-1].seconds == pytest.approx(seen[-1].cycles)


def test_cycles_needed_grow_with_the_square_of_the_half_width(shrinking: float) -> None:
    last = looks(8, within=2.0, parameters=("fy",))[-1]
    # 20/sqrt(N) = 2, but for rounding
    assert last.cycles == 8 and last.needed in (100, 101)


def test_a_parameter_that_the_test_leaves_open_is_never_reached(shrinking: float) -> None:
    (open_one,) = looks(5, within=2.0, parameters=("f0",), least_cycles=5)
    assert open_one.needed is None and not open_one.reached and not open_one.values[0].reached


def test_without_names_those_count_that_the_test_determines(shrinking: float) -> None:
    (last,) = looks(9, within=3.0, least_cycles=9)
    assert [v.name for v in last.values] == ["fy"]


def test_parameters_that_are_named_count_in_the_order_of_the_model(shrinking: float) -> None:
    (last,) = looks(9, within=3.0, least_cycles=9, parameters=("f0", "fy"))
    assert [v.name for v in last.values] == ["fy", "f0"] and not last.reached


@pytest.mark.parametrize(("most", "before"), [(41, 40), (3, None)])
def test_a_test_that_ends_between_looks_is_looked_at_once_more(shrinking: float, most: int, before: int | None) -> None:
    seen = [one.cycles for one in looks(most, within=0.1, parameters=("fy",))]
    assert seen[-1] == most and (seen[-2:-1] or [None])[0] == before


def test_the_last_look_stands_by_itself_where_no_other_can_confirm_it(shrinking: float) -> None:
    enough = math.ceil((shrinking / 6.0) ** 2 / (1.0 - (1.96 * DRIFT) ** 2))
    *before, last = looks(enough, within=6.0, parameters=("fy",))
    assert last.reached and not before[-1].reached and last.cycles == before[-1].cycles == enough


def test_a_share_is_the_half_width_over_that_which_is_asked_for() -> None:
    assert _share(quantity(6.0), 6.0) == pytest.approx(1.0)
    assert _share(replace(quantity(6.0), low=90.0, high=108.0), 6.0) == pytest.approx(1.5)
    assert _share(quantity(6.0, -100.0), 3.0) == pytest.approx(2.0)
    assert _share(quantity(None), 6.0) == math.inf == _share(replace(quantity(6.0), high=math.inf), 6.0)
    # an offset may be zero: then it is asked for as a share of what it is added to
    assert _share(quantity(1.0, 0.0), 5.0) == math.inf
    offset = replace(quantity(1.0, 0.0), added_to=400.0)
    assert _share(offset, 5.0) == pytest.approx(1.0 / (0.05 * 400.0 * SLIGHT / POOR))


def test_a_record_is_replayed_after_each_of_its_cycles() -> None:
    whole = record(8)
    cycles, period = steady_cycles(whole)
    assert 6 <= cycles <= 8 and period == pytest.approx(CYCLE, rel=0.02)
    seen = list(replayed(whole))
    assert seen[-1] is whole and [one.samples for one in seen[:-1]] == [round(k * period) for k in range(1, len(seen))]
    assert seen[-2].samples < whole.samples <= seen[-2].samples + CYCLE + 1
    np.testing.assert_array_equal(seen[2].channels["force"], whole.channels["force"][: seen[2].samples])
    # too short to have a cycle
    assert steady_cycles(replace(whole, channels={n: v[:20] for n, v in whole.channels.items()})) == (0, math.inf)
