"""Lookup tables: the output over velocity, current and temperature, and the current that gives an output.

A table knows no past: it holds the mean of the rising and the falling branch of a steady sine through the fit's range.
How much that loses against the model is measured on the fit's logs and stands at its head.
"""

import math
from dataclasses import dataclass

import numpy as np

from mrfit.core.channels import ANTIDERIVATIVES, unit_of
from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.export.c_parts import prefix_of
from mrfit.export.head import head_lines
from mrfit.export.source import SOURCE_INPUTS, ExportSource
from mrfit.export.stage import Files
from mrfit.export.templating import TEMPLATES, environment
from mrfit.export.text import ascii_line, c_comment, field, in_comment, number, wrapped
from mrfit.settings.export import Settings

# Breakpoints of the drive, of the current and of the temperature, and of the output in the inverse
_POINTS, _LEVELS, _TEMPERATURES, _OUTPUTS = 61, 17, 5, 41
# Samples of a cycle, cycles until it is steady, frequency in Hz where the logs have no stroke
CYCLE, SETTLE, FREQUENCY = 4000, 2, 1.0
# How much closer breakpoints are at 0 than at the ends, where the output turns
CLOSER = 3.0
# Currents between which the inverse is interpolated, states at which it is tried
_FINE, _TRIED = 201, 10_000


@dataclass(frozen=True)
class Axis:
    """A channel and its breakpoints (M,)."""

    name: str
    at: Array

    @property
    def unit(self) -> str:
        """Its SI unit."""
        return unit_of(self.name)

    @property
    def field(self) -> str:
        """Its name in C."""
        return field(self.name)

    @property
    def constants(self) -> list[str]:
        """Its breakpoints in C."""
        return _constants(self.at)


@dataclass(frozen=True)
class LookupTable:
    """Values of a channel over axes, in their order."""

    name: str
    axes: tuple[Axis, ...]
    values: Array

    @property
    def unit(self) -> str:
        """Its SI unit."""
        return unit_of(self.name)

    @property
    def constants(self) -> list[str]:
        """Its values in C."""
        return _constants(self.values)

    def __call__(self, *points: Array) -> Array:
        """Return the value at points (N,) of every axis: linear between breakpoints, held beyond."""
        found = np.zeros(len(points[0]))
        places, shares = [], []
        for axis, x in zip(self.axes, points, strict=True):
            if len(axis.at) < 2:
                places.append(np.zeros(len(x), dtype=np.int64))
                shares.append(np.zeros(len(x)))
                continue
            low = np.clip(np.searchsorted(axis.at, x, side="right") - 1, 0, len(axis.at) - 2)
            places.append(low)
            shares.append(np.clip((x - axis.at[low]) / (axis.at[low + 1] - axis.at[low]), 0.0, 1.0))
        for corner in range(2 ** len(self.axes)):
            weight, index = np.ones(len(found)), []
            for k, axis in enumerate(self.axes):
                up = corner >> k & 1
                weight = weight * (shares[k] if up else 1.0 - shares[k])
                index.append(np.minimum(places[k] + up, len(axis.at) - 1))
            found += weight * self.values[tuple(index)]
        return found


def files(source: ExportSource, settings: Settings) -> Files:
    """Return the tables as CSV and as C.

    Raises
    ------
    DataError
        If the fit's logs are not at hand, or the model has no drive.
    """
    table = forward(source)
    inverse = inverted(source, table)
    largest, rms = against_model(source, table)
    extent, unit = source.output_range, unit_of(source.spec.output)
    told = [
        f"Table of {' x '.join(f'{len(a.at)} {a.name}' for a in table.axes)}: mean of the branches of a steady sine.",
        f"Difference from the simulation in Python on the fit's logs: {rms * extent:.3g} {unit} RMS, "
        f"{100.0 * rms:.2g} % of the range, {100.0 * largest:.2g} % at most: what a table without a past loses.",
    ]
    if inverse:
        off, share = of_inverse(source, table, inverse)
        told.append(
            f"Inverse: at {_TRIED} random states of the table's range the current it gives yields the output within "
            f"{100.0 * off:.2g} % of the range RMS; of random outputs there, {100.0 * share:.3g} % can be had by some "
            "current, for others it is held at its end."
        )
    prefix = prefix_of(source.prefix or source.name)
    contents = {f"{prefix}_lookup.csv": _csv(source, table, told)}
    if inverse:
        contents[f"{prefix}_inverse.csv"] = _csv(source, inverse, told)
    contents |= _c(source, table, inverse, told)
    return Files(contents, tuple(told), largest)


def drive_of(source: ExportSource) -> str:
    """Return the channel over which the table is laid: a velocity, or what drives the model.

    Raises
    ------
    DataError
        If the model has neither.
    """
    for name in ("velocity", "angular_velocity"):
        if name in source.channels or any(name == of for c in source.channels for of, _ in ANTIDERIVATIVES.get(c, ())):
            return name
    first = source.spec.inputs[0]
    if first in SOURCE_INPUTS:
        raise DataError(f"--to lookup: {source.assembly.name} has no velocity and no other drive")
    return first


def forward(source: ExportSource) -> LookupTable:
    """Return the output over the drive, and over current and temperature where the model has them."""
    if not source.stretches:
        raise DataError(f"{source.name}: its logs are not at hand, and with them the ranges that a table needs")
    name = drive_of(source)
    low, high = _range(source, name)
    shape = np.sinh(CLOSER * np.linspace(-1.0, 1.0, _POINTS)) / math.sinh(CLOSER)
    middle = 0.5 * (low + high)
    axes = [Axis(name, middle + 0.5 * (high - low) * shape)]
    for level, count in (("current", _LEVELS), ("temperature", _TEMPERATURES)):
        if level in source.channels and level != name:
            ends = source.ranges[level]
            axes.append(Axis(level, np.linspace(*ends, count) if ends[1] > ends[0] else np.array(ends[:1])))
    values = np.empty([len(a.at) for a in axes])
    for place in np.ndindex(*values.shape[1:]):
        levels = {a.name: float(a.at[k]) for a, k in zip(axes[1:], place, strict=True)}
        values[(slice(None), *place)] = _centre(source, axes[0], levels)
    return LookupTable(source.spec.output, tuple(axes), values)


def _range(source: ExportSource, name: str) -> tuple[float, float]:
    if name in source.ranges:
        return source.ranges[name]
    # a model that derives its velocity itself
    rates = [np.gradient(s.inputs["displacement"], s.dt) for s in source.stretches]
    top = max(float(np.max(np.abs(r))) for r in rates)
    return -top, top


def _centre(source: ExportSource, axis: Axis, levels: dict[str, float]) -> Array:
    """Return the mean of the branches of a steady sine at the breakpoints of its drive."""
    phase = 2.0 * np.pi * np.arange((SETTLE + 1) * CYCLE + 1) / CYCLE
    amplitude, middle = 0.5 * (axis.at[-1] - axis.at[0]), 0.5 * (axis.at[-1] + axis.at[0])
    moving = axis.name in ("velocity", "angular_velocity")
    stroke = "angle" if axis.name == "angular_velocity" else "displacement"
    ends = source.ranges.get(stroke, (0.0, 0.0))
    reach = 0.5 * (ends[1] - ends[0])
    omega = amplitude / reach if moving and reach > 0.0 else 2.0 * math.pi * FREQUENCY
    dt = 2.0 * math.pi / omega / CYCLE
    drive = middle + amplitude * np.sin(phase)
    rate = "angular_acceleration" if axis.name == "angular_velocity" else "acceleration"
    rows = {
        axis.name: drive,
        stroke: 0.5 * (ends[0] + ends[1]) - amplitude / omega * np.cos(phase),
        rate: amplitude * omega * np.cos(phase),
        "time": dt * np.arange(len(phase)),
    }
    given = {**(rows if moving else {axis.name: drive, "time": rows["time"]}), **levels}
    channels = np.stack([np.broadcast_to(given.get(n, 0.0), phase.shape) for n in source.spec.inputs])
    output = source.simulate(channels.astype(np.float64), dt)[-CYCLE - CYCLE // 4 - 1 :]
    tail = drive[-CYCLE - CYCLE // 4 - 1 :]
    # from the lowest drive up, then down again
    half = CYCLE // 2
    up, down = slice(0, half + 1), slice(half, 2 * half + 1)
    falling = np.interp(axis.at, tail[down][::-1], output[down][::-1])
    rising = np.interp(axis.at, tail[up], output[up])
    return 0.5 * (falling + rising)


def against_model(source: ExportSource, table: LookupTable) -> tuple[float, float]:
    """Return largest and RMS difference from the model on the fit's logs, as shares of the output's range."""
    largest, squares, samples = 0.0, 0.0, 0
    for (drive, dt), stretch in zip(source.compared(), source.stretches, strict=False):
        rows = dict(zip(source.spec.inputs, drive, strict=True))
        if table.axes[0].name not in rows:
            rows[table.axes[0].name] = np.gradient(stretch.inputs["displacement"][: drive.shape[1]], dt)
        off = np.abs(table(*(rows[a.name] for a in table.axes)) - source.simulate(drive, dt))
        largest, squares, samples = max(largest, float(off.max())), squares + float(np.sum(off**2)), samples + len(off)
    return largest / source.output_range, math.sqrt(squares / samples) / source.output_range


def inverted(source: ExportSource, table: LookupTable) -> LookupTable | None:
    """Return the current over the drive, the output and the temperature; None of a model without a current.

    Where an output is given by no current within the fit's range, the table holds the nearer end of it.
    """
    names = [a.name for a in table.axes]
    low, high = float(table.values.min()), float(table.values.max())
    wanted = Axis(table.name, np.linspace(low, high, _OUTPUTS))
    if "current" not in names:
        return None
    if names[0] == "current":
        values = _solved(table.axes[0].at, table.values[:, None], wanted.at)[0]
        return LookupTable("current", (wanted,), values)
    place = names.index("current")
    current = table.axes[place].at
    if len(current) < 2:
        return None
    moved = np.moveaxis(table.values, place, 0)
    rest = moved.shape[1:]
    found = _solved(current, moved.reshape(len(current), -1), wanted.at).reshape(*rest, _OUTPUTS)
    axes = tuple(a for a in table.axes if a.name != "current")
    # over drive, output, temperature
    return LookupTable("current", (axes[0], wanted, *axes[1:]), np.moveaxis(found, -1, 1))


def _solved(current: Array, columns: Array, wanted: Array) -> Array:
    """Return for each column (I, M) the currents (M, O) whose output is nearest to those wanted."""
    fine = np.linspace(current[0], current[-1], _FINE)
    found = np.empty((columns.shape[1], len(wanted)))
    for k, column in enumerate(columns.T):
        outputs = np.interp(fine, current, column)
        for j, value in enumerate(wanted):
            crossing = np.flatnonzero((outputs[:-1] - value) * (outputs[1:] - value) <= 0.0)
            if len(crossing):
                at = int(crossing[0])
                rise = outputs[at + 1] - outputs[at]
                share = (value - outputs[at]) / rise if rise else 0.0
                found[k, j] = fine[at] + share * (fine[at + 1] - fine[at])
            else:
                found[k, j] = fine[int(np.argmin(np.abs(outputs - value)))]
    return found


def of_inverse(source: ExportSource, table: LookupTable, inverse: LookupTable) -> tuple[float, float]:
    """Return the RMS error of the output under the inverse's current, and the share of states that can be had."""
    rng = np.random.default_rng(0)
    points = {a.name: rng.uniform(a.at[0], a.at[-1], _TRIED) for a in table.axes}
    wanted = table(*(points[a.name] for a in table.axes))
    asked = {**points, table.name: wanted}
    given = {**points, "current": inverse(*(asked[a.name] for a in inverse.axes))}
    off = table(*(given[a.name] for a in table.axes)) - wanted
    low, high = float(table.values.min()), float(table.values.max())
    anywhere = rng.uniform(low, high, _TRIED)
    current = inverse(*({**points, table.name: anywhere}[a.name] for a in inverse.axes))
    reached = table(*({**points, "current": current}[a.name] for a in table.axes))
    near = np.abs(reached - anywhere) < 0.02 * (high - low)
    return float(np.sqrt(np.mean(off**2))) / source.output_range, float(np.mean(near))


def _csv(source: ExportSource, table: LookupTable, told: list[str]) -> bytes:
    lines = [f"# {ascii_line(line)}".rstrip() for line in wrapped(head_lines(source, told))]
    names = [f"{a.name} [{a.unit}]" for a in table.axes] + [f"{table.name} [{unit_of(table.name)}]"]
    lines.append(",".join(names))
    grids = np.meshgrid(*(a.at for a in table.axes), indexing="ij")
    rows = np.column_stack([g.ravel() for g in grids] + [table.values.ravel()])
    lines += [",".join(f"{v:.9g}" for v in row) for row in rows.tolist()]
    return ("\n".join(lines) + "\n").encode("ascii")


def _c(source: ExportSource, table: LookupTable, inverse: LookupTable | None, told: list[str]) -> dict[str, bytes]:
    prefix = prefix_of(source.prefix or source.name)
    context = {"p": prefix, "output": in_comment(table.name), "table": table, "inverse": inverse}
    jinja = environment(TEMPLATES / "lookup")
    head = c_comment(head_lines(source, told))
    short = c_comment([f"See {prefix}_lookup.h"])
    header = jinja.get_template("lookup.h.j2").render(context, head=head)
    code = jinja.get_template("lookup.c.j2").render(context, head=short)
    return {f"{prefix}_lookup.h": header.encode("ascii"), f"{prefix}_lookup.c": code.encode("ascii")}


def _constants(values: Array) -> list[str]:
    return [f"K({number(v)})" for v in values.ravel().tolist()]
