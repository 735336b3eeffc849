"""Containers that lie about what is in them: each is refused in one line or read right, and soon."""

import io
import os
import struct
import zlib
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.io import savemat

from mrfit.core.recording import Recording
from mrfit.errors import ConfigError, DataError
from mrfit.ingest.containers import memory, subprocess_reader
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.readers.matlab import unpacked_sizes
from mrfit.ingest.reading import OWN_FAULT
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.stage import Settings, run
from mrfit.ingest.table import Source
from mrfit.ingest.text.head import open_head
from mrfit.io.workspace import Workspace
from mrfit.settings.forms import size_of
from tests.conftest import Run
from tests.ingest.examining import examine
from tests.ingest.samples import mdf, seven_three, signals

HOSTILE = Path(__file__).parent.parent / "data" / "hostile"
MB = 1e6


def read(path: Path, max_memory: float | None = None) -> list[Recording]:
    recordings, refusals = examine([path], Settings(max_memory=max_memory))
    if refusals:
        assert "\n" not in str(refusals[0]) and OWN_FAULT not in refusals[0].reason
        raise refusals[0]
    return recordings


def taken_by(path: Path, max_memory: float) -> float:
    """The peak memory in bytes that a worker process takes while it refuses a file."""
    subprocess_reader._worker.close()
    with pytest.raises(Refusal, match="and it may take"):
        read(path, max_memory)
    peak: float = 1024.0 * subprocess_reader._worker.call(10.0, _peak)
    return peak


def _peak() -> float:
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(float(line.split()[1]) for line in lines if line.startswith("VmHWM"))


def test_datasets_that_unpack_to_gigabytes_are_refused_before() -> None:
    with pytest.raises(Refusal, match=r"unpacks to 2.5e\+08 numbers: about 8.0 GB .* may take 1.0 GB; .*--max-memory"):
        read(HOSTILE / "bomb_gzip.h5", 1e9)
    assert taken_by(HOSTILE / "bomb_gzip.h5", 100 * MB) < 200 * MB


def test_variables_that_unpack_to_much_are_refused_before_and_read_where_there_is_room(tmp_path: Path) -> None:
    path = tmp_path / "bomb.mat"
    time = np.arange(2_000_000) * 1e-3
    savemat(path, {"time": time, "force": np.zeros(len(time))}, do_compression=True)
    assert path.stat().st_size < 8 * MB
    with pytest.raises(Refusal, match="its variables unpack to arrays: about 64 MB of memory are needed"):
        read(path, 50 * MB)
    assert taken_by(path, 10 * MB) < 150 * MB
    assert read(path, 1000 * MB)[0].samples == len(time)


@pytest.mark.parametrize("packed", [False, True])
def test_the_unpacked_size_is_that_of_the_variables(tmp_path: Path, packed: bool) -> None:
    path = tmp_path / "run.mat"
    savemat(path, {"a": np.zeros(100_000), "b": np.arange(5000)}, do_compression=packed)
    assert unpacked_sizes(path, np.inf) == pytest.approx([800_000, 40_000], abs=100)
    assert len(unpacked_sizes(path, 1000.0)) == 1  # counted no further than needed


def test_a_piece_that_unpacks_to_more_than_it_states_is_stopped(tmp_path: Path) -> None:
    path = tmp_path / "chunk.h5"
    with h5py.File(path, "w") as file:
        file["time"] = np.arange(1000) * 1e-3
        made = file.create_dataset("force", (1000,), "f8", chunks=(1000,), compression="gzip")
        made.id.write_direct_chunk((0,), zlib.compress(bytes(300_000_000), 1))
    subprocess_reader._worker.close()
    with pytest.raises(Refusal, match="damaged HDF5|more memory than it states"):
        read(path, 60 * MB)
    assert 1024.0 * subprocess_reader._worker.call(10.0, _peak) < 250 * MB


def test_a_library_that_asks_for_more_is_held_to_the_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.mat"
    savemat(path, {"Ts": 1e-3, "force": np.arange(9.0)})
    source = Source(open_head(path), Rules(), memory=50 * MB)
    with monkeypatch.context() as patch:
        patch.setattr(subprocess_reader, "read_tables", greedy)
        with pytest.raises(Refusal, match="asks for more memory than it states it needs, and it may take 50 MB"):
            subprocess_reader.read_in_subprocess("matlab", source)
    assert len(subprocess_reader.read_in_subprocess("matlab", source)) == 1


def greedy(reader: str, source: Source, named: str) -> None:
    with memory.held_to(source.memory):
        np.ones(20_000_000)


@pytest.mark.slow
def test_a_library_that_goes_round_in_circles_is_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A text of varying length of which HDF5 follows the address for ever."""
    monkeypatch.setattr(subprocess_reader, "READING_SECONDS", 4.0)
    (tmp_path / "good.csv").write_text(GOOD)
    (tmp_path / "loop.h5").write_bytes((HOSTILE / "loop.h5").read_bytes())
    summary = run([tmp_path], Settings(), Workspace(tmp_path / "w"))
    assert [Path(s).name for s in summary.added] == ["good.csv"]
    (refused,) = summary.refused
    assert refused.reason == "damaged: reading it takes more than 4 s"


@pytest.mark.parametrize(("length", "sound"), [(24, True), (0xFFFFFFFF, False)])
def test_a_record_longer_than_its_file_is_damaged(length: int, sound: bool, tmp_path: Path) -> None:
    """asammdf makes room for one record, whatever its length."""
    data = bytearray(mdf().data)
    place = data.index(b"##CG") + 96  # behind the head, six links, record id, cycles and flags
    assert struct.unpack_from("<I", data, place) == (24,)
    struct.pack_into("<I", data, place, length)
    path = tmp_path / "run.mf4"
    path.write_bytes(data)
    if sound:
        assert read(path)[0].rows_kept == 240
    else:
        with pytest.raises(Refusal, match="a record of 4294967295 bytes in a file of"):
            read(path)


def test_a_dataset_whose_numbers_lie_in_another_file_is_not_opened(tmp_path: Path) -> None:
    with pytest.raises(Refusal, match="the numbers of 'force' lie in other files, which are not opened"):
        read(HOSTILE / "leak.h5")
    secret = tmp_path / "secret.h5"
    with h5py.File(secret, "w") as file:
        file["force"] = np.full(300, 42.0)
    path = tmp_path / "links.h5"
    layout = h5py.VirtualLayout((300,), "f8")
    layout[:] = h5py.VirtualSource(str(secret), "force", shape=(300,))
    with h5py.File(path, "w") as file:
        file["time"], file["voltage"] = np.arange(300) * 1e-3, np.sin(np.arange(300.0))
        file["linked"] = h5py.ExternalLink(str(secret), "force")
        file["rig/linked"] = h5py.ExternalLink(str(secret), "/")
        file.create_virtual_dataset("virtual", layout)
    (record,) = read(path)
    assert list(record.channels) == ["voltage"]
    (said,) = [f.text for f in record.findings if f.kind == "not-read"]
    assert said == "the numbers of 'linked', 'rig/linked', 'virtual' lie in other files, which are not opened: left out"


def test_a_virtual_dataset_of_the_files_own_numbers_is_read(tmp_path: Path) -> None:
    path = tmp_path / "own.h5"
    layout = h5py.VirtualLayout((300,), "f8")
    layout[:] = h5py.VirtualSource(".", "raw/force", shape=(300,))
    with h5py.File(path, "w") as file:
        file["time"], file["raw/force"] = np.arange(300) * 1e-3, np.sin(np.arange(300.0))
        file.create_virtual_dataset("force", layout)
    (record,) = read(path)
    np.testing.assert_array_equal(record.channels["force"], np.sin(np.arange(300.0)))


def test_links_out_of_a_matlab_file_are_not_followed(tmp_path: Path) -> None:
    time, one, _ = signals()
    with h5py.File(tmp_path / "secret.h5", "w") as file:
        file["force"] = one

    def fill(file: h5py.File) -> None:
        file["time"], file["current"] = time[None, :], one[None, :]
        file["force"] = h5py.ExternalLink(str(tmp_path / "secret.h5"), "force")

    path = tmp_path / "run.mat"
    path.write_bytes(seven_three(fill))
    (record,) = read(path)
    assert list(record.channels) == ["current"]
    assert any("the numbers of 'force' lie in other files" in f.text for f in record.findings)


def test_circular_references_end() -> None:
    with pytest.raises(Refusal, match="no numeric array"):
        read(HOSTILE / "refs73.mat")


def _cells(width: int, depth: int, circular: bool) -> bytes:
    """A MATLAB 7.3 file of cells, each of which holds the next ``width`` times; the last one numbers, or the first."""
    time, one, _ = signals()

    def fill(file: h5py.File) -> None:
        file["time"], file["force"] = time[None, :], one[None, :]
        cells = [file.create_dataset(f"#refs#/{k}", (width, 1), h5py.ref_dtype) for k in range(depth)]
        last = file.create_dataset("#refs#/numbers", data=np.arange(50.0)[None, :])
        for cell, inner in zip(cells, [*cells[1:], cells[0] if circular else last], strict=True):
            cell[...] = np.array([[inner.ref]] * width, dtype=h5py.ref_dtype)
        file.create_dataset("nest", (1, 1), h5py.ref_dtype)[...] = cells[0].ref

    return seven_three(fill)


def test_what_contains_itself_costs_itself_alone(tmp_path: Path) -> None:
    path = tmp_path / "run.mat"
    path.write_bytes(_cells(2, 3, circular=True))
    (record,) = read(path)
    np.testing.assert_array_equal(record.channels["force"], signals()[1])


def test_references_that_multiply_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "run.mat"
    path.write_bytes(_cells(60, 4, circular=False))
    with pytest.raises(Refusal, match="more than 20000 references"):
        read(path)
    path.write_bytes(_cells(3, 4, circular=False))
    assert list(read(path)[0].channels) == ["force"]


def test_a_unit_that_never_ends_is_no_unit(mrfit: Run) -> None:
    done = mrfit("ingest", HOSTILE / "unit0.csv", timeout=60.0)
    assert "Traceback" not in done.stderr
    assert "N**9**9**9" in done.stderr + done.stdout
    assert done.returncode in (0, 1)


@pytest.mark.parametrize("text", ["500MB", "2 GB", "1.5gib", "12", "800k"])
def test_sizes_of_memory(text: str, tmp_path: Path) -> None:
    sizes = {"500MB": 5e8, "2 GB": 2e9, "1.5gib": 1.5 * 2**30, "12": 12.0, "800k": 8e5}
    assert size_of(text) == sizes[text]


@pytest.mark.parametrize("text", ["", "0", "much", "-1GB", "1e3", "nan", "5XB"])
def test_what_is_no_size_is_an_error_of_the_command_line(text: str) -> None:
    with pytest.raises(ConfigError, match="--max-memory takes a size such as 500MB"):
        size_of(text)


def test_what_is_no_size_is_one_line_and_exit_code_two(mrfit: Run) -> None:
    done = mrfit("ingest", HOSTILE / "types.parquet", "--max-memory=")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1 and "--max-memory" in done.stderr


def test_the_default_is_half_of_what_is_free(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "free_memory", lambda: 3e9)
    assert memory.Room(Path("x")).limit == 1.5e9
    assert memory.Room(Path("x"), 7.0).limit == 7.0


def test_a_log_refused_for_want_of_memory_is_read_when_there_is_more(tmp_path: Path) -> None:
    workspace, good, large = Workspace(tmp_path / "w"), tmp_path / "good.csv", tmp_path / "large.mat"
    good.write_text("time (s),force (N)\n" + "".join(f"{k / 1000},{k % 7}\n" for k in range(50)))
    time = np.arange(20_000) * 1e-3
    savemat(large, {"time": time, "force": np.sin(time)})
    first = run([tmp_path], Settings(max_memory=1e6), workspace)
    assert [Path(r.source).name for r in first.refused] == ["large.mat"]
    again = run([tmp_path], Settings(max_memory=1e6), workspace)
    assert [Path(r.source).name for r in again.refused] == ["large.mat"]
    second = run([tmp_path], Settings(), workspace)
    assert not second.refused and [Path(s).name for s in second.added] == ["large.mat"]


def _parquet(path: Path, **columns: object) -> Path:
    pq.write_table(pa.table(columns), path)
    return path


TIME = np.arange(2000) * 1e-3


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("meta_chan2", r"channels: \[{\"name\": \"force\", \"unit\": 7}\]"),
        ("meta_cond", r"condition: \[1\]"),
        ("meta_dt", 'dt: "x"'),
        ("meta_start", 'start: "a"'),
    ],
)
def test_metadata_that_mrfit_does_not_write_is_refused_by_name(name: str, said: str) -> None:
    with pytest.raises(Refusal, match=said):
        read(HOSTILE / f"{name}.parquet")


@pytest.mark.parametrize(
    "text",
    ["{", "[1]", "7", '{"dt": 0}', '{"dt": NaN}', '{"dt": true}', '{"start": Infinity}', '{"channels": {}}']
    + ["[" * 100_000, '{"condition": null}', '{"channels": [{"name": "force"}]}'],
)
def test_any_such_metadata_is_refused_in_one_line(text: str, tmp_path: Path) -> None:
    made = pa.table({"time": TIME, "force": TIME}).replace_schema_metadata({b"mrfit": text.encode()})
    pq.write_table(made, tmp_path / "odd.parquet")
    with pytest.raises(Refusal, match="is not as mrfit writes it"):
        read(tmp_path / "odd.parquet")


def test_other_metadata_is_no_concern(tmp_path: Path) -> None:
    made = pa.table({"time": TIME, "force": TIME}).replace_schema_metadata({b"pandas": b"{", b"note": b"\xff"})
    pq.write_table(made, tmp_path / "odd.parquet")
    assert read(tmp_path / "odd.parquet")[0].dt == pytest.approx(1e-3)


def test_columns_of_every_type_and_the_numbers_among_them() -> None:
    (record,) = read(HOSTILE / "types.parquet")
    assert record.dt == pytest.approx(1e-3)
    np.testing.assert_allclose(record.channels["force"][:3], pq.read_table(HOSTILE / "types.parquet")["force"][:3])
    assert record.channels["i64"][0] == 2.0**62 and record.channels["u64"][0] == 2.0**64
    assert record.channels["f16"][0] == 1.0 and record.columns["force"] == 9
    assert "bin" not in record.channels and "dict" not in record.channels


def test_two_columns_of_one_name_are_both_kept() -> None:
    (record,) = read(HOSTILE / "dupnames.parquet")
    first, second = list(record.channels.values())
    made = pq.ParquetFile(HOSTILE / "dupnames.parquet").read()
    np.testing.assert_array_equal(first, made.column(1))
    np.testing.assert_array_equal(second, made.column(2))
    assert any(f.kind == "ambiguous-channel" for f in record.findings)


def test_whole_nanoseconds_since_1970_are_a_time() -> None:
    (record,) = read(HOSTILE / "epoch_ns.parquet")
    assert record.dt == pytest.approx(1e-3, rel=1e-9)
    assert list(record.channels) == ["force"] and record.samples == 2000
    assert any("taken as ns since 1970" in f.text for f in record.findings)


@pytest.mark.parametrize(("unit", "per_second"), [("ns", 10**9), ("us", 10**6), ("ms", 10**3)])
@pytest.mark.parametrize("stated", [False, True])
def test_whole_numbers_since_1970_by_their_size(unit: str, per_second: int, stated: bool, tmp_path: Path) -> None:
    step = per_second // 1000
    whole = [1_700_000_000 * per_second + 7 + step * k for k in range(2000)]
    name = f"time ({unit})" if stated else "time"
    (record,) = read(_parquet(tmp_path / "a.parquet", **{name: whole, "force (N)": TIME}))
    assert record.dt == pytest.approx(1e-3, rel=1e-9 if unit == "ns" or not stated else 1e-4)
    assert any("since 1970" in f.text for f in record.findings) is not stated


def test_other_whole_numbers_stay_what_they_are(tmp_path: Path) -> None:
    """Seconds from the start, and a count of 1.7e12 of a column that is no time."""
    count = [1_700_000_000_000 + k for k in range(2000)]
    (record,) = read(_parquet(tmp_path / "a.parquet", time=list(range(2000)), count=count))
    assert record.dt == 1.0 and record.start == 0.0
    np.testing.assert_array_equal(record.channels["count"], np.array(count, dtype=np.float64))


def test_a_text_that_stands_for_gigabytes_is_left_packed(tmp_path: Path) -> None:
    """As plain texts, 2000 times a million letters would be 2 GB."""
    notes = pa.chunked_array([pa.array(["x" * 1_000_000] * 20)] * 100)
    path = tmp_path / "a.parquet"
    with pq.ParquetWriter(path, pa.schema({"time": pa.float64(), "note": pa.string(), "force": pa.float64()})) as file:
        file.write_table(pa.table({"time": TIME, "note": notes, "force": TIME}))
    assert path.stat().st_size < 5 * MB
    pa.default_memory_pool().release_unused()
    before = pa.default_memory_pool().max_memory()
    (record,) = read(path)
    assert pa.default_memory_pool().max_memory() == before or pa.default_memory_pool().max_memory() < 100 * MB
    assert list(record.channels) == ["force"] and record.columns["force"] == 2


GOOD = "time (s),force (N)\n" + "".join(f"{k / 1000},{k % 7}\n" for k in range(300))


def test_odd_files_in_a_folder_are_named_and_the_others_read(mrfit: Run, tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    logs.mkdir()
    (logs / "good.csv").write_text(GOOD)
    (logs / ("a" * 240 + ".csv")).write_text(GOOD.replace("3", "4"))
    Path(os.fsdecode(os.fsencode(logs) + b"/caf\xe9.csv")).write_text(GOOD.replace("3", "5"))
    for name in ("leak.h5", "meta_dt.parquet", "epoch_ns.parquet"):
        (logs / name).write_bytes((HOSTILE / name).read_bytes())
    done = mrfit("ingest", "logs")
    assert done.returncode == 0, done.stderr
    summary = Workspace(tmp_path / "mrfit-work").ingest_summary()
    assert [r.id for r in summary.recordings] == ["epoch_ns", "good"]
    refused = {Path(r.source).name[:12]: r.reason for r in summary.refused}
    assert refused["caf\\xe9.csv"] == "its path is not UTF-8"
    assert refused["a" * 12].startswith("its name is 240 bytes long")
    assert set(refused) == {"caf\\xe9.csv", "a" * 12, "leak.h5", "meta_dt.parq"}
    assert sum(line.startswith("  refused ") for line in done.stdout.splitlines()) == 4
    again = mrfit("ingest", "logs")
    assert again.returncode == 0 and "nothing had changed" in again.stdout


@pytest.mark.parametrize("length", [200, 201])
def test_names_up_to_two_hundred_bytes_are_read(length: int, tmp_path: Path) -> None:
    path = tmp_path / ("a" * length + ".csv")
    path.write_text(GOOD)
    if length > 200:
        with pytest.raises(DataError, match="its name is 201 bytes long"):
            run([path], Settings(), Workspace(tmp_path / "w"))
    else:
        assert run([path], Settings(), Workspace(tmp_path / "w")).added


def test_what_is_no_file_and_a_name_no_file_can_have_are_one_line(mrfit: Run, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    for name, said in (("pipe.csv", "no plain file"), ("x" * 300, "no such file"), ("/dev/zero", "no plain file")):
        done = mrfit("ingest", name, timeout=30.0)
        assert done.returncode == 1 and said in done.stderr and done.stderr.count("\n") == 1


def test_a_reader_that_fails_costs_its_file_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from mrfit.ingest.readers import parquet

    def fails(*_: object) -> None:
        raise ZeroDivisionError("not\nexpected")

    monkeypatch.setattr(parquet, "_table", fails)
    (tmp_path / "good.csv").write_text(GOOD)
    _parquet(tmp_path / "odd.parquet", time=TIME, force=TIME)
    summary = run([tmp_path], Settings(), Workspace(tmp_path / "w"))
    assert [Path(s).name for s in summary.added] == ["good.csv"]
    (refused,) = summary.refused
    assert refused.reason == f"{OWN_FAULT} parquet (ZeroDivisionError: not)"


def test_a_full_disk_is_no_fault_of_the_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from mrfit.ingest.readers import parquet

    def full(*_: object) -> None:
        raise DataError("no room on the disk")

    monkeypatch.setattr(parquet, "_table", full)
    (tmp_path / "good.csv").write_text(GOOD)
    _parquet(tmp_path / "odd.parquet", time=TIME, force=TIME)
    with pytest.raises(DataError, match="no room on the disk"):
        run([tmp_path], Settings(), Workspace(tmp_path / "w"))


def test_damaged_files_in_memory_are_named(tmp_path: Path) -> None:
    buffer = io.BytesIO()
    savemat(buffer, {"x": np.arange(9.0)}, do_compression=True)
    path = tmp_path / "run.mat"
    path.write_bytes(buffer.getvalue()[:140] + b"no stream at all" * 3)
    with pytest.raises(Refusal, match="damaged MAT-file"):
        read(path)
