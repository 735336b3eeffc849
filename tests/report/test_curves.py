import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mrfit.report.curves import BEYOND, CURVE_PANELS, decimate, limits, prefixed, sheets, shown_cycles, worst_of_each
from mrfit.report.source import OutputSeries


def series(
    condition: str, error: float = 0.0, frequency: float = 0.0, role: str = "train", count: int = 100
) -> OutputSeries:
    time = np.arange(count) / 100.0
    return OutputSeries(condition, f"{condition}#0", role, time, np.full(count, error), np.zeros(count), {}, frequency)


@given(
    st.integers(1, 3000).flatmap(lambda n: arrays(np.float64, n, elements=st.floats(-1e3, 1e3))), st.integers(4, 300)
)
def test_decimation_keeps_ends_and_extremes_in_few_points(values, limit):
    at = decimate(values, limit)
    assert len(at) <= limit or len(at) == len(values)
    assert at[0] == 0 and at[-1] == len(values) - 1
    assert np.all(np.diff(at) > 0)
    assert values[at].max() == values.max() and values[at].min() == values.min()


def test_decimation_misses_no_single_spike():
    values = np.sin(np.linspace(0.0, 20.0, 100_000))
    values[54_321] = 3.0
    assert 54_321 in decimate(values, 500)


def test_two_cycles_are_shown_with_their_last_point():
    assert series("a", frequency=5.0).time[shown_cycles(series("a", frequency=5.0))][-1] == pytest.approx(0.4)


def test_what_is_not_periodic_is_shown_whole():
    assert shown_cycles(series("a")) == slice(None)


def test_worst_repeat_stands_for_its_condition():
    chosen = worst_of_each(
        [series("b-10A"), series("b-2A", 1.0), series("b-2A", 3.0, role="holdout"), series("b-2A", 2.0)]
    )
    assert [(s.condition, s.error) for s in chosen] == [("b-2A", 3.0), ("b-10A", 0.0)]


def test_diverged_repeat_is_the_worst():
    assert np.isnan(worst_of_each([series("a", 5.0), series("a", np.nan)])[0].error)


def test_families_share_a_sheet():
    conditions = [series(f"sine-{f}Hz-{a}A") for f in (1, 5, 10) for a in range(1, 6)]
    assert [{s.condition[:7] for s in sheet} for sheet in sheets(conditions)] == [{"sine-1H"}, {"sine-5H"}, {"sine-10"}]


@given(st.lists(st.integers(1, 30), min_size=1, max_size=12))
def test_sheets_keep_every_condition_in_order_and_are_not_crowded(sizes):
    conditions = [series(f"f{f}-{k}", count=2) for f, size in enumerate(sizes) for k in range(size)]
    pages = sheets(conditions)
    assert [s.condition for page in pages for s in page] == [s.condition for s in conditions]
    assert max(len(page) for page in pages) <= CURVE_PANELS
    assert len(conditions) > CURVE_PANELS or len(pages) == 1


@pytest.mark.parametrize(
    ("largest", "unit", "expected"),
    [
        (0.02, "Wb", (1e3, "mWb")),
        (0.5, "A", (1.0, "A")),
        (2500.0, "N", (1e-3, "kN")),
        (0.01, "m", (1e3, "mm")),
        (0.05, "m/s", (1e3, "mm/s")),
        (4e-5, "Wb", (1e6, "µWb")),
        (1e-12, "Wb", (1e6, "µWb")),
        (2500.0, "degC", (1.0, "°C")),
        (2500.0, "1/s", (1.0, "1/s")),
        (0.0, "N", (1.0, "N")),
        (np.nan, "N", (1.0, "N")),
    ],
)
def test_unit_prefix_suits_the_size(largest, unit, expected):
    factor, text = prefixed(largest, unit)
    assert (pytest.approx(factor), text) == expected


def test_an_axis_follows_a_simulation_that_leaves_the_measured_values_by_half_their_extent():
    measured = np.array([-1.0, 3.0])
    assert limits(measured, np.array([-2.9, 4.9])) is None
    assert limits(measured, np.array([0.0, 1e6])) == (-1.0, 3.0 + 4.0 * BEYOND)
    assert limits(measured, np.array([-1e6, np.nan])) == (-1.0 - 4.0 * BEYOND, 3.0)
    # nothing to scale by: the figure scales itself
    assert limits(np.ones(3), np.array([1e6])) is None and limits(measured, np.array([np.nan])) is None
