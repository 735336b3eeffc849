"""Rows of statistics above or below the samples."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.core.specs import Array
from mrfit.ingest.meaning.statistics import without_statistics
from mrfit.ingest.table import Column, Table
from tests.ingest.conftest import ReadLog

K = np.arange(500)
DISP, FORCE = 10.0 * np.sin(K / 30.0), 900.0 * np.cos(K / 30.0) + 20.0
STATISTICS = {
    "max": np.max,
    "min": np.min,
    "mean": np.mean,
    "total": np.sum,
    "std": np.std,
    "range": np.ptp,
    "rms": lambda v: np.sqrt(np.mean(v * v)),
}


@pytest.mark.parametrize("place", ["end", "start"])
@pytest.mark.parametrize(
    "chosen", [("max", "min"), ("max", "min", "mean"), ("mean", "std"), ("total",), ("rms", "range")]
)
@pytest.mark.parametrize("blank", ["", "\n"])
def test_rows_of_statistics_are_refused(place: str, chosen: tuple[str, ...], blank: str, read_log: ReadLog) -> None:
    rows = "".join(f"{a:.4f},{b:.3f}\n" for a, b in zip(DISP, FORCE, strict=True))
    said = "".join(f"{STATISTICS[s](DISP):.4f},{STATISTICS[s](FORCE):.3f}\n" for s in chosen)
    body = rows + blank + said if place == "end" else said + blank + rows
    (record,) = read_log("Sample rate: 500 Hz\nDisp (mm),Load (N)\n" + body)
    assert (record.samples, record.rows_refused) == (500, len(chosen))
    np.testing.assert_allclose(record.channels["force"], FORCE, atol=1e-3)
    assert any("row of statistics" in f.text for f in record.findings)


def test_labels_beside_or_above_the_statistics(read_log: ReadLog) -> None:
    rows = "".join(f"{a:.4f},{b:.3f}\n" for a, b in zip(DISP, FORCE, strict=True))
    for said in ("Max,{a:.4f},{b:.3f}\n", "Maximum\n{a:.4f},{b:.3f}\n", "{a:.4f},{b:.3f},Max\n"):
        end = said.format(a=DISP.max(), b=FORCE.max())
        (record,) = read_log("Sample rate: 500 Hz\nDisp (mm),Load (N)\n" + rows + end)
        np.testing.assert_allclose(record.channels["force"], FORCE, atol=1e-3)


@given(st.integers(0, 2**32), st.sampled_from(["walk", "hold", "ramp"]))
def test_samples_are_no_statistics(seed: int, kind: str) -> None:
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.standard_normal((200, 2)), axis=0)
    values = {
        "walk": walk,
        "hold": np.minimum(walk, 1.0),
        "ramp": np.maximum.accumulate(walk),
    }
    columns = tuple(Column(n, None, v.copy(), k) for k, (n, v) in enumerate(zip("ab", values[kind].T, strict=True)))
    table = Table(columns, np.arange(1, 201))
    assert without_statistics(table).rows == 200


@pytest.mark.parametrize("samples", [500, 5000, 200_000])
@pytest.mark.parametrize("shape", [np.zeros_like, np.ones_like, np.sign])
def test_rows_at_a_steady_end_are_samples(samples: int, shape: Callable[[Array], Array]) -> None:
    time = 1e-3 * np.arange(samples)
    columns = (Column("force", "N", shape(np.maximum(time, 1e-9)), 0),)
    table = Table(columns, np.arange(1, samples + 1), time=Column("time", "s", time, 1))
    assert without_statistics(table).rows == samples
