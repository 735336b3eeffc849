"""Terms that a formula is looked for among: what breaks an invariance of every law, by place, side, mass, time, warmth.

Variables are ``x`` the place from the middle of the stroke, ``v``, ``a``, the current ``i``, the temperature ``T``, the
time ``t`` of the record, and ``L`` the force of the law. What any law may make, as v|v| or i^2*v, is not among them.
"""

from collections.abc import Collection, Sequence

from mrfit.discover.formula.factors import FACTOR_KINDS, Factor, Term


def over_grid(variable: str, *kinds: str) -> list[Factor]:
    """Return factors of a variable at every constant that they are tried with."""
    return [Factor(variable, kind, constants) for kind in kinds for constants in FACTOR_KINDS[kind].grid]


PROPORTIONAL, DIRECTIONS = Factor("v", "line"), over_grid("v", "side")
FLOWS = (PROPORTIONAL, DIRECTIONS[0], Factor("v", "odd-square"), over_grid("v", "odd-power")[0])
LAW_FORCE, CONTROLLED, INERTIAL = Factor("L", "line"), Factor("i", "line"), Factor("a", "line")


def products(first: Sequence[Factor], *others: Sequence[Factor]) -> list[Term]:
    """Return every product of one factor of each."""
    terms: list[tuple[Factor, ...]] = [(f,) for f in first]
    for factors in others:
        terms = [(*t, f) for t in terms for f in factors]
    return [Term(t) for t in terms]


def grammar(variables: Collection[str]) -> tuple[Term, ...]:
    """Return all terms of the variables that move."""
    place = over_grid("x", "line", "square", "cube", "size", "odd-square", "over", "under", "dead-zone", "bump")
    gains = over_grid("x", "line", "square", "size", "dead-zone", "bump", "over", "under")
    sides = over_grid("v", "above", "below", "size", "square", "size-power")
    # a hinge at rest is a side; one that opens against the motion is a side with a constant
    sides += [f for f in over_grid("v", "over") if f.constants[0] > 0.0]
    sides += [f for f in over_grid("v", "under") if f.constants[0] < 0.0]
    masses = [INERTIAL, *over_grid("a", "size"), Factor("a", "above", (1.0,)), Factor("a", "below", (1.0,))]
    terms = products([*place, *over_grid("x", "gas-column")]) + products(gains, (*FLOWS, LAW_FORCE))
    terms += products(sides) + products([LAW_FORCE], [*DIRECTIONS, PROPORTIONAL])
    terms += products(masses) + products([INERTIAL], over_grid("x", "line", "square", "size"))
    terms += products([Factor("v", "size")], [Factor("x", "line"), INERTIAL])
    if "i" in variables:
        terms += products(over_grid("x", "line", "square", "cube", "size", "dead-zone", "over", "under"), [CONTROLLED])
        terms += products(over_grid("v", "above", "below", "size", "square"), [CONTROLLED])
        terms += products([CONTROLLED, Factor("i", "square")]) + products([CONTROLLED], [INERTIAL])
        terms += products([Factor("x", "line")], [Factor("i", "square")])
        terms += products(over_grid("x", "line", "square", "size"), [CONTROLLED], [PROPORTIONAL, DIRECTIONS[0]])
    held = (*FLOWS[:3], LAW_FORCE, Factor("x", "line"))
    if "t" in variables:
        ageing = [*over_grid("t", "line", "decay"), over_grid("t", "size-power")[0]]
        terms += products(ageing) + products(ageing, held)
    if "T" in variables:
        warmth = over_grid("T", "line", "thermal")
        terms += products(warmth) + products(warmth, held)
        terms += products([Factor("T", "line")], DIRECTIONS[:1], [CONTROLLED]) if "i" in variables else []
    return tuple(dict.fromkeys(terms))


def from_an_origin(term: Term) -> Term | None:
    """Return a term of powers of the place with their origin left open; None where it has none."""
    origins = {kind: f"{kind}-from" for kind in ("square", "cube", "size")}
    found = [
        Factor("x", origins[f.kind], (0.0,)) if f.variable == "x" and f.kind in origins else f for f in term.factors
    ]
    return Term(tuple(found)) if tuple(found) != term.factors else None


def mirrored(term: Term) -> list[Term]:
    """Return the other readings of a term that is one-sided in the velocity: its odd half is a law's.

    max(0,v)^m, max(0,-v)^m and |v|^m/2 differ by a force that is odd in v; beside a law they are one.
    """
    found = []
    for at, f in enumerate(term.factors):
        if f.variable == "v" and not any(g.variable == "v" for g in term.factors[:at] + term.factors[at + 1 :]):
            found += [Term((*term.factors[:at], m, *term.factors[at + 1 :])) for m in _mirrors(f)]
    return found


def _mirrors(f: Factor) -> list[Factor]:
    if f.kind in ("over", "under"):
        return [Factor(f.variable, "under" if f.kind == "over" else "over", (-f.constants[0],))]
    power = {"size": 1.0, "square": 2.0}.get(f.kind, f.constants[0] if f.kind in SIDED else 0.0)
    even = {1.0: Factor(f.variable, "size"), 2.0: Factor(f.variable, "square")}.get(power)
    all_of = [Factor(f.variable, kind, (power,)) for kind in SIDED[:2]]
    all_of.append(even or Factor(f.variable, "size-power", (power,)))
    return [m for m in all_of if m != f] if power else []


SIDED = ("above", "below", "size-power")
