"""Logs with one row for each channel and time: their rows sorted into a column for each channel."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrfit.core.recording import Finding
from mrfit.core.specs import Array
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Column, RejectedRow, Source, Table
from mrfit.ingest.text.layout import Header, name_and_unit

CHANNEL_NAMES = re.compile(
    r"(?:channel|signal|sensor|variable|parameter|quantity|tag|series|measurand|kanal|messgr(?:ö|oe)(?:ß|ss)e|canal|voie)"
    r"(?:[ _-]?(?:name|id|no\.?|nr\.?|number))?|name|ch",
    re.IGNORECASE,
)
VALUE_NAMES = re.compile(
    r"(?:measured |mess)?(?:values?|wert|reading|val|valeur|valor)|data|measurement", re.IGNORECASE
)
UNIT = re.compile(r"units?|einheit|unité|unidad|unità", re.IGNORECASE)
MOST_CHANNELS = 256


@dataclass(frozen=True, slots=True)
class LongFormat:
    """Columns that hold the channel, its value, and its unit where there is one."""

    channel: int
    value: int
    unit: int | None

    @property
    def texts(self) -> tuple[int, ...]:
        """Columns to read as text."""
        return tuple(k for k in (self.channel, self.unit) if k is not None)


def long_format(header: Header, kinds: Sequence[str]) -> LongFormat | None:
    """Return the columns of channels and values; None if every channel has a column."""

    def places(form: re.Pattern[str], allowed: tuple[str, ...]) -> list[int]:
        names = [n.strip() for n in header.names]
        return [k for k, n in enumerate(names) if form.fullmatch(n) and kinds[k] in allowed]

    channel, value = places(CHANNEL_NAMES, ("text", "number")), places(VALUE_NAMES, ("number",))
    numbers = [k for k, kind in enumerate(kinds) if kind == "number" and k not in channel]
    if len(channel) > 1:
        channel = [k for k in channel if kinds[k] == "text"][:1] or channel[:1]
    if len(channel) != 1 or len(value) != 1 or len(numbers) > 2 + kinds.count("stamp"):
        return None
    unit = places(UNIT, ("text",))
    return LongFormat(channel[0], value[0], unit[0] if unit else None)


def sorted_out(table: Table, form: LongFormat, texts: dict[int, list[str]], source: Source) -> Table:
    """Return a table with a column for each channel, and a clock for each that has times of its own.

    Raises
    ------
    Refusal
        If there is no time, a channel has several units, or the log is read block by block.
    """
    path = source.head.path
    if source.block is not None and not (source.block.line == 1 and source.block.last):
        raise Refusal(path, "one row for each channel and time, in a log read in parts", "export a column per channel")
    if table.time is None:
        raise Refusal(path, "one row for each channel, and no column of times", "export a column for each channel")
    names = np.array(texts[form.channel])
    values = next(c for c in table.columns if c.index == form.value)
    channels = list(dict.fromkeys(names[names != ""].tolist()))
    if len(channels) > MOST_CHANNELS:
        raise Refusal(
            path, f"column '{form.channel}' names {len(channels)} channels", "export a column for each channel"
        )
    columns: list[Column] = []
    clocks: list[Column] = []
    longest = max(int(np.count_nonzero(names == n)) for n in channels)
    lines = table.lines[:longest]
    for place, name in enumerate(channels):
        own = names == name
        lines = table.lines[own] if np.count_nonzero(own) == longest else lines
        clocks.append(replace(table.time, values=_padded(table.time.values[own], longest), index=2 * place))
        called, written = name_and_unit(name)
        if form.unit is not None:
            called, written = name, _unit(name, np.array(texts[form.unit])[own], path)
        shown = f"channel {name}" if re.fullmatch(r"[\d.]+", name) else called
        columns.append(Column(shown, written or values.unit, _padded(values.values[own], longest), 2 * place + 1))
    if all(np.array_equal(c.values, clocks[0].values, equal_nan=True) for c in clocks):
        clocks = clocks[:1]
    elif source.rules.time is not None:
        raise Refusal(path, "channels, one row each, have times that differ", "leave time = … out of the channel map")
    lost = tuple(RejectedRow("no channel", int(n)) for n in table.lines[names == ""])
    text = f"each row holds one channel and time: {len(channels)} channels are sorted into columns"
    return replace(
        table,
        columns=tuple(sorted([*columns, *clocks[1:]], key=lambda c: c.index)),
        time=clocks[0],
        lines=lines,
        refused=tuple(sorted((*table.refused, *lost), key=lambda r: r.line)),
        findings=(*table.findings, Finding("long-format", "", None, text)),
        history=(*table.history, f"sorted {len(channels)} channels into columns"),
    )


def _padded(values: Array, length: int) -> Array:
    return np.concatenate([values, np.full(length - len(values), np.nan)])


def _unit(name: str, written: NDArray[Any], path: Path) -> str | None:
    units = sorted(set(written.tolist()))
    if len(units) > 1:
        shown = " and ".join(f"'{u}'" for u in units)
        raise Refusal(path, f"channel '{name}' has the units {shown}", "export it with one unit")
    return units[0] or None
