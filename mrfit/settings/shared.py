"""Settings of several stages."""

import os
from typing import Annotated, Literal

from mrfit.core.setting import Setting
from mrfit.settings.forms import NUMBER_OR_WORD, NUMBERS, OHMS, ORDER_FORM, Pairs

CORES = os.cpu_count() or 1
READ_BY_PROCESSES = 64
"""Logs from which on processes save more time than their start takes; threads read few short ones at once."""

Jobs = Annotated[
    int,
    Setting(
        "Workers; does not change the result.",
        short="-j",
        low=1,
        command_default=CORES,
        changes_result=False,
        told=None,
    ),
]
Seed = Annotated[int, Setting("Seed of every random choice.", low=0, told=None)]
RESISTANCE = Setting(
    "Coil resistance in ohm, or 'auto' to estimate it; later commands of the workspace keep it.",
    metavar="OHM|auto",
    form=OHMS,
)
Resistance = Annotated[float | Literal["auto"] | None, RESISTANCE]
Start = Annotated[
    Pairs,
    Setting(
        "Change a start value; several by commas.", metavar="NAME=VALUE", form=NUMBERS, told="{0} started at {1:g}"
    ),
]
DrivenBy = Annotated[
    Literal["none", "force", "base"],
    Setting("Excitation that moves a mass on the model: force in, or base acceleration in, motion out."),
]
Mass = Annotated[str, Setting("Mass in kg that is driven, or free to fit it.", metavar="KG|free", form=NUMBER_OR_WORD)]
CurrentOrder = Annotated[
    str,
    Setting(
        "Order 0-4 of parameters in current, for all or by name; 1:0.2:2 is order 1 to 0.2 A and 2 from there, "
        "meeting, 1/0.2/2 lets them jump.",
        metavar="auto|ORDER|NAME=ORDER,…",
        form=ORDER_FORM,
    ),
]
