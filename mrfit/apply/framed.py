"""Results of many samples, which a terminal or a notebook shows as their data frame."""

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pandas import DataFrame


class FramedResult(ABC):
    """A result whose text is that of its data frame, of which pandas leaves out most rows."""

    @abstractmethod
    def to_frame(self) -> "DataFrame":
        """Return it as a data frame."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}\n{self.to_frame()!r}"
