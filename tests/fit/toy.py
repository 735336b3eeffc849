"""A model linear in its parameters, whose fits have closed forms."""

from dataclasses import replace

import numpy as np

from mrfit.core.recording import Segment
from mrfit.core.specs import Array, ModelSpec, Param
from mrfit.search.cube import Cube, cube_of
from mrfit.search.parts import SegmentPart
from mrfit.search.problem import SegmentBlock
from mrfit.signal.smoothing import Drive
from mrfit.simulate.assembly import Assembly

DT = 1e-3


def segment(samples: int, cycles: int = 0, role: str = "train") -> Segment:
    """A test at 1 A, of so many cycles."""
    nan = float("nan")
    frequency = cycles / (samples * DT) if cycles else 0.0
    return Segment("s#1", "s", "s", 0, samples, 0, "sine", "current", frequency, 1.0, 0.0, cycles, nan, nan, role)


def linear_model(*roles: str) -> tuple[Assembly, Cube]:
    """Σ_k p_k·u_k for inputs u_0 … u_K-1 and parameters p_0 … p_K-1 in -1 … 1."""
    names = [f"u{k}" for k in range(len(roles))]
    params = tuple(Param(f"p{k}", "N", -1.0, 1.0, 0.0, role=role) for k, role in enumerate(roles))
    spec = ModelSpec("toy", "toy", "", "", tuple(names), "force", params)

    def simulate(drive: Array, theta: Array, dt: float) -> Array:
        return theta @ drive

    return (
        Assembly("toy", spec, simulate, lambda theta: np.empty((len(theta), 0)), lambda drive, output, dt: {}),
        cube_of(spec, {}, {}, {}),
    )


def block(drive: Array, target: Array, cycles: int = 0) -> SegmentBlock:
    """A full block without warm-up."""
    samples = len(target)
    return SegmentBlock(
        segment=segment(samples, cycles),
        drive=np.ascontiguousarray(drive),
        dt=DT,
        target=target,
        nodes=np.arange(samples)[:, None],
        weights=np.ones((samples, 1)),
        counts=np.ones(samples),
        scatter=0.0,
        method="as recorded",
    )


def part(drive: Array, target: Array, condition: str = "s", cycles: int = 0, role: str = "train") -> SegmentPart:
    """A part of a test, driven as recorded."""
    own = replace(segment(len(target), cycles, role), condition=condition, id=f"{condition}#1")
    return SegmentPart(own, Drive(np.ascontiguousarray(drive), 0, DT, "as recorded", {}, None), target)


def coloured(rng: np.random.Generator, samples: int, rho: float) -> Array:
    """AR(1) noise of unit variance."""
    noise = rng.standard_normal(samples) * np.sqrt(1 - rho**2)
    noise[0] = rng.standard_normal()
    for k in range(1, samples):
        noise[k] += rho * noise[k - 1]
    return noise
