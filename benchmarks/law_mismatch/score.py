"""Judge what was said of a case against the truth."""

from dataclasses import dataclass

from benchmarks.law_mismatch.faults import LIBRARY
from benchmarks.law_mismatch.protocol import Case
from benchmarks.law_mismatch.runner import Result
from benchmarks.law_mismatch.said import Name, Number

# A value counts as right within this share of the truth
CLOSE = 0.25
# Root mean square of an effect over that of the noise from which it is clear: below, noise buries it in all records
CLEAR = 1.0


@dataclass(frozen=True)
class Found:
    """A hidden effect that was named: how far its judged value is off (share), and whether the interval holds it."""

    hidden: str
    size: float
    error: float
    holds: bool | None


@dataclass(frozen=True)
class Outcome:
    """What is to be said of a case.

    Attributes
    ----------
    case, result
        Judged.
    names, wrong
        Effects named, and those of them that are not there (a real record's own, named of it as it is, are).
    right
        Whether the demand of its group was met.
    stated
        Whether the truth stands in a stated set, or was named together with others.
    found
        The hidden effects that were named, with their judged values.
    """

    case: Case
    result: Result
    names: frozenset[str]
    wrong: frozenset[str]
    right: bool
    stated: bool
    found: tuple[Found, ...]

    @property
    def exact(self) -> bool:
        """Whether exactly what is hidden was named."""
        return bool(self.names) and self.names == self.case.inside

    @property
    def size(self) -> float:
        """Size of the smallest hidden effect over the range."""
        return min((t["size"] for t in self.result.truth.values()), default=0.0)

    @property
    def clear(self) -> bool:
        """Whether every hidden effect stands out of the noise."""
        return all(t.get("contrast", CLEAR) >= CLEAR for t in self.result.truth.values())

    @property
    def close(self) -> bool:
        """Whether all hidden effects were named with a value close to the truth."""
        return len(self.found) == len(self.case.inside) > 0 and all(f.error <= CLOSE for f in self.found)


def judge(case: Case, result: Result, own: Result | None = None) -> Outcome:
    """Return the outcome of a case; ``own`` is what was said of a real record as it is, from the same base."""
    said = result.said
    names = frozenset(n.name for n in said.names)
    own_names = frozenset(n.name for n in own.said.names) if own else frozenset()
    wrong = names - case.inside - own_names
    together = {t for n in said.names for t in (n.name, *n.together) if n.together}
    stated = bool(case.inside) and case.inside <= (names | set(said.stated) | together) and case.inside != names
    found = tuple(f for h in case.hidden if (f := _found(h, result, own)) is not None)
    right = {
        "null": not names,
        "long-memory": not names,
        "outside": not names and said.verdict == "unexplained",
        "single": names == case.inside,
        "pair": names == case.inside,
        "planted": case.inside <= names and not wrong,
        "real": True,
    }[case.group]
    return Outcome(case, result, names, wrong, right and said.verdict != "error", stated, found)


def _found(hidden: str, result: Result, own: Result | None) -> Found | None:
    if hidden not in LIBRARY or hidden not in result.truth:
        return None
    name = next((n for n in result.said.names if n.name == LIBRARY[hidden][0]), None)
    if name is None:
        return None
    truth = result.truth[hidden]
    for parameter, value in truth["values"].items():
        number = _total(name, parameter)
        if number is not None:
            value += _own(own, name.name, parameter)
            ends = number.low is not None and number.high is not None
            holds = number.low <= value <= number.high if ends else False
            return Found(hidden, truth["size"], abs(number.value / value - 1), holds)
    return Found(hidden, truth["size"], 0.0, None)


def _total(name: Name, parameter: str) -> Number | None:
    """Return a judged number; the dead time of a lag counts as lag, which it is to first order."""
    number, dead = name.numbers.get(parameter), name.numbers.get("t_d")
    if number is None or parameter != "tau" or dead is None:
        return number
    ends = (None if q is None else q + dead.value for q in (number.low, number.high))
    return Number(number.value + dead.value, *ends)


def _own(own: Result | None, name: str, parameter: str) -> float:
    """Return what a real record as it is was said to have of a parameter, also where that was too little for a name."""
    if own is None:
        return 0.0
    found = next((n for n in own.said.names if n.name == name), None)
    number = _total(found, parameter) if found else None
    return number.value if number else own.said.weak.get(name, {}).get(parameter, 0.0)


def judge_all(cases: list[Case], results: list[Result]) -> list[Outcome]:
    """Judge all cases; planted records are compared with the same records as they are, where these were run."""
    real = {(c.records, c.base): r for c, r in zip(cases, results, strict=True) if c.group == "real"}
    return [
        judge(c, r, real.get((c.records, c.base)) if c.hidden else None) for c, r in zip(cases, results, strict=True)
    ]
