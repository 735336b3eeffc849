"""Feed-forward neural network: velocity and current, now and 4 ms ago, through two hidden layers of three.

    h1 = tanh(W1*u + b1),  h2 = tanh(W2*h1 + b2),  F = w3*h2 + b3,    u = (v, i, v 4 ms ago, i 4 ms ago)

v velocity (m/s), i current (A), F force (N). 31 parameters: W1_jk (weight of input k in unit j; s/m or 1/A), b1_j,
W2_jk, b2_j (1), w3_j and b3 (N). Values 4 ms ago are linear between samples, and the first sample's value before it.
The start values are fixed numbers spread over -1 ... 1, since equal units would stay equal for ever.

Source: Savaia et al., section 4. The activation is not printed; the hyperbolic tangent is MATLAB's default.
"""

import math
from dataclasses import replace

import numpy as np

from mrfit.core.specs import Array, Ends, Index, ModelSpec, Param, ReducedModel, State, Steps, Values
from mrfit.kernels.elements import response_of
from mrfit.kernels.lti import delayed
from mrfit.kernels.network import network
from mrfit.kernels.past import late
from mrfit.kernels.theta import by_blocks, plain

LAG, LATE = 4e-3, 2
_UNITS = 3
# Share of the bounds of weights and biases within which to search first
_SEARCHED = 0.12
_INPUTS = (("v", "s/m", 10.0), ("i", "1/A", 1.0), ("v_ago", "s/m", 10.0), ("i_ago", "1/A", 1.0))


def _spread(k: int) -> float:
    """Return the k-th of a sequence of fixed numbers spread evenly over -1 ... 1 (multiples of the golden ratio)."""
    return 2.0 * ((k + 1) * 0.6180339887498949 % 1.0) - 1.0


def _params() -> tuple[Param, ...]:
    rows = [
        *((f"W1_{j}_{name}", unit, 20.0 * size, size) for j in range(1, 4) for name, unit, size in _INPUTS),
        *((f"b1_{j}", "1", 20.0, 0.5) for j in range(1, 4)),
        *((f"W2_{j}_{k}", "1", 20.0, 1.0) for j in range(1, 4) for k in range(1, 4)),
        *((f"b2_{j}", "1", 20.0, 0.5) for j in range(1, 4)),
        *((f"w3_{j}", "N", 1e5, 500.0) for j in range(1, 4)),
        ("b3", "N", 1e5, 0.0),
    ]
    return tuple(
        Param(
            name,
            unit,
            -bound,
            bound,
            _spread(k) * size,
            text="bias" if name[0] == "b" else "weight",
            symbol=_symbol(name),
        )
        for k, (name, unit, bound, size) in enumerate(rows)
    )


def _symbol(name: str) -> str:
    """Return a weight's symbol: its layer above, what it leads to and from below."""
    layer, *ends = name.replace("_ago", "'").split("_")
    return f"{layer[0]}^{{({layer[1]})}}" + (f"_{{{','.join(ends)}}}" if ends else "")


SPEC = ModelSpec(
    name="neural-network",
    title="Feed-forward neural network, two hidden layers of three",
    equation="F = w3*tanh(W2*tanh(W1*u + b1) + b2) + b3;  u = (v, i, v 4 ms ago, i 4 ms ago)",
    reference="Savaia et al. section 4",
    inputs=("velocity", "current"),
    output="force",
    params=_params(),
    linear=("w3_1", "w3_2", "w3_3", "b3"),
)


def longest(theta: Values) -> float:
    """Return the greatest age in s of velocity and current that a step reads."""
    return LAG


def rest(now: Values, theta: Values) -> State:
    """Return velocity and current."""
    return now[0], now[1]


def step(state: State, before: Values, now: Values, theta: Ends, dt: float, past: Array) -> tuple[float, State]:
    """Return the force in N at the end of a step, and velocity and current there."""
    weights = theta[1]
    v, i = now
    v_ago, i_ago = late(past, 0, LAG, dt, v), late(past, 1, LAG, dt, i)
    h = np.zeros(3)
    for k in range(3):
        inner = weights[4 * k] * v + weights[4 * k + 1] * i + weights[4 * k + 2] * v_ago + weights[4 * k + 3] * i_ago
        h[k] = math.tanh(inner + weights[12 + k])
    force = weights[30]
    for j in range(3):
        first = 15 + 3 * j
        total = weights[first] * h[0] + weights[first + 1] * h[1] + weights[first + 2] * h[2] + weights[24 + j]
        force += weights[27 + j] * math.tanh(total)
    return force, (v, i)


_stepped = response_of(SPEC, rest, step, LATE)


def response(drive: Array, theta: Array, dt: Steps) -> Array:
    """Return the force in N, shape (P, N), of velocity (m/s) and current (A), shape (2, N), sampled every dt s."""
    if isinstance(dt, np.ndarray) or theta.ndim == 3:
        return _stepped(drive, theta, dt)
    ago = [delayed(plain(row), np.array([LAG / dt])) for row in drive]
    inputs = np.vstack([drive, *ago])
    return by_blocks(lambda block: _layers(inputs, block), drive.shape[1], theta)


def _layers(inputs: Array, theta: Array) -> Array:
    """Return the output layer (P, N) of inputs (4, N)."""
    count = len(theta)
    h1 = np.matmul(theta[:, :12].reshape(count, _UNITS, 4), inputs) + theta[:, 12:15, None]
    np.tanh(h1, out=h1)
    h2 = np.matmul(theta[:, 15:24].reshape(count, _UNITS, _UNITS), h1) + theta[:, 24:27, None]
    np.tanh(h2, out=h2)
    out: Array = np.matmul(theta[:, None, 27:30], h2)[:, 0] + theta[:, 30:]
    return out


def sensitivities(drive: Array, theta: Array, dt: float, columns: Index) -> Array:
    """Return the force in N of velocity (m/s) and current (A), and its derivatives, as ``specs.Sensitivities`` says.

    A vector with NaN gives NaN.
    """
    lag = np.array([LAG / dt])
    return network(plain(drive), lag, plain(theta), np.array(columns, dtype=np.int64))


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return first weights scaled to the inputs' range, last weights to the output's, and its mean as b3."""
    found = {}
    for p in SPEC.params:
        if p.name.startswith("W1"):
            channel = drive[0] if "_v" in p.name else drive[1]
            size = 10.0 if "_v" in p.name else 1.0
            found[p.name] = p.start / size * min(2.0 / max(float(np.max(np.abs(channel))), 1e-6), 10.0 * size)
        elif p.name.startswith("w3"):
            found[p.name] = p.start / 500.0 * float(np.ptp(output))
    found["b3"] = float(np.mean(output))
    return {p.name: float(np.clip(found[p.name], p.low, p.high)) for p in SPEC.params if p.name in found}


def _same(theta: Array) -> Array:
    return theta


# Units whose weights are great are saturated and have no slope to follow: the search begins among the smaller ones
REDUCED = ReducedModel(
    spec=replace(
        SPEC,
        params=tuple(
            p if p.name in SPEC.linear else replace(p, low=_SEARCHED * p.low, high=_SEARCHED * p.high)
            for p in SPEC.params
        ),
    ),
    response=response,
    reduce=_same,
    restore=_same,
    sensitivities=sensitivities,
)
