"""National Instruments TDMS, through npTDMS."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from mrfit.core.counting import few
from mrfit.core.specs import ReaderSpec
from mrfit.ingest import series
from mrfit.ingest.containers.attributes import doubt_of, units_in
from mrfit.ingest.containers.rates import SAME_INTERVAL, StatedNumber, stated_rate, told_in
from mrfit.ingest.containers.runs import conditions_in, history_of, only_logs
from mrfit.ingest.containers.shelf import Shelf, check_disk
from mrfit.ingest.meaning import units
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.meaning.chosen import clocks_meant
from mrfit.ingest.refusal import Refusal, TransientRefusal, damaged
from mrfit.ingest.table import Column, Source, Table
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.layout import is_called_time, name_and_units

SPEC = ReaderSpec("tdms", "National Instruments TDMS (needs npTDMS)", fragile=True, libraries=("nptdms",))
UNSET_INCREMENT = 1.0
"""Increment in s of a waveform that was given none."""


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
    begins = [c.began for group in groups for c in group.channels if c.began is not None]
    times = _times(groups, source.rules)
    # a group of times alone is the clock of groups without one
    alone = [t for own, group in zip(times, groups, strict=True) if len(own) == len(group.channels) for t in own]
    for own, group in zip(times, groups, strict=True):
        by_clock: dict[tuple[int, float, float], list[_TdmsChannel]] = {}
        for channel in group.channels:
            if channel.column in own:
                continue
            late = (channel.began - min(begins)) / np.timedelta64(1, "s") if channel.began is not None else 0.0
            clock = (len(channel.column.values), channel.increment, channel.offset + float(late))
            by_clock.setdefault(clock, []).append(channel)
        made = [
            _table(members, own or ([] if clock[1] > 0.0 else alone), group, *clock)
            for clock, members in by_clock.items()
            if clock[0] > 1
        ]
        tables += [replace(t, **group.test()) for t in made] if len(groups) > 1 else made
    tables = only_logs(tables, source)
    doubts = [f"'{c.column.name}': {c.doubt}" for group in groups for c in group.channels if c.doubt]
    if tables and doubts:
        tables[0] = tables[0].finding("packing-unclear", f"{few(doubts, 3)}; a channel map can say another scale")
    if any(table.time is None and table.dt == UNSET_INCREMENT for table in tables):
        text = "the file states an increment of 1 s, which LabVIEW writes where none was set"
        tables[0] = tables[0].finding("rate-doubtful", f"{text}; a channel map can say rate = HZ")
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
    doubt: str = ""
    told: tuple[StatedNumber, ...] = ()


@dataclass(frozen=True, slots=True)
class _TdmsGroup:
    """A group's channels, its properties, and what it and the file tell of the rate."""

    name: str
    channels: list[_TdmsChannel]
    about: Mapping[str, Any]
    told: tuple[StatedNumber, ...]

    def test(self) -> dict[str, Any]:
        """Return condition and history of the group as a test of its own."""
        numbers = {k: float(v) for k, v in self.about.items() if isinstance(v, (int, float, np.number))}
        return {"condition": conditions_in(numbers, {}), "history": history_of("group", self.name)}


def _groups(path: Path, source: Source) -> list[_TdmsGroup]:
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
                channels: list[_TdmsChannel] = []
                for channel in group.channels():
                    values = np.asarray(channel[:])
                    if values.dtype.kind in "fiuM":
                        channels.append(_described(channel, values, index, source.shelf))
                    index += 1
                told = (*_told(file.properties), *_told(group.properties))
                groups.append(_TdmsGroup(group.name, channels, group.properties, told))
    except Exception as error:  # npTDMS raises whatever it met in a damaged file
        raise damaged(path, "TDMS", error) from None
    return groups


def _told(properties: Mapping[str, Any]) -> list[StatedNumber]:
    """Return the statements of properties on the rate, but those of the waveform: its axis has their unit."""
    return told_in({key: value for key, value in properties.items() if not key.startswith("wf_")})


def _expect(path: Path, lengths: list[int], source: Source) -> None:
    """Check that there is room for channels of these lengths: of those put on the disk, for one after the other."""
    room, shelf = source.room(), source.shelf
    long = [length for length in lengths if shelf and shelf.takes(length)]
    room.expect(sum(lengths) - sum(long) + max(long, default=0))
    if shelf:
        check_disk(path, sum(long), shelf.folder)


def _described(channel: Any, values: Any, index: int, shelf: Shelf | None) -> _TdmsChannel:
    about = channel.properties
    name, unit = name_and_units(channel.name, "".join(units_in(about)) or None)
    stamped = values.dtype.kind == "M"
    if stamped and len(values):
        values, unit = (values - values[0]) / np.timedelta64(1, "s"), "s"
    axis = str(about.get("wf_xunit_string") or "s")
    timed = units.known(axis) and units.compatible(axis, "s")  # the x axis of a spectrum is a frequency
    second = units.to_unit(axis, "s").scale if timed else 0.0
    began = about.get("wf_start_time") if timed else None
    numbers = values.astype(np.float64)
    return _TdmsChannel(
        Column(name, unit, shelf.kept(numbers) if shelf else numbers, index),
        second * float(about.get("wf_increment", 0.0)),
        second * float(about.get("wf_start_offset", 0.0)),
        np.datetime64(began) if isinstance(began, (np.datetime64, datetime)) else None,
        stamped,
        doubt_of(about, None),
        tuple(_told(about)),
    )


def _times(groups: Sequence[_TdmsGroup], rules: Rules) -> list[list[Column]]:
    """Return the times of each group: the map's or, without a map, those of that kind, or named so where they rise."""
    if rules.time is not None:
        names = {c.column.index: c.column.name for group in groups for c in group.channels}
        places = clocks_meant(rules.time.column, names)
        return [[c.column for c in group.channels if c.column.index in places] for group in groups]
    return [[c.column for c in group.channels if _is_time(c, rules)] for group in groups]


def _is_time(channel: _TdmsChannel, rules: Rules) -> bool:
    name, unit, values = channel.column.name, channel.column.unit, channel.column.values
    named = is_called_time(name, unit) and not rules.leaves_out(name)
    return channel.stamped or named and series.rises(values)


def _table(
    channels: list[_TdmsChannel], times: list[Column], group: _TdmsGroup, rows: int, increment: float, offset: float
) -> Table:
    """Return the table of channels, with the first times of as many rows beside the increment.

    Other times of the group may be those of some channels; copies are not.

    A rate among the properties holds where the waveform has no increment, or the one that was not set.
    """
    fitting, within = [t for t in times if len(t.values) == rows], [c.column for c in group.channels]
    others = [t for t in fitting[1:] if t in within and not series.equal(t.values, fitting[0].values)]
    columns = tuple(sorted((*(c.column for c in channels), *others), key=lambda c: c.index))
    table = Table(
        columns,
        series.counted(rows, series.in_memory(columns[0].values)),
        time=fitting[0] if fitting else None,
        dt=increment if increment > 0.0 else None,
        start=offset,
    )
    if table.time is not None:
        return table
    dt, findings = stated_rate([*group.told, *(one for c in channels for one in c.told)])
    if table.dt is None:
        return replace(table, dt=dt, findings=findings)
    if dt is None or abs(dt / increment - 1.0) < SAME_INTERVAL:
        return table
    used = dt if increment == UNSET_INCREMENT else increment
    text = f"the waveforms have an increment of {increment:g} s, and a property states a sample interval of {dt:g} s"
    return replace(table, dt=used).finding(
        "rate-doubtful", f"{text}: {used:g} s is used; a channel map can say rate = HZ"
    )
