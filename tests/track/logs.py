"""Logs of a damper whose law is written here in numpy, and a fit of it of known parameters and covariance."""

import numpy as np

from mrfit.core.specs import Array
from mrfit.export.source import ExportSource, LogStretch
from mrfit.io.schemas.fit import Covariance, Fit, MetricRow, Quantity, Result
from mrfit.simulate.assembly import assemble

DT = 1e-3
NOISE = 8.0
VALUES = {"fy": 800.0, "a1": 60.0, "a2": 40.0, "c": 700.0, "k": 900.0, "f0": 40.0}
# Standard deviations of the fit, as shares of the values
SHARE = 0.01


def motion(seconds: float, seed: int = 0) -> dict[str, Array]:
    """Displacement and velocity of three sines of random phases."""
    t, rng = DT * np.arange(round(seconds / DT)), np.random.default_rng(seed)
    x, v = np.zeros(len(t)), np.zeros(len(t))
    for frequency, amplitude in ((0.7, 8e-3), (1.9, 4e-3), (4.3, 1e-3)):
        w, phase = 2 * np.pi * frequency, rng.uniform(0, 2 * np.pi)
        x, v = x + amplitude * np.sin(w * t + phase), v + amplitude * w * np.cos(w * t + phase)
    return {"displacement": x, "velocity": v}


def columns(channels: dict[str, Array]) -> dict[str, Array]:
    """What each of the linear parameters is multiplied by in the law."""
    x, v = channels["displacement"], channels["velocity"]
    loop = np.tanh(VALUES["a1"] * v + VALUES["a2"] * x)
    return {"fy": loop, "c": v, "k": x, "f0": np.ones(len(x))}


def force(channels: dict[str, Array], seed: int | None = None, **values: float | Array) -> Array:
    """The force, with noise where a seed is given; parameters may move along the log."""
    clean: Array = sum(values.get(n, VALUES[n]) * column for n, column in columns(channels).items())  # type: ignore[assignment]
    return clean if seed is None else clean + NOISE * np.random.default_rng(seed).standard_normal(len(clean))


def fitted(name: str = "tanh.test") -> ExportSource:
    """The fit, at its true values."""
    assembly, channels = assemble("tanh"), motion(4.0)
    measured = force(channels, 1)
    rows = np.diag([(SHARE * (1.0 if p.scale == "log" else VALUES[p.name])) ** 2 for p in assembly.spec.params])
    covariance = Covariance(
        names=list(VALUES),
        roles=[p.role for p in assembly.spec.params],
        log=[p.scale == "log" for p in assembly.spec.params],
        rows=rows.tolist(),
        degrees=1000.0,
    )
    parameters = [Quantity(name=n, value=v) for n, v in VALUES.items()]
    content = Fit(
        name=name,
        model="tanh",
        optimizer="none",
        output="force",
        metrics=[MetricRow(condition="all", role="train", samples=len(measured), rmse=NOISE)],
        results=[Result(condition="all", evaluations=0, parameters=parameters, covariance=covariance)],
    )
    log = LogStretch("log#0", "test", "train", DT, channels, measured, force(channels), channels)
    return ExportSource(content, assembly, "all", np.array(list(VALUES.values())), (log,))
