"""One item after the other, in this process."""

from collections.abc import Generator, Iterable
from typing import Any

from mrfit.core.executors.items import ItemEnd, Make, made_here
from mrfit.core.progress import Progress


class Serial:
    """Does everything here."""

    apart = False

    def ends(self, make: Make, items: Iterable[Any], progress: Progress) -> Generator[ItemEnd[Any], None, None]:
        """Yield the ends of the items in their order."""
        for place, item in enumerate(items):
            yield made_here(make, item, place, progress)
