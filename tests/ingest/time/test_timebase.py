from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.ingest import series
from mrfit.ingest.text.printed import Digits, digits_of, print_step
from mrfit.ingest.time.timebase import TimeFault, on_grid, repeated, time_base


def test_uniform_times_give_the_interval_they_were_made_with() -> None:
    base = time_base(-0.3 + np.arange(1000) * 6.25e-6, None)
    assert base.dt == pytest.approx(6.25e-6, rel=1e-12)
    assert len(base.pieces) == 1 and base.pieces[0].position is None
    assert base.findings == []


def test_samples_lost_evenly_do_not_stretch_a_stated_interval() -> None:
    """A hundred even losses look like a slower clock printed to whole intervals; the header knows better."""
    every = np.delete(np.arange(100_000), np.arange(500, 100_000, 1000))
    base = time_base(every * 1e-6, 1e-6)
    assert base.dt == 1e-6
    assert [f.kind for p in base.pieces for f in p.findings] == ["dropped-samples"]
    values = on_grid(np.sin(every * 1e-3), base.pieces[0])
    assert len(values) == every[-1] + 1
    assert values == pytest.approx(np.sin(np.arange(len(values)) * 1e-3), abs=1e-6)


@settings(max_examples=30, deadline=None)
@given(
    rate=st.floats(20.0, 5e4),
    start=st.floats(-5.0, 5.0),
    rows=st.integers(2000, 4000),
    decimals=st.integers(0, 3),
)
def test_rate_from_rounded_times_is_true_to_the_record_length(
    rate: float, start: float, rows: int, decimals: int
) -> None:
    """Printed to a step near or above the interval, the whole record still gives the rate within one step."""
    step = 10.0 ** -(np.floor(np.log10(rate)) + decimals)
    time = np.round((start + np.arange(rows) / rate) / step) * step
    base = time_base(time, None)
    assert sum(p.rows.stop - p.rows.start for p in base.pieces) == rows
    assert abs(base.dt * rate - 1.0) < 2.0 * step * rate / rows + 2e-7
    assert len(base.pieces) == 1
    piece = base.pieces[0]
    assert piece.position is None  # no sample invented, none moved


def test_rounded_times_without_a_stated_rate_are_said() -> None:
    base = time_base(np.round(np.arange(3000) * 1.6e-6, 6), None)
    assert base.dt == pytest.approx(1.6e-6, rel=1e-4)
    assert [f.kind for f in base.findings] == ["rounded-time"]


@pytest.mark.parametrize("rounded", [np.floor, np.round])
@pytest.mark.parametrize(
    ("interval", "tick"), [(0.005, 0.016), (0.01, 0.06), (0.00996, 0.06), (0.2, 0.36), (1e-3, 0.6)]
)
def test_times_in_ticks_of_any_length_are_even(
    interval: float, tick: float, rounded: Callable[[series.Values], series.Values]
) -> None:
    time = rounded(np.arange(20_000) * interval / tick + 1e-9) * tick
    base = time_base(time, None)
    assert base.dt == pytest.approx(interval, rel=1e-12)
    assert [(p.rows, p.position) for p in base.pieces] == [(slice(0, 20_000), None)]
    assert [f.kind for f in base.findings] == ["rounded-time"]
    assert time_base(time, interval).dt == interval


@pytest.mark.parametrize(
    "time",
    [
        np.cumsum(np.random.default_rng(1).integers(1, 4, 2000)) * 1e-3,  # uneven steps of whole milliseconds
        np.arange(2000) * 5e-3 + np.random.default_rng(1).uniform(-2e-3, 2e-3, 2000),
        np.delete(np.floor(np.arange(2000) * 0.05 / 0.06 + 1e-9) * 0.06, [500, 501, 502, 900]),
    ],
)
def test_uneven_times_are_no_ticks(time: series.Values) -> None:
    assert [f.kind for p in time_base(time, None).pieces for f in p.findings] == ["resampled"]


def test_stated_interval_wins_over_rounded_times() -> None:
    base = time_base(np.round(np.arange(3000) * 1.6e-6, 6), 1.6e-6)
    assert base.dt == 1.6e-6
    assert base.findings == []


def test_false_stated_interval_is_said_and_not_used() -> None:
    base = time_base(np.arange(500) * 0.33, 1.0)
    assert base.dt == pytest.approx(0.33)
    assert [f.kind for f in base.findings] == ["rate-differs"]


@settings(max_examples=30, deadline=None)
@given(lost=st.sets(st.integers(5, 390), min_size=1, max_size=5))
def test_single_missing_samples_are_interpolated_and_all_others_untouched(lost: set[int]) -> None:
    lost = {k for k in lost if not {k - 1, k - 2, k - 3, k - 4, k - 5} & lost}
    keep = np.array([k for k in range(400) if k not in lost])
    time, values = keep * 1e-3, np.sin(0.05 * keep)
    base = time_base(time, None)
    (piece,) = base.pieces
    assert base.dt == pytest.approx(1e-3)
    filled = on_grid(values, piece)
    assert len(filled) == 400
    np.testing.assert_array_equal(filled[keep], values)
    np.testing.assert_allclose(filled, np.sin(0.05 * np.arange(400)), atol=2e-3)
    assert [f.kind for f in piece.findings] == ["dropped-samples"]
    assert f"{len(lost)} sample" in piece.findings[0].text


@pytest.mark.parametrize(("rate", "lost"), [(700.0, [9000]), (700.0, [3000, 9000, 9001]), (2000.0, [9000])])
def test_a_missing_sample_is_found_though_times_are_rounded(rate: float, lost: list[int]) -> None:
    """Printed to ms, every step for itself could be rounding."""
    keep = np.delete(np.arange(20000), lost)
    base = time_base(np.round(keep / rate, 3), None)
    (piece,) = base.pieces
    assert base.dt == pytest.approx(1.0 / rate, rel=1e-9)
    assert [f.kind for f in piece.findings] == ["dropped-samples"]
    assert piece.findings[0].text.startswith(f"{len(lost)} sample")
    place = on_grid(keep * 1.0, piece)
    assert len(place) == 20000
    assert np.max(np.abs(place - np.arange(20000))) <= 1.0  # known to the print only


def test_refused_rows_count_as_missing_samples() -> None:
    """Evenly spread, they look like a slower clock, printed coarsely; their lines say that they were there."""
    keep = np.delete(np.arange(2000), np.arange(50, 2000, 100))
    base = time_base(keep * 1e-3, None, number=keep * 1.0)
    (piece,) = base.pieces
    assert base.dt == 1e-3 and base.findings == []
    assert [f.kind for f in piece.findings] == ["dropped-samples"]
    np.testing.assert_allclose(on_grid(keep * 1.0, piece), np.arange(2000), atol=1e-9)


def test_refused_rows_of_a_rounded_log_count_as_missing_samples() -> None:
    keep = np.delete(np.arange(2000), np.arange(50, 2000, 100))
    base = time_base(np.round(keep / 700.0, 3), None, number=keep * 1.0)
    (piece,) = base.pieces
    assert base.dt == pytest.approx(1.0 / 700.0, rel=1e-9)
    np.testing.assert_allclose(on_grid(keep * 1.0, piece), np.arange(2000), atol=1e-9)


def test_refused_rows_that_were_no_samples_do_not_stretch_even_times() -> None:
    rows = np.arange(2000)
    time = np.round(rows / 700.0, 3)
    base = time_base(time, None, number=rows + np.floor(rows / 100.0))  # a page's title in every 100th line
    assert base.dt == pytest.approx(1.0 / 700.0, rel=1e-6)
    assert base.pieces[0].position is None or np.array_equal(base.pieces[0].position[:], rows)


def test_gap_splits_the_record() -> None:
    time = np.concatenate([np.arange(100), np.arange(200, 350)]) * 1e-3
    base = time_base(time, None)
    assert [(p.rows.start, p.rows.stop, p.start) for p in base.pieces] == [(0, 100, 0.0), (100, 250, 0.2)]
    assert [[f.kind for f in p.findings] for p in base.pieces] == [["gap"], []]
    assert base.pieces[0].findings[0].at == pytest.approx(0.099)


def test_clock_that_jumps_back_splits_the_record() -> None:
    base = time_base(np.concatenate([np.arange(100), np.arange(100)]) * 1e-3, None)
    assert [p.rows.start for p in base.pieces] == [0, 100]
    assert [[f.kind for f in p.findings] for p in base.pieces] == [["clock-jump"], []]


def test_stated_breaks_split_where_the_clock_does_not() -> None:
    base = time_base(np.arange(100) * 1e-3, None, (40,))
    assert [p.rows.start for p in base.pieces] == [0, 40]
    assert [[f.kind for f in p.findings] for p in base.pieces] == [["new-run"], []]


def test_cuts_are_said_where_they_are_and_many_in_one_line() -> None:
    """After a restart, times alone do not say which piece a cut is in."""
    few = time_base(np.tile(np.arange(100) * 1e-3, 3), None)
    assert [[f.kind for f in p.findings] for p in few.pieces] == [["clock-jump"], ["clock-jump"], []]
    assert [p.findings[0].at for p in few.pieces[:2]] == pytest.approx([0.099, 0.099])
    many = time_base(np.tile(np.arange(100) * 1e-3, 50), None, tuple(range(100, 5000, 100)))
    assert len(many.pieces) == 50
    (finding,) = [f for p in many.pieces for f in p.findings]
    assert finding.text.endswith("the record is split there, and so 48 more times")


def test_jitter_is_resampled_and_said() -> None:
    rng = np.random.default_rng(1)
    time = np.arange(1000) * 0.01 + rng.uniform(-0.002, 0.002, 1000)
    base = time_base(time, None)
    (piece,) = base.pieces
    assert base.dt == pytest.approx(0.01, rel=1e-3)
    assert [f.kind for f in piece.findings] == ["resampled"]
    grid = time[0] + base.dt * np.arange(len(on_grid(time, piece)))
    np.testing.assert_allclose(on_grid(3.0 * time, piece), 3.0 * grid, atol=1e-9)


def test_irregular_times_are_resampled_not_torn_apart() -> None:
    time = np.array([0.0, 0.33, 1.2, 1.53, 1.93, 2.84, 3.83, 7.96, 9.72])
    base = time_base(time, 1.0)
    assert len(base.pieces) == 1
    assert base.pieces[0].findings[0].kind == "resampled"


@pytest.mark.parametrize("time", [np.zeros(50), np.tile([0.0, 1.0, 0.5], 40), np.random.default_rng(0).random(100)])
def test_no_time_at_all_is_refused(time: np.ndarray) -> None:
    with pytest.raises(TimeFault):
        repeated(time)
        time_base(time, None)


def test_repeated_times_are_found() -> None:
    time = np.arange(200) * 1e-3
    time[50] = time[49]
    assert repeated(time).tolist() == [50] and repeated(time, (50,)).tolist() == []


@pytest.mark.parametrize("dt", [2e-3, 5e-3])
def test_runs_of_other_rates_have_intervals_of_their_own(dt: float) -> None:
    time = np.concatenate([2e-3 * np.arange(500), dt * np.arange(300), 2e-3 * np.arange(400)])
    base = time_base(np.round(time, 3), None)
    assert [p.dt or base.dt for p in base.pieces] == [2e-3, dt, 2e-3]
    assert [(p.rows.start, p.rows.stop, p.position) for p in base.pieces] == [
        (0, 500, None),
        (500, 800, None),
        (800, 1200, None),
    ]
    assert [f.kind for p in base.pieces for f in p.findings] == ["clock-jump", "clock-jump"]


def test_runs_of_a_long_log_are_looked_at_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(series, "SERIES_CHUNK", 128)
    time, lengths = np.concatenate([2e-3 * np.arange(1000), 5e-3 * np.arange(700)]), []

    def read(begin: int, end: int) -> np.ndarray:
        lengths.append(end - begin)
        return time[begin:end]

    base = time_base(series.Series(len(time), read), None)  # type: ignore[arg-type]
    assert [p.dt for p in base.pieces] == [pytest.approx(2e-3), pytest.approx(5e-3)]
    assert max(lengths) <= 2 * 128


def test_runs_of_one_rate_that_are_printed_coarsely_share_it() -> None:
    runs = [np.round(3.3e-3 * np.arange(n), 3) for n in (400, 300)]
    base = time_base(np.concatenate(runs), None)
    assert base.dt == pytest.approx(3.3e-3, rel=1e-3) and [p.dt for p in base.pieces] == [None, None]


def test_print_step_follows_a_change_of_format() -> None:
    fine, coarse = np.round(np.arange(2048) * 1e-4, 7), np.round(1.0 + np.arange(2048) * 3.3e-4, 4)
    steps = print_step(np.concatenate([fine, coarse]))
    assert steps[0] == pytest.approx(1e-4)
    assert steps[-1] == pytest.approx(1e-4)
    assert print_step(np.random.default_rng(0).random(600))[:].max() == 0.0


@settings(max_examples=30, deadline=None)
@given(
    decade=st.integers(-11, 2),
    digit=st.sampled_from([1, 2, 4, 5, 8]),
    lost=st.sets(st.integers(5, 2990), max_size=4),
    gap=st.sampled_from([0, 1000]),
    offset=st.integers(-4000, 4000),
)
def test_gaps_do_not_depend_on_the_unit_of_time(decade: int, digit: int, lost: set[int], gap: int, offset: int) -> None:
    """The same losses give the same samples whether the interval is 10 ps or 800 s."""
    keep = np.setdiff1d(np.arange(3000), np.array(sorted(lost), dtype=int))
    keep[keep > 1500] += gap
    step = digit * 10.0**decade
    time = np.array([float(f"{(k + offset) * digit}e{decade}") for k in keep])  # as a parser reads it
    base = time_base(time, None)
    assert base.dt == pytest.approx(step, rel=1e-9)
    assert len(base.pieces) == 1 + bool(gap)
    for piece in base.pieces:
        rows = keep[piece.rows]
        place = np.arange(len(rows)) if piece.position is None else np.asarray(piece.position[:])
        np.testing.assert_allclose(place, rows - rows[0], atol=1e-6)
        assert piece.start == pytest.approx((rows[0] + offset) * step, abs=1e-6 * step)


@pytest.mark.parametrize("unit", [1e-9, 1e-3, 1.0])
def test_samples_lost_evenly_show_where_times_have_more_digits_than_they_need(unit: float) -> None:
    """Every 60th row is missing: by the numbers alone that is a clock slower by 1.7 %; its text has 9 digits more."""
    keep = np.delete(np.arange(3000), np.arange(9, 3000, 60))
    base = time_base(keep * unit, None, printed=1e-9 * unit)
    (piece,) = base.pieces
    assert base.dt == pytest.approx(unit, rel=1e-12) and base.findings == []
    assert [f.text.split()[0] for f in piece.findings] == ["50"]
    np.testing.assert_allclose(np.asarray(piece.position[:]), keep)


def test_a_clock_that_ticks_coarsely_is_no_loss_of_samples() -> None:
    """Ticks of 1 ms printed to the microsecond: one step in five is double, the rate is 833 Hz."""
    time = np.floor(np.arange(4000) * 1.2) * 1e-3
    base = time_base(time, None, printed=1e-6)
    assert base.dt == pytest.approx(1.2e-3, rel=1e-6)
    assert [p.position for p in base.pieces] == [None]


def test_times_that_span_far_more_samples_than_rows_are_refused_before_memory_is_taken() -> None:
    """Rows of 1 s before rows of 10 ns, the interval that the header states: 51 thousand million samples."""
    time = np.concatenate([np.arange(512.0), 511.0 + np.arange(1, 4000) * 1e-8])
    with pytest.raises(TimeFault, match="4511 rows span 5.11e[+]10 samples"):
        time_base(time, 1e-8)


@pytest.mark.parametrize("rows", [513, 1025, 1600])
@pytest.mark.parametrize("step", [1.25e-9, 2e-3, 1.25e-3, 0.125])
def test_print_step_is_the_last_digit_whatever_the_scale(rows: int, step: float) -> None:
    """Every eighth row of 0.125 s ends in whole seconds, and so may the last row by itself."""
    last = 10.0 ** np.floor(np.log10(step) + 1e-9)
    while round(step / last, 6) % 1:
        last /= 10.0
    time = np.array([float(f"{k * step:.15g}") for k in range(1 - rows, 1)])
    np.testing.assert_allclose(print_step(time)[:], last, rtol=1e-9)


def test_digits_are_read_off_the_text() -> None:
    assert digits_of(["0.001000", "-12.002000", "3,000000"]) == Digits(6, False)
    assert digits_of(["1.000E-09", "-2.500E+02"]) == Digits(3, True)
    assert digits_of(["0.1", "0.25"]) is None and digits_of(["1.0", "1.0E-1"]) is None and digits_of(["x"]) is None
    assert Digits(3, True).step(2.5e-7) == pytest.approx(1e-10)
    assert Digits(6, False).step(2.5e4) == pytest.approx(1e-6)
