"""Inputs that a causal differentiator gives, of a stroke or angle alone."""

from dataclasses import dataclass

from mrfit.core.channels import ANTIDERIVATIVES
from mrfit.export.source import ExportSource
from mrfit.export.text import field, number


@dataclass(frozen=True)
class Differentiator:
    """A differentiator: the channel it takes, and the fields it sets to the first and the second derivative."""

    channel: str
    source: str
    rate: str
    second: str
    tau: str

    @property
    def targets(self) -> list[str]:
        """The fields it sets."""
        return [name for name in (self.rate, self.second) if name]


def derived_of(source: ExportSource) -> tuple[str, dict[int, str]]:
    """Return the channel from which inputs can be derived, and these inputs by the order of the derivative."""
    found: dict[str, dict[int, str]] = {}
    for name in source.channels:
        for of, order in ANTIDERIVATIVES.get(name, ()):
            if of not in ANTIDERIVATIVES:
                found.setdefault(of, {})[order] = name
    return next(iter(found.items()), ("", {}))


def motion_of(source: ExportSource, tau: float) -> Differentiator | None:
    """Return the differentiator of a model, None where it has no use for one.

    It takes the stroke from the inputs; a model that does not use the stroke has it there for this alone.
    """
    channel, orders = derived_of(source)
    if not orders:
        return None
    return Differentiator(
        channel,
        field(channel),
        field(orders.get(1, "")) if 1 in orders else "",
        field(orders[2]) if 2 in orders else "",
        number(tau),
    )
