"""Speed of every model in ns per (parameter vector x sample), beside what a user would write, in one run.

Run: python benchmarks/models_speed.py [samples]. Ratios hold within a run only.
"""

import ctypes
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import odeint

from mrfit.core import registry

SAMPLES = int(sys.argv[1]) if len(sys.argv) > 1 else 20_000
VECTORS, CYCLES, FREQUENCY = 16, 10, 2.0
T = np.linspace(0, CYCLES / FREQUENCY, SAMPLES)
DT, W = float(T[1]), 2 * np.pi * FREQUENCY


def channels() -> dict[str, np.ndarray]:
    x, v, a = np.sin(W * T), W * np.cos(W * T), -(W**2) * np.sin(W * T)
    made = {
        "displacement": 0.01 * x,
        "velocity": 0.01 * v,
        "acceleration": 0.01 * a,
        "flux": 0.05 * x,
        "current": 2 * x,
    }
    return made | {"angle": 0.3 * x, "angular_velocity": 0.3 * v, "angular_acceleration": 0.3 * a}


def fastest(run: Callable[[], object], repeats: int = 7) -> float:
    """Return the least processor seconds of some repeats, after one to compile and warm up."""
    run()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return min(times)


def batch(name: str) -> tuple[np.ndarray, np.ndarray, Callable[..., np.ndarray]]:
    model = registry.load("model", name)
    made = channels()
    theta = model.SPEC.start * np.exp(0.02 * np.random.default_rng(0).normal(size=(VECTORS, len(model.SPEC.params))))
    low, high = np.array([(p.low, p.high) for p in model.SPEC.params]).T
    return np.stack([made[c] for c in model.SPEC.inputs]), np.clip(theta, low, high), model.response


def every_model() -> dict[str, float]:
    print(
        f"{SAMPLES} samples, {VECTORS} vectors\n{'model':34s}{'batch':>10s}{'single':>10s}   ns per vector and sample"
    )
    found = {}
    for name in registry.names("model"):
        drive, theta, response = batch(name)
        found[name] = fastest(lambda: response(drive, theta, DT)) / VECTORS / SAMPLES * 1e9  # noqa: B023
        single = fastest(lambda: response(drive, theta[:1], DT)) / SAMPLES * 1e9  # noqa: B023
        print(f"{name:34s}{found[name]:10.2f}{single:10.2f}")
    return found


def python_flux(current: np.ndarray, theta: np.ndarray) -> np.ndarray:
    A, Lc, kappa, beta, gamma, n, D = theta.tolist()
    z, out = 0.0, [A * Lc * current[0]]
    for before, now in zip(current[:-1].tolist(), current[1:].tolist(), strict=True):
        d = now - before

        def growth(z: float, d: float = d) -> float:
            size = abs(z)
            return kappa * d - beta * d * size**n - gamma * abs(d) * (size**n if z > 0 else -(size**n))

        k1 = growth(z)
        z += 0.5 * (k1 + growth(z + k1))
        out.append(A * Lc * now + (1 - A) * Lc / D * z)
    return np.array(out)


def numpy_flux(current: np.ndarray, theta: np.ndarray) -> np.ndarray:
    A, Lc, kappa, beta, gamma, n, D = theta.T
    z, out = np.zeros(len(theta)), np.empty((len(current), len(theta)))
    out[0] = A * Lc * current[0]

    def growth(z: np.ndarray, d: float) -> np.ndarray:
        size = np.abs(z) ** n
        return kappa * d - beta * d * size - gamma * abs(d) * np.sign(z) * size

    for j in range(1, len(current)):
        d = current[j] - current[j - 1]
        k1 = growth(z, d)
        z = z + 0.5 * (k1 + growth(z + k1, d))
        out[j] = A * Lc * current[j] + (1 - A) * Lc / D * z
    return out.T


def odeint_flux(theta: np.ndarray) -> np.ndarray:
    _, _, kappa, beta, gamma, n, _ = theta.tolist()

    def rate(z: np.ndarray, t: float) -> float:
        d, size = 2 * W * np.cos(W * t), abs(z[0])
        return kappa * d - beta * d * size**n - gamma * abs(d) * np.sign(z[0]) * size**n

    return odeint(rate, 0.0, T, rtol=1e-6, atol=1e-9)


def odeint_spencer(theta: np.ndarray) -> np.ndarray:
    c0, c_inf, _, k_inf, alpha, growth, beta, gamma, n, _ = theta.tolist()

    def rate(s: list[float], t: float) -> list[float]:
        u = (c0 * 0.01 * W * np.cos(W * t) - alpha * s[1] - k_inf * s[0]) / (c0 + c_inf)
        size = abs(s[1])
        return [u, growth * u - beta * u * size**n - gamma * abs(u) * np.sign(s[1]) * size**n]

    return odeint(rate, [0.0, 0.0], T, rtol=1e-6, atol=1e-9)


def compiled() -> ctypes.CDLL | None:
    """Return the C reference, or None where there is no C compiler."""
    compiler = shutil.which("cc")
    if not compiler:
        return None
    folder = tempfile.mkdtemp()
    library = Path(folder) / "reference.so"
    source = Path(__file__).with_name("models_reference.c")
    flags = ["-O3", "-march=native", "-mprefer-vector-width=512", "-ffast-math", "-shared", "-fPIC"]
    subprocess.run([compiler, *flags, str(source), "-o", str(library), "-lm"], check=True)
    return ctypes.CDLL(str(library))


def pointer(values: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(values.ctypes.data)


def c_times(reference: ctypes.CDLL) -> dict[str, tuple[str, float]]:
    """Return for each C function the model it stands for and its ns per vector and sample."""
    made, count, out = channels(), ctypes.c_long(SAMPLES), np.empty((8, SAMPLES))
    x, v, current = made["displacement"], made["velocity"], made["current"]
    flux, spencer, tanh = (np.ascontiguousarray(batch(n)[1][:8]) for n in ("boucwen-flux", "spencer", "tanh"))
    flux_lanes, spencer_lanes = np.ascontiguousarray(flux.T), np.ascontiguousarray(spencer.T)
    run = {
        "flux_heun": ("boucwen-flux", 1, (pointer(current), count, pointer(flux), pointer(out))),
        "flux_heun_lanes": ("boucwen-flux", 8, (pointer(current), count, pointer(flux_lanes), pointer(out))),
        "spencer_lanes": (
            "spencer",
            8,
            (pointer(x), pointer(v), count, ctypes.c_double(DT), pointer(spencer_lanes), pointer(out)),
        ),
        "tanh_model": ("tanh", 1, (pointer(x), pointer(v), count, pointer(tanh), pointer(out))),
    }
    return {
        name: (model, fastest(lambda: getattr(reference, name)(*arguments)) / vectors / SAMPLES * 1e9)  # noqa: B023
        for name, (model, vectors, arguments) in run.items()
    }


def main() -> None:
    ours = every_model()
    current, theta = channels()["current"], batch("boucwen-flux")[1]
    short = current[:2000]
    rows = {
        "Python loop, Heun": ("boucwen-flux", fastest(lambda: python_flux(short, theta[0]), 3) / 2000 * 1e9),
        "numpy over the vectors, Heun": (
            "boucwen-flux",
            fastest(lambda: numpy_flux(short, theta), 3) / 2000 / VECTORS * 1e9,
        ),
        "scipy odeint, rtol 1e-6": ("boucwen-flux", fastest(lambda: odeint_flux(theta[0]), 2) / SAMPLES * 1e9),
        "scipy odeint, rtol 1e-6 ": (
            "spencer",
            fastest(lambda: odeint_spencer(batch("spencer")[1][0]), 2) / SAMPLES * 1e9,
        ),
    }
    reference = compiled()
    if reference:
        rows |= {f"C {name}": found for name, found in c_times(reference).items()}
    print(f"\n{'written as':34s}{'model':>16s}{'ns':>10s}{'times ours':>12s}")
    for name, (model, spent) in rows.items():
        print(f"{name:34s}{model:>16s}{spent:10.2f}{spent / ours[model]:12.2f}")


if __name__ == "__main__":
    main()
