"""Widths of the bands of a predicted series."""

from dataclasses import dataclass

from mrfit.core.specs import Array


@dataclass(frozen=True)
class Width:
    """Half-widths of the 95 % bands of one segment, shape (N,).

    Attributes
    ----------
    parameters
        Of the model's output, for what the parameters leave open.
    whole
        Of a measured output.
    """

    parameters: Array
    whole: Array
