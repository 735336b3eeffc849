"""Cubic damper: a passive damper whose orifice hardens with speed.

    F = c*v + c3*v^3 + f0

v velocity (m/s), F force (N), c viscous damping (N*s/m), c3 cubic damping (N*s^3/m^3), f0 offset (N).

Source: none; an example.
"""

from mrfit.core.specs import Array, ModelSpec, Param
from mrfit.kernels.theta import evaluate

SPEC = ModelSpec(
    name="cubic-damper",
    title="Cubic damper",
    equation="F = c*v + c3*v^3 + f0",
    reference="an example",
    inputs=("velocity",),
    output="force",
    params=(
        Param("c", "N*s/m", 1.0, 1e5, 500.0, "log", "viscous", "viscous damping"),
        Param("c3", "N*s^3/m^3", 0.0, 1e6, 1000.0, text="cubic damping"),
        Param("f0", "N", -1e4, 1e4, 0.0, role="offset", text="offset"),
    ),
    linear=("c", "c3", "f0"),
)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of velocity (m/s), shape (1, N)."""
    return evaluate(_force, drive, theta)


def _force(v: Array, c: Array, c3: Array, f0: Array) -> Array:
    force: Array = c * v + c3 * v**3 + f0
    return force
