"""National Instruments TDMS, through npTDMS."""

from pathlib import Path
from typing import Any

import numpy as np

from mrfit.ingest.head import Head
from mrfit.ingest.layout import TIME_NAMES, name_and_unit
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Column, Source, Table
from mrfit.specs import ReaderSpec

SPEC = ReaderSpec("tdms", "National Instruments TDMS (needs npTDMS)")
FRAGILE = True  # read in a process of its own: the library crashes on some damaged files
UNIT_KEYS = ("unit_string", "NI_UnitDescription", "unit", "Unit")


def sniff(head: Head) -> bool:
    """Whether the file begins with TDMS's tag."""
    return head.raw.startswith(b"TDSm")


def read(source: Source) -> list[Table]:
    """Return one table for every group's channels of one length and one increment.

    Raises
    ------
    Refusal
        If npTDMS is missing, the file is damaged, or it holds no numbers.
    """
    path = source.head.path
    tables = []
    for channels in _groups(path):
        by_clock: dict[tuple[int, float, float], list[Column]] = {}
        for index, (name, unit, values, increment, offset) in channels:
            by_clock.setdefault((len(values), increment, offset), []).append(Column(name, unit, values, index))
        tables += [_table(columns, *clock) for clock, columns in by_clock.items() if clock[0] > 1]
    if not tables:
        raise Refusal(path, "no channel of two or more numbers", "check what the recorder wrote")
    return tables


def _groups(path: Path) -> list[list[tuple[int, tuple[str, str | None, Any, float, float]]]]:
    try:
        import nptdms
    except ImportError:
        raise Refusal(path, "TDMS needs npTDMS", "install it: pip install 'mrfit[tdms]'") from None
    groups = []
    index = 0
    try:
        for group in nptdms.TdmsFile.read(path).groups():
            channels = []
            for channel in group.channels():
                values = np.asarray(channel[:])
                if values.dtype.kind in "fiu":
                    channels.append((index, _described(channel, values)))
                index += 1
            groups.append(channels)
    except Exception as error:  # npTDMS raises whatever it met in a damaged file
        text = (str(error).splitlines() or ["unreadable"])[0]
        raise Refusal(path, f"damaged TDMS ({text})", "copy it again") from None
    return groups


def _described(channel: Any, values: Any) -> tuple[str, str | None, Any, float, float]:
    name, bracketed = name_and_unit(channel.name)
    unit = next((str(channel.properties[k]) for k in UNIT_KEYS if channel.properties.get(k)), None) or bracketed
    increment = float(channel.properties.get("wf_increment", 0.0))
    return name, unit, values.astype(np.float64), increment, float(channel.properties.get("wf_start_offset", 0.0))


def _table(columns: list[Column], rows: int, increment: float, offset: float) -> Table:
    time = next((c for c in columns if c.name.lower() in TIME_NAMES), None) if increment <= 0.0 else None
    return Table(
        tuple(c for c in columns if c is not time),
        np.arange(1, rows + 1, dtype=np.int64),
        time=time,
        dt=increment if increment > 0.0 else None,
        start=offset,
    )
