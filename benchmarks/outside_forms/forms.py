"""Hidden forms: products of factors, each of one variable and one shape, and which readings of them are right."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field

import numpy as np

Array = np.ndarray
# stroke (m), velocity (m/s), acceleration (m/s²), current (A), temperature (degC), time (s), force of the law (N)
VARIABLES = ("x", "v", "a", "i", "T", "t", "L")


@dataclass(frozen=True)
class Scales:
    """Largest values of the variables in a specimen's tests, in SI units."""

    x: float
    v: float
    a: float
    i: float
    t: float


SHAPES: dict[str, Callable[..., Array]] = {
    "odd": lambda y, n: np.sign(y) * np.abs(y) ** n,
    "even": lambda y, n: np.abs(y) ** n,
    "sign": lambda y, width: np.tanh(y / width),
    "side": lambda y, side, n, place: np.maximum(side * y - place, 0.0) ** n,
    "bump": lambda y, place, width: np.exp(-(((y - place) / width) ** 2)),
    "column": lambda y, length, n: (1 - y / length) ** -n - 1,
    "pressure": lambda y, length, n: (1 - y / length) ** -n,
    "decay": lambda y, tau: np.exp(-y / tau),
    "arrhenius": lambda y, heat: np.exp(heat * (1 / (y + 273.15) - 1 / 298.15)),
    "dead-zone": lambda y, place: np.sign(y) * np.maximum(np.abs(y) - place, 0.0),
    "shift": lambda y, place: y - place,
}


@dataclass(frozen=True)
class Factor:
    """A shape of one variable, with its constants in SI units."""

    variable: str
    shape: str
    constants: dict[str, float] = field(default_factory=dict)

    def at(self, values: Mapping[str, Array]) -> Array:
        """Return the factor where the variables have these values."""
        return SHAPES[self.shape](values[self.variable], **self.constants)


Name = frozenset[tuple[str, str]]


@dataclass(frozen=True)
class Term:
    """A product of factors with a coefficient."""

    factors: tuple[Factor, ...]
    coefficient: float = 1.0

    def at(self, values: Mapping[str, Array]) -> Array:
        """Return the force (N) of the term."""
        return self.coefficient * np.prod([f.at(values) for f in self.factors], axis=0)

    @property
    def name(self) -> Name:
        """Variables and shapes of the factors, constants left out."""
        return name_of(
            (f.variable, f.shape, f.constants.get("n", 1.0), f.constants.get("side", 1.0)) for f in self.factors
        )

    def described(self) -> dict[str, object]:
        """Return the term as the results have it."""
        return asdict(self)


def name_of(factors: Iterable[tuple[str, str, float, float]]) -> Name:
    """Join factors (variable, shape, exponent, side) to one per variable: v |v| is odd of order 2, as sgn(v) v² is."""
    powers: dict[str, tuple[bool, float]] = {}
    name: set[tuple[str, str]] = set()
    for variable, shape, exponent, side in factors:
        if variable == "L":
            name.add(("L", ""))
        elif shape in ("odd", "even", "sign", "shift"):
            odd, order = powers.get(variable, (False, 0.0))
            powers[variable] = (odd != (shape != "even"), order + (0.0 if shape == "sign" else exponent))
        elif shape == "side":
            name.add((variable, f"side {'+' if side > 0 else '-'} {round(2 * exponent) / 2:g}"))
        else:
            name.add((variable, shape))
    for variable, (odd, order) in powers.items():
        parity = "power" if variable in "iTt" else "odd" if odd else "even"  # these are of one sign
        if parity == "odd" or order:
            name.add((variable, f"{parity} {round(2 * order) / 2:g}"))
    return frozenset(name)


def _power(variable: str, n: float) -> Factor:
    return Factor(variable, "odd" if n % 2 else "even", {"n": n})


def _sign(s: Scales) -> Factor:
    return Factor("v", "sign", {"width": 0.03 * s.v})


LAW = Factor("L", "odd", {"n": 1.0})
Draw = Callable[[np.random.Generator, Scales], tuple[Factor, ...]]

SINGLES: dict[str, Draw] = {
    "cubic": lambda r, s: (_power("x", 3),),
    "bilinear": lambda r, s: (Factor("x", "side", _place(r, s.x, 0.1, 0.5, 1.0)),),
    "friction-bump": lambda r, s: (_sign(s), Factor("x", "bump", _bump(r, s))),
    "x-v": lambda r, s: (_power("x", 1), _power("v", 1)),
    "rebound-square": lambda r, s: (Factor("v", "side", {"side": -1.0, "n": 2.0, "place": 0.0}),),
    "rebound-orifice": lambda r, s: (Factor("v", "side", {"side": -1.0, "n": 0.5, "place": 0.0}),),
    "cavitation": lambda r, s: (Factor("v", "side", {**_place(r, s.v, 0.25, 0.5, 1.0), "side": -1.0}),),
    "arrhenius": lambda r, s: (_power("v", 1), Factor("T", "arrhenius", {"heat": float(r.uniform(2000, 4000))})),
    "polytropic": lambda r, s: (Factor("x", "column", {"length": s.x * float(r.uniform(1.5, 2.5)), "n": 1.3}),),
    "one-sided-mass": lambda r, s: (Factor("a", "side", {"side": 1.0, "n": 1.0, "place": 0.0}),),
    "current-place": lambda r, s: (_power("i", 1), _power("x", 1)),
    "x2-v": lambda r, s: (_power("x", 2), _power("v", 1)),
    "settling-spring": lambda r, s: (_power("x", 1), Factor("t", "decay", {"tau": s.t * float(r.uniform(0.2, 0.6))})),
    "coil-pull": lambda r, s: (_power("i", 2),),
    "fading-friction": lambda r, s: (_sign(s), Factor("t", "decay", {"tau": s.t * float(r.uniform(0.2, 0.6))})),
    "guide-friction": lambda r, s: (Factor("x", "even", {"n": 1.0}), LAW),
    "linear": lambda r, s: (_power("x", 1),),
}
LIBRARY: dict[str, Draw] = {
    "gas-spring": SINGLES["linear"],
    "end-stop": lambda r, s: (Factor("x", "dead-zone", {"place": s.x * float(r.uniform(0.4, 0.7))}),),
    "inertia": lambda r, s: (_power("a", 1),),
    "asymmetry": lambda r, s: (LAW, _sign(s)),
    "temperature": lambda r, s: (LAW, Factor("T", "shift", {"place": 25.0})),
    "gain-drift": lambda r, s: (LAW, _power("t", 1)),
}
# forms of several terms; the last of the 18 are the first two
FORMS = {name: (name,) for name in SINGLES if name != "linear"} | {
    "duffing": ("linear", "cubic"),
    "x2-v-and-mass": ("x2-v", "one-sided-mass"),
}
PAIRS = {
    "bump-and-pull": ("friction-bump", "coil-pull"),
    "place-and-mass": ("current-place", "one-sided-mass"),
    "x-v-and-fading": ("x-v", "fading-friction"),
    "polytropic-and-arrhenius": ("polytropic", "arrhenius"),
    "bilinear-and-square": ("bilinear", "rebound-square"),
}
NULLS = ("null-wrong-law", "null-exact-law")
GROUPS = {"form": tuple(FORMS), "pair": tuple(PAIRS), "null": NULLS, "library": tuple(LIBRARY)}
KINDS = tuple(kind for kinds in GROUPS.values() for kind in kinds)
_LAW_NAME = ("L", "odd", 1.0, 1.0)
# other readings of the same force, right beside the planted one
SAME: dict[str, list[list[tuple[str, str, float, float]]]] = {
    "end-stop": [[("x", "side", 1.0, 1.0)], [("x", "side", 1.0, -1.0)]],
    "gas-spring": [[("x", "column", 1.0, 1.0)]],
    "asymmetry": [[_LAW_NAME, ("v", "side", 0.0, 1.0)], [_LAW_NAME, ("v", "side", 0.0, -1.0)]],
    "temperature": [[_LAW_NAME, ("T", "arrhenius", 1.0, 1.0)]],
}


def parts_of(kind: str) -> tuple[str, ...]:
    """Return the names of the single terms that a kind hides."""
    if kind in NULLS:
        return ()
    return {**FORMS, **PAIRS}.get(kind, (kind,))


def draw_terms(kind: str, rng: np.random.Generator, scales: Scales) -> list[tuple[Term, frozenset[Name]]]:
    """Draw the terms of a kind, of coefficient one, each with the names that are right."""
    drawn = []
    for part in parts_of(kind):
        term = Term({**SINGLES, **LIBRARY}[part](rng, scales))
        drawn.append((term, frozenset({term.name, *map(name_of, SAME.get(part, ()))})))
    return drawn


def _place(rng: np.random.Generator, scale: float, low: float, high: float, n: float) -> dict[str, float]:
    return {"side": float(rng.choice([-1.0, 1.0])), "n": n, "place": scale * float(rng.uniform(low, high))}


def _bump(rng: np.random.Generator, s: Scales) -> dict[str, float]:
    return {"place": s.x * float(rng.uniform(-0.4, 0.4)), "width": s.x * float(rng.uniform(0.2, 0.4))}
