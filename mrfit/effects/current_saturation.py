"""Current saturation: beyond some current the field, and with it the yield force, hardly grows.

    i_eff = i/(1 + |i/i_s|^p)^(1/p),    q = 1/i_s^2

i current (A), i_eff the current that the base sees (A), i_s saturation current (A), q its inverse square (1/A^2),
which is 0 where nothing saturates, p sharpness of the knee (1): 1 for Froehlich's curve, 2 to 4 as tanh. p does
nothing while q is 0. q and not 1/i_s is the parameter because with p = 2 its first effect is q*i^3/2: the sensitivity
to q does not vanish at 0. Base parameters that are polynomials of current of order 2 or more take up most
of it.

Source: O. Froehlich, Elektrotechnische Zeitschrift 2 (1881) 134 (p = 1); tanh is the Brillouin function of spin 1/2:
J. M. D. Coey, Magnetism and Magnetic Materials (2010), ch. 4.
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Param, Programme

SPEC = EffectSpec(
    name="current-saturation",
    title="Field saturating with current",
    equation="i_eff = i/(1 + |i/i_s|^p)^(1/p),  q = 1/i_s^2",
    reference="Froehlich (1881), with the sharpness of the knee left open",
    slot="input",
    outputs=("force", "torque"),
    inputs=("current",),
    params=(
        Param("q", "1/A^2", 0.0, 10.0, 0.0, text="inverse square of the saturation current"),
        Param("p", "1", 1.0, 16.0, 2.0, "linear", "shape", "sharpness of the knee"),
    ),
    neutral=(0.0, 2.0),
    aliases=("temperature",),
    experiment="one sine at five or more constant currents up to the rated one, in random order, with the damper "
    "cooled to the same temperature before each",
    asks=(Programme(currents=5),),
)


def law(i: Array, q: Array, p: Array) -> Array:
    """Return the effective current in A of numbers or arrays that broadcast."""
    effective: Array = i / (1.0 + (np.sqrt(q) * np.abs(i)) ** p) ** (1.0 / p)
    return effective


def transform(channels: dict[str, Array], theta: Array, dt: float) -> dict[str, Array]:
    """Return the effective current in A, shape (N,); theta is (q, p), q in 1/A^2."""
    return {"current": law(channels["current"], *theta)}
