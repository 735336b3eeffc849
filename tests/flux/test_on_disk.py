"""Flux of a recording that stays on disk is that of the same recording in memory."""

import contextlib
import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from benchmarks.scale_logs import coil
from mrfit.cli import main
from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.flux import channel, integral
from mrfit.flux.channel import InMemory, OnDisk, channel_of, swing
from mrfit.flux.integral import drift_removed, integral_on_disk, integrate
from mrfit.io import columns
from mrfit.io.workspace import Workspace
from mrfit.signal.cycles import steady_stretches
from tests.flux.records import remove_drift

SAMPLES = 30_001


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    for module in (columns, channel, integral):
        monkeypatch.setattr(module, "COLUMN_CHUNK", 4096)
    yield


def test_the_running_sum_of_a_channel_read_in_pieces_is_that_of_the_whole() -> None:
    values = np.cumsum(np.random.default_rng(1).standard_normal(SAMPLES))
    read, whole = OnDisk(SAMPLES, lambda a, b: values[a:b]), InMemory(values)
    boundaries = np.concatenate([np.arange(900.25, SAMPLES - 2, 613.7), [SAMPLES - 0.5]])
    assert np.allclose(read.means(boundaries), whole.means(boundaries), rtol=1e-9, atol=1e-9)
    assert np.array_equal(read.between(boundaries), whole.between(boundaries))
    assert read.mean() == pytest.approx(whole.mean())
    assert swing(read, 5000, 20_000, 0.01) == swing(whole, 5000, 20_000, 0.01)


@pytest.mark.parametrize("samples", [SAMPLES, 8192, 8193, 8194, 8195])
@pytest.mark.parametrize("rule", ["trapezoid", "simpson"])
def test_an_integral_by_pieces_is_that_of_the_whole(rule: str, samples: int) -> None:
    voltage = np.random.default_rng(2).standard_normal(samples)
    found = integral_on_disk(lambda a, b: voltage[a:b], samples, 1e-3, rule)
    whole = integrate(voltage, 1e-3, rule)
    assert np.allclose(found.read(0, samples), whole, rtol=0.0, atol=1e-12)
    assert np.allclose(found.read(4000, 8190), whole[4000:8190], rtol=0.0, atol=1e-12)
    if rule == "trapezoid":
        # the same sums in the same order
        assert np.array_equal(found.read(0, samples), whole)


def a_coil(bias: float = 0.0, steady: bool = True) -> tuple[Array, Array, float]:
    """Return voltage, current and dt of a coil with an offset of its voltage."""
    time, voltage, current = coil(SAMPLES, 2.0, 2.0, 7).T
    if not steady:
        current = current + 0.5 * np.sin(0.37 * np.arange(SAMPLES) ** 1.5 / SAMPLES)
    half = np.arange(SAMPLES) > SAMPLES // 2
    return voltage + 0.01 + bias * half * 2.0, current + bias * half, float(time[1])


@pytest.mark.parametrize("method", ["cycle", "linear", "none"])
@pytest.mark.parametrize("steady, bias", [(True, 0.0), (True, 1.0), (False, 0.0)])
def test_drift_is_removed_as_from_the_whole(method: str, steady: bool, bias: float) -> None:
    voltage, current, dt = a_coil(bias, steady)
    stretches = steady_stretches(current, dt) if steady else []
    assert bool(stretches) == steady
    induced = voltage - 2.0 * current
    whole, expected = remove_drift(integrate(induced, dt, "trapezoid"), current, dt, stretches, method)
    read = integral_on_disk(lambda a, b: induced[a:b], SAMPLES, dt, "trapezoid")
    found, drift = drift_removed(read, OnDisk(SAMPLES, lambda a, b: current[a:b]), dt, stretches, method)
    assert len(found.array) == SAMPLES
    assert np.allclose(found.array[0:SAMPLES], whole, rtol=0.0, atol=1e-9 * np.ptp(whole))
    assert drift.offset_volt == pytest.approx(expected.offset_volt, rel=1e-7, abs=1e-12)
    assert drift.constant == pytest.approx(expected.constant, rel=1e-7, abs=1e-12)
    assert np.allclose(drift.closure, expected.closure, atol=1e-9)
    assert (drift.method, drift.finding) == (expected.method, expected.finding)


def made(root: Path, voltage: Array, current: Array, dt: float) -> Recording:
    """Ingest a log of a coil, reconstruct its flux, and return the recording."""
    root.mkdir()
    time = np.arange(len(current)) * dt
    log = pa.table({"time (s)": time, "voltage (V)": voltage, "current (A)": current})
    pq.write_table(log, root / "a.parquet")
    for command in (["ingest", str(root / "a.parquet")], ["flux", "--resistance", "2.0"]):
        with contextlib.redirect_stdout(io.StringIO()):
            main.app([*command, "--work", str(root / "work")], standalone_mode=False)
    return Workspace(root / "work").read_recording("a", "flux")


def test_the_stage_makes_of_a_long_recording_what_it_makes_of_any(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    voltage, current, dt = a_coil()
    whole = made(tmp_path / "whole", voltage, current, dt)
    monkeypatch.setattr(columns, "LONG_SEGMENT", 10_000)
    read = made(tmp_path / "read", voltage, current, dt)
    assert columns.is_on_disk(
        Workspace(tmp_path / "read" / "work").read_recording("a", streamed=True).channels["current"]
    )
    span = float(np.ptp(whole.channels["flux"]))
    # the fundamental is refined on other sums
    assert np.allclose(read.channels["flux"], whole.channels["flux"], rtol=0.0, atol=1e-6 * span)
    assert np.array_equal(read.channels["current"], current)


def test_what_is_asked_of_a_channel_in_memory_is_not_read_again() -> None:
    assert isinstance(channel_of(np.zeros(5)), InMemory)
