"""The arrays of a damper's ``Chain``, from its model, effects, parameters and law of current.

Items of plug-ins that are functions of arrays, as compiled loops call them.
"""

import ctypes
import math
from collections.abc import Callable, Collection
from functools import cache
from typing import Any

import numpy as np

from mrfit.core import registry
from mrfit.core.channels import CHANNELS, LEVEL_CHANNELS
from mrfit.core.protocols import AddsTerm, ChangesInput, HasCurve, HasLaw, HasStep, MovesDrive, ShapesOutput
from mrfit.core.specs import Array, EffectSpec
from mrfit.effects.temperature import REFERENCE
from mrfit.errors import DataError
from mrfit.kernels.branch import curve_of, numbers_of
from mrfit.kernels.elements import WIRED, Entry, entry_of
from mrfit.kernels.past import RESERVED
from mrfit.simulate import chain as columns
from mrfit.simulate.chain import ChainPlaces, DamperChain
from mrfit.simulate.current_dependence import CurrentDependence, coordinate, count, form_of, knee_of, logarithmic

# Samples and interval with which a definition is tested for memory
_PROBE, _PROBE_DT = 24, 1e-3
_POINTER = ctypes.POINTER(ctypes.c_double)
_FUNCTION = ctypes.CFUNCTYPE(ctypes.c_double, *[_POINTER] * 4, ctypes.c_double, _POINTER)


def entry_for(item: Any, curved: bool = False) -> Entry:
    """Return an item for compiled loops to call: its ``step`` or ``law`` compiled, else its function of arrays.

    One that is ``curved`` is stepped along its curve.

    Raises
    ------
    DataError
        If it has a memory and no ``step``.
    """
    if curved or isinstance(item, HasLaw | HasStep):
        return entry_of(item, curved)
    return _called(item.SPEC.name, _Values(item))


@cache
def _called(name: str, values: "_Values") -> Entry:
    _check_memoryless(name, values)
    last, count = WIRED + len(values.inputs), len(values.item.SPEC.params)

    # an array of its own at every call would cost as much as most laws
    drive, given = np.empty((last - WIRED, 1)), np.empty((1, count))

    def function(state: Any, following: Any, inputs: Any, theta: Any, dt: float, past: Any) -> float:
        drive[:, 0], given[0] = inputs[WIRED:last], theta[count : 2 * count]
        return float(values(drive, given)[0])

    made = _FUNCTION(function)
    _alive.append(made)
    return Entry(ctypes.cast(made, ctypes.c_void_p).value or 0, values.inputs)


# What addresses point at
_alive: list[Any] = []


class _Values:
    """A model or an effect as a function of its inputs (C, N) and parameters (1, K)."""

    def __init__(self, item: Any) -> None:
        spec = item.SPEC
        signal = ("",) if isinstance(spec, EffectSpec) and spec.slot == "output" else ()
        self.item, self.inputs = item, (*signal, *spec.inputs)
        # chosen once: to ask which protocol an effect has takes longer than its term
        self.of = _function_of(item, self.inputs)

    def __hash__(self) -> int:
        return hash(id(self.item))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Values) and other.item is self.item

    def __call__(self, drive: Array, theta: Array) -> Array:
        channels = dict(zip(self.inputs, drive, strict=True)) or {"": np.zeros(drive.shape[1] if drive.size else 1)}
        return np.asarray(self.of(channels, drive, theta))


def _function_of(item: Any, inputs: tuple[str, ...]) -> Callable[[dict[str, Array], Array, Array], Array]:
    """Return the function of an item's channels by name, all its inputs (C, N) and its parameters (1, K).

    Raises
    ------
    DataError
        If an effect is none of these functions.
    """
    if not isinstance(item.SPEC, EffectSpec):
        return lambda channels, drive, theta: item.response(drive, theta, _PROBE_DT)[0]
    if isinstance(item, ChangesInput):
        return lambda channels, drive, theta: item.transform(channels, theta[0], _PROBE_DT)[inputs[-1]]
    if isinstance(item, AddsTerm):
        return lambda channels, drive, theta: item.term(channels, theta, _PROBE_DT)[0]
    if isinstance(item, ShapesOutput):
        return lambda channels, drive, theta: item.shape(channels.pop("")[None], channels, theta, _PROBE_DT)[0]
    raise DataError(f"apply does not take the effect {item.SPEC.name}: give it a law, see docs/plugins.md")


def _check_memoryless(name: str, values: _Values) -> None:
    """Refuse a definition with memory of which no step is known.

    Raises
    ------
    DataError
        If a permutation of samples does not permute its output.
    """
    rng = np.random.default_rng(0)
    drive = 0.05 * rng.standard_normal((len(values.inputs), _PROBE))
    theta = np.array([[p.start for p in values.item.SPEC.params]])
    order = rng.permutation(_PROBE)
    with np.errstate(all="ignore"):
        straight, mixed = values(drive, theta), values(np.ascontiguousarray(drive[:, order]), theta)
    if not np.allclose(straight[..., order], mixed, rtol=1e-12, atol=0.0, equal_nan=True):
        raise DataError(f"'{name}' has a memory, and apply knows no steps of it: give it a step, see docs/plugins.md")


# Of a channel that nobody gives: a fluid at the temperature to which parameters refer, a record's start
DEFAULTS = {"temperature": REFERENCE, "time": 0.0}
# Places of a ring beyond those that its longest delay takes
SPARE = 5
_KINDS = {"input": columns.INPUT, "theta": columns.FACTORS}


class DamperProgram:
    """A damper ready to be stepped; parameters of the base that are ``moving`` may be changed on the way.

    Attributes
    ----------
    chain
        What compiled loops take.
    channels
        Names of the channels that it is given, in their order.
    effects
        Name, module and parameters (Q,) of the effects that act, in the order in which they do.
    """

    def __init__(  # noqa: PLR0913
        self,
        model: str,
        values: Array,
        dependence: CurrentDependence | None,
        held: bool,
        shortest: float,
        moving: Collection[str] = (),
    ) -> None:
        base, *written = model.split("+")
        self._module = registry.load("model", base)
        modules = sorted((registry.load("effect", e) for e in written), key=lambda m: m.SPEC.place)
        ends = len(values) - np.cumsum([0, *(len(m.SPEC.params) for m in reversed(modules))])[::-1]
        self._dependence, self._shortest = dependence, shortest
        self._moving = {*moving, *(name for name, _ in (dependence.orders if dependence else ()))}
        self._nodes = self._read(values[: ends[0]])
        self.effects: list[tuple[str, Any, Array]] = [
            (m.SPEC.name, m, values[a:b])
            for m, a, b in zip(modules, ends[:-1], ends[1:], strict=True)
            if not np.all(values[a:b] == np.array(m.SPEC.neutral))
        ]
        # effects of mrfit's own that a base consists of: before the others, and behind
        self._before, self._behind = self._split()
        needed = (*self._module.SPEC.inputs, *(n for m in modules for n in m.SPEC.inputs), "current")
        more = [p.needs for m in modules for p in m.SPEC.params if p.needs]
        self.channels = tuple(dict.fromkeys((*needed, *more)))
        # a channel of use where another part brings it
        self.unasked = frozenset(more) - frozenset(needed)
        self._rows: list[dict[str, int]] = []
        self._rings: list[tuple[dict[str, int], float]] = []
        self._place = len(self.channels)
        self._wires: list[int] = []
        self._params: list[float] = []
        self.chain = self._made(held)

    @property
    def behind(self) -> list[tuple[str, Any, Array]]:
        """Effects with memory behind the force, from the force on."""
        return [*self._behind, *(e for e in self.effects if e[1].SPEC.slot == "output" and isinstance(e[1], HasStep))]

    @property
    def before(self) -> list[tuple[str, Any, Array]]:
        """Effects on the current's way to the base."""
        changing = (*self.effects, *self._before)
        return [e for e in changing if e[1].SPEC.slot == "input" and "current" in e[1].SPEC.inputs]

    def _read(self, values: Array) -> dict[str, Array]:
        """Return the base's values by parameter, of those that depend on current at their nodes."""
        dependence = self._dependence
        orders = dict(dependence.orders) if dependence else {}
        sizes = [count(orders[p.name]) if orders.get(p.name) else 1 for p in self._module.SPEC.params]
        parts = np.split(values, np.cumsum(sizes)[:-1])
        return dict(zip(self._module.SPEC.names, parts, strict=True))

    def _split(self) -> tuple[list[tuple[str, Any, Array]], list[tuple[str, Any, Array]]]:
        """Take ``hammerstein-wiener`` apart into M(s), its static map and H(s), unless a current moves their poles."""
        at = {name: float(nodes[0]) for name, nodes in self._nodes.items() if len(nodes) == 1}
        names = ("p1", "p2", "p3", "p4", "omega", "xi", "q1", "q2", "zero", "tau")
        if self._module.SPEC.name != "hammerstein-wiener" or not set(names) <= set(at):
            return [], []
        p1, p2, p3, p4, omega, xi, q1, q2, zero, tau = (at[n] for n in names)
        self._module = registry.load("model", "hw-static")
        m = np.array([1.0 / q1, q1 / q2, q1 / zero, tau])
        h = np.array([1.0 / p1, p1 / p2, p1 / p3, p1 / p4, p1 / omega, xi])
        filters = registry.load("effect", "current-filter"), registry.load("effect", "force-filter")
        return [("hammerstein-wiener", filters[0], m)], [("hammerstein-wiener", filters[1], h)]

    def _made(self, held: bool) -> DamperChain:
        number, count, current = len(self.channels), len(self._module.SPEC.params), self.channels.index("current")
        laws, pieces = self._laws()
        late: list[tuple[str, Any, Array]] = [e for e in self.effects if isinstance(e[1], MovesDrive)]
        dead = late[0][1].longest(tuple(late[0][2])) if late else 0.0
        middle = bool(late) and late[0][1].needs_middles(late[0][2])
        own, block, lag = [-1, -1], [-1, -1], -1
        for _, module, theta in (*self.effects, *self._before):
            if module.SPEC.slot in _KINDS:
                self._add(module, theta, _KINDS[module.SPEC.slot])
        for k in (0, 1) if middle else (0,):
            own[k], block[k] = len(self._rows), self._place
            self._place += number + count
            self._add(self._module, np.array([self._nodes[n][0] for n in self._module.SPEC.names]), columns.BASE)
            for _, module, theta in self.effects:
                if module.SPEC.slot == "add" and not self._behind:
                    self._add(module, theta, columns.ADD + k)
        length, self._place = self._place, self._place + 1
        for _, module, theta in (*self._behind, *self.effects):
            if module.SPEC.slot == "add" and self._behind:
                self._add(module, theta, columns.TERM)
            elif module.SPEC.slot == "output":
                if isinstance(module, MovesDrive) and middle:
                    lag = len(self._rows)
                self._add(module, theta, columns.OUTPUT if isinstance(module, HasStep) else columns.SHAPING)
        moved = len(self._rows) if dead > 0.0 else -1
        if dead > 0.0:
            self._add_dead_time(dead)
        small = self._place
        for row, longest in self._rings:
            row |= {"ring": self._place, "places": math.ceil(longest / self._shortest) + SPARE}
            self._place += RESERVED + row["numbers"] + row["places"] * (row["late"] + 1)
        lagging = [r["channel"] for r in self._rows if r["kind"] == columns.INPUT and r["states"] > 0]
        ends = 2 * WIRED + 2 * count
        dependence = self._dependence
        low, high = (dependence.low, dependence.high) if dependence else (-np.inf, np.inf)
        places = ChainPlaces(
            number, current, count, low, high, (own[0], own[1]), (block[0], block[1]), small, self._place, held,
            held and current not in lagging, length, moved, lag, ends, ends + 4 * number, ends + 4 * number + 2,
        )  # fmt: skip
        rows = [tuple(row[name] for name in columns.ELEMENT.names or ()) for row in self._rows]
        wires, params = np.array([*self._wires, 0], dtype=np.int64), np.array([*self._params, 0.0])
        made = DamperChain(np.array(rows, columns.ELEMENT), wires, params, laws, pieces, places, np.empty(0))
        return columns.in_memory(made, current)

    def _add(self, item: Any, theta: Array, kind: int) -> None:
        """Add an element."""
        curved = kind == columns.BASE and isinstance(item, HasCurve) and not self._moving & {*item.SHAPE}
        entry, place, first = entry_for(item, curved), self._place, len(self._params)
        replaced = self.channels.index(entry.inputs[-1]) if entry.inputs and entry.inputs[-1] else -1
        wires = [self.channels.index(n) if n else -1 for n in entry.inputs]
        own = {"address": entry.address, "kind": kind, "channel": replaced, "param": first, "last": place}
        own |= {"state": place + 1, "states": entry.state, "late": entry.late, "numbers": entry.own}
        if curved:
            self._params += numbers_of(curve_of(*item.loop(tuple(theta)))).tolist()
        elif kind != columns.BASE:
            self._params += [*theta, *theta]
        self._place += 1 + (0 if kind == columns.FACTORS else entry.state)
        longest = float(item.longest(tuple(theta))) if entry.late else 0.0
        if kind == columns.FACTORS:
            own["channel"] = len(self._wires) + len(wires)
        self._put(own, wires, longest if entry.late or entry.own else None)
        if kind == columns.FACTORS:
            roles = getattr(item, "ROLES", ())
            self._wires += [roles.index(p.role) if p.role in roles else -1 for p in self._module.SPEC.params]

    def _put(self, own: dict[str, int], wires: list[int], longest: float | None) -> None:
        """Add a row with its wires; with how far back in s it needs its past, None without one."""
        row = dict.fromkeys(columns.ELEMENT.names or (), 0) | own | {"wires": len(wires), "wire": len(self._wires)}
        self._wires += wires
        self._rows.append(row)
        if longest is not None:
            self._rings.append((row, longest))

    def _add_dead_time(self, dead: float) -> None:
        """Add the dead time, which keeps all channels: motions are smooth, levels may be switched, others stay."""
        own = {"kind": columns.DELAY, "state": self._place, "param": len(self._params), "late": len(self.channels)}
        self._params.append(dead)
        self._place += len(self.channels)
        wires = [-1 if n not in CHANNELS else 0 if n in LEVEL_CHANNELS else 1 for n in self.channels]
        self._put(own, wires, dead + 3.0 * self._shortest)

    def _laws(self) -> tuple[Any, Any]:
        """Return the laws of current of the base's parameters, and their pieces."""
        spec, dependence = self._module.SPEC, self._dependence
        orders = dict(dependence.orders) if dependence else {}
        distinct = list(dict.fromkeys(o for o in orders.values() if o))
        laws = []
        for p in spec.params:
            order = orders.get(p.name, 0)
            log = bool(order) and logarithmic(spec, p, order)
            held = bool(order) and not log and p.low > 0.0 and p.name not in spec.linear
            form = columns.LOG_LAW if log else columns.BOUNDED_LAW if held else columns.PLAIN_LAW
            nodes = self._nodes[p.name]
            laws.append((distinct.index(order) if order else -1, form, len(self._params), p.low, p.high))
            self._params += (np.log(nodes) if log else nodes).tolist()
        pieces = []
        for k, order in enumerate(distinct):
            assert dependence is not None
            ends = (dependence.low, dependence.high)
            for piece in dependence.pieces(order):
                nodes = coordinate(piece.nodes, ends, form_of(order))
                knee, padded = knee_of(form_of(order), ends), np.pad(nodes, (0, columns.LAW_NODES - len(nodes)))
                pieces.append((k, len(nodes), int(piece.columns[0]), piece.low, piece.high, knee, padded))
        return np.array(laws, columns.LAW), np.array(pieces, columns.LAW_PIECE)
