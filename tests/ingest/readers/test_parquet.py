from pathlib import Path

import numpy as np
import pytest

from mrfit.ingest.refusal import Refusal
from mrfit.ingest.stage import Settings, run
from mrfit.store import Workspace
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


def test_truncated_file_is_refused(read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match="damaged Parquet"):
        read_log(parquet().data[:-20])
