"""Entry point of a printed program: a function of Python whose arguments are found in those that are printed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from mrfit.export.printer import ir


@dataclass
class EntryPoint:
    """A function that the program begins with: how its arguments in Python are found in those that are printed.

    Attributes
    ----------
    arguments
        Those that are printed; those that are not needed are left out.
    bound
        What stands for every argument in Python.
    destinations
        Where the values go that it returns, None for the one that is the function's own.
    title
        Lines of comment above it.
    after
        What else is remembered as it ends, where its body mentions the place, or ``always``.
    tables
        What stands for arrays of all channels or parameters, of a function of whole arrays.
    factors
        Whether the destinations are multiplied by the values.
    calls
        What stands for calls of arguments that are functions.
    """

    arguments: list[ir.Argument]
    bound: dict[str, ir.Expression]
    destinations: list[ir.Place | None]
    title: tuple[str, ...]
    after: list[tuple[ir.Place, ir.Expression]] = field(default_factory=list)
    always: bool = False
    tables: Mapping[str, Mapping[str, ir.Expression] | ir.Values] = field(default_factory=dict)
    factors: bool = False
    calls: Mapping[str, Callable[..., ir.Call]] = field(default_factory=dict)
