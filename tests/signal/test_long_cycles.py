"""Steady cycles of a signal on disk are those of the same signal in memory."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.io import columns
from mrfit.io.tables import read_table, write_table
from mrfit.signal import long_cycles
from mrfit.signal.cycles import steady_stretches
from mrfit.signal.harmonics import harmonic_fit, series_at
from mrfit.signal.long_cycles import stretches_of

DT, SAMPLES = 1e-3, 60_000
T = np.arange(SAMPLES) * DT
OnDisk = Callable[..., list[Array]]


@pytest.fixture
def on_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> OnDisk:
    monkeypatch.setattr(columns, "LONG_SEGMENT", 1000)
    monkeypatch.setattr(columns, "COLUMN_CHUNK", 7000)
    monkeypatch.setattr(long_cycles, "CYCLE_WINDOW", 9000)

    def written(*channels: Array) -> list[Array]:
        write_table(tmp_path / "a.parquet", {f"c{k}": values for k, values in enumerate(channels)})
        return list(read_table(tmp_path / "a.parquet", (), tmp_path)[0].values())

    return written


def a_drive(frequency: float, noise: float = 0.01) -> Array:
    turn = 2 * np.pi * frequency * T
    return np.sin(turn) + 0.2 * np.sin(3 * turn + 1.0) + noise * np.random.default_rng(1).standard_normal(SAMPLES)


@pytest.mark.parametrize("frequency", [1.0, 2.7183, 11.3])
def test_one_stretch_through_all_windows(on_disk: OnDisk, frequency: float) -> None:
    values = a_drive(frequency)
    (whole,) = steady_stretches(values, DT)
    (found,) = stretches_of(on_disk(values)[0], DT)
    assert (found.start, found.stop, found.cycles) == (whole.start, whole.stop, whole.cycles)
    # both miss the truth by what noise allows
    assert found.fit.frequency == pytest.approx(frequency, rel=2e-6)
    assert found.fit.amplitude == pytest.approx(whole.fit.amplitude, rel=2e-3)
    assert found.fit.residual == pytest.approx(whole.fit.residual, rel=0.03)


def test_what_changes_is_another_stretch(on_disk: OnDisk) -> None:
    half = T > 30.0
    values = a_drive(2.0) * np.where(half, 1.5, 1.0)
    found = stretches_of(on_disk(values)[0], DT)
    assert [(round(s.start, -3), round(s.stop, -3)) for s in found] == [(0, 30_000), (30_000, 60_000)]
    # the edge of a window is where the level changes: the drive alone goes on
    level = np.where(T >= 27.0, 2.0, 1.0) + 0.001 * np.random.default_rng(2).standard_normal(SAMPLES)
    drive, current = on_disk(a_drive(2.0), level)
    assert len(stretches_of(drive, DT)) == 1
    assert len(stretches_of(drive, DT, [current])) == 2
    # and so it does not after a jump of phase
    jumped = np.concatenate([a_drive(2.0)[:27_000], a_drive(2.0)[27_200:], a_drive(2.0)[:200]])
    assert len(stretches_of(on_disk(jumped)[0], DT)) >= 2


def test_a_series_at_a_known_frequency_is_that_of_the_whole(on_disk: OnDisk) -> None:
    values = a_drive(2.7183)
    whole, found = harmonic_fit(values, DT, 2.7183, refine=False), series_at(on_disk(values)[0], DT, 2.7183)
    assert np.allclose(found.coefficients, whole.coefficients, atol=1e-10)
    assert found.residual == pytest.approx(whole.residual, rel=1e-9)
