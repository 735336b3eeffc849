"""``mrfit track-parameters``: estimates beside refits of blocks, in files and on the page."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mrfit.api.recordings import Recording
from mrfit.errors import DataError
from mrfit.track.call import columns_of, tracked
from mrfit.track.page import HEADS, page_of, rows_of
from tests.track.logs import DT, VALUES, fitted, force, motion


def recording(share: float, seconds: float = 24.0) -> Recording:
    """A log in which the yield force steps at half its time."""
    channels = motion(seconds, 21)
    course = VALUES["fy"] * np.where(np.arange(len(channels["velocity"])) * DT > seconds / 2, 1.0 + share, 1.0)
    return Recording.from_arrays(dt=DT, name="life", **channels, force=force(channels, 22, fy=course))


def test_a_step_is_on_the_page_in_the_numbers_and_in_the_blocks(tmp_path: Path) -> None:
    found = tracked(fitted(), [recording(0.2)], ["fy", "c"])
    (log,), blocks = found.content.logs, found.blocks[next(iter(found.blocks))]
    first, other = log.parameters
    assert (first.name, first.fit, first.unit) == ("fy", VALUES["fy"], "N")
    assert abs(first.end - 1.2 * VALUES["fy"]) < 3.0 * first.end_deviation < 10.0
    assert abs(other.end - VALUES["c"]) < 3.0 * other.end_deviation
    assert first.block is not None and abs(first.block - first.end) < 5.0
    # a block says how little it tells
    assert rows_of(found.content)[0][-2:] == [first.block, first.block_deviation]
    assert HEADS[-2:] == ("last block alone", "± 1 sd of the block") and first.block_deviation
    late = blocks.time > 13.0
    assert np.abs(blocks.values[late, 0] / VALUES["fy"] - 1.2).max() < 0.01
    assert 0.8 < log.moved < 1.0 and log.innovation == pytest.approx(8.0, rel=0.2)
    saved = found.save(str(tmp_path), "life")
    page = (tmp_path / "life.html").read_text()
    # of what is not drawn nothing is said
    assert log.moving > 0.0 and "Red: the parameters are taken to move." in page
    assert "measured − model (N)" in page and "A factor multiplies" not in page
    assert saved.page.endswith("life.html") and "<svg" in page and "fy (N)" in page
    table = pd.read_parquet(tmp_path / "life-life.parquet")
    assert list(table) == ["time", "fy", "c", "fy_sd", "c_sd", "innovation", "moves", "filter"]
    assert set(columns_of(next(iter(found.tracks.values())))) == set(table)


def test_a_parameter_that_stays_has_no_red_and_a_factor_is_called_one(tmp_path: Path) -> None:
    found = tracked(fitted(), [recording(0.0)], ["fy"])
    (log,) = found.content.logs
    factor = replace(found.content, logs=[replace(log, parameters=[replace(log.parameters[0], factor=True)])])
    assert rows_of(factor)[0][2] == "factor" and rows_of(found.content)[0][2] == "N"
    page = page_of(factor, found.tracks, found.blocks, "x.json")
    assert log.moving == 0.0 and "Red:" not in page and "A factor multiplies" in page


def test_a_log_without_the_output_is_refused() -> None:
    channels = motion(4.0, 3)
    bare = Recording.from_arrays(dt=DT, name="bare", **channels)
    with pytest.raises(DataError, match="no channel 'force'"):
        tracked(fitted(), [bare], ["fy"])
