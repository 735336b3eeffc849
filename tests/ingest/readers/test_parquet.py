from pathlib import Path

import numpy as np
import pytest

from mrfit.ingest.refusal import Refusal
from mrfit.ingest.stage import Settings, run
from mrfit.io.workspace import Workspace
from tests.ingest.conftest import ReadLog
from tests.ingest.samples import parquet, sample


def test_recording_of_another_workspace_comes_back_the_same(tmp_path: Path) -> None:
    _, path = sample("delimited", tmp_path)
    first = Workspace(tmp_path / "one")
    run([path], Settings(resistance=2.5), first)
    before = first.read_recording("log")
    second = Workspace(tmp_path / "two")
    run([first.recording_file("log")], Settings(), second)
    again = second.read_recording("log")
    assert (again.dt, again.start, dict(again.units)) == (before.dt, before.start, dict(before.units))
    assert again.condition["resistance"] == 2.5
    for name, values in before.channels.items():
        np.testing.assert_array_equal(again.channels[name], values)


def test_unit_from_the_fields_metadata_and_time_stamps(read_log: ReadLog, tmp_path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = pa.schema(
        [
            pa.field("timestamp", pa.timestamp("us")),
            pa.field("Load", pa.float32(), metadata={"unit": "kN"}),
            pa.field("note", pa.string()),
        ]
    )
    stamps = [1_700_000_000_000_000 + 1000 * k for k in range(50)]
    whole = pa.table([stamps, np.arange(50, dtype=np.float32), ["x"] * 50], schema=schema)
    path = tmp_path / "made.parquet"
    pq.write_table(whole, path)
    (record,) = read_log(path.read_bytes(), "made.parquet")
    assert record.dt == pytest.approx(1e-3)
    assert record.channels["force"][2] == 2000.0


def test_integers_and_missing_values(read_log: ReadLog, tmp_path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = tmp_path / "made.parquet"
    force = [None if k == 10 else k for k in range(50)]
    pq.write_table(pa.table({"time": np.arange(50) * 0.1, "force [N]": force}), path)
    (record,) = read_log(path.read_bytes(), "made.parquet")
    assert (record.rows_kept, record.rows_refused) == (49, 1)
    assert record.channels["force"][10] == pytest.approx(10.0)


def test_stamps_of_a_fast_log_stay_exact(read_log: ReadLog, tmp_path: Path) -> None:
    """At 1 MHz: as floats, nanoseconds since 1970 have steps of 256."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = tmp_path / "made.parquet"
    first = 1_700_000_000_000_000_123
    stamps = pa.array([None if k == 7 else first + 1000 * k for k in range(2000)], pa.timestamp("ns"))
    pq.write_table(pa.table({"when": stamps, "force [N]": np.arange(2000.0)}), path)
    (record,) = read_log(path.read_bytes(), "made.parquet")
    assert record.dt == 1e-6
    assert (record.samples, record.rows_kept, record.rows_refused) == (2000, 1999, 1)
    assert "resampled" not in {f.kind for f in record.findings}


def test_the_map_says_which_column_is_time_and_in_which_unit(read_log: ReadLog, tmp_path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = tmp_path / "made.parquet"
    pq.write_table(pa.table({"count": np.arange(50.0), "force [N]": np.arange(50.0)}), path)
    (record,) = read_log(path.read_bytes(), "made.parquet", 'time = {column = "count", unit = "ms"}')
    assert record.dt == pytest.approx(1e-3)
    assert list(record.channels) == ["force"]


def test_truncated_file_is_refused(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="damaged Parquet"):
        read_log(parquet().data[:-20])
