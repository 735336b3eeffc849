"""Saturation of the core: the inductance falls as the current grows.

    flux = flux_base(i_s*tanh(i/i_s)),    q = 1/i_s^2

i current (A), flux (Wb), i_s current at which the core saturates (A), q its inverse square (1/A^2), which is 0 for a
core that does not. q and not 1/i_s is the parameter because the flux bends by q*i^3/3 at first: its sensitivity to q
does not vanish at 0. Base models keep their hysteresis, driven by the bent current.

Source: tanh is the Brillouin function of spin 1/2: J. M. D. Coey, Magnetism and Magnetic Materials (2010), ch. 4.
"""

from mrfit.kernels.filters import bent
from mrfit.specs import Array, EffectSpec, Param

SPEC = EffectSpec(
    name="saturation",
    title="Saturation of the core",
    equation="flux = flux_base(i_s*tanh(i/i_s)),  q = 1/i_s^2",
    reference="Brillouin function of spin 1/2, Coey, Magnetism and Magnetic Materials (2010), ch. 4",
    slot="input",
    outputs=("flux",),
    inputs=("current",),
    params=(Param("q", "1/A^2", 0.0, 10.0, 0.0, text="inverse square of the saturation current"),),
    neutral=(0.0,),
    aliases=("boucwen-flux",),
    experiment="slow sines at several amplitudes up to the rated current: saturation flattens both branches of the "
    "loop near the peaks of the largest ones only, the knee of a hysteresis stays one turn-over current behind "
    "every reversal",
)


def transform(channels: dict[str, Array], theta: Array, dt: float) -> dict[str, Array]:
    """Return the current in A, shape (N,), that gives this flux without saturation; theta is (q,) in 1/A^2."""
    return {"current": bent(channels["current"], theta[0])}
