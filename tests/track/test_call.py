"""Numbers of a tracked log: refits of its blocks by least squares, and what its row says, by hand."""

from dataclasses import replace

import numpy as np
import pytest

from mrfit.api.recordings import Recording
from mrfit.core.recording import Finding
from mrfit.core.specs import Array
from mrfit.export.tracker import TrackerPlan, plan_of
from mrfit.track.call import _in_numbers, _refits, columns_of, table_name
from mrfit.track.call import tracked as tracked_source
from mrfit.track.run import BlockRefits, ParameterTrack
from tests.track.logs import DT, SHARE, VALUES, columns, fitted, force, motion

TRACKED = ("fy", "c")


def refitted(measured: Array, channels: dict[str, Array]) -> tuple[BlockRefits, TrackerPlan, Array]:
    source = fitted()
    plan = plan_of(source, TRACKED)
    drive = np.stack([channels[n] for n in source.spec.inputs])
    return _refits(source, plan, drive, measured, DT), plan, plan.moves(source.spec.inputs, drive) > 0


def test_blocks_are_refitted_each_by_itself_where_the_damper_moves() -> None:
    channels = motion(6.0, 5)
    measured = force(channels, 3, fy=840.0, c=650.0)
    measured[500:600] = np.nan
    blocks, plan, moves = refitted(measured, channels)
    # 24 blocks, each at the mean of its times
    np.testing.assert_allclose(blocks.time, 0.25 * (np.arange(24) + 0.5) - 0.5 * DT, atol=1e-9)
    rows = np.column_stack([columns(channels)[n] for n in TRACKED])
    rest = force(channels) - rows @ [VALUES[n] for n in TRACKED]
    variance = plan.deviation**2 * max(1.0, plan.correlated / DT)
    for k in (0, 2, 13, 23):
        own = slice(250 * k, 250 * (k + 1))
        good = moves[own] & np.isfinite(measured[own])
        a, b = rows[own][good], (measured - rest)[own][good]
        np.testing.assert_allclose(blocks.values[k], np.linalg.lstsq(a, b, rcond=None)[0], rtol=1e-6)
        spread = np.sqrt(variance * np.diag(np.linalg.inv(a.T @ a)))
        np.testing.assert_allclose(blocks.deviations[k], spread, rtol=1e-5)


@pytest.mark.parametrize("kind", ["stuck", "clipped"])
def test_parameters_are_held_where_the_force_was_not_measured(kind: str) -> None:
    channels = motion(6.0, 5)
    measured = force(channels, 3)
    if kind == "stuck":
        measured[2000:2600] = measured[2000]
    else:
        top = 0.8 * measured.max()
        measured = np.minimum(measured, top)
    finding = Finding(kind=kind, text="", channel="force", at=DT * float(np.argmax(measured == measured[2300])))
    if kind == "clipped":
        finding = replace(finding, at=DT * float(np.argmax(measured)))
    log = Recording("a", "a", "0", "none", DT, 21.0, {**channels, "force": measured}, {}, findings=(finding,))
    whole, unknown = (tracked_source(fitted(), [one], TRACKED).tracks["a"] for one in (log, replace(log, findings=())))
    assert whole.time[[0, -1]] == pytest.approx([21.0, 27.0 - DT])
    left = np.isnan(whole.innovations)
    assert left.any() and np.all(left[2010:2590] if kind == "stuck" else left[measured == measured.max()])
    for k, name in enumerate(TRACKED):
        off, astray = (np.abs(one.values[:, k] / VALUES[name] - 1.0).max() for one in (whole, unknown))
        assert off < 0.1 < astray


def test_a_block_that_tells_nothing_has_no_refit() -> None:
    channels = motion(6.0, 5)
    still = {n: v.copy() for n, v in channels.items()}
    still["velocity"][:250] = 0.0
    measured = force(still, fy=840.0, c=650.0)
    measured[250:500] = np.nan
    # two samples are no more than the parameters are
    measured[502:750] = np.nan
    measured[753:1000] = np.nan
    blocks, _, _ = refitted(measured, still)
    assert np.isnan(blocks.values[:3]).all() and np.isnan(blocks.deviations[:3]).all()
    np.testing.assert_allclose(blocks.values[4:], np.tile([840.0, 650.0], (20, 1)), rtol=1e-6)


def tracked(**more: Array) -> ParameterTrack:
    """Return a track of four samples, the second of which stands."""
    plan = plan_of(fitted(), TRACKED)
    given = {
        "values": np.array([[800.0, 700.0], [790.0, 705.0], [820.0, 690.0], [810.0, 695.0]]),
        "deviations": np.array([[8.0, 7.0], [7.0, 6.0], [6.0, 5.0], [5.0, 4.0]]),
        "innovations": np.array([3.0, 100.0, -4.0, np.nan]),
        "chosen": np.array([0.0, 1.0, 2.0, 0.0]),
        "moves": np.array([1, 0, 1, 1]),
        **more,
    }
    return ParameterTrack(replace(plan, held=np.diag([36.0, 0.0])), DT * np.arange(4), covariance=np.eye(2), **given)


def test_the_row_of_a_log_is_its_extremes_its_end_and_its_innovations_while_it_moves() -> None:
    log = Recording.from_arrays(dt=DT, name="life", **motion(0.1))
    blocks = BlockRefits(np.zeros(2), np.array([[1.0, 2.0], [805.0, np.nan]]), np.array([[0.0, 0.0], [2.0, np.nan]]))
    row = _in_numbers(log, tracked(), blocks)
    assert (row.recording, row.samples, row.dt) == ("life", 4, DT)
    assert (row.moved, row.moving) == (0.75, 0.5)
    assert row.innovation == pytest.approx(np.sqrt((9.0 + 16.0) / 2.0))
    first, other = row.parameters
    assert (first.name, first.unit, first.factor, first.fit) == ("fy", "N", False, VALUES["fy"])
    # the deviation of the fit, and that of what is held beside it
    assert first.fit_deviation == pytest.approx(np.hypot(SHARE * VALUES["fy"], 6.0), rel=1e-4)
    assert other.fit_deviation == pytest.approx(SHARE * VALUES["c"], rel=1e-4)
    assert (first.least, first.greatest, first.end, first.end_deviation) == (790.0, 820.0, 810.0, 5.0)
    assert (first.block, first.block_deviation) == (805.0, 2.0) and other.block is other.block_deviation is None
    still = _in_numbers(log, tracked(moves=np.zeros(4, dtype=np.int64)), blocks)
    assert (still.moved, still.innovation) == (0.0, 0.0)


def test_the_table_of_a_log_has_every_estimate_with_its_deviation() -> None:
    table = columns_of(tracked())
    assert list(table) == ["time", "fy", "c", "fy_sd", "c_sd", "innovation", "moves", "filter"]
    assert table["c"].tolist() == [700.0, 705.0, 690.0, 695.0] and table["fy_sd"].tolist() == [8.0, 7.0, 6.0, 5.0]
    assert table["filter"].tolist() == [0.0, 1.0, 2.0, 0.0] and table["moves"].tolist() == [1.0, 0.0, 1.0, 1.0]
    assert table_name("page", "log#1") == "page-log#1.parquet"
