"""Settings of the flux stage."""

from dataclasses import dataclass, replace
from typing import Annotated, Literal, get_args

from mrfit.core.setting import Setting
from mrfit.settings.shared import RESISTANCE

Drift = Literal["cycle", "linear", "none"]
Rule = Literal["trapezoid", "simpson"]
DRIFTS, RULES = get_args(Drift), get_args(Rule)


@dataclass(frozen=True, slots=True)
class Settings:
    """Settings of the reconstruction of flux linkage.

    Attributes
    ----------
    resistance
        Coil resistance in Ω for all recordings, ``auto`` to estimate it from the data, or None for each recording's own
        (from the channel map) and ``auto`` for those without.
    drift
        ``cycle``, ``linear`` or ``none``.
    rule
        ``trapezoid`` or ``simpson``.
    fallback
        Resistance in Ω for recordings without their own, instead of estimating it.
    """

    # a pipeline file has it in [ingest]
    resistance: Annotated[float | Literal["auto"] | str | None, replace(RESISTANCE, in_file=False)] = None
    drift: Annotated[Drift, Setting("How drift is removed: cycle, linear or none.")] = "cycle"
    rule: Annotated[Rule, Setting("Integration rule: trapezoid or simpson.")] = "trapezoid"
    fallback: float | None = None
