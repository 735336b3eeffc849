"""Columns of a log as a channel map means them: by place, by name, or by a cell of the header."""

from collections.abc import Mapping, Sequence

from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.table import Column
from mrfit.ingest.text.layout import name_and_unit


def columns_meant(wanted: str | int, names: Mapping[int, str]) -> list[int]:
    """Return the places of the columns that a map means, by place, by name or else by a name of any case.

    Parameters
    ----------
    wanted
        As the map has it.
    names
        Names by places from 0.
    """
    if isinstance(wanted, int):
        return [place for place in names if place == wanted]
    called = {place: name.strip() for place, name in names.items()}
    same = [place for place, name in called.items() if name == wanted.strip()]
    return same or [place for place, name in called.items() if name.lower() == wanted.strip().lower()]


def clocks_meant(wanted: str | int, names: Mapping[int, str]) -> list[int]:
    """Return the places of the columns that a map calls the time, by its name or by its cell of the header."""
    cells = [wanted, *([name_and_unit(wanted)[0]] if isinstance(wanted, str) else [])]
    return next(filter(None, (columns_meant(cell, names) for cell in cells)), [])


def places_meant(wanted: str | int, columns: Sequence[Column]) -> list[int]:
    """Return the places of the columns that a map means, by a cell of the header only if its unit is theirs."""
    there = {c.index: c for c in columns}
    places = columns_meant(wanted, {place: c.name for place, c in there.items()})
    if places or isinstance(wanted, int):
        return places
    split = name_and_unit(wanted)
    return [place for place, c in there.items() if c.unit and (c.name, c.unit) == split]


def mapped_places(rules: Rules, columns: Sequence[Column], settled: bool = False) -> set[int]:
    """Return the places of the columns of which a map makes channels, or of those whose unit or scale it gives.

    ``settled`` says that only columns are meant whose unit or scale is given.
    """
    given = [r for r in rules.channels.values() if not settled or r.unit is not None or r.scale != 1.0]
    return {place for rule in given for one in rule.columns for place in places_meant(one, columns)}


def ignored_places(rules: Rules, columns: Sequence[Column]) -> set[int]:
    """Return the places of the columns that a map leaves out."""
    return {place for one in rules.ignore for place in places_meant(one, columns)}
