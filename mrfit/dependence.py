"""Parameters that depend on coil current: polynomials through their values at a few currents.

A parameter p of order m is given by its values p_0 … p_m at m + 1 currents I_0 … I_m spread over the tested range, and

    p(i) = Σ_k p_k·ℓ_k(i),   ℓ_k the Lagrange polynomials of the nodes,

on a logarithmic scale where the parameter has one and does not enter linearly, so that a sharpness or an exponent
stays positive. Forces and stiffnesses, which enter linearly, are polynomials of i as papers print them, and stay
linear. Values at nodes have the unit, the bounds and the start value of the parameter itself, which coefficients of
powers of i have not. Outside the tested range the current is held at its end: a polynomial says nothing there.
"""

from dataclasses import dataclass, replace

import numpy as np

from mrfit.errors import ConfigError, DataError
from mrfit.specs import Array, Derived, ModelSpec, Param

HIGHEST = 4
# Parameters that do not depend on the coil's field unless the user says so
FIXED_ROLES = ("offset", "shape")


@dataclass(frozen=True, slots=True)
class CurrentDependence:
    """Which parameters depend on current, and over which range of it.

    Attributes
    ----------
    orders
        (parameter name, order) pairs; parameters not named are constant.
    low, high
        Tested range of current in A.

    Raises
    ------
    DataError
        If a parameter is to vary over a range without extent.
    """

    orders: tuple[tuple[str, int], ...]
    low: float
    high: float

    def __post_init__(self) -> None:
        if self.varies and not self.low < self.high:
            raise DataError(
                f"a dependence on current needs tests at two currents or more, these are all at {self.low:.4g} A: "
                "add tests at other currents, or leave --current-order out"
            )

    @property
    def varies(self) -> bool:
        """Whether any parameter depends on current."""
        return any(order for _, order in self.orders)

    def nodes(self, order: int) -> Array:
        """Return the currents (order + 1,) in A at which a parameter of this order is given."""
        return np.linspace(self.low, self.high, order + 1)

    def basis(self, order: int, current: Array) -> Array:
        """Return the Lagrange polynomials at currents (N,) in A, shape (order + 1, N)."""
        nodes = self.nodes(order)
        held = np.clip(current, self.low, self.high)
        rows = np.ones((order + 1, len(current)))
        for k in range(order + 1):
            for j in range(order + 1):
                if j != k:
                    rows[k] *= (held - nodes[j]) / (nodes[k] - nodes[j])
        return rows


def orders_of(spec: ModelSpec, text: str) -> tuple[tuple[str, int], ...]:
    """Return the (parameter, order) pairs of a written current dependence: ``2``, or ``fy=2,c=1``.

    A single number goes to every parameter but offsets and shapes.

    Raises
    ------
    ConfigError
        If an order is not 0 to 4 or a name is not a parameter.
    """
    if "=" not in text:
        order = _order(text)
        return tuple((p.name, order) for p in spec.params if p.role not in FIXED_ROLES and order)
    named = {name.strip(): order for name, _, order in (item.partition("=") for item in text.split(","))}
    for name in named:
        if name not in spec.names:
            raise ConfigError(
                f"--current-order: '{spec.name}' has no parameter '{name}'; it has {', '.join(spec.names)}"
            )
    return tuple((n, _order(v)) for n, v in named.items() if _order(v))


def _order(text: str) -> int:
    if text.strip() not in tuple(str(k) for k in range(HIGHEST + 1)):
        raise ConfigError(f"--current-order takes 0 to {HIGHEST}, or NAME=ORDER pairs, not '{text}'")
    return int(text)


def expanded(spec: ModelSpec, dependence: CurrentDependence) -> ModelSpec:
    """Return the SPEC of a model with its parameters given at nodes of current."""
    orders = dict(dependence.orders)
    params: list[Param] = []
    for p in spec.params:
        order = orders.get(p.name, 0)
        nodes = list(dependence.nodes(order)) if order else []
        params += [replace(p, name=f"{p.name}@{i:.4g}A", text=f"{p.text} at {i:.4g} A") for i in nodes] or [p]
    linear = [q.name for q in params if q.name.partition("@")[0] in spec.linear]
    coefficients = [
        _coefficient(spec, p, power)
        for p in spec.params
        for power in range(orders.get(p.name, 0) + 1)
        if orders.get(p.name, 0)
    ]
    return replace(
        spec,
        inputs=(*spec.inputs, *(() if "current" in spec.inputs else ("current",))),
        params=tuple(params),
        linear=tuple(linear),
        derived=tuple(coefficients),
    )


def _logarithmic(spec: ModelSpec, param: Param) -> bool:
    return param.scale == "log" and param.name not in spec.linear


def _coefficient(spec: ModelSpec, param: Param, power: int) -> Derived:
    name, unit = (f"ln({param.name})", "1") if _logarithmic(spec, param) else (param.name, param.unit)
    return Derived(
        f"{param.name}.i{power}", f"{unit}/A^{power}" if power else unit, f"coefficient of i^{power} of {name}"
    )


def at_current(spec: ModelSpec, dependence: CurrentDependence, theta: Array, current: Array) -> Array:
    """Return the base model's parameters at a current, shape (P, K, N), or (P, K) where nothing varies.

    Parameters
    ----------
    spec
        The base model's SPEC, K parameters.
    dependence
        Orders and range.
    theta
        Parameters at the nodes, shape (P, K'), or (P, K', N) where an effect makes them vary.
    current
        Current in A, shape (N,).
    """
    constant = theta.ndim == 2 and bool(np.all(current == current[0]))
    values = current[:1] if constant else current
    nodal = theta if theta.ndim == 3 else theta[:, :, None]
    orders = dict(dependence.orders)
    result = np.empty((len(theta), len(spec.params), len(values)))
    column = 0
    for k, p in enumerate(spec.params):
        order = orders.get(p.name, 0)
        nodes = nodal[:, column : column + order + 1]
        column += order + 1
        if not order:
            result[:, k] = nodes[:, 0]
        elif _logarithmic(spec, p):
            result[:, k] = np.exp(np.sum(np.log(nodes) * dependence.basis(order, values), axis=1))
        else:
            result[:, k] = np.sum(nodes * dependence.basis(order, values), axis=1)
    return result[:, :, 0].copy() if constant else result


def through(spec: ModelSpec, dependence: CurrentDependence, currents: Array, theta: Array) -> Array:
    """Return the parameters at the nodes (K',) whose polynomials come nearest to values found current by current.

    Parameters
    ----------
    spec
        The base model's SPEC, K parameters.
    dependence
        Orders and range.
    currents
        Currents in A, shape (L,).
    theta
        The base model's parameters at each of them, shape (L, K); a constant parameter takes their median.
    """
    orders = dict(dependence.orders)
    nodes: list[Array] = []
    for k, p in enumerate(spec.params):
        order = orders.get(p.name, 0)
        if not order:
            nodes.append(np.median(theta[:, k : k + 1], axis=0))
            continue
        values = np.log(theta[:, k]) if _logarithmic(spec, p) else theta[:, k]
        found = np.linalg.lstsq(dependence.basis(order, currents).T, values, rcond=None)[0]
        nodes.append(np.clip(np.exp(found) if _logarithmic(spec, p) else found, p.low, p.high))
    return np.concatenate(nodes)


def coefficients(spec: ModelSpec, dependence: CurrentDependence, theta: Array) -> Array:
    """Return the coefficients of powers of current, as papers print them, shape (P, D) for ``expanded``'s derived."""
    orders = dict(dependence.orders)
    columns: list[Array] = []
    column = 0
    for p in spec.params:
        order = orders.get(p.name, 0)
        if order:
            nodes = theta[:, column : column + order + 1]
            nodes = np.log(nodes) if _logarithmic(spec, p) else nodes
            powers = np.linalg.inv(np.vander(dependence.nodes(order), increasing=True))
            columns += list((nodes @ powers.T).T)
        column += order + 1
    return np.stack(columns, axis=1)
