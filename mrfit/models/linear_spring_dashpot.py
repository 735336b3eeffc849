"""Linear spring beside a dashpot.

    F = f0 + k*x + c*v

x displacement (m), v velocity (m/s), F force (N), k stiffness (N/m), c damping (N*s/m), f0 offset (N).

Source: Kelvin-Voigt element, in any textbook of vibration.
"""

from mrfit.core.specs import Array, ModelSpec, Param
from mrfit.kernels.theta import evaluate

SPEC = ModelSpec(
    name="linear-spring-dashpot",
    title="Linear spring beside a dashpot",
    equation="F = f0 + k*x + c*v",
    reference="Kelvin-Voigt element",
    inputs=("displacement", "velocity"),
    output="force",
    params=(
        Param("k", "N/m", 1e-2, 1e9, 1e4, "log", "stiffness", "stiffness"),
        Param("c", "N*s/m", 1e-2, 1e7, 100.0, "log", "viscous", "damping"),
        Param("f0", "N", -1e5, 1e5, 0.0, "linear", "offset", "offset of the force"),
    ),
    linear=("k", "c", "f0"),
)


def law(x: Array, v: Array, k: Array, c: Array, f0: Array) -> Array:
    """Return the force in N of numbers or arrays that broadcast."""
    return f0 + k * x + c * v


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of displacement (m) and velocity (m/s), shape (2, N); dt does not enter."""
    return evaluate(law, drive, theta)
