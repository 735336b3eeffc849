"""Saturation of the core: the inductance falls as the flux grows, and the loop closes.

    flux = flux_base/(1 + |flux_base/flux_s|^p)^(1/p),    q = 1/flux_s^2

flux (Wb), flux_s flux linkage at which the core saturates (Wb), q its inverse square (1/Wb^2), which is 0 for a core
that does not, p sharpness of the knee (1): 1 for Froehlich's curve, 2 to 4 as tanh. p does nothing while q is 0. q and
not 1/flux_s is the parameter because with p = 2 the flux bends by q*flux^3/2 at first: its sensitivity to q does not
vanish at 0. The base's whole flux is bent, hysteresis included: a saturated core has no loop.

Source: O. Froehlich, Elektrotechnische Zeitschrift 2 (1881) 134 (p = 1); tanh is the Brillouin function of spin 1/2:
J. M. D. Coey, Magnetism and Magnetic Materials (2010), ch. 4.
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Param, Programme
from mrfit.kernels.theta import columns

SPEC = EffectSpec(
    name="saturation",
    title="Saturation of the core",
    equation="flux = flux_base/(1 + |flux_base/flux_s|^p)^(1/p),  q = 1/flux_s^2",
    reference="Froehlich (1881), with the sharpness of the knee left open",
    slot="output",
    outputs=("flux",),
    inputs=(),
    params=(
        Param("q", "1/Wb^2", 0.0, 1e4, 0.0, text="inverse square of the flux at which the core saturates"),
        Param("p", "1", 1.0, 16.0, 2.0, "linear", "shape", "sharpness of the knee"),
    ),
    neutral=(0.0, 2.0),
    aliases=("boucwen-flux",),
    experiment="slow sines at several amplitudes up to the rated current: saturation flattens both branches of the "
    "loop near the peaks of the largest ones only, the knee of a hysteresis stays one turn-over current behind every "
    "reversal",
    asks=(Programme(amplitudes=3),),
)


def law(flux: Array, q: Array, p: Array) -> Array:
    """Return the saturated flux in Wb of numbers or arrays that broadcast."""
    saturated: Array = flux / (1.0 + (np.sqrt(q) * np.abs(flux)) ** p) ** (1.0 / p)
    return saturated


def shape(output: Array, channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the saturated flux in Wb, shape (P, N), of q in 1/Wb^2 and p, theta (P, 2)."""
    return law(output, *columns(theta))
