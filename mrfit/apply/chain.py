"""A damper as compiled loops see it: its elements in the order in which they act, and one step of the whole.

A damper's state is a flat array: channels as given, what elements remember, channels and parameters as the base saw
them, then the rings of what is read late. ``step`` writes the state behind a step, without rings, to another array and
leaves its own as it is, so that a step can be tried; ``commit`` takes it over. A step of a negative length asks for the
state of a damper that has stood still.
"""

import math
from typing import NamedTuple

import numpy as np

from mrfit.core.specs import Array, Index
from mrfit.kernels.jit import call, kernel
from mrfit.kernels.past import begun, late, pushed, smooth_late

# What an element is: one with MIDDLE runs between steps too, for an effect behind it; a TERM is added behind H(s)
INPUT, BASE, ADD, ADD_MIDDLE, TERM, SHAPE, OUTPUT, DELAY, FACTORS = range(9)
# Columns of ``Chain.elements``: address, kind, number and first of its wires, number and first of its states, first of
# its parameters, late signals, numbers of its own in its past, that past and its places, channel that it replaces,
# where its last input or output is kept
ADDRESS, KIND, WIRES, WIRE, STATES, STATE, PARAM, LATE, NUMBERS, RING, PLACES, CHANNEL, LAST, COLUMNS = range(14)
# Columns of ``Chain.laws``, a row for each parameter of the base: basis or -1, form, first of its nodes; then, for each
# effect that scales parameters, which of its factors, or -1
BASIS, FORM, FIRST, FACTOR = range(4)
PLAIN, LOG, BOUNDED = range(3)
# Entries of ``Chain.sizes``: channels, the current's place, parameters of the base, rows of base and middle base, where
# their channels and parameters are kept, end of the state without rings and with them, whether commands are held, and
# reach the base so, where the last step's length is kept, row of a delay's dead time and of its lag, -1 of none; where
# buffers begin, and their size
CHANNELS, CURRENT, COUNT, OWN, OWN_MIDDLE, BLOCK, BLOCK_MIDDLE, SMALL = range(8)
WHOLE, HELD, DIRECT, LENGTH, DEAD, LAG, ENDS, WORK = range(8, 16)
WIRED = 16


class Chain(NamedTuple):
    """A damper in arrays, whose columns are named above; ``edges`` are low, high and knee of pieces of laws."""

    elements: Index
    wires: Index
    params: Array
    laws: Index
    bounds: Array
    pieces: Index
    edges: Array
    nodes: Array
    sizes: Index
    extent: Array


@kernel
def _gather(chain: Chain, e: int, seen: Array, at: int, signal: float, work: Array, to: int) -> None:
    """Write an element's inputs: channels, and the signal it acts on for a wire below 0."""
    first = chain.elements[e, WIRE]
    for k in range(chain.elements[e, WIRES]):
        place = chain.wires[first + k]
        work[to + k] = signal if place < 0 else seen[at + place]


@kernel
def _polynomial(chain: Chain, piece: int, first: int, current: float) -> float:
    """Return the polynomial of a piece through a parameter's nodes."""
    total = 0.0
    for k in range(chain.pieces[piece, 1]):
        share, own = 1.0, chain.nodes[piece, k]
        for j in range(chain.pieces[piece, 1]):
            if j != k:
                share *= (current - chain.nodes[piece, j]) / (own - chain.nodes[piece, j])
        total += float(chain.params[first + chain.pieces[piece, 2] + k]) * share
    return total


@kernel
def parameters(chain: Chain, seen: Array, at: int, found: Array, to: int, work: Array) -> None:
    """Write the base's parameters where it sees the channels from ``at`` on."""
    sizes = chain.sizes
    current = min(max(seen[at + sizes[CURRENT]], chain.extent[0]), chain.extent[1])
    for k in range(sizes[COUNT]):
        basis, form, first = chain.laws[k, BASIS], chain.laws[k, FORM], chain.laws[k, FIRST]
        value = chain.params[first]
        for piece in range(len(chain.pieces) if basis >= 0 else 0):
            low, high, knee = chain.edges[piece]
            if chain.pieces[piece, 0] == basis and current <= high and (current > low or low == chain.extent[0]):
                value = _polynomial(chain, piece, first, knee * math.tanh(current / knee) if knee > 0.0 else current)
        if form == LOG:
            value = math.exp(value)
        elif form == BOUNDED:
            value = min(max(value, chain.bounds[k, 0]), chain.bounds[k, 1])
        found[to + k] = value
    column = FACTOR
    for e in range(len(chain.elements)):
        if chain.elements[e, KIND] == FACTORS:
            _gather(chain, e, seen, at, 0.0, work, 0)
            theta = chain.elements[e, PARAM]
            call(chain.elements[e, ADDRESS], work, 0, work, WIRED, work, 0, work, 0, chain.params, theta, 0.0, work, 0)
            for k in range(sizes[COUNT]):
                if chain.laws[k, column] >= 0:
                    found[to + k] *= work[WIRED + chain.laws[k, column]]
            column += 1


@kernel
def _run(  # noqa: PLR0913
    chain: Chain, e: int, state: Array, following: Array, ends: Array, one: float, other: float, dt: float, work: Array
) -> float:
    """Let an element but the base take a step between both rows of ``ends``, and from one signal to another."""
    element = chain.elements[e]
    _gather(chain, e, ends, 0, one, work, 0)
    _gather(chain, e, ends, chain.sizes[CHANNELS], other, work, WIRED)
    place, theta = element[STATE], element[PARAM]
    found: float = call(
        element[ADDRESS], state, place, following, place, work, 0, work, WIRED, chain.params, theta, dt, state,
        element[RING],
    )  # fmt: skip
    return found


@kernel
def _begin(chain: Chain, e: int, state: Array) -> None:
    """Begin what an element reads late with what it remembers at rest."""
    element = chain.elements[e]
    past = state[element[RING] :]
    if element[LATE] > 0 or element[NUMBERS] > 0:
        begun(past, element[PLACES], element[LATE], element[NUMBERS])
    if element[LATE] > 0:
        pushed(past, state[element[STATE] :], 0.0)


@kernel
def _settled(  # noqa: PLR0913
    chain: Chain, e: int, following: Array, ends: Array, signal: float, work: Array
) -> float:
    """Put an element to rest, and return its output there."""
    if chain.elements[e, STATES] > 0:
        _run(chain, e, following, following, ends, signal, signal, -1.0, work)
        _begin(chain, e, following)
    return _run(chain, e, following, following, ends, signal, signal, 0.0, work)


@kernel
def _at_start(chain: Chain, block: int, state: Array, ends: Array, theta: int, work: Array) -> None:
    """Write the base's parameters at a step's beginning: those of the last step's end unless a command is held."""
    count, same = chain.sizes[CHANNELS], True
    for c in range(count):
        same = same and ends[c] == state[block + c]
    if same:
        for k in range(chain.sizes[COUNT]):
            work[theta + k] = state[block + count + k]
    else:
        parameters(chain, ends, 0, work, theta, work)


@kernel
def _core(  # noqa: PLR0913
    chain: Chain, middle: int, state: Array, following: Array, ends: Array, dt: float, work: Array
) -> float:
    """Return what base and added terms make at the end of a step, or in the middle between steps."""
    sizes, count, number = chain.sizes, chain.sizes[CHANNELS], chain.sizes[COUNT]
    row, block, theta = sizes[OWN + middle], sizes[BLOCK + middle], 2 * WIRED
    base = chain.elements[row]
    parameters(chain, ends, count, following, block + count, work)
    if base[STATES] > 0 and dt >= 0.0:
        _at_start(chain, block, state, ends, theta, work)
    for k in range(number):
        work[theta + number + k] = following[block + count + k]
    _gather(chain, row, ends, 0, 0.0, work, 0)
    _gather(chain, row, ends, count, 0.0, work, WIRED)
    for c in range(count):
        following[block + c] = ends[count + c]
    address, place, ring = base[ADDRESS], base[STATE], base[RING]
    source, length = state, dt
    if dt < 0.0:
        for k in range(number):
            work[theta + k] = work[theta + number + k]
        if base[STATES] > 0:
            call(address, following, place, following, place, work, 0, work, WIRED, work, theta, dt, following, ring)
            _begin(chain, row, following)
        source, length = following, 0.0
    made = call(address, source, place, following, place, work, 0, work, WIRED, work, theta, length, source, ring)
    value = float(made)
    for e in range(len(chain.elements)):
        if chain.elements[e, KIND] == ADD + middle:
            if dt < 0.0:
                value += _settled(chain, e, following, ends, 0.0, work)
            else:
                value += _run(chain, e, state, following, ends, 0.0, 0.0, dt, work)
    return value


@kernel
def inputs(chain: Chain, state: Array, given: Array, dt: float, following: Array, work: Array) -> float:
    """Write what effects of the slot ``input`` make of channels at both ends of a step; return the current at its end.

    A command that is held has its new value from the step's beginning on.
    """
    sizes, count = chain.sizes, chain.sizes[CHANNELS]
    ends = work[sizes[ENDS] :]
    for c in range(count):
        ends[c], ends[count + c], following[c] = state[c] if dt >= 0.0 else given[c], given[c], given[c]
    if sizes[HELD] > 0:
        ends[sizes[CURRENT]] = given[sizes[CURRENT]]
    for e in range(len(chain.elements)):
        if chain.elements[e, KIND] == INPUT:
            channel, last = chain.elements[e, CHANNEL], chain.elements[e, LAST]
            if dt < 0.0:
                value = start = _settled(chain, e, following, ends, 0.0, work)
            elif chain.elements[e, STATES] == 0:
                value = _run(chain, e, state, following, ends, 0.0, 0.0, dt, work)
                _gather(chain, e, ends, 0, 0.0, work, WIRED)
                start = call(
                    chain.elements[e, ADDRESS], work, 0, work, 0, work, 0, work, WIRED, chain.params,
                    chain.elements[e, PARAM], dt, work, 0,
                )  # fmt: skip
            else:
                value, start = _run(chain, e, state, following, ends, 0.0, 0.0, dt, work), state[last]
            ends[channel], ends[count + channel], following[last] = start, value, value
    return float(ends[count + sizes[CURRENT]])


@kernel
def _moved(chain: Chain, state: Array, following: Array, ends: Array, dt: float) -> None:
    """Put what the channels were a dead time ago in their place; those that may be switched along lines."""
    delay, count = chain.elements[chain.sizes[DEAD]], chain.sizes[CHANNELS]
    age, block = chain.params[delay[PARAM]], chain.sizes[BLOCK]
    for c in range(count):
        now = ends[count + c]
        following[delay[STATE] + c] = now
        if dt >= 0.0:
            past, kind = state[delay[RING] :], chain.wires[delay[WIRE] + c]
            if kind == 1:
                ends[count + c] = smooth_late(past, c, age, dt, now)
            elif kind == 0:
                ends[count + c] = late(past, c, age, dt, now)
            ends[c] = state[block + c]


@kernel
def step(  # noqa: PLR0913
    chain: Chain, state: Array, given: Array, dt: float, field: float, following: Array, work: Array
) -> tuple[float, float, float]:
    """Take a step of dt s to channels; ``field`` is the current in A that the base is to see, or nan.

    Returns
    -------
    tuple
        The output, what it is before effects of the slot ``output`` that remember, and the current that the base sees.
    """
    sizes, count = chain.sizes, chain.sizes[CHANNELS]
    seen = inputs(chain, state, given, dt, following, work)
    ends = work[sizes[ENDS] :]
    if field == field:
        seen = ends[count + sizes[CURRENT]] = field
        if sizes[DIRECT] > 0:
            ends[sizes[CURRENT]] = field
    if sizes[DEAD] >= 0:
        _moved(chain, state, following, ends, dt)
    between = 0.0
    if sizes[OWN_MIDDLE] >= 0:
        middle, block = ends[2 * count :], sizes[BLOCK]
        length = state[sizes[LENGTH]]
        for c in range(count):
            middle[c] = state[sizes[BLOCK_MIDDLE] + c] if dt >= 0.0 else ends[c]
            middle[count + c] = 0.5 * (state[block + c] + ends[count + c]) if dt > 0.0 else ends[count + c]
        apart = 0.5 * (length + dt) if length > 0.0 and dt > 0.0 else dt
        between = _core(chain, 1, state, following, middle, apart, work)
    following[sizes[LENGTH]] = dt if dt > 0.0 else (state[sizes[LENGTH]] if dt == 0.0 else 0.0)
    force = _core(chain, 0, state, following, ends, dt, work)
    inner = force
    for e in range(len(chain.elements)):
        kind, last = chain.elements[e, KIND], chain.elements[e, LAST]
        if kind == TERM:
            term = (
                _settled(chain, e, following, ends, 0.0, work)
                if dt < 0.0
                else _run(chain, e, state, following, ends, 0.0, 0.0, dt, work)
            )
            force, inner = force + term, inner + term
        elif kind == SHAPE:
            inner = _run(chain, e, state, following, ends, 0.0, inner, dt, work)
            force = _run(chain, e, state, following, ends, 0.0, force, dt, work)
        elif kind == OUTPUT:
            before, signal = state[last], force
            following[last] = signal
            if dt < 0.0:
                force = _settled(chain, e, following, ends, signal, work)
            elif e == sizes[LAG] and dt > 0.0:
                _run(chain, e, state, following, ends, before, between, 0.5 * dt, work)
                force = _run(chain, e, following, following, ends, between, signal, 0.5 * dt, work)
            else:
                force = _run(chain, e, state, following, ends, before, signal, dt, work)
    return force, inner, seen


@kernel
def commit(chain: Chain, state: Array, following: Array, dt: float) -> None:
    """Go on from the end of a step, or begin at rest where dt is below 0."""
    for k in range(chain.sizes[SMALL]):
        state[k] = following[k]
    for e in range(len(chain.elements)):
        element = chain.elements[e]
        if dt < 0.0:
            _begin(chain, e, state)
        elif dt > 0.0 and element[LATE] > 0:
            pushed(state[element[RING] :], state[element[STATE] :], dt)


@kernel
def advanced(chain: Chain, states: Array, given: Array, dt: float, fields: Array) -> tuple[Array, Array]:
    """Take a step of dt s in many lanes, from states (B, S) to channels (B, C); return outputs (B, 3) and states."""
    following, found = states.copy(), np.empty((len(states), 3))
    after, work = np.empty(chain.sizes[WHOLE]), np.empty(chain.sizes[WORK])
    for b in range(len(states)):
        found[b, 0], found[b, 1], found[b, 2] = step(chain, states[b], given[b], dt, fields[b], after, work)
        commit(chain, following[b], after, dt)
    return found, following


@kernel
def followed(chain: Chain, state: Array, given: Array, steps: Array) -> Array:
    """Return the outputs (N, 3) of channels (N, C), steps (N,) in s between them; the state goes along."""
    found, after, work = np.empty((len(given), 3)), np.empty(chain.sizes[WHOLE]), np.empty(chain.sizes[WORK])
    for n in range(len(given)):
        found[n, 0], found[n, 1], found[n, 2] = step(chain, state, given[n], steps[n], np.nan, after, work)
        commit(chain, state, after, steps[n])
    return found
