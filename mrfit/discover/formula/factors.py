"""Factors that a formula is made of: functions of one variable, in numpy's functions, from which all else follows.

A factor is evaluated, written into a plug-in and said in SI from its one expression in ``factors.toml``. The variable
u is scaled: place, speed, acceleration, current, temperature and time by what was visited, the law's force by the
output's range.
"""

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np

from mrfit.core.specs import Array


@dataclass(frozen=True)
class FactorKind:
    """A function of one variable.

    Attributes
    ----------
    expression, text
        In numpy's functions, and as it is said; ``{u}`` is the variable, ``{0}``, ``{1}`` are constants.
    bounds
        Of each constant.
    grid
        Constants with which it is tried at first.
    price
        What it costs beside a straight line.
    power
        Power of the unit of u by which it grows, ``first`` for the first constant; 0 for none.
    places
        Which constants are in the unit of u.
    varying
        The same without a constant that a law may make, where it differs.
    inverse
        Whether the first constant is said as its inverse, and the function was divided by all of them.
    """

    expression: str
    text: str
    bounds: tuple[tuple[float, float], ...] = ()
    grid: tuple[tuple[float, ...], ...] = ((),)
    price: float = 0.0
    power: float | Literal["first"] = 0.0
    places: tuple[int, ...] = ()
    varying: str = ""
    inverse: bool = False

    def compiled(self) -> Callable[..., Array]:
        """Return the expression as a function of u (N,) and the constants."""
        names = [f"c{k}" for k in range(len(self.bounds))]
        code = f"lambda {', '.join(['u', *names])}: {self.expression.format(*names, u='u')}"
        # the text is this module's own: no other way makes what is evaluated and what is written out the same
        return cast(Callable[..., Array], eval(code, {"np": np}))


def _read() -> dict[str, FactorKind]:
    rows = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    return {name: FactorKind(**{k: _tuples(v) for k, v in row.items()}) for name, row in rows.items()}


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


FACTOR_KINDS = _read()
"""Every kind of factor by its name."""
ODD = ("line", "side", "odd-square", "odd-power")
"""Factors that turn with their variable."""
FUNCTIONS = {name: kind.compiled() for name, kind in FACTOR_KINDS.items()}


@dataclass(frozen=True)
class Factor:
    """A function of one variable at its constants."""

    variable: str
    kind: str
    constants: tuple[float, ...] = ()

    @property
    def key(self) -> str:
        """Variable and kind."""
        return f"{self.variable} {self.kind}"

    def of(self, values: Array) -> Array:
        """Return the factor (N,) of a scaled variable (N,)."""
        return FUNCTIONS[self.kind](values, *self.constants)


@dataclass(frozen=True)
class Term:
    """A product of factors."""

    factors: tuple[Factor, ...]

    @property
    def structure(self) -> tuple[str, ...]:
        """Factors without their constants, in order."""
        return tuple(sorted(f.key for f in self.factors))

    @property
    def price(self) -> float:
        """Price of its factors, of a line 1 and half as much of every further factor."""
        return 0.5 + sum(0.5 + FACTOR_KINDS[f.kind].price for f in self.factors)

    @property
    def constants(self) -> tuple[float, ...]:
        """Constants of all factors."""
        return tuple(c for f in self.factors for c in f.constants)

    @property
    def bounds(self) -> tuple[tuple[float, float], ...]:
        """Their bounds."""
        return tuple(b for f in self.factors for b in FACTOR_KINDS[f.kind].bounds)

    def at(self, constants: tuple[float, ...]) -> "Term":
        """Return the term at other constants."""
        found, first = [], 0
        for f in self.factors:
            found.append(Factor(f.variable, f.kind, constants[first : first + len(f.constants)]))
            first += len(f.constants)
        return Term(tuple(found))

    @property
    def gain(self) -> Factor | None:
        """Factor of the place on a force that any law may make, whose mean is the law's; None if it is no such term."""
        places = [f for f in self.factors if f.variable == "x"]
        return places[0] if len(places) == 1 and len(self.factors) > 1 and self.mean_is_lawful(places[0]) else None

    def mean_is_lawful(self, factor: Factor) -> bool:
        """Return whether a law makes the product of the other factors, so that the mean of this one is not known."""
        others = [f for f in self.factors if f is not factor]
        variables = {f.variable for f in others}
        sided = any(f.variable == "v" and f.kind not in ODD for f in others)
        return not others or (bool(variables & {"v", "L"}) and variables <= {"v", "i", "L"} and not sided)

    def of(self, values: Mapping[str, Array], gauge: float = 0.0) -> Array:
        """Return the product (N,) at scaled variables (N,), a mean taken off its gain."""
        product = np.ones(1)
        for f in self.factors:
            own = f.of(values[f.variable])
            product = product * (own - gauge if f is self.gain else own)
        return np.asarray(product)
