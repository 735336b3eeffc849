"""An advice in words, and the drive of a test as a file."""

from collections.abc import Sequence

import numpy as np

from mrfit.advise.drives import Test
from mrfit.advise.rivalry import ERRORS_APART
from mrfit.advise.rivals import NO_MORE_RIVALS
from mrfit.advise.specimen import CURRENT, TEMPERATURE, Channels
from mrfit.core.channels import unit_of
from mrfit.core.counting import number_of
from mrfit.core.specs import Array
from mrfit.io.csv_table import csv_table
from mrfit.io.schemas.advice import AdvisedTest, Pair, Width

# Units in which motions are said, and their factors
SAID = {"m": ("mm", 1e3)}
DIGITS = 9
MOST_PAIRS = 4
"""Rivals, or pairs of them, that a sentence names."""


def number(value: float) -> str:
    """Return a number in three significant digits."""
    return f"{float(f'{value:.3g}'):g}"


def test_words(test: Test, channels: Channels) -> str:
    """Return a test in words for the operator of the rig."""
    own = test.numbers
    unit, factor = SAID.get(unit_of(channels.motion), (unit_of(channels.motion), 1.0))
    size = f"{number(factor * own['amplitude'])} {unit}"
    if test.kind == "sweep":
        what = f"a sweep from {number(own['frequency'])} to {number(own['to'])} Hz at constant speed, up to {size}"
    else:
        shape = "triangle" if test.kind == "triangle" else "sine"
        what = f"a {shape} of {number(own['frequency'])} Hz and {size}"
    if "dwell" in own:
        return (
            f"{what} under a current stepped between {number(own['low'])} and {number(own['current'])} A "
            f"about every {number(own['dwell'])} s"
        )
    held = f" at {number(own['current'])} A" if "current" in own else ""
    if test.kind == "repeat":
        return f"{what}{held}, {number(own['wait'])} s of rest, and the same again"
    if test.kind == "warm-up":
        return f"{what}{held}, once cold and once warm"
    return f"{what}{held}"


def drive_csv(test: Test, channels: Channels, driven: dict[str, Array]) -> str:
    """Return the drive of a test as CSV: time, motion and its rate, current, and temperature where it is set."""
    names = [channels.motion, channels.rate]
    if channels.motion != CURRENT and len(test.current):
        names.append(CURRENT)
    if len(test.warmth):
        names.append(TEMPERATURE)
    columns = {"time [s]": test.time}
    rows = dict(zip((channels.motion, channels.rate), test.motion, strict=False))
    columns |= {f"{n} [{unit_of(n)}]": rows.get(n, driven.get(n, np.empty(0))) for n in names if n}
    table = np.round(np.stack(list(columns.values())), DIGITS) + 0.0
    return csv_table(list(columns), (dict(zip(columns, row, strict=True)) for row in table.T.tolist()))


def listed(words: Sequence[str], last: str = "and") -> str:
    """Return words as a list in a sentence."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} {last} {words[-1]}"


def of_rivals(pairs: Sequence[Pair], tests: Sequence[AdvisedTest], companion: AdvisedTest | None) -> list[str]:
    """Return what to do to separate rivals, in sentences."""
    apart = [k for k, p in enumerate(pairs) if p.separable]
    if not apart:
        rivals = listed(_those(pairs, range(len(pairs))))
        return [
            f"No test within these limits separates the rivals, {rivals}: the best one puts none of them 3 standard "
            "errors apart, so none is proposed.",
            "Where the rivals are one function of the rig's motion and current, no limits help: keep one of them. "
            "Else give wider limits.",
        ]
    first = tests[0]
    told = [k for k in apart if first.distances[k] >= ERRORS_APART]
    left, apart = len(apart) - len(told), told or apart
    weakest = min(apart, key=lambda k: first.distances[k])
    nearest = " and ".join(map(_rival, pairs[weakest].names))
    said = [
        f"Run {first.text}, {_length(first)}: it puts {listed(_those(pairs, apart))} at least "
        f"{number(first.distances[weakest])} standard errors apart ({nearest}); "
        f"in the data there are it is {number(pairs[weakest].before)}."
    ]
    if left and told:
        said.append(f"It leaves {number_of('more pair', left)} closer that another test separates: ask again after it.")
    if companion is not None:
        said.append(f"Then run {companion.text}, {_length(companion)}, so that a test of this kind can be held out.")
    never = [p.names for p in pairs if not p.separable]
    unseen = [n for names in never if NO_MORE_RIVALS in names for n in names if n != NO_MORE_RIVALS]
    alike = [" from ".join(names) for names in never if NO_MORE_RIVALS not in names]
    for verb, names, what in (("would show", unseen, "effects"), ("tells", alike, "pairs")):
        more = [f"{len(names) - MOST_PAIRS} more {what}, which advise.json names"] * (len(names) > MOST_PAIRS)
        if names:
            said.append(f"No test within these limits {verb} {listed([*names[:MOST_PAIRS], *more], 'or')}.")
    return said


def _those(pairs: Sequence[Pair], apart: Sequence[int]) -> list[str]:
    return list(dict.fromkeys(_rival(n) for k in apart for n in pairs[k].names))


def _rival(name: str) -> str:
    return "the model as found" if name == NO_MORE_RIVALS else name


def _length(test: AdvisedTest) -> str:
    return f"{number(test.seconds)} s" + (f" and {number(test.waiting)} s to warm it" if test.waiting else "")


def of_parameters(widths: Sequence[Width], first: AdvisedTest) -> list[str]:
    """Return what to do to narrow intervals, in sentences."""
    shares = [w.after / w.before for w in widths if w.before and w.after is not None]
    said = f"Run {first.text}, {_length(first)}"
    if not shares:
        return [f"{said}: the data there are leave every parameter open."]
    middle = float(np.exp(np.mean(np.log(shares))))
    return [
        f"{said}: intervals shrink to {number(100.0 * middle)} % of their width, in the geometric mean.",
        "Whether the parameters stay, over life, temperature or other units, `mrfit drift` says of several fits.",
    ]
