"""A check of one thing that an item has to keep, and what is said where it does not."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from mrfit.core.specs import Array

Item = TypeVar("Item")


class ContractBreach(Exception):
    """An item does not keep what it has to; the message says by how much, or where."""


@dataclass(frozen=True)
class Check(Generic[Item]):
    """One check.

    Attributes
    ----------
    text
        What has to hold, in one sentence.
    run
        Raises if it does not.
    applies
        Whether the item is one that it concerns.
    """

    text: str
    run: Callable[[Item], None]
    applies: Callable[[Item], bool] = lambda item: True

    @property
    def name(self) -> str:
        """Name of the function that checks."""
        return self.run.__name__


def check_of(run: Callable[[Item], None], applies: Callable[[Item], bool] = lambda item: True) -> Check[Item]:
    """Return a check whose text is the first line of the function's docstring."""
    return Check((run.__doc__ or "").partition("\n")[0], run, applies)


def need(holds: object, text: str) -> None:
    """Raise what is said where something does not hold.

    Raises
    ------
    ContractBreach
        If it does not.
    """
    if not holds:
        raise ContractBreach(text)


def need_close(found: Array, wanted: Array, share: float, floor: float, what: str) -> None:
    """Raise if values are further from those wanted than a share of these, and than ``floor``.

    Raises
    ------
    ContractBreach
        If they are, or their shapes differ; the message has the largest difference.
    """
    need(found.shape == wanted.shape, f"{what}: shape {found.shape} instead of {wanted.shape}")
    apart = np.abs(found - wanted)
    need(np.all(apart <= np.maximum(share * np.abs(wanted), floor)), f"{what}: off by up to {apart.max():.3g}")


def broken(check: Check[Item], item: Item) -> str:
    """Return the fault in one line; empty if the check holds. Warnings are wrong too: they reach the user."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            check.run(item)
        except ContractBreach as error:
            return str(error)
        except Exception as error:
            return f"{type(error).__name__}: {' '.join(str(error).split())}"
    return ""


def applying(checks: Sequence[Check[Item]], item: Item) -> list[Check[Item]]:
    """Return the checks that concern an item."""
    return [c for c in checks if c.applies(item)]
