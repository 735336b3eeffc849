"""ASAM MDF 3 and 4 (MDF, DAT, MF4), through asammdf."""

import contextlib
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np

from mrfit.core.specs import ReaderSpec
from mrfit.ingest import series
from mrfit.ingest.containers.runs import only_logs
from mrfit.ingest.containers.shelf import Shelf
from mrfit.ingest.refusal import Refusal, TransientRefusal, damaged
from mrfit.ingest.table import Column, Source, Table
from mrfit.ingest.text.head import Head

SPEC = ReaderSpec(
    "mdf",
    "ASAM MDF (needs asammdf)",
    fragile=True,
    libraries=("asammdf", "asammdf.blocks.mdf_v3", "asammdf.blocks.mdf_v4"),
)
LONGEST_RECORD = 1 << 24
"""Bytes of a record that no file is too short for, since it may be packed."""
MDF_TIME = 1
"""MDF's number for a master channel that is time; 2 is angle, 3 distance, 4 index."""


def sniff(head: Head) -> bool:
    """Whether the file begins with MDF's mark."""
    return head.raw.startswith((b"MDF     ", b"UnFinMF "))


def read(source: Source) -> list[Table]:
    """Return one table for every channel group.

    Raises
    ------
    Refusal
        If asammdf is missing, the file is damaged, or it holds no numbers.
    """
    path = source.head.path
    try:
        import asammdf
        from asammdf.blocks import mdf_v3, mdf_v4
    except ImportError:
        raise TransientRefusal(path, "MDF needs asammdf", "install it: pip install 'mrfit[mdf]'") from None
    for kind in (mdf_v3.MDF3, mdf_v4.MDF4):
        # asammdf's own destructor fails on a half-opened file and prints a traceback
        kind.__del__ = _close_quietly  # type: ignore[method-assign]
    try:
        with warnings.catch_warnings(), path.open("rb") as handle, asammdf.MDF(handle) as mdf:
            warnings.simplefilter("ignore")
            _check_records(mdf, source.head.size)
            source.room().expect(sum(_unpacked(group, source.shelf) for group in mdf.groups))
            tables = list(_tables(mdf, source.shelf))
    except Exception as error:  # asammdf raises whatever it met in a damaged file
        raise damaged(path, "MDF", error) from None
    if not tables:
        raise Refusal(path, "no channel of two or more numbers", "check what the recorder wrote")
    return only_logs(tables, source)


def _close_quietly(mdf: Any) -> None:
    with contextlib.suppress(Exception):
        mdf.close()


def _check_records(mdf: Any, size: int) -> None:
    """Refuse a record (one sample of every channel of a group) longer than the file: asammdf makes room for it."""
    for group in mdf.groups:
        about = group.channel_group
        record = about.samples_byte_nr + getattr(about, "invalidation_bytes_nr", 0)
        if record > max(size, LONGEST_RECORD):
            raise ValueError(f"a record of {record} bytes in a file of {size}")


def _unpacked(group: Any, shelf: Shelf | None) -> float:
    """Return the count of a group's numbers in memory at once: of one that is put on the disk, three channels'."""
    rows = float(group.channel_group.cycles_nr)
    return rows * (3 if shelf and shelf.takes(int(rows)) else len(group.channels))


def _tables(mdf: Any, shelf: Shelf | None) -> Iterator[Table]:
    """Yield one table for every channel group; where its master is no time (an angle, an index), it has none."""
    index = 0
    for number, group in enumerate(mdf.groups):
        master = mdf.masters_db.get(number)
        columns, times, timed = [], None, master is not None
        for place in range(len(group.channels)):
            # left to itself, asammdf drops a channel's invalid samples and with them the rows of the group
            signal = mdf.get(group=number, index=place, ignore_invalidation_bits=True)
            index += 1
            timed = timed and (signal.master_metadata or ("", MDF_TIME))[1] == MDF_TIME
            values = np.asarray(signal.samples)
            if (place == master and timed) or values.ndim != 1 or values.dtype.kind not in "fiu":
                continue
            values = values.astype(np.float64)
            if signal.invalidation_bits is not None:
                values[np.asarray(signal.invalidation_bits, dtype=bool)] = np.nan
            kept = shelf.kept(values) if shelf else values
            columns.append(Column(signal.name, signal.unit or None, kept, index - 1))
            times = np.asarray(signal.timestamps, dtype=np.float64)
        if columns and times is not None and len(times) > 1:
            clock = Column("time", "s", shelf.kept(times) if shelf else times, -1) if timed else None
            lines = series.counted(len(times), series.in_memory(columns[0].values))
            yield Table(tuple(columns), lines, time=clock)
