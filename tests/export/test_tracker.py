"""The tracker in C: equal to that in Python, under a strict compiler and its sanitizers, in double and in float."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.core.specs import Array
from mrfit.errors import ConfigError
from mrfit.export.c import built, tracker_files, user_inputs
from mrfit.export.c_parts import parts_of
from mrfit.export.causality import Cost
from mrfit.export.compiler import compiler
from mrfit.export.source import ExportSource
from mrfit.export.tracker import plan_of
from mrfit.simulate.current_dependence import CurrentDependence, orders_of
from mrfit.track.run import track_log
from tests.export.rigs import channels, rig
from tests.export.test_c import STRICT

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")

NOISE, DT = 8.0, 1e-3
# A shape is not linear: rounding grows by the differences that sensitivities are made of
CASES = (
    ("tanh", ("fy", "c"), "", 1e-9),
    ("tanh+temperature", ("temperature.b_yield", "fy"), "", 1e-9),
    ("boucwen", ("alpha", "c"), "alpha=1", 1e-9),
    pytest.param("boucwen", ("alpha", "c", "kappa"), "alpha=1", 1e-7, marks=pytest.mark.slow),
)


def noisy(model: str, orders: str) -> ExportSource:
    """A fit with a residual of known size."""
    spec = registry.load("model", model.partition("+")[0]).SPEC
    source = rig(model, CurrentDependence(orders_of(spec, orders), 0.2, 1.4) if orders else None)
    (log,) = source.stretches
    noise = NOISE * np.random.default_rng(0).standard_normal(len(log.measured))
    return replace(source, stretches=(replace(log, measured=log.simulated + noise),))


def drive_of(source: ExportSource, seconds: float = 1.0) -> tuple[Array, Array]:
    """Inputs (C, N), which rest for a while, and an output that grows by a fifth."""
    signals = {
        n: np.concatenate([v, np.full(500, v[-1] * (n not in RATES)), v]) for n, v in channels(seconds, DT).items()
    }
    signals["time"] = DT * np.arange(len(signals["time"]))
    drive = np.stack([signals[n] for n in source.spec.inputs])
    clean = source.simulate(drive, DT)
    growth = 1.0 + 0.2 * (np.arange(len(clean)) > len(clean) // 3)
    return drive, clean * growth + NOISE * np.random.default_rng(1).standard_normal(len(clean))


RATES = ("velocity", "angular_velocity", "acceleration")


def compiled_track(
    source: ExportSource, names: Sequence[str], drive: Array, measured: Array, options: Sequence[str]
) -> Array:
    """Output, whether parameters move, estimates and variances (A, N) of the tracker in C."""
    plan = plan_of(source, names)
    parts = parts_of(replace(source, prefix="own_tracker"), plan=plan)
    files = tracker_files(replace(source, prefix="own"), plan, Cost((), 0.002))
    with built(parts, files, options) as program:
        return program.run(np.vstack([user_inputs(source, drive), measured]), DT)


@pytest.mark.parametrize(("model", "names", "orders", "bound"), CASES)
def test_it_is_the_tracker_in_python(model: str, names: tuple[str, ...], orders: str, bound: float) -> None:
    source = noisy(model, orders)
    drive, measured = drive_of(source)
    measured[800:820] = np.nan
    found = track_log(source, plan_of(source, names), dict(zip(source.spec.inputs, drive, strict=True)), measured, DT)
    got, size = compiled_track(source, names, drive, measured, STRICT), len(names)
    assert (found.chosen > 0).any() and not found.moves.all()
    np.testing.assert_array_equal(got[1] > 0.0, found.chosen > 0)
    np.testing.assert_allclose(got[2 : 2 + size].T, found.values, rtol=bound, atol=0.0)
    np.testing.assert_allclose(np.sqrt(got[2 + size :]).T, found.deviations, rtol=100.0 * bound)


def test_floats_are_near() -> None:
    source = noisy("boucwen", "")
    drive, measured = drive_of(source)
    exact = compiled_track(source, ("alpha", "c"), drive, measured, STRICT)
    near = compiled_track(source, ("alpha", "c"), drive, measured, (*STRICT, "-DOWN_TRACKER_FLOAT"))
    assert np.abs(near[2:4] - exact[2:4]).max(axis=1) == pytest.approx(0.0, abs=5.0)
    assert np.abs((near[2:4, -1] - exact[2:4, -1]) / np.sqrt(exact[4:, -1])).max() < 0.2


def test_a_dead_time_is_refused() -> None:
    source = noisy("tanh+delay", "")
    with pytest.raises(ConfigError, match="by which delay is late"):
        plan_of(source, ("delay.tau",))
