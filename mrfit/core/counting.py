"""Numbers of things in words."""


def number_of(what: str, number: int) -> str:
    """Return a number of things, as ``1 log`` or ``2 logs``."""
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
