"""A quantity of a test sheet: its estimate with a unit, or the reason why a log does not allow it."""

from collections.abc import Mapping
from dataclasses import dataclass

from mrfit.measure.intervals import Estimate

SHEET_QUANTITIES: Mapping[str, tuple[str, str]] = {
    "F0+": ("N", "force at mid-stroke, positive velocity"),
    "F0-": ("N", "force at mid-stroke, negative velocity"),
    "Fd+": ("N", "force at the greatest displacement"),
    "Fd-": ("N", "force at the least displacement"),
    "Fmax+": ("N", "peak force, positive velocity"),
    "Fmax-": ("N", "peak force, negative velocity"),
    "ratio": ("", "peak force of rebound over that of compression"),
    "E": ("J", "energy per cycle"),
    "closure": ("", "work of the gap between begin and end of a cycle, over E"),
    "K_eff": ("N/m", "effective stiffness"),
    "xi_eff": ("", "effective damping ratio"),
    "C_eq": ("N*s/m", "equivalent viscous damping"),
    "efficiency": ("", "E over that of a rectangle, 4*Fmax*d"),
    "K_0": ("N/m", "elastic stiffness, by the slope of unloading"),
    "K_p": ("N/m", "post-yield stiffness, by the slope of unloading"),
    "F_y": ("N", "yield force, by the slope of unloading"),
    "d_y": ("m", "yield displacement, by the slope of unloading"),
    "K_0 initial": ("N/m", "elastic stiffness, by the initial loading"),
    "K_p peaks": ("N/m", "post-yield stiffness, by the peaks of cycles"),
    "F_y peaks": ("N", "yield force, by initial loading and peaks"),
    "d_y peaks": ("m", "yield displacement, by initial loading and peaks"),
    "friction": ("N", "half the height of a slow loop"),
    "gas force": ("N", "mean of slow forces at mid-stroke"),
    "gas rate": ("N/m", "slope of the mean of slow forces over the stroke"),
    "free travel": ("m", "travel about zero force after a reversal"),
    "ripple": ("", "largest ripple over a smooth loop, over the peak force"),
    "width+": ("N", "force while positive velocity rises less that while it falls"),
    "width-": ("N", "force while negative velocity rises less that while it falls"),
    "width v": ("m/s", "width of the loop over velocity at zero force"),
    "fade+": ("", "loss of peak force, positive velocity"),
    "fade-": ("", "loss of peak force, negative velocity"),
    "dead time up": ("s", "before the force answers a rise of the current"),
    "t63 up": ("s", "to 63 % after a rise of the current"),
    "t90 up": ("s", "to 90 % after a rise of the current"),
    "overshoot up": ("", "beyond the new level, over the step"),
    "dead time down": ("s", "before the force answers a fall of the current"),
    "t63 down": ("s", "to 63 % after a fall of the current"),
    "t90 down": ("s", "to 90 % after a fall of the current"),
    "overshoot down": ("", "beyond the new level, over the step"),
    "C+": ("N*(s/m)^alpha", "of F = C*v^alpha, positive velocity"),
    "C-": ("N*(s/m)^alpha", "of F = C*v^alpha, negative velocity"),
    "alpha+": ("", "exponent of velocity, positive velocity"),
    "alpha-": ("", "exponent of velocity, negative velocity"),
    "dynamic range": ("", "peak force at the greatest current over that at the least, means of both directions"),
}
"""Quantity -> unit and meaning, in the order of a sheet."""


@dataclass(frozen=True)
class Quantity:
    """A quantity with its estimate, or why there is none.

    Attributes
    ----------
    name
        A key of ``SHEET_QUANTITIES``.
    estimate
        Value with interval, SI.
    reason
        Why there is none; empty where there is one.
    late
        Value of a force that is one sample later, SI; None where it is not asked for.
    """

    name: str
    estimate: Estimate | None = None
    reason: str = ""
    late: float | None = None


def without(names: tuple[str, ...], reason: str) -> list[Quantity]:
    """Return quantities that a log does not allow, with the reason."""
    return [Quantity(name, None, reason) for name in names]
