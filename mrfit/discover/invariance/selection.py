"""The decision: evidence in, effects out. Nothing here computes, reads or writes."""

from collections.abc import Sequence
from dataclasses import dataclass

from mrfit.discover.invariance.findings import Standing
from mrfit.discover.invariance.policy import Policy


@dataclass(frozen=True)
class Candidate:
    """What screening says of an effect.

    Attributes
    ----------
    name
        Of the effect.
    share
        Of the squared error beside the best law, how much it could take to first order.
    left
        Share of its sensitivity's square that no law takes.
    theta
        Parameters to start from.
    wrong
        Whether its strength has a sign that is not physical.
    """

    name: str
    share: float
    left: float
    theta: tuple[float, ...] = ()
    wrong: bool = False

    @property
    def rank(self) -> float:
        """Share, 0 for one of the wrong sign."""
        return 0.0 if self.wrong else self.share


@dataclass(frozen=True)
class Refined:
    """An effect refined beside those that are there already.

    Attributes
    ----------
    name
        Of the effect.
    standing
        How clearly it shows.
    error
        Squared error with it.
    sign
        Whether its strength has a physical sign.
    early
        Share that a record which is early would take, over its own; 0 where that is no rival.
    """

    name: str
    standing: Standing
    error: float
    sign: bool = True
    early: float = 0.0


def worth_refining(candidates: Sequence[Candidate], policy: Policy) -> tuple[list[Candidate], list[Candidate]]:
    """Return the candidates to refine, the one that could take most first, and those that are turned down at once."""
    ordered = sorted(candidates, key=lambda c: -c.rank)
    least = policy.worth_refining * policy.share
    good = [c for c in ordered if c.left >= policy.left and c.rank >= least][: policy.most_refined]
    return good, [c for c in ordered if c not in good]


def screened_out(candidate: Candidate, policy: Policy) -> str:
    """Return why a candidate is not refined."""
    if candidate.left < policy.left:
        return "the law may have it"
    if candidate.wrong and candidate.share >= policy.worth_refining * policy.share:
        return "its strength would have the wrong sign"
    return f"takes only {candidate.share:.0%} of what no law makes"


def objection(row: Refined, policy: Policy) -> str:
    """Return why a refined effect is not there; empty if it is."""
    s = row.standing
    reasons = (
        (s.left < policy.left, "the law may have it"),
        (not row.sign, "its strength would have the wrong sign"),
        (row.early > policy.early, f"a record that is early would take {row.early:.0%} of what it takes"),
        (s.z < policy.clear, f"only {s.z:.1f} standard errors from neutral"),
        (s.share < policy.share, f"takes only {s.share:.0%} of what no law makes"),
        (s.kept < policy.kept, f"takes only {s.kept:.0%} on conditions left out"),
        (s.held < policy.held, f"takes only {s.held:.0%} on conditions left out, the law from the others too"),
        (s.size < policy.size, f"at most {s.size:.2%} of the range"),
    )
    return next((text for fails, text in reasons if fails), "")


@dataclass(frozen=True)
class Round:
    """What one round of refinements decides: the effect to add, or none, its rivals, and why others are not there."""

    winner: str
    rivals: tuple[str, ...]
    reasons: tuple[tuple[str, str], ...]


def decide(rows: Sequence[Refined], policy: Policy) -> Round:
    """Return the effect that leaves least among those without objection; rivals leave hardly more."""
    reasons = tuple((r.name, objection(r, policy)) for r in rows)
    good = sorted((r for r, (_, why) in zip(rows, reasons, strict=True) if not why), key=lambda r: r.error)
    if not good:
        return Round("", (), reasons)
    rivals = tuple(r.name for r in good[1:] if r.error < policy.rival * good[0].error)
    return Round(good[0].name, rivals, reasons)


def weakest(rows: Sequence[Refined], policy: Policy) -> tuple[str, str]:
    """Return the effect with an objection that takes least beside the others, and the objection; empty if none has."""
    bad = [(r, objection(r, policy)) for r in rows]
    bad = [(r, why) for r, why in bad if why]
    if not bad:
        return "", ""
    row, why = min(bad, key=lambda b: b[0].standing.share)
    return row.name, why
