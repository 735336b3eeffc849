"""A damper as compiled loops see it: its elements in the order in which they act, and one step of the whole.

A damper's state is a flat array: channels as given, what elements remember, channels and parameters as the base saw
them, then the rings of what is read late. ``step`` writes the state behind a step, without rings, to another array and
leaves its own as it is, so that a step can be tried; ``commit`` takes it over. A step of a negative length asks for the
state of a damper that has stood still.
"""

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from mrfit.core.specs import Array, Index
from mrfit.kernels.elements import WIRED
from mrfit.kernels.jit import address_of, array_at, borrowing, call, kernel, length_in_memory, part, tuple_in_memory
from mrfit.kernels.past import begun, late, pushed, smooth_late

# Kinds of elements: one with MIDDLE runs between steps too, for an effect behind it; a TERM is added behind H(s)
INPUT, BASE, ADD, ADD_MIDDLE, TERM, SHAPING, OUTPUT, DELAY, FACTORS = range(9)
# Row of ``Chain.elements``: number and first of its wires, number and first of its states, first of its parameters,
# late signals, numbers of its own in its past, that past and its places, channel that it replaces, where its last input
# or output is kept
_COLUMNS = "address kind wires wire states state param late numbers ring places channel last".split()
ELEMENT = np.dtype([(name, np.int64) for name in _COLUMNS])
# Row of ``Chain.laws``, for each parameter of the base: basis or -1, form, first of its nodes, bounds
LAW = np.dtype([(name, np.int64) for name in ("basis", "form", "first")] + [("low", float), ("high", float)])
# Row of ``Chain.pieces``: basis, number and first of its nodes, range of current, knee, the nodes
LAW_NODES = 5
LAW_PIECE = np.dtype(
    [(name, np.int64) for name in ("basis", "count", "first")]
    + [(name, float) for name in ("low", "high", "knee")]
    + [("nodes", float, (LAW_NODES,))]
)
PLAIN_LAW, LOG_LAW, BOUNDED_LAW = range(3)


class ChainPlaces(NamedTuple):
    """Places and sizes in the arrays of a chain.

    Attributes
    ----------
    channels, current, params
        Number of channels, the current's place among them, number of the base's parameters.
    low, high
        Range of the laws of current in A.
    own, block
        Of base and middle base: their row, and where their channels and parameters are kept.
    small, whole
        End of the state without rings and with them.
    held, direct
        Whether commands are held, and reach the base so.
    length
        Place of the last step's length.
    dead, lag
        Row of a delay's dead time and of its lag, -1 of none.
    ends, made, work
        Beginning of buffers, place of what a step makes besides its output, and their size.
    step, inputs
        Addresses of what ``step`` and ``inputs`` call.
    """

    channels: int
    current: int
    params: int
    low: float
    high: float
    own: tuple[int, int]
    block: tuple[int, int]
    small: int
    whole: int
    held: bool
    direct: bool
    length: int
    dead: int
    lag: int
    ends: int
    made: int
    work: int
    step: int = 0
    inputs: int = 0


class DamperChain(NamedTuple):
    """A damper in arrays, few of them: kernels count references to each array that they pass on.

    ``elements``, ``laws`` and ``pieces`` are rows as named above; ``params`` are the parameters of all elements.
    ``wires`` are the channels that each element takes; of one that scales parameters, also which factor acts on each
    parameter of the base, or -1. ``memory`` holds all of it, for what is called by its address.
    """

    elements: Any
    wires: Index
    params: Array
    laws: Any
    pieces: Any
    places: ChainPlaces
    memory: Array


class Trial(NamedTuple):
    """A step that is tried: from a state to channels, the state behind it, and room to work in."""

    state: Array
    given: Array
    after: Array
    work: Array


@kernel
def trial_of(chain: DamperChain, state: Array, given: Array) -> Trial:
    """Return a step to be tried."""
    return Trial(state, given, np.empty(chain.places.whole), np.empty(chain.places.work))


@borrowing
def _gather(chain: DamperChain, e: int, seen: Array, signal: float, work: Array, to: int) -> None:
    """Write an element's inputs: channels, and the signal it acts on for a wire below 0."""
    first = chain.elements[e].wire
    for k in range(chain.elements[e].wires):
        place = chain.wires[first + k]
        work[to + k] = signal if place < 0 else seen[place]


@part
def _polynomial(chain: DamperChain, piece: int, first: int, current: float) -> float:
    """Return the polynomial of a piece through a parameter's nodes."""
    own, total = chain.pieces[piece], 0.0
    for k in range(own.count):
        share = 1.0
        for j in range(own.count):
            if j != k:
                share *= (current - own.nodes[j]) / (own.nodes[k] - own.nodes[j])
        total += float(chain.params[first + own.first + k]) * share
    return total


@borrowing
def parameters(chain: DamperChain, seen: Array, found: Array, work: Array) -> None:
    """Write the base's parameters where it sees channels."""
    count = chain.places.params
    current = min(max(seen[chain.places.current], chain.places.low), chain.places.high)
    for k in range(count):
        law = chain.laws[k]
        value = chain.params[law.first]
        for piece in range(len(chain.pieces) if law.basis >= 0 else 0):
            own = chain.pieces[piece]
            inside = current <= own.high and (current > own.low or own.low == chain.places.low)
            if own.basis == law.basis and inside:
                at = own.knee * math.tanh(current / own.knee) if own.knee > 0.0 else current
                value = _polynomial(chain, piece, law.first, at)
        if law.form == LOG_LAW:
            value = math.exp(value)
        elif law.form == BOUNDED_LAW:
            value = min(max(value, law.low), law.high)
        found[k] = value
    for e in range(len(chain.elements)):
        element = chain.elements[e]
        if element.kind == FACTORS:
            _gather(chain, e, seen, 0.0, work, WIRED)
            call(element.address, work, 0, work, 0, work, 0, chain.params, element.param, 0.0, work, 0)
            for k in range(count):
                factor = chain.wires[element.channel + k]
                if factor >= 0:
                    found[k] *= work[factor]


@borrowing
def _run(chain: DamperChain, e: int, trial: Trial, ends: Array, signals: tuple[float, float], dt: float) -> float:
    """Let an element but the base take a step between both rows of ``ends``, and from one signal to another."""
    element, work = chain.elements[e], trial.work
    _gather(chain, e, ends, signals[0], work, 0)
    _gather(chain, e, ends[chain.places.channels :], signals[1], work, WIRED)
    place = element.state
    found: float = call(
        element.address, trial.state, place, trial.after, place, work, 0, chain.params, element.param, dt, trial.state,
        element.ring,
    )  # fmt: skip
    return found


@borrowing
def _begin(chain: DamperChain, e: int, state: Array) -> None:
    """Begin what an element reads late with what it remembers at rest."""
    element = chain.elements[e]
    past = state[element.ring :]
    if element.late > 0 or element.numbers > 0:
        begun(past, element.places, element.late, element.numbers)
    if element.late > 0:
        pushed(past, state[element.state :], 0.0)


@borrowing
def _started(chain: DamperChain, e: int, trial: Trial, ends: Array, signal: float, dt: float) -> float:
    """Let an element take a step under one signal; put it to rest first where dt is below 0."""
    if dt >= 0.0:
        return _run(chain, e, trial, ends, (signal, signal), dt)
    still = Trial(trial.after, trial.given, trial.after, trial.work)
    if chain.elements[e].states > 0:
        _run(chain, e, still, ends, (signal, signal), -1.0)
        _begin(chain, e, trial.after)
    return _run(chain, e, still, ends, (signal, signal), 0.0)


@part
def _at_start(chain: DamperChain, block: int, trial: Trial, ends: Array, theta: int) -> None:
    """Write the base's parameters at a step's beginning: those of the last step's end unless a command is held."""
    count, same = chain.places.channels, True
    for c in range(count):
        same = same and ends[c] == trial.state[block + c]
    if same:
        for k in range(chain.places.params):
            trial.work[theta + k] = trial.state[block + count + k]
    else:
        parameters(chain, ends, trial.work[theta:], trial.work)


@borrowing
def _core(chain: DamperChain, middle: int, trial: Trial, ends: Array, dt: float) -> float:
    """Return the output of base and added terms at the end of a step, or in the middle between steps."""
    places, count, number = chain.places, chain.places.channels, chain.places.params
    row, block, theta = places.own[middle], places.block[middle], 2 * WIRED
    base, after, work = chain.elements[row], trial.after, trial.work
    parameters(chain, ends[count:], after[block + count :], work)
    if base.states > 0 and dt >= 0.0:
        _at_start(chain, block, trial, ends, theta)
    for k in range(number):
        work[theta + number + k] = after[block + count + k]
    _gather(chain, row, ends, 0.0, work, 0)
    _gather(chain, row, ends[count:], 0.0, work, WIRED)
    for c in range(count):
        after[block + c] = ends[count + c]
    address, place = base.address, base.state
    source, length = trial.state, dt
    if dt < 0.0:
        for k in range(number):
            work[theta + k] = work[theta + number + k]
        if base.states > 0:
            call(address, after, place, after, place, work, 0, work, theta, dt, after, base.ring)
            _begin(chain, row, after)
        source, length = after, 0.0
    # one without a past may have a curve
    past, ring = (source, base.ring) if base.places > 0 else (chain.params, base.param)
    made = call(address, source, place, after, place, work, 0, work, theta, length, past, ring)
    value = float(made)
    for e in range(len(chain.elements)):
        if chain.elements[e].kind == ADD + middle:
            value += _started(chain, e, trial, ends, 0.0, dt)
    return value


@borrowing
def _inputs(chain: DamperChain, trial: Trial, dt: float) -> float:
    """Take the part of ``inputs``."""
    places, count, work = chain.places, chain.places.channels, trial.work
    ends = work[places.ends :]
    for c in range(count):
        ends[count + c] = trial.after[c] = trial.given[c]
        ends[c] = trial.state[c] if dt >= 0.0 else trial.given[c]
    if places.held:
        ends[places.current] = trial.given[places.current]
    for e in range(len(chain.elements)):
        element = chain.elements[e]
        if element.kind == INPUT:
            value = start = _started(chain, e, trial, ends, 0.0, dt)
            if dt >= 0.0 and element.states == 0:
                _gather(chain, e, ends, 0.0, work, WIRED)
                start = call(element.address, work, 0, work, 0, work, 0, chain.params, element.param, dt, work, 0)
            elif dt >= 0.0:
                start = trial.state[element.last]
            ends[element.channel], ends[count + element.channel], trial.after[element.last] = start, value, value
    return float(ends[count + places.current])


@part
def _moved(chain: DamperChain, trial: Trial, ends: Array, dt: float) -> None:
    """Put the channels of a dead time ago in place of those now; those that may be switched along lines."""
    delay, count = chain.elements[chain.places.dead], chain.places.channels
    age, block = chain.params[delay.param], chain.places.block[0]
    for c in range(count):
        now = ends[count + c]
        trial.after[delay.state + c] = now
        if dt >= 0.0:
            past, kind = trial.state[delay.ring :], chain.wires[delay.wire + c]
            if kind == 1:
                ends[count + c] = smooth_late(past, c, age, dt, now)
            elif kind == 0:
                ends[count + c] = late(past, c, age, dt, now)
            ends[c] = trial.state[block + c]


@borrowing
def _step(chain: DamperChain, trial: Trial, dt: float, field: float) -> tuple[float, float, float]:
    """Take the step of ``step``."""
    places, count, state = chain.places, chain.places.channels, trial.state
    seen = _inputs(chain, trial, dt)
    ends = trial.work[places.ends :]
    if field == field:
        seen = ends[count + places.current] = field
        if places.direct:
            ends[places.current] = field
    if places.dead >= 0:
        _moved(chain, trial, ends, dt)
    between = 0.0
    if places.own[1] >= 0:
        middle, block = ends[2 * count :], places.block[0]
        length = state[places.length]
        for c in range(count):
            middle[c] = state[places.block[1] + c] if dt >= 0.0 else ends[c]
            middle[count + c] = 0.5 * (state[block + c] + ends[count + c]) if dt > 0.0 else ends[count + c]
        apart = 0.5 * (length + dt) if length > 0.0 and dt > 0.0 else dt
        between = _core(chain, 1, trial, middle, apart)
    trial.after[places.length] = dt if dt > 0.0 else (state[places.length] if dt == 0.0 else 0.0)
    force = _core(chain, 0, trial, ends, dt)
    inner = force
    for e in range(len(chain.elements)):
        kind, last = chain.elements[e].kind, chain.elements[e].last
        if kind == TERM:
            term = _started(chain, e, trial, ends, 0.0, dt)
            force, inner = force + term, inner + term
        elif kind == SHAPING:
            inner = _run(chain, e, trial, ends, (0.0, inner), dt)
            force = _run(chain, e, trial, ends, (0.0, force), dt)
        elif kind == OUTPUT:
            before, signal = state[last], force
            trial.after[last] = signal
            if dt < 0.0:
                force = _started(chain, e, trial, ends, signal, dt)
            elif e == places.lag and dt > 0.0:
                _run(chain, e, trial, ends, (before, between), 0.5 * dt)
                halfway = Trial(trial.after, trial.given, trial.after, trial.work)
                force = _run(chain, e, halfway, ends, (between, signal), 0.5 * dt)
            else:
                force = _run(chain, e, trial, ends, (before, signal), dt)
    return force, inner, seen


@borrowing
def inputs(chain: DamperChain, trial: Trial, dt: float) -> float:
    """Make channels at both ends of a step behind effects of the slot ``input``; return the current at its end.

    A command that is held has its new value from the step's beginning on.
    """
    found: float = call(
        chain.places.inputs, trial.state, 0, trial.after, 0, trial.given, 0, trial.work, 0, dt, chain.memory, 0
    )
    return found


@borrowing
def step(chain: DamperChain, trial: Trial, dt: float, field: float) -> tuple[float, float, float]:
    """Take a step of dt s to channels; ``field`` is the current in A that the base is to see, or nan.

    Returns
    -------
    tuple
        The output, what it is before effects of the slot ``output`` that remember, and the current that the base sees.
    """
    work, made = trial.work, chain.places.made
    work[made] = field
    force: float = call(chain.places.step, trial.state, 0, trial.after, 0, trial.given, 0, work, 0, dt, chain.memory, 0)
    return force, work[made], work[made + 1]


_NO_ROWS = DamperChain(
    np.empty(0, ELEMENT), np.empty(0, np.int64), np.empty(0), np.empty(0, LAW), np.empty(0, LAW_PIECE),
    ChainPlaces(0, 0, 0, 0.0, 0.0, (0, 0), (0, 0), 0, 0, False, False, 0, 0, 0, 0, 0, 0), np.empty(0),
)  # fmt: skip
_write_chain, _read_chain = tuple_in_memory(_NO_ROWS)


@borrowing
def _trial_at(chain: DamperChain, state: Any, after: Any, given: Any, work: Any) -> Trial:
    """Return the step that pointers tell."""
    places = chain.places
    return Trial(
        array_at(state, places.whole), array_at(given, places.channels), array_at(after, places.whole),
        array_at(work, places.work),
    )  # fmt: skip


def _inputs_of(state: Any, after: Any, given: Any, work: Any, dt: float, memory: Any) -> float:
    """Take the part of ``inputs`` at pointers."""
    chain = _read_chain(memory)
    return _inputs(chain, _trial_at(chain, state, after, given, work), dt)


def _step_of(state: Any, after: Any, given: Any, work: Any, dt: float, memory: Any) -> float:
    """Take the step of ``step`` at pointers."""
    chain = _read_chain(memory)
    trial, made = _trial_at(chain, state, after, given, work), chain.places.made
    force, trial.work[made], trial.work[made + 1] = _step(chain, trial, dt, trial.work[made])
    return force


@cache
def _addresses() -> tuple[int, int]:
    return address_of(_step_of, kept=True, counted=False), address_of(_inputs_of, kept=True, counted=False)


@kernel
def _keep(chain: DamperChain) -> None:
    _write_chain(chain.memory, chain)


def in_memory(chain: DamperChain, current: int) -> DamperChain:
    """Return a chain with the current at a place of its channels, whose steps are called by their address.

    They are so compiled once, not again in every loop. A chain changed otherwise would step as before.
    """
    step_at, inputs_at = _addresses()
    places = chain.places._replace(step=step_at, inputs=inputs_at, current=current)
    chain = chain._replace(places=places, memory=np.zeros(length_in_memory(_NO_ROWS)))
    _keep(chain)
    return chain


@borrowing
def commit(chain: DamperChain, trial: Trial, dt: float) -> None:
    """Go on from the end of a step, or begin at rest where dt is below 0."""
    state = trial.state
    for k in range(chain.places.small):
        state[k] = trial.after[k]
    for e in range(len(chain.elements)):
        element = chain.elements[e]
        if dt < 0.0:
            _begin(chain, e, state)
        elif dt > 0.0 and element.late > 0:
            pushed(state[element.ring :], state[element.state :], dt)


@kernel
def advanced(chain: DamperChain, states: Array, given: Array, dt: float, fields: Array) -> tuple[Array, Array]:
    """Take a step of dt s in many lanes, from states (B, S) to channels (B, C); return outputs (B, 3) and states."""
    following, found = states.copy(), np.empty((len(states), 3))
    for b in range(len(states)):
        trial = trial_of(chain, following[b], given[b])
        found[b] = step(chain, trial, dt, fields[b])
        commit(chain, trial, dt)
    return found, following


@kernel
def followed(chain: DamperChain, state: Array, given: Array, steps: Array) -> Array:
    """Return the outputs (N, 3) of channels (N, C), steps (N,) in s between them; the state goes along."""
    found, trial = np.empty((len(given), 3)), trial_of(chain, state, np.empty(given.shape[1]))
    for n in range(len(given)):
        trial.given[:] = given[n]
        found[n] = step(chain, trial, steps[n], np.nan)
        commit(chain, trial, steps[n])
    return found
