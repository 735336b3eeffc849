"""National Instruments TDMS, through npTDMS."""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from mrfit.core.specs import ReaderSpec
from mrfit.ingest import series
from mrfit.ingest.containers.attributes import units_in
from mrfit.ingest.containers.shelf import Shelf, check_disk
from mrfit.ingest.meaning import units
from mrfit.ingest.refusal import Refusal, TransientRefusal, damaged
from mrfit.ingest.table import Column, Source, Table
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.layout import TIME_NAMES, name_and_unit

SPEC = ReaderSpec("tdms", "National Instruments TDMS (needs npTDMS)", fragile=True, libraries=("nptdms",))


def sniff(head: Head) -> bool:
    """Whether the file begins with TDMS's tag."""
    return head.raw.startswith(b"TDSm")


def read(source: Source) -> list[Table]:
    """Return one table for every group's channels of one length and one clock.

    A waveform's clock is its increment, offset and start time (``wf_increment``, ``wf_start_offset``,
    ``wf_start_time``), as long as its x axis is time; starts count from the earliest of the file.

    Raises
    ------
    Refusal
        If npTDMS is missing, the file is damaged, or it holds no numbers.
    """
    path = source.head.path
    tables = []
    groups = _groups(path, source)
    begins = [c.began for channels in groups for c in channels if c.began is not None]
    for channels in groups:
        by_clock: dict[tuple[int, float, float], list[_TdmsChannel]] = {}
        for channel in channels:
            late = (channel.began - min(begins)) / np.timedelta64(1, "s") if channel.began is not None else 0.0
            clock = (len(channel.column.values), channel.increment, channel.offset + float(late))
            by_clock.setdefault(clock, []).append(channel)
        tables += [_table(members, *clock) for clock, members in by_clock.items() if clock[0] > 1]
    if not tables:
        raise Refusal(path, "no channel of two or more numbers", "check what the recorder wrote")
    return tables


@dataclass(frozen=True, slots=True, eq=False)
class _TdmsChannel:
    """A channel's numbers and its clock; ``stamped`` says that the numbers are time stamps, in s from the first."""

    column: Column
    increment: float
    offset: float
    began: np.datetime64 | None
    stamped: bool


def _groups(path: Path, source: Source) -> list[list[_TdmsChannel]]:
    try:
        import nptdms
    except ImportError:
        raise TransientRefusal(path, "TDMS needs npTDMS", "install it: pip install 'mrfit[tdms]'") from None
    groups = []
    index = 0
    try:
        with nptdms.TdmsFile.open(path) as file:
            _expect(path, [len(channel) for group in file.groups() for channel in group.channels()], source)
            for group in file.groups():
                channels = []
                for channel in group.channels():
                    values = np.asarray(channel[:])
                    if values.dtype.kind in "fiuM":
                        channels.append(_described(channel, values, index, source.shelf))
                    index += 1
                groups.append(channels)
    except Exception as error:  # npTDMS raises whatever it met in a damaged file
        raise damaged(path, "TDMS", error) from None
    return groups


def _expect(path: Path, lengths: list[int], source: Source) -> None:
    """Check that there is room for channels of these lengths: of those put on the disk, for one after the other."""
    room, shelf = source.room(), source.shelf
    long = [length for length in lengths if shelf and shelf.takes(length)]
    room.expect(sum(lengths) - sum(long) + max(long, default=0))
    if shelf:
        check_disk(path, sum(long), shelf.folder)


def _described(channel: Any, values: Any, index: int, shelf: Shelf | None) -> _TdmsChannel:
    name, bracketed = name_and_unit(channel.name)
    about = channel.properties
    unit = "".join(units_in(about)) or bracketed
    stamped = values.dtype.kind == "M"
    if stamped and len(values):
        values, unit = (values - values[0]) / np.timedelta64(1, "s"), "s"
    axis = str(about.get("wf_xunit_string") or "s")
    timed = units.known(axis) and units.compatible(axis, "s")  # the x axis of a spectrum is a frequency
    began = about.get("wf_start_time") if timed else None
    numbers = values.astype(np.float64)
    return _TdmsChannel(
        Column(name, unit, shelf.kept(numbers) if shelf else numbers, index),
        float(about.get("wf_increment", 0.0)) if timed else 0.0,
        float(about.get("wf_start_offset", 0.0)) if timed else 0.0,
        np.datetime64(began) if isinstance(began, (np.datetime64, datetime)) else None,
        stamped,
    )


def _table(channels: list[_TdmsChannel], rows: int, increment: float, offset: float) -> Table:
    times = [c.column for c in channels if c.stamped] + [
        c.column for c in channels if c.column.name.lower() in TIME_NAMES
    ]
    time = times[0] if times and increment <= 0.0 else None
    return Table(
        tuple(c.column for c in channels if c.column is not time),
        series.counted(rows, series.in_memory(channels[0].column.values)),
        time=time,
        dt=increment if increment > 0.0 else None,
        start=offset,
    )
