"""Judge a discovery against the truth: right, wrong, or only cautious."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from benchmarks.discovery.protocol import Case
from benchmarks.discovery.runner import Result
from datasets.rig.effects import EFFECTS


def _same(truth: dict[str, Any], size: float) -> float:
    return size


# What the base law cannot absorb, over the noise: from here on an effect is clearly visible
CLEAR = 2.5
# How many of the places named first count
PLACES = 4
# Effects whose magnitude means the same in any formulation: unit of the parameter, and its true value
COMPARABLE: dict[str, tuple[str, Callable[[dict[str, Any], float], float]]] = {
    "eddy-current": ("S", lambda truth, ohm: 1.0 / ohm),
    "resistance-error": ("ohm", lambda truth, share: share * truth["base"]["resistance"]),
    "integrator-offset": ("V", _same),
    "probe-skew": ("s", _same),
    "current-lag": ("s", _same),
    "delay": ("s", _same),
    "residual-magnetism": ("A", _same),
    "inertia": ("kg", _same),
    "coulomb-friction": ("N", _same),
    "quadratic-drag": ("N*s^2/m^2", _same),
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """What is to be said of one case.

    Attributes
    ----------
    case, result
        Judged.
    verdict
        As mrfit gave it, or ``error``.
    names
        Effects named.
    wrong
        Names that were not built in.
    right
        Whether the case's own demand was met.
    why
        What went wrong, empty if nothing did.
    covered
        By effect, whether the interval of its comparable parameter holds the truth.
    """

    case: Case
    result: Result
    verdict: str
    names: frozenset[str]
    wrong: frozenset[str]
    right: bool
    why: str
    covered: dict[str, bool] = field(default_factory=dict)

    @property
    def contrast(self) -> float:
        """How far what the base law cannot absorb stands above the noise."""
        return float(self.result.truth["visible"]) / float(self.result.truth["noise"])

    @property
    def closed(self) -> float:
        """Share of the gap closed on held-out conditions."""
        return float(self.result.discovery.get("gap", {}).get("closed") or 0.0)


def judge(case: Case, result: Result, twin: Outcome | None = None) -> Outcome:
    """Return the outcome of a case; ``twin`` is the outcome whose verdict a metamorphic case must repeat."""
    found = result.discovery
    verdict = "error" if result.error else str(found.get("verdict", "error"))
    names = frozenset(e["name"] for e in found.get("effects", []))
    why = result.error or _complaint(case, result, verdict, names)
    if not why and twin is not None and (twin.verdict, twin.names) != (verdict, names):
        why = f"{verdict} {sorted(names)} where its twin is {twin.verdict} {sorted(twin.names)}"
    return Outcome(case, result, verdict, names, names - case.inside, not why, why, _covered(case, result))


def _complaint(case: Case, result: Result, verdict: str, names: frozenset[str]) -> str:
    wrong = names - case.inside
    if wrong:
        return f"named {', '.join(sorted(wrong))}, which is not there"
    demand = {
        "null": _nothing,
        "absorbed": _nothing,
        "untellable": _cautious,
        "outside": _unexplained,
        "little": _too_little,
        "missing": _no_name,
        "other-law": _something,
    }.get(case.stratum, _exact if case.inside else _nothing)
    return demand(case, result, verdict, names)


def _nothing(case: Case, result: Result, verdict: str, names: frozenset[str]) -> str:
    return "" if verdict == "none" else f"verdict {verdict}, nothing can be seen"


def _exact(case: Case, result: Result, verdict: str, names: frozenset[str]) -> str:
    if names == case.inside:
        return ""
    if names:
        return f"named {', '.join(sorted(names))} only"
    stated = ", ".join(result.discovery.get("ambiguous_set", []))
    return f"verdict {verdict}" + (f" ({stated})" if stated else "")


def _cautious(case: Case, result: Result, verdict: str, names: frozenset[str]) -> str:
    # a guess is caught by the effect's twin: each of a pair that cannot be told apart is hidden in its turn
    if names == case.inside:
        return ""
    if verdict == "ambiguous":
        lost = case.inside - set(result.discovery.get("ambiguous_set", []))
        return f"the stated set lacks {', '.join(sorted(lost))}" if lost else ""
    invisible = result.truth["visible"] < CLEAR * result.truth["noise"]
    if verdict in ("none", "insufficient-data") and invisible:
        return ""
    return f"verdict {verdict}"


def _unexplained(case: Case, result: Result, verdict: str, names: frozenset[str]) -> str:
    if verdict != "unexplained":
        return f"verdict {verdict}"
    (effect,) = case.hidden.effects
    found = result.discovery
    where = [*found.get("unexplained", {}).get("where", []), *found.get("where", [])][:PLACES]
    places = [str(w["region"] if isinstance(w, dict) else w) for w in where]
    if any(word.lower() in place.lower() for word in EFFECTS[effect].places for place in places):
        return ""
    return f"unexplained, but placed in {'; '.join(places) or 'no region'}"


def _too_little(case: Case, result: Result, verdict: str, names: frozenset[str]) -> str:
    return "" if verdict == "insufficient-data" else f"verdict {verdict} on too little data"


def _something(case: Case, result: Result, verdict: str, names: frozenset[str]) -> str:
    return "nothing found in a coil whose law the base cannot have" if verdict == "none" else ""


def _no_name(case: Case, result: Result, verdict: str, names: frozenset[str]) -> str:
    return "named what no channel shows" if names else ""


def _covered(case: Case, result: Result) -> dict[str, bool]:
    covered = {}
    magnitudes = {e if e in COMPARABLE else EFFECTS[e].canonical: m for e, m in case.hidden.effects.items()}
    for effect in result.discovery.get("effects", []):
        name = effect["name"]
        unit, value = COMPARABLE.get(name, ("", _same))
        matching = [p for p in effect.get("parameters", []) if p.get("unit") == unit]
        if name in magnitudes and case.hidden.bench != "other-coil" and matching:
            truth = value(result.truth, magnitudes[name])
            low, high = matching[0]["low"], matching[0]["high"]
            # an end that is not to be had is no interval: it would hold anything
            covered[name] = low is not None and high is not None and bool(low <= truth <= high)
    return covered


def judge_all(cases: list[Case], results: list[Result]) -> list[Outcome]:
    """Judge all cases, twins before those that must repeat them."""
    known: dict[str, Outcome] = {}
    for case, result in sorted(zip(cases, results, strict=True), key=lambda pair: bool(pair[0].twin)):
        known[case.name] = judge(case, result, known.get(case.twin))
    return [known[c.name] for c in cases]
