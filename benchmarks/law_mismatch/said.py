"""What a method says of a case, in one form for all methods."""

from dataclasses import asdict, dataclass, field
from typing import Any, Self


@dataclass(frozen=True)
class Number:
    """A parameter found, with its 95 % interval, SI; None where an end is open."""

    value: float
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Name:
    """An effect named: its numbers by parameter, and the effects that it is told together with, if any."""

    name: str
    numbers: dict[str, Number]
    together: tuple[str, ...] = ()


@dataclass(frozen=True)
class Said:
    """All that is kept of a case.

    Attributes
    ----------
    verdict
        ``none``, ``named``, ``ambiguous``, ``unexplained``, ``insufficient-data`` or ``error``.
    names
        Effects named.
    stated
        The set, where it is ambiguous.
    broken
        Invariances said to be broken by something without a name.
    seconds, cpu
        Wall time and processor time of the method (s).
    why
        What went wrong, or what the method noted of effects it turned down.
    weak
        Strength of an effect that it turned down, to first order, by name of effect and parameter.
    """

    verdict: str
    names: tuple[Name, ...] = ()
    stated: tuple[str, ...] = ()
    broken: tuple[str, ...] = ()
    seconds: float = 0.0
    cpu: float = 0.0
    why: dict[str, str] = field(default_factory=dict)
    weak: dict[str, dict[str, float]] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON."""
        return asdict(self)

    @classmethod
    def of(cls, read: dict[str, Any]) -> Self:
        """Return it from JSON."""
        names = tuple(
            Name(n["name"], {k: Number(**q) for k, q in n["numbers"].items()}, tuple(n["together"]))
            for n in read["names"]
        )
        return cls(**{**read, "names": names, "stated": tuple(read["stated"]), "broken": tuple(read["broken"])})
