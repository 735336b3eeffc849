"""The choice of the tests that a discovery holds out: none that alone tells what a law of current is made of.

Where a held-out test is at a current, or as fast at a current, that no fitted test tells of, its error is that of the
law of current. It hides what an effect takes.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from mrfit.core.channels import EXCITATIONS
from mrfit.core.recording import Segment
from mrfit.discover.policy import STANDARD, Policy
from mrfit.simulate.current_levels import level_of, levels_of


def too_little(segments: Sequence[Segment], policy: Policy) -> str:
    """Return the lack of the data for any verdict, or an empty string."""
    training = {s.condition for s in segments if s.role == "train"}
    if not any(s.role == "holdout" for s in segments):
        return (
            f"no held-out condition (conditions: {len(training)}): a verdict needs at least four, or "
            "`mrfit segment --holdout PATTERN`"
        )
    periodic = all(s.cycles and s.drive not in EXCITATIONS.values() for s in segments if s.role == "train")
    if periodic and len(training) < policy.fewest_training:
        return (
            "only one periodic training condition: a missing effect cannot be told from the base; log more conditions"
        )
    return ""


def with_laws_trained(segments: Sequence[Segment]) -> tuple[list[Segment], str]:
    """Return segments of which none is held out that alone tells of a law of current, and a word on those moved."""
    found, at_current = with_their_currents_trained(segments)
    found, as_fast = with_their_speeds_trained(found)
    return found, "; ".join(word for word in (at_current, as_fast) if word)


def with_their_currents_trained(segments: Sequence[Segment]) -> tuple[list[Segment], str]:
    """Return segments with roles by which the current of every held-out condition is also trained, and a word on it.

    Of several held-out conditions at a current that is not trained all but the last are trained; a single one is, where
    others stay held out.
    """
    levels = _all_levels(segments)
    seen = {level_of(s, levels) for s in segments if s.role == "train"}
    unseen: dict[float, list[str]] = {}
    for s in segments:
        level = level_of(s, levels)
        if s.role == "holdout" and np.isfinite(level) and level not in seen:
            unseen.setdefault(level, []).append(s.condition)
    groups = [sorted(set(own)) for own in unseen.values()]
    moved = {c for own in groups for c in own[:-1]}
    alone = {own[0] for own in groups if len(own) == 1}
    held = {s.condition for s in segments if s.role == "holdout"}
    moved |= alone if held - moved - alone else set()
    word = f"no other test is at their current, so {', '.join(sorted(moved))} were fitted here and not held out"
    return _trained(segments, moved), word if moved else ""


def with_their_speeds_trained(segments: Sequence[Segment]) -> tuple[list[Segment], str]:
    """Return segments of which none is held out where one current alone is trained by tests as fast, and a word on it.

    What grows with the speed depends on the current, too. Of such conditions the one at the farthest current is
    trained, so that the others are between the two. At least one condition stays held out.
    """
    found, moved = list(segments), list[str]()
    while len({s.condition for s in found if s.role == "holdout"}) > 1 and (lonely := _beside_one_current(found)):
        moved.append(max(lonely, key=lambda c: (lonely[c], c)))
        found = _trained(found, moved)
    word = (
        f"the other tests as fast are at one current, so {', '.join(sorted(moved))} were fitted here and not held out"
    )
    return found, word if moved else ""


def _trained(segments: Sequence[Segment], conditions: Collection[str]) -> list[Segment]:
    return [replace(s, role="train") if s.condition in conditions else s for s in segments]


def _all_levels(segments: Sequence[Segment]) -> list[float]:
    return levels_of(replace(s, role="train") for s in segments)


def _beside_one_current(segments: Sequence[Segment]) -> dict[str, float]:
    """Return the held-out conditions of which trained tests as fast are at one other current, and how far it is (A)."""
    levels, found = _all_levels(segments), dict[str, float]()
    at_level = [(s, level) for s in segments if np.isfinite(level := level_of(s, levels))]
    for held, level in at_level:
        if held.role == "train" or not held.cycles:
            continue
        as_fast = {own for s, own in at_level if s.role == "train" and STANDARD.as_fast * _speed(s) >= _speed(held)}
        if len(as_fast) == 1 and level not in as_fast:
            found[held.condition] = abs(level - as_fast.pop())
    return found


def _speed(segment: Segment) -> float:
    """Return a measure of the speed of a motion, in m/s, 0 of one without cycles."""
    return segment.amplitude * segment.frequency if segment.cycles else 0.0
