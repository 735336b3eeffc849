"""Current saturation: beyond some current the field, and with it the yield force, hardly grows.

    i_eff = i_s*tanh(i/i_s),    q = 1/i_s^2

i current (A), i_eff the current that the base sees (A), i_s saturation current (A), q its inverse square (1/A^2),
which is 0 where nothing saturates. q and not 1/i_s is the parameter because its first effect is q*i^3/3: the
sensitivity to q does not vanish at 0. Base parameters that are polynomials of current of order 2 or more take up most
of it.

Source: tanh is the Brillouin function of spin 1/2: J. M. D. Coey, Magnetism and Magnetic Materials (2010), ch. 4.
"""

from mrfit.kernels.filters import bent
from mrfit.specs import Array, EffectSpec, Param

SPEC = EffectSpec(
    name="current-saturation",
    title="Field saturating with current",
    equation="i_eff = i_s*tanh(i/i_s),  q = 1/i_s^2",
    reference="Brillouin function of spin 1/2, Coey, Magnetism and Magnetic Materials (2010), ch. 4",
    slot="input",
    outputs=("force", "torque"),
    inputs=("current",),
    params=(Param("q", "1/A^2", 0.0, 10.0, 0.0, text="inverse square of the saturation current"),),
    neutral=(0.0,),
    aliases=("temperature",),
    experiment="one sine at five or more constant currents up to the rated one, in random order, with the damper "
    "cooled to the same temperature before each",
)


def transform(channels: dict[str, Array], theta: Array, dt: float) -> dict[str, Array]:
    """Return the effective current in A, shape (N,); theta is (q,) in 1/A^2."""
    return {"current": bent(channels["current"], theta[:1])}
