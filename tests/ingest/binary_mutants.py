"""Damaged logs of formats without lines by number: the same number damages the same sample in the same way, always.

    python -m tests.ingest.binary_mutants [--count 2000] [--first 0] [--out FILE.md]

reads so many mutants of every such format and prints a table: how many were read, refused, or broke a promise, the
longest time and the most memory that one took.
"""

import argparse
import contextlib
import io
import os
import random
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from mrfit.core.recording import Recording
from mrfit.errors import DataError
from mrfit.ingest.containers import subprocess_reader
from mrfit.ingest.reading import OWN_FAULT
from mrfit.ingest.stage import Settings
from tests.ingest.examining import examine
from tests.ingest.samples import Sample, hdf5, json_log, matlab, matlab_seven_three, mdf, parquet, signals, tdms

LONGEST = 30.0
"""Seconds of computing that one file may take."""
LARGEST = 1e9
"""Bytes of memory that one file may take."""

Mutation = Callable[[bytearray, random.Random], bytearray]


def matlab_packed() -> Sample:
    """Version 5 as MATLAB saves it: each variable deflated; a struct among them."""
    from scipy.io import savemat

    time_, one, two = signals()
    buffer = io.BytesIO()
    savemat(buffer, {"run": {"time": time_, "force": one, "notes": ["a", "b"]}, "x": two}, do_compression=True)
    return Sample("packed.mat", buffer.getvalue(), {}, {})


def hdf5_packed() -> Sample:
    """Chunks, deflated, with a table of columns, attributes and groups."""
    import h5py

    time_, one, two = signals()
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file.attrs["sample_rate"] = 1000.0
        file.create_dataset("rig/force", data=one, chunks=(64,), compression="gzip", shuffle=True, fletcher32=True)
        rows = np.rec.fromarrays([time_, two], names="time,current")
        file.create_dataset("table", data=rows, chunks=(50,), maxshape=(None,))
        file["names"] = np.array(["one", "two"], dtype=h5py.string_dtype())
    return Sample("packed.h5", buffer.getvalue(), {}, {})


def parquet_packed() -> Sample:
    """Several row groups and pages, dictionaries, nulls, stamps and texts, deflated."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    time_, one, _ = signals()
    stamps = pa.array([1_700_000_000_000_000_000 + 1_000_000 * k for k in range(len(time_))])
    force = pa.array([None if k % 50 == 7 else v for k, v in enumerate(one)])
    made = pa.table({"time": stamps, "force (N)": force, "step": np.arange(len(one)) % 3, "note": ["x"] * len(one)})
    buffer = io.BytesIO()
    pq.write_table(made, buffer, row_group_size=64, data_page_size=128, compression="gzip")
    return Sample("packed.parquet", buffer.getvalue(), {}, {})


def mdf_packed() -> Sample:
    """Version 4 with deflated data blocks, and whole numbers."""
    import asammdf

    time_, one, two = signals()
    made = asammdf.MDF(version="4.10")
    made.append([asammdf.Signal(one, time_, name="Load", unit="kN")])
    made.append([asammdf.Signal((100 * two).astype(np.int16), time_, name="Coil", unit="A")])
    with tempfile.TemporaryDirectory() as folder:
        data = Path(made.save(Path(folder) / "run.mf4", compression=2)).read_bytes()
    made.close()
    return Sample("packed.mf4", data, {}, {})


def mdf_three() -> Sample:
    """Version 3."""
    import asammdf

    time_, one, _ = signals()
    made = asammdf.MDF(version="3.30")
    made.append([asammdf.Signal(one, time_, name="Load", unit="kN")])
    with tempfile.TemporaryDirectory() as folder:
        data = Path(made.save(Path(folder) / "run.mdf")).read_bytes()
    made.close()
    return Sample("three.mdf", data, {}, {})


SAMPLES: dict[str, Callable[[], Sample]] = {
    "parquet": parquet,
    "parquet-packed": parquet_packed,
    "hdf5": hdf5,
    "hdf5-packed": hdf5_packed,
    "matlab": matlab,
    "matlab-packed": matlab_packed,
    "matlab-7.3": matlab_seven_three,
    "tdms": tdms,
    "mdf": mdf,
    "mdf-packed": mdf_packed,
    "mdf-3": mdf_three,
    "json-log": json_log,
}


def place(data: bytearray, rng: random.Random) -> int:
    """Where to damage: in the head, in the tail (where Parquet has its directory), or anywhere."""
    where = rng.random()
    if where < 0.4:
        return rng.randrange(min(len(data), 800))
    return rng.randrange(max(0, len(data) - 800), len(data)) if where < 0.6 else rng.randrange(len(data))


def flip_byte(data: bytearray, rng: random.Random) -> bytearray:
    data[place(data, rng)] = rng.randrange(256)
    return data


def flip_bit(data: bytearray, rng: random.Random) -> bytearray:
    data[place(data, rng)] ^= 1 << rng.randrange(8)
    return data


def huge_number(data: bytearray, rng: random.Random) -> bytearray:
    """Write a number into 2, 4 or 8 bytes that is as large as it can be, negative, or just too large for the file."""
    size, at = rng.choice([2, 4, 8]), place(data, rng)
    largest = (1 << (8 * size)) - 1
    number = rng.choice([largest, largest >> 1, (largest >> 1) + 1, largest >> 4, len(data), 1 << (8 * size - 2), 0])
    raw = (number & largest).to_bytes(size, rng.choice(["little", "big"]))
    data[at : at + size] = raw[: len(data) - at]
    return data


def other_number(data: bytearray, rng: random.Random) -> bytearray:
    """Copy 4 or 8 bytes of the file to another place in it: an address that leads elsewhere, perhaps back."""
    size, source, at = rng.choice([4, 8]), place(data, rng), place(data, rng)
    raw = data[source : source + size]
    data[at : at + len(raw)] = raw
    return data


def cut(data: bytearray, rng: random.Random) -> bytearray:
    return data[: rng.randrange(1, len(data) + 1)]


def lose_bytes(data: bytearray, rng: random.Random) -> bytearray:
    at = place(data, rng)
    del data[at : at + rng.randrange(1, 200)]
    return data or bytearray(b"x")


def double_bytes(data: bytearray, rng: random.Random) -> bytearray:
    at = place(data, rng)
    return data[:at] + data[at : at + rng.randrange(1, 200)] + data[at:]


def no_bytes(data: bytearray, rng: random.Random) -> bytearray:
    """Zeros in place of a stretch, as a copy broken off leaves them."""
    at = place(data, rng)
    stop = min(len(data), at + rng.randrange(1, 600))
    data[at:stop] = bytes(stop - at)
    return data


MUTATIONS: list[Mutation] = [
    *(flip_byte, flip_byte, flip_bit, flip_bit, huge_number, huge_number, huge_number),
    *(other_number, other_number, cut, lose_bytes, double_bytes, no_bytes),
]


def mutant(name: str, data: bytes, number: int) -> bytes:
    """Return a sample after one to four mutations."""
    rng = random.Random(f"{name} {number}")
    damaged = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 4])):
        damaged = rng.choice(MUTATIONS)(damaged, rng)
    return bytes(damaged)


@dataclass
class Campaign:
    """What became of the mutants of one format."""

    name: str
    read: int = 0
    refused: int = 0
    broken: list[str] = field(default_factory=list)
    longest: float = 0.0
    largest: float = 0.0

    @property
    def count(self) -> int:
        """How many there were."""
        return self.read + self.refused + len(self.broken)

    def row(self) -> str:
        """Return the line of the table."""
        size = f"{self.largest / 1e6:.0f} MB"
        cells = (self.name, self.count, self.read, self.refused, len(self.broken), f"{self.longest:.2f} s", size)
        return f"| {' | '.join(map(str, cells))} |"


HEADER = (
    "| format | mutants | read | refused in one line | promises broken | longest | most memory |\n" + "|---" * 7 + "|"
)


def run(name: str, count: int, first: int = 0) -> Campaign:
    """Read mutants and judge what comes of each."""
    campaign, made = Campaign(name), SAMPLES[name]()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / made.name
        for number in range(first, first + count):
            path.write_bytes(mutant(name, made.data, number))
            _forget_peak()
            begin, before = _computed(), _peak("self")
            try:
                _judge(path, campaign)
            except Exception as error:
                campaign.broken.append(f"{name} {number}: {type(error).__name__} {str(error)[:300]}")
            seconds, memory = _computed() - begin, _most_memory(before)
            campaign.longest, campaign.largest = max(campaign.longest, seconds), max(campaign.largest, memory)
            if seconds > LONGEST or memory > LARGEST:
                campaign.broken.append(f"{name} {number}: {seconds:.0f} s, {memory / 1e6:.0f} MB")
                subprocess_reader._worker.close()
    return campaign


def _judge(path: Path, campaign: Campaign) -> None:
    try:
        recordings, refusals = examine([path], Settings(jobs=1))
    except DataError as error:
        assert "\n" not in str(error)
        campaign.refused += 1
        return
    for refusal in refusals:
        assert "\n" not in str(refusal) and refusal.reason and refusal.remedy
        assert OWN_FAULT not in refusal.reason, str(refusal)
    for record in recordings:
        _check(record)
    campaign.read += bool(recordings)
    campaign.refused += not recordings


def _check(record: Recording) -> None:
    assert np.isfinite(record.dt) and record.dt > 0.0
    assert record.rows_kept >= 2
    for values in record.channels.values():
        assert len(values) == record.samples
        assert np.isfinite(values).all()


def _peak(process: str) -> float:
    """Return the most bytes of memory a process has had, since it began."""
    try:
        lines = Path(f"/proc/{process}/status").read_text().splitlines()
    except OSError:
        return 0.0
    return next((1024.0 * float(line.split()[1]) for line in lines if line.startswith("VmHWM")), 0.0)


def _forget_peak() -> None:
    """Begin anew to measure the most memory of this process: what ran in it before is not a file's."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def _computed() -> float:
    """Return the seconds that this process and those it started have computed."""
    ended, worker = os.times(), subprocess_reader._worker.process
    seconds = ended.user + ended.system + ended.children_user + ended.children_system
    try:
        fields = Path(f"/proc/{worker.pid}/stat").read_text().rpartition(")")[2].split() if worker else []
    except OSError:
        fields = []
    return seconds + sum(map(float, fields[11:13])) / os.sysconf("SC_CLK_TCK")


def _most_memory(before: float) -> float:
    """Return the most bytes a file took: in the process that reads fragile formats, or above `before` in this one."""
    worker = subprocess_reader._worker.process
    # a container may forbid to forget a peak, and a test process that has compiled kernels holds more than a gigabyte
    return max(_peak("self") - before, _peak(str(worker.pid)) if worker else 0.0)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", default="")
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    names = [n for n in SAMPLES if not arguments.only or n == arguments.only]
    rows, broken = [HEADER], []
    for name in names:
        campaign = run(name, arguments.count, arguments.first)
        rows.append(campaign.row())
        broken += campaign.broken
        print(rows[-1], *campaign.broken[:20], sep="\n", flush=True)
    if arguments.out:
        arguments.out.write_text("\n".join(rows) + "\n")
    raise SystemExit(1 if broken else 0)


if __name__ == "__main__":
    main()
