import io
from pathlib import Path
from typing import Any

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


TIME = np.arange(60) * 0.002
FORCE, TRAVEL = np.sin(60.0 * TIME), np.cos(60.0 * TIME)


def _parquet(columns: dict[str, Any], metadata: dict[str, str] | None = None) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    buffer = io.BytesIO()
    pq.write_table(pa.table(columns).replace_schema_metadata(metadata or {}), buffer)
    return buffer.getvalue()


@pytest.mark.parametrize(
    "metadata",
    [
        {"sample_rate_hz": "500"},
        {"SampleRate": "500 Hz"},
        {"PANDAS_ATTRS": '{"dt_ms": 2}'},
        {"about": '{"sampling": {"sample_rate": {"value": 0.5, "unit": "kHz"}}}'},
    ],
)
def test_a_rate_in_the_metadata(metadata: dict[str, str], read_log: ReadLog) -> None:
    (record,) = read_log(_parquet({"force_N": FORCE}, metadata), "run.parquet")
    assert record.dt == pytest.approx(0.002)


@pytest.mark.parametrize(
    ("metadata", "said"),
    [
        ({"sample_rate_hz": "500", "dt_ms": "5"}, "sample_rate_hz = 500 Hz and dt_ms = 5 ms: not used"),
        ({"camera": '{"fs": 30}'}, r"camera.fs = 30: not used"),
        ({"about": "{" * 5000, "note": "500 Hz"}, "no sample rate"),
    ],
)
def test_a_rate_in_doubt_is_not_used(metadata: dict[str, str], said: str, read_log: ReadLog) -> None:
    with pytest.raises(Refusal, match=said):
        read_log(_parquet({"force_N": FORCE}, metadata), "run.parquet")


@pytest.mark.parametrize(
    ("metadata", "known"),
    [
        ({"units": '{"time": "s", "disp": "mm", "force": "kN"}'}, True),
        ({"PANDAS_ATTRS": '{"units": {"time": "s", "disp": "mm", "force": "kN"}}'}, True),
        ({"time_unit": "s", "disp_unit": "mm", "force_unit": "kN"}, True),
        ({"units": '["s", "mm"]', "comment": '{"disp": "mm"}'}, False),
    ],
)
def test_units_in_the_metadata(metadata: dict[str, str], known: bool, read_log: ReadLog) -> None:
    (record,) = read_log(_parquet({"time": TIME, "disp": TRAVEL, "force": FORCE}, metadata), "run.parquet")
    np.testing.assert_allclose(record.channels["displacement"], (1e-3 if known else 1.0) * TRAVEL)
    np.testing.assert_allclose(record.channels["force"], (1e3 if known else 1.0) * FORCE)


@pytest.mark.parametrize("packed", [False, True])
def test_a_row_for_each_channel_and_time(packed: bool, read_log: ReadLog) -> None:
    import pyarrow as pa

    names = pa.array(["disp_mm", "force_N"] * len(TIME))
    columns = {
        "time_s": np.repeat(TIME, 2),
        "channel": names.dictionary_encode() if packed else names,
        "value": np.column_stack([TRAVEL, FORCE]).ravel(),
    }
    (record,) = read_log(_parquet(columns), "run.parquet")
    assert record.dt == pytest.approx(0.002) and "long-format" in {f.kind for f in record.findings}
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * TRAVEL)
    np.testing.assert_allclose(record.channels["force"], FORCE)


def test_a_text_beside_two_values_is_no_channel(read_log: ReadLog) -> None:
    columns = {"time_s": TIME, "channel": ["a"] * len(TIME), "value": FORCE, "disp_mm": TRAVEL, "force_N": FORCE}
    (record,) = read_log(_parquet(columns), "run.parquet")
    assert record.samples == len(TIME) and "no-channel" in {f.kind for f in record.findings}


@pytest.mark.parametrize("names", [[f"c{k}" for k in range(600)], ["a", "b" * 1000] * 300])
def test_texts_that_are_no_few_channels_are_refused(names: list[str], read_log: ReadLog) -> None:
    columns = {"time": np.arange(600.0), "channel": names, "value": np.arange(600.0)}
    with pytest.raises(Refusal, match="no few channels"):
        read_log(_parquet(columns), "run.parquet")
