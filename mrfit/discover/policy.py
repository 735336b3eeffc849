"""Every threshold of a discovery: its value, what it means and what set it, from ``thresholds.toml``."""

import tomllib
from dataclasses import dataclass, make_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any


@dataclass(frozen=True)
class Threshold:
    """A number that decides, or several."""

    value: Any
    meaning: str
    what_set_it: str


def _read() -> dict[str, dict[str, Threshold]]:
    sections = tomllib.loads(Path(__file__).with_name("thresholds.toml").read_text(encoding="utf-8"))
    return {
        title: {
            name: Threshold(tuple(value) if isinstance(value, list) else value, *words)
            for name, (value, *words) in rows.items()
        }
        for title, rows in sections.items()
    }


SECTIONS = _read()
"""Thresholds by section and name."""
_TABLE = [(name, Any, own.value) for rows in SECTIONS.values() for name, own in rows.items()]

if TYPE_CHECKING:

    @dataclass(frozen=True)
    class Policy:
        """All thresholds, by name."""

        def __getattr__(self, name: str) -> Any: ...

else:
    Policy = make_dataclass("Policy", _TABLE, frozen=True, namespace={"__doc__": "All thresholds, by name."})
STANDARD = Policy()
