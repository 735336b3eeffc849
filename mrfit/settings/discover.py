"""Settings of a discovery."""

from dataclasses import dataclass
from typing import Annotated

from mrfit.core.setting import Setting
from mrfit.settings.shared import CurrentOrder, DrivenBy, Jobs, Mass, Seed, Start


@dataclass(frozen=True)
class Settings:
    """Settings of a discovery.

    Attributes
    ----------
    model
        Base model; effects written with it (``tanh+delay``) are part of it.
    driven_by
        ``none``, or ``force`` or ``base``: that drives a mass on the model; its motion in, and what the excitation and
        its inertia leave of force out.
    mass
        Its mass in kg, or ``free``: every law is fitted with a mass of its own.
    current_order
        How the base's parameters depend on current: ``auto``, an order, or ``NAME=ORDER,…``.
    start
        The user's start values.
    formulas
        Whether a formula, and terms that the law lacks, are looked for where the verdict is ``unexplained``.
    seed
        Of every random choice.
    jobs
        Worker threads; the result does not depend on it.
    """

    model: Annotated[str, Setting("Base model; effects written with it (tanh+delay) are part of it.", names="model")]
    driven_by: DrivenBy = "none"
    mass: Mass = ""
    current_order: CurrentOrder = "auto"
    start: Start = ()
    formulas: Annotated[bool, Setting("Look for a formula, and what the law lacks, if no effect explains it.")] = False
    seed: Seed = 0
    jobs: Jobs = 1
