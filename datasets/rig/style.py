"""How a lab writes down one and the same test: noise, columns, units, signs, rate, file names."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

DAMPER_COLUMNS = ("Displacement", "Load", "Current", "Temperature")


@dataclass(frozen=True, slots=True)
class Style:
    """Everything about the files that must not change a verdict, and the noise, which must not either.

    Attributes
    ----------
    noise
        Kind of noise, one of ``noise.KINDS``.
    columns
        Columns of a damper log beside time.
    other_units
        Inches, pounds-force and degrees Fahrenheit (damper) or milliamperes (coil) instead of the usual units.
    sign
        -1 turns every sensor round: motion and force, or voltage, current and flux.
    stride
        Every stride-th sample is written.
    renamed
        Files get names that say nothing and come in another order.
    testsuite
        Damper logs as MTS TestSuite exports them (tabs, time last, lines of text first) instead of CSV.
    integrator
        A coil log has a third channel, an electronic integrator's flux linkage.
    """

    noise: str = "white"
    columns: tuple[str, ...] = DAMPER_COLUMNS
    other_units: bool = False
    sign: float = 1.0
    stride: int = 1
    renamed: bool = False
    testsuite: bool = False
    integrator: bool = False

    def names(self, given: Sequence[str]) -> list[str]:
        """Return the file names, without ending, of logs in their order."""
        if not self.renamed:
            return list(given)
        order = np.random.default_rng(len(given)).permutation(len(given))
        return [f"log{k:02d}" for k in order]
