"""Names and units beside arrays: lists for the columns of a matrix."""

import re
from collections.abc import Mapping, Sequence

from mrfit.core.grouping import grouped
from mrfit.ingest.text.layout import is_recognised

_OF = "(?:ch(?:an(?:nel)?)?|col(?:umn)?|sig(?:nal)?|var(?:iable)?)"
NAME_LISTS = re.compile(rf"{_OF}?(?:names|labels?|headers?)|(?:channel|column|signal|variable)s")
UNIT_LISTS = re.compile(rf"{_OF}?units?")
MOST_LABELS, LONGEST_LABEL = 64, 200
"""Texts that a list of names has at most, and characters of each."""


def is_name_list(name: str) -> bool:
    """Whether an array called so may hold the names of a matrix's columns."""
    return NAME_LISTS.fullmatch(_word(name)) is not None


def _word(name: str) -> str:
    return re.sub(r"[\W_]+", "", re.split(r"[./]", name)[-1]).lower()


def labels_of(signals: Sequence[str], lists: Mapping[str, Sequence[str]]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the names and the units of columns of matrices, as lists beside each of as many texts say them.

    A list is part of the matrix (an attribute), or stands beside it, or further out; the nearest one holds, and of
    several the one with more known names.

    Parameters
    ----------
    signals
        Names of the arrays; columns are called ``x[0]``, ``x[1]`` and so on.
    lists
        Lists of texts by name.
    """
    columns = [match for name in signals if (match := re.fullmatch(r"(.+)\[\d+\]", name))]
    names: dict[str, str] = {}
    units: dict[str, str] = {}
    for base, members in grouped((match[1], match[0]) for match in columns).items():
        pandas = f"{base.removesuffix('_values')}_items"  # block0_items of block0_values
        for words, found in ((NAME_LISTS, names), (UNIT_LISTS, units)):
            near = [
                (len(parent), sum(map(is_recognised, texts)), texts)
                for key, texts in lists.items()
                if len(texts) == len(members)
                and (words.fullmatch(_word(key)) or words is NAME_LISTS and key == pandas)
                and f"{base}.".startswith(f"{parent}." if (parent := key.strip(".").rpartition(".")[0]) else "")
            ]
            if near:
                chosen = max(near, key=lambda item: item[:2])[2]
                found.update((m, t) for m, t in zip(members, chosen, strict=True) if t)
    return names, units
