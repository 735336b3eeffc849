"""Numbers of things in words."""

from collections.abc import Sequence


def number_of(what: str, number: int, several: str = "") -> str:
    """Return a number of things, as ``1 log`` or ``2 logs``; ``several`` is a plural that does not end so."""
    return f"{number} {what if number == 1 else several or what + 's'}"


def few(names: Sequence[object], most: int = 12, between: str = ", ") -> str:
    """Return the first names of several, and how many more there are."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return between.join(map(str, names[:most])) + more
