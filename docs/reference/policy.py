"""The table of a discovery's thresholds: value, meaning and what set it."""

from typing import Any

from docs.reference.markdown import plain, table
from mrfit.discover.policy import SECTIONS


def page() -> str:
    """Return the table."""
    rows = [
        [f"`{name}`", _text(own.value), plain(own.meaning), plain(own.what_set_it), plain(title)]
        for title, section in SECTIONS.items()
        for name, own in section.items()
    ]
    return table(("threshold", "value", "meaning", "what set it", "part of a discovery"), rows) + "\n"


def _text(value: Any) -> str:
    return ", ".join(f"{number:g}" for number in (value if isinstance(value, tuple) else (value,)))
