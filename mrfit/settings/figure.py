"""Settings of a figure for print."""

from dataclasses import dataclass
from typing import Annotated, Literal

from mrfit.core.setting import Setting
from mrfit.settings.forms import LISTED, NAMES, Names

FIGURE_KINDS = ("loops", "parameters", "predicted", "correlation", "starts", "profiles")


@dataclass(frozen=True)
class Settings:
    """Settings of a figure.

    Attributes
    ----------
    fits
        Names of fits; empty for all finished ones.
    conditions
        Patterns on conditions; empty for all that have room, some of every error of more.
    overlay
        What shares axes: ``conditions``, ``fits`` or ``none``.
    over
        Channel of loops, or quantity of parameters; empty for the usual one.
    width
        Width in print, as ``84mm``.
    formats
        ``pdf``, ``svg``, ``png``.
    """

    fits: Annotated[tuple[str, ...], Setting("Fit to draw; default: all.", flag="fit", form=LISTED)] = ()
    conditions: Annotated[tuple[str, ...], Setting("Pattern on conditions.", flag="condition", form=LISTED)] = ()
    overlay: Annotated[Literal["none", "conditions", "fits"], Setting("What shares the axes of loops.")] = "none"
    over: Annotated[str, Setting("Channel of loops, or current, temperature, frequency, amplitude.")] = ""
    width: Annotated[str, Setting("Width in print, 84mm for a column, 174mm for a page.")] = "84mm"
    formats: Annotated[Names, Setting("Formats by commas: pdf, svg, png.", flag="format", form=NAMES)] = ("pdf", "svg")
