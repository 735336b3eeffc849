"""A damper stepped in time: one interface for every model and effect, many lanes side by side.

``rest`` gives the state of a damper that has stood still, ``step`` the force at the end of a step and the next state. A
state is never changed, so that a step can be tried with several currents or motions and thrown away. Motion is linear
over a step. The current is what a controller commands: it is held over a step at its value at the step's end; with
``held=False`` it is linear, as between the samples of a log.

Models and effects without memory are taken as they are: their samples are the lanes here. That a definition has no
memory is tested, by whether a permutation of its samples permutes its output. Those with memory have their steps in
``memory``.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from mrfit.apply import memory
from mrfit.apply.damper import Damper
from mrfit.core import registry
from mrfit.core.protocols import AddsTerm, ChangesInput, Effect, ScalesParameters, ShapesOutput
from mrfit.core.specs import Array
from mrfit.effects.temperature import REFERENCE
from mrfit.errors import DataError
from mrfit.models import hw_static
from mrfit.simulate.current_dependence import at_current

Channels = Mapping[str, Array]
# Of a channel that nobody gives: a fluid at the temperature to which parameters refer, a record's start
_DEFAULTS = {"temperature": REFERENCE, "time": 0.0}
# Samples and interval with which a definition is tested for memory
_PROBE, _PROBE_DT = 24, 1e-3
_HW = "hammerstein-wiener"


@dataclass(frozen=True)
class State:
    """What a damper remembers: channels at the last step, as given and as its base saw them, and its elements'."""

    given: dict[str, Array]
    seen: dict[str, Array]
    base: Any
    inputs: tuple[Any, ...]
    adds: tuple[Any, ...]
    outputs: tuple[Any, ...]
    inner: Array


@dataclass(frozen=True)
class Step:
    """The end of a step.

    Attributes
    ----------
    force
        Force or torque, shape (B,).
    inner
        The same before the effects behind the base that have memory (``force-filter``, ``delay``).
    field
        Current in A that the base sees.
    state
        To go on from.
    """

    force: Array
    inner: Array
    field: Array
    state: State


class Stepper:
    """Steps a damper; see the module."""

    def __init__(self, damper: Damper, held: bool = True) -> None:
        self.damper, self.low, self.high = damper, damper.low, damper.high
        base, *written = damper.model.split("+")
        self._module = registry.load("model", base)
        spec = self._module.SPEC
        self._dependence, self._theta = damper.dependence, damper.theta
        values = np.split(self._theta[0], [len(self._theta[0]) - _effects_size(written)])
        self._own = values[0][None]
        self._factors: tuple[_Link, ...] = ()
        self._last = np.empty(0), self._own
        own_inputs: tuple[Any, ...] = ()
        own_outputs: tuple[Any, ...] = ()
        self._spec, self._response = spec, self._module.response
        self._memory = memory.BASES.get(base)
        if base == _HW:
            own_inputs, own_outputs = self._links_of_hammerstein_wiener(held)
        elif self._memory is None:
            _check_memoryless(base, spec.inputs, lambda d: self._module.response(d, _start(spec), _PROBE_DT))
        if isinstance(self._memory, memory.Spencer):
            middle = np.array([0.5 * (damper.low + damper.high)])
            self._memory = self._memory.tuned(_columns(self._parameters({"current": middle}), 1)[:, 0])
        effects = _effects(written, values[1])
        self._inputs = (*own_inputs, *_links(effects, "input", held))
        self._adds = _links(effects, "add", held)
        outputs = (*own_outputs, *_links(effects, "output", held))
        # what has no memory scales the force; the rest, which a current of this moment hardly moves, comes last
        self._shapes = tuple(link for link in outputs if link.element is None)
        self._outputs = tuple(link for link in outputs if link.element is not None)
        self._factors = _links(effects, "theta", held)
        needed = (*spec.inputs, *(n for e, _ in effects for n in e.SPEC.inputs), "current")
        self.inputs = tuple(dict.fromkeys(needed))
        self.behind = tuple(dict.fromkeys(link.name for link in self._outputs))
        elements = (*self._inputs, *self._adds, *self._outputs)
        self.memoryless = self._memory is None and all(link.element is None for link in elements)
        # whether only the current's way to the base has a memory
        self.static_behind_field = self._memory is None and all(
            link.element is None or link.channel == "current" for link in elements
        )
        self.bends = bool(self._shapes)
        self.lagging = tuple(dict.fromkeys(link.name for link in self._inputs if link.channel == "current"))

    def complete(self, channels: Channels) -> dict[str, Array]:
        """Return the channels that the model needs, those that nobody gave at their usual value.

        Raises
        ------
        DataError
            If one is missing.
        """
        lanes = len(channels["current"])
        found = {n: np.full(lanes, _DEFAULTS[n]) for n in self.inputs if n in _DEFAULTS}
        found |= {n: channels[n] for n in self.inputs if n in channels}
        if missing := [n for n in self.inputs if n not in found]:
            raise DataError(f"'{self.damper.name}' needs {' and '.join(missing)}")
        return found

    def rest(self, channels: Channels) -> State:
        """Return the state of a damper that has stood still at these channels (B,)."""
        given = self.complete(channels)
        seen, inputs = dict(given), []
        for link in self._inputs:
            state = link.element.rest(seen, seen[link.channel]) if link.element else None
            inputs.append(state)
            seen |= link.started(seen, state)
        theta = self._parameters(seen)
        base = self._memory.rest(seen, _columns(theta, len(given["current"]))) if self._memory else None
        nothing = np.zeros(len(given["current"]))
        adds = tuple(link.element.rest(seen, nothing) if link.element else None for link in self._adds)
        inner = self._inner(State(seen, seen, base, (), adds, (), nothing), seen, 0.0)[0]
        outputs = tuple(link.element.rest(seen, inner) for link in self._outputs)
        return State(given, seen, base, tuple(inputs), adds, outputs, inner)

    def field(self, state: State, channels: Channels, dt: float) -> Array:
        """Return the current in A that the base would see at the end of a step."""
        return self._seen(state, self.complete(channels), dt)[0]["current"]

    def coil(self, state: State, channels: Channels, dt: float) -> State:
        """Take a step of what changes the channels on their way to the base, and of nothing behind."""
        given = self.complete(channels)
        seen, inputs = self._seen(state, given, dt)
        return replace(state, given=given, seen=seen, inputs=inputs)

    def inner(self, state: State, channels: Channels, dt: float, field: Array) -> Array:
        """Return the force at the end of a step, before what is ``behind`` it, where the base sees a current (B,)."""
        given = self.complete(channels)
        seen = {**self._seen(state, given, dt)[0], "current": field}
        return self._inner(state, seen, dt)[0]

    def step(self, state: State, channels: Channels, dt: float, field: Array | None = None) -> Step:
        """Take a step of dt s to channels (B,), or one in which the base sees a given current."""
        given = self.complete(channels)
        seen, inputs = self._seen(state, given, dt)
        if field is not None:
            seen["current"] = field
        inner, base, adds = self._inner(state, seen, dt)
        force, outputs = inner, []
        signals = state.inner, inner
        for link, own in zip(self._outputs, state.outputs, strict=True):
            force, following = link.element.step(own, state.seen, seen, signals, dt)
            outputs.append(following)
            signals = force, force
        following_state = State(given, seen, base, inputs, adds, tuple(outputs), inner)
        return Step(force, inner, seen["current"], following_state)

    @property
    def lasting(self) -> float:
        """Return for how many s the force is felt in what lies ``behind`` it."""
        return float(sum(link.element.lasting for link in self._outputs))

    def undone(self, desired: Array, dt: float) -> Array:
        """Return the forces (L, N) before what lies ``behind`` them of those desired, which are known ahead."""
        for link in reversed(self._outputs):
            desired = link.element.undone(desired, dt)
        return desired

    def _seen(self, state: State, given: dict[str, Array], dt: float) -> tuple[dict[str, Array], tuple[Any, ...]]:
        """Return the channels as the base sees them, and the states of what changes them."""
        seen, before, following = dict(given), dict(state.given), list[Any]()
        for link, own in zip(self._inputs, state.inputs, strict=True):
            if link.element is None:
                seen |= link.changed(seen)
                before |= link.changed(before)
                following.append(None)
                continue
            signals = before[link.channel], seen[link.channel]
            value, after = link.element.step(own, before, seen, signals, dt)
            before = {**before, link.channel: state.seen[link.channel]}
            seen = {**seen, link.channel: value}
            following.append(after)
        return seen, tuple(following)

    def _inner(self, state: State, seen: dict[str, Array], dt: float) -> tuple[Array, Any, tuple[Any, ...]]:
        lanes, theta = len(seen["current"]), self._parameters(seen)
        if self._memory:
            force, base = self._memory.step(state.base, state.seen, seen, _columns(theta, lanes), dt)
        else:
            drive = np.stack([seen[n] for n in self._spec.inputs])
            force, base = self._response(drive, theta, dt)[0], None
        adds = []
        for link, own in zip(self._adds, state.adds, strict=True):
            if link.element is None:
                term, following = cast(AddsTerm, link.module).term(seen, link.theta, dt)[0], None
            else:
                term, following = link.element.step(own, state.seen, seen, (force, force), dt)
            force = force + term
            adds.append(following)
        for link in self._shapes:
            force = cast(ShapesOutput, link.module).shape(force[None], seen, link.theta, dt)[0]
        return force, base, tuple(adds)

    def _parameters(self, seen: Channels) -> Array:
        """Return the base's parameters, (1, K) or (1, K, B)."""
        spec, theta = self._module.SPEC, self._own
        if self._dependence is not None:
            theta = self._at_current(seen["current"])
        for link in self._factors:
            scale = cast(ScalesParameters, link.module).factors(dict(seen), link.theta, 0.0)
            for role, factors in scale.items():
                columns = [k for k, p in enumerate(spec.params) if p.role == role]
                if columns:
                    theta = (
                        theta.copy() if theta.ndim == 3 else np.repeat(theta[:, :, None], len(seen["current"]), axis=2)
                    )
                for k in columns:
                    theta[:, k] = theta[:, k] * factors
        if self._spec is not spec:  # of Hammerstein-Wiener the static map alone
            theta = np.concatenate([theta[:, :4], theta[:, -1:]], axis=1)
        return theta

    def _at_current(self, current: Array) -> Array:
        """Return the base's parameters at a current; a command that is held asks for the same ones again."""
        known, theta = self._last
        if not np.array_equal(known, current):
            assert self._dependence is not None
            theta = at_current(self._module.SPEC, self._dependence, self._own, current)
            self._last = current.copy(), theta
        return theta

    def _links_of_hammerstein_wiener(self, held: bool) -> tuple[tuple["_Link", ...], tuple["_Link", ...]]:
        """Return M(s) and H(s); the base is the static map between them."""
        theta = self._own[0]
        names = list(self._module.SPEC.names)
        at = {n: float(theta[names.index(n)]) for n in names}
        poles = np.array([at[f"p{k}"] for k in range(1, 5)])
        filtering = memory.magnetisation(np.array([at["q1"], at["q2"]]), at["zero"], at["tau"], held)
        damping = memory.damping(poles, at["omega"], at["xi"])
        self._spec, self._response = hw_static.SPEC, hw_static.response
        return (_Link(_HW, None, self._own, filtering, "current"),), (_Link(_HW, None, self._own, damping, ""),)


@dataclass(frozen=True)
class _Link:
    """An effect: by its own function, or by an element with memory."""

    name: str
    module: Effect | None
    theta: Array
    element: Any
    channel: str

    def changed(self, channels: Channels) -> dict[str, Array]:
        """Return the channels that an effect without memory changes."""
        return cast(ChangesInput, self.module).transform(dict(channels), self.theta[0], _PROBE_DT)

    def started(self, channels: Channels, state: Any) -> dict[str, Array]:
        """Return them where everything has stood still."""
        if self.element is None:
            return self.changed(channels)
        signal = channels[self.channel]
        value, _ = self.element.step(state, channels, channels, (signal, signal), 0.0)
        return {self.channel: value}


def _effects_size(written: list[str]) -> int:
    return sum(len(registry.load("effect", e).SPEC.params) for e in written)


def _effects(written: list[str], values: Array) -> list[tuple[Effect, Array]]:
    """Return effects with their parameters (1, Q), in the order of their names, as an assembly has them."""
    from mrfit.simulate.assembly import SLOTS

    modules = sorted(
        (registry.load("effect", e) for e in written), key=lambda m: (SLOTS.index(m.SPEC.slot), m.SPEC.name)
    )
    ends = np.cumsum([0, *(len(m.SPEC.params) for m in modules)])
    return [(m, values[None, ends[k] : ends[k + 1]]) for k, m in enumerate(modules)]


def _links(effects: list[tuple[Effect, Array]], slot: str, held: bool) -> tuple[_Link, ...]:
    links = []
    for module, theta in effects:
        spec = module.SPEC
        if spec.slot != slot or np.all(theta[0] == np.array(spec.neutral)):
            continue
        made = memory.ELEMENTS.get(spec.name)
        if made is None:
            _check_memoryless(spec.name, spec.inputs, _probe(module, theta))
        channel = "current" if "current" in spec.inputs else "velocity" if slot == "input" else ""
        links.append(_Link(spec.name, module, theta, made(theta[0], held) if made else None, channel))
    return tuple(links)


def _probe(module: Effect, theta: Array) -> Callable[[Array], Array]:
    """Return an effect as a function of its channels (C, N), and of an output where it shapes one."""
    spec = module.SPEC

    def values(drive: Array) -> Array:
        channels = dict(zip(spec.inputs, drive, strict=False)) or {"": drive[0]}
        if isinstance(module, ChangesInput):
            return np.stack(list(module.transform(channels, theta[0], _PROBE_DT).values()))
        if isinstance(module, ScalesParameters):
            return np.stack(
                [np.broadcast_to(f[0], drive.shape[1:]) for f in module.factors(channels, theta, 0).values()]
            )
        if isinstance(module, AddsTerm):
            return module.term(channels, theta, _PROBE_DT)
        return cast(ShapesOutput, module).shape(np.cos(7.0 * drive[:1]), channels, theta, _PROBE_DT)

    return values


def _check_memoryless(name: str, inputs: tuple[str, ...], values: Callable[[Array], Array]) -> None:
    """Refuse a definition with memory of which no step is known.

    Raises
    ------
    DataError
        If a permutation of samples does not permute its output.
    """
    rng = np.random.default_rng(0)
    drive = 0.05 * rng.standard_normal((max(len(inputs), 1), _PROBE))
    order = rng.permutation(_PROBE)
    with np.errstate(all="ignore"):
        straight, mixed = values(drive), values(np.ascontiguousarray(drive[:, order]))
    if not np.allclose(straight[..., order], mixed, rtol=1e-12, atol=0.0, equal_nan=True):
        raise DataError(f"'{name}' has a memory, and apply knows no steps of it: take a model or effect of mrfit's own")


def _start(spec: Any) -> Array:
    return np.array([[p.start for p in spec.params]])


def _columns(theta: Array, lanes: int) -> Array:
    """Return parameters (K, B)."""
    return theta[0] if theta.ndim == 3 else np.repeat(theta[0][:, None], lanes, axis=1)


def simulate(stepper: Stepper, channels: Channels, dt: float) -> Array:
    """Return the force (N,) of a log's channels (N,), step by step; what ``Assembly.simulate`` gives at once."""
    given = stepper.complete(channels)
    state = stepper.rest({n: c[:1] for n, c in given.items()})
    force = np.empty(len(given["current"]))
    force[0] = stepper.step(state, {n: c[:1] for n, c in given.items()}, 0.0).force[0]
    for k in range(1, len(force)):
        done = stepper.step(state, {n: c[k : k + 1] for n, c in given.items()}, dt)
        force[k], state = done.force[0], done.state
    return force


def take(state: State, lanes: NDArray[np.int64]) -> State:
    """Return the state of some lanes of a state, in their order; a lane may be taken several times."""

    def taken(value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return value[..., lanes]
        if isinstance(value, memory.Past):
            return replace(value, values=value.values[:, lanes])
        if isinstance(value, dict):
            return {k: taken(v) for k, v in value.items()}
        return tuple(taken(v) for v in value) if isinstance(value, tuple) else value

    return State(**{name: taken(getattr(state, name)) for name in State.__dataclass_fields__})
