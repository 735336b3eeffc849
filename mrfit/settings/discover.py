"""Settings of a discovery."""

from dataclasses import dataclass
from typing import Annotated

from mrfit.core.setting import Setting
from mrfit.settings.shared import CurrentOrder, Jobs, Seed, Start


@dataclass(frozen=True)
class Settings:
    """Settings of a discovery.

    Attributes
    ----------
    model
        Base model; effects written with it (``tanh+delay``) are part of it.
    current_order
        How the base's parameters depend on current: ``auto``, an order, or ``NAME=ORDER,…``.
    start
        The user's start values.
    seed
        Of every random choice.
    jobs
        Worker threads; the result does not depend on it.
    """

    model: Annotated[str, Setting("Base model; effects written with it (tanh+delay) are part of it.", names="model")]
    current_order: CurrentOrder = "auto"
    start: Start = ()
    seed: Seed = 0
    jobs: Jobs = 1
