"""Fits that were never fitted: models with chosen parameters on drives of known form, to be exported."""

from collections.abc import Mapping, Sequence

import numpy as np

from mrfit.core import registry
from mrfit.core.specs import Array, EffectSpec, ModelSpec
from mrfit.export.source import SOURCE_INPUTS, ExportSource, LogStretch
from mrfit.io.schemas.fit import Fit, MetricRow, Quantity, Result
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence

# Effects that are errors of a record, which have no form in C
RECORD = ("integrator-offset", "probe-skew", "resistance-error", "resistance-heating")
# Effects' parameters away from neutral: what a damper or coil may have; of others a tenth of the way to their bounds
STRENGTH: dict[str, tuple[float, ...]] = {
    "asymmetry": (0.3, -0.2, 0.02),
    "coulomb-friction": (60.0, 5e-4, 0.7, 3e-4),
    "current-filter": (0.02, 0.15, 0.3, 0.0053),
    "current-lag": (0.02, 0.0043),
    "current-saturation": (0.5, 2.5),
    "delay": (0.0123, 0.3),
    "end-stop": (5e4, 0.006, 0.001, 1.5),
    "force-filter": (0.01, 0.5, 0.25, 0.125, 0.375, 0.7),
    "force-offset": (25.0,),
    "gain-drift": (0.05,),
    "gas-spring": (3000.0, 4.0),
    "inertia": (2.5,),
    "quadratic-drag": (900.0, 0.02),
    "relief-valve": (0.4, 0.2, 150.0, 500.0),
    "residual-magnetism": (0.1,),
    "slow-release": (0.4, 0.05),
    "stribeck": (40.0, 0.03, 1.5, 5e-4, 0.4, 3e-4),
    "temperature": (0.01, 0.006),
    "temperature-polynomial": (-0.4, 0.2, -0.1),
    "velocity-hysteresis": (3.0, 0.01),
    "eddy-current": (0.4,),
    "saturation": (300.0, 2.0),
}


def channels(seconds: float, dt: float) -> dict[str, Array]:
    """Every channel, smooth, with a stroke of two sines; current and temperature move."""
    t = dt * np.arange(int(round(seconds / dt)) + 1)
    x, v, a = (np.zeros(len(t)) for _ in range(3))
    for frequency, share, phase in ((2.0, 0.8, 0.3), (5.3, 0.2, 0.7)):
        w = 2 * np.pi * frequency
        x += share * np.sin(w * t + phase)
        v += share * w * np.cos(w * t + phase)
        a -= share * w**2 * np.sin(w * t + phase)
    return {
        "displacement": 0.01 * x,
        "velocity": 0.01 * v,
        "acceleration": 0.01 * a,
        "angle": 0.3 * x,
        "angular_velocity": 0.3 * v,
        "angular_acceleration": 0.3 * a,
        "current": 0.8 + 0.7 * np.sin(2 * np.pi * 1.7 * t),
        "flux": 0.03 * x,
        "temperature": 25.0 + 30.0 * t / t[-1],
        "time": t,
        "flux_resistance": np.zeros(len(t)),
        "heat_before": np.zeros(len(t)),
    }


def stretch(names: Sequence[str], signals: Mapping[str, Array], output: Array, dt: float) -> LogStretch:
    inputs = {n: signals[n] for n in names if n not in SOURCE_INPUTS}
    return LogStretch("log#0", "test", "train", dt, inputs, output, output, inputs)


def effects_of(base: ModelSpec) -> list[str]:
    """Effects that act on what a base gives, and have a form in C."""
    found = [registry.load("effect", n).SPEC for n in registry.names("effect") if n not in RECORD]
    return [s.name for s in found if base.output in s.outputs]


def rig(
    model: str,
    dependence: CurrentDependence | None = None,
    seconds: float = 1.0,
    dt: float = 1e-3,
    changes: Mapping[str, float] | None = None,
    name: str = "",
) -> ExportSource:
    """A source of the model's own start values, its effects as in ``STRENGTH``."""
    assembly = assemble(model, dependence)
    modules = [registry.load("effect", e).SPEC for e in model.split("+")[1:]]
    specs: list[EffectSpec] = sorted(modules, key=lambda s: s.place)
    own = [v for s in specs for v in STRENGTH.get(s.name) or away(s)]
    theta = np.array([*assembly.spec.start[: len(assembly.spec.params) - len(own)], *own])
    idle = theta == 0.0
    idle[len(theta) - len(own) :] = False
    reach = np.array([p.high for p in assembly.spec.params])
    theta = np.where(idle, 3e-4 * reach * np.cos(np.arange(len(theta))), theta)
    theta = theta * np.where(np.arange(len(theta)) < len(theta) - len(own), slope(len(theta)), 1.0)
    for key, value in (changes or {}).items():
        theta[assembly.spec.names.index(key)] = value
    signals = channels(seconds, dt)
    drive = np.stack([signals[n] for n in assembly.spec.inputs])
    output = assembly.simulate(drive, theta[None], dt)[0]
    row = MetricRow(condition="all", role="holdout", samples=len(output), rmse=1.0, nrmse=0.01)
    parameters = [Quantity(name=n, value=float(v)) for n, v in zip(assembly.spec.names, theta, strict=True)]
    content = Fit(
        name=name or model.replace("+", "."),
        model=model,
        optimizer="none",
        output=assembly.spec.output,
        metrics=[row],
        results=[Result(condition="all", evaluations=0, parameters=parameters)],
    )
    stretches = (stretch(assembly.spec.inputs, signals, output, dt),)
    return ExportSource(content, assembly, "all", theta, stretches)


def away(spec: EffectSpec) -> tuple[float, ...]:
    """Parameters a tenth of the way from neutral to their upper bounds."""
    return tuple(0.9 * n + 0.1 * p.high for n, p in zip(spec.neutral, spec.params, strict=True))


def slope(count: int) -> Array:
    """Factors near 1, so that values at several currents differ."""
    return 1.0 + 0.3 * np.sin(1.0 + 2.0 * np.arange(count))
