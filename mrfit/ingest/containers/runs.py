"""Tests that a file of named arrays holds side by side, and tables of a file that are no logs."""

import math
import re
from collections.abc import Mapping, Sequence

from mrfit.core.channels import unit_of
from mrfit.core.counting import few
from mrfit.core.grouping import grouped
from mrfit.ingest.meaning import units
from mrfit.ingest.meaning.naming import OF_CONTAINERS
from mrfit.ingest.refusal import excerpt
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.layout import aliases_of, name_and_unit

TEST_WORDS = re.compile(
    r"(?<![a-z])(?:tests?|runs?|trials?|exp(?:eriments?)?|rec(?:ord(?:ing)?s?)?|meas(?:urements?)?|versuch|messung|lauf"
    r"|essai|prova|ensayo)(?![a-z])",
    re.IGNORECASE,
)
"""Words in the names of groups that are tests of their own."""
UNITS_OF_CONDITIONS = {"frequency": "Hz", "amplitude": "m"} | {
    n: unit_of(n) for n in ("current", "voltage", "temperature")
}
"""Conditions of a test that its numbers may state, with their SI units."""
OF_FILE = " of the file"
DEEPEST_TEST = 6
"""Groups in groups in which tests are looked for."""
FEW_RESULTS, FEW_WITHOUT_RATE, FAR_FEWER = 32, 200, 10
"""Most rows of a table of results, with and without the rate of the log beside it, and how many times more that has."""


def split_in_tests(names: Sequence[str], lengths: Mapping[str, int]) -> dict[str, list[str]]:
    """Return the groups or elements of a struct array that are tests, in their order, with the arrays in each.

    Such groups lie beside each other and hold arrays of the same names. As sensors do so too, they are tests only if
    they are called so, are elements of a struct array, or have lengths that differ; and if an array is called as a
    channel is, or a number alone tells them apart.

    Parameters
    ----------
    names
        Paths of the arrays, with dots.
    lengths
        Of the arrays.
    """
    inside: dict[str, dict[str, list[str]]] = {}
    for name in names:
        parts = name.split(".")
        for depth in range(1, min(len(parts), DEEPEST_TEST + 1)):
            inside.setdefault(".".join(parts[: depth - 1]), {}).setdefault(".".join(parts[:depth]), []).append(name)
    for groups in (inside[parent] for parent in sorted(inside, key=lambda p: (p.count("."), p != ""))):
        leaves = {group: tuple(sorted(n[len(group) + 1 :] for n in within)) for group, within in groups.items()}
        chosen = max(grouped((leaf, group) for group, leaf in leaves.items()).values(), key=len)
        sizes = {tuple(lengths[f"{group}.{leaf}"] for leaf in leaves[group]) for group in chosen}
        called = all(TEST_WORDS.search(g.rpartition(".")[2].replace("_", " ")) or g.endswith("]") for g in chosen)
        told = _has_channel(leaves[chosen[0]]) or called and _are_numbered(chosen)
        if len(chosen) > 1 and told and (called or len(sizes) > 1):
            return {group: groups[group] for group in in_order(chosen)}
    return {}


def _has_channel(leaves: Sequence[str]) -> bool:
    """Whether an array is called as a channel is, in a part of its path that is no place where programs keep any."""
    parts = {p.partition("[")[0] for leaf in leaves for p in leaf.split(".")}
    return any(aliases_of(name_and_unit(p)[0]) for p in parts if p and p.lower() not in OF_CONTAINERS)


def _are_numbered(groups: Sequence[str]) -> bool:
    return len({re.sub(r"\d+", "", g) for g in groups}) == 1


def in_order(groups: Sequence[str]) -> list[str]:
    """Return names in their order; those that differ in one number, as ``run_10`` and ``run_2``, by it."""
    if not _are_numbered(groups):
        return list(groups)
    return sorted(groups, key=lambda g: [int(n) for n in re.findall(r"\d{1,18}", g)])


def conditions_in(scalars: Mapping[str, float], written: Mapping[str, str]) -> dict[str, float]:
    """Return the numbers of a test that are conditions, as ``current_A`` and ``frequency_Hz``, in SI.

    Only those with a unit of their kind, since of others nobody knows whether they are in A or mA, and stated once.
    """
    found: dict[str, set[float]] = {}
    for name, value in scalars.items():
        bare, unit = name_and_unit(name)
        if unit is None and "_" in name:
            bare, _, unit = name.rpartition("_")
        unit = written.get(name) or unit or ""
        word = bare.strip().lower()
        key = {"freq": "frequency"}.get(word, word if word in UNITS_OF_CONDITIONS else "".join(aliases_of(bare)[:1]))
        wanted = UNITS_OF_CONDITIONS.get(key)
        if wanted and unit and math.isfinite(value) and units.known(unit) and units.compatible(unit, wanted):
            conversion = units.to_unit(unit, wanted)
            found.setdefault(key, set()).add(conversion.scale * value + conversion.offset)
    return {key: values.pop() for key, values in found.items() if len(values) == 1}


def is_of_results(table: Table, log: Table) -> bool:
    """Whether a table beside a log is none, as of peaks by cycle: it has no times, no rate of its own, and few rows."""
    few_rows = FEW_WITHOUT_RATE if table.dt is None else FEW_RESULTS
    own_rate = table.dt is not None and log.dt not in (None, table.dt)  # as of slow channels
    return table.time is None and not own_rate and table.rows <= few_rows and FAR_FEWER * table.rows <= log.rows


def _is_in_doubt(table: Table) -> bool:
    return any(f.kind == "rate-unclear" for f in table.findings)


def only_logs(tables: Sequence[Table], source: Source) -> list[Table]:
    """Return the tables that can be logs; others are left out and said: without a clock, or of a few results.

    Where none has a clock, all are returned; one whose rate is in doubt is to be asked for.
    """
    logs: list[Table] = []
    clocked = [t for t in tables if t.time is not None or t.dt or source.rules.dt or _is_in_doubt(t)]
    longest = max(clocked, key=lambda t: t.rows, default=None)
    if longest is not None:
        logs = [t for t in clocked if not is_of_results(t, longest)]
    left = [t for t in tables if all(t is not log for log in logs)]
    if not logs or not left:
        return _told_apart(list(tables))
    shown = few([f"'{excerpt(c.name)}' ({t.rows})" for t in left for c in t.columns], 8)
    text = f"tables without times beside those with them, or of a few results, are no logs and left out: {shown}"
    return _told_apart([logs[0].finding("not-read", text), *logs[1:]])


def _told_apart(tables: list[Table]) -> list[Table]:
    """Return tables, the first with what in the file each is of, by their histories, where these differ."""
    places = dict.fromkeys(t.history[0].removesuffix(OF_FILE) for t in tables if t.history)
    if len(places) < 2:
        return tables
    text = f"the file holds, in the order of the recordings: {few([*places], 8)}"
    return [tables[0].finding("several-tests", text), *tables[1:]]


def history_of(kind: str, name: str) -> tuple[str, ...]:
    """Return the first entry of the history of a table from one group, run or test of a file."""
    return (f"{kind} '{excerpt(name)}'{OF_FILE}",)
