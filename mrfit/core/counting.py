"""Numbers of things in words."""


def number_of(what: str, number: int, several: str = "") -> str:
    """Return a number of things, as ``1 log`` or ``2 logs``; ``several`` is a plural that does not end so."""
    return f"{number} {what if number == 1 else several or what + 's'}"
