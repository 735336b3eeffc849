"""The logs with a hidden effect: the same bytes again, and the effect is in them as README.md says."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter, savgol_filter

from datasets import make_discovery_logs
from datasets.make_discovery_logs import COIL, DRIVES, EDDY, LAG, PER_PERIOD
from datasets.rig.damper import Damper

SHIPPED = Path(make_discovery_logs.__file__).parent
LIMITS = {"coil-eddy": 1_200_000, "damper-lag": 1_500_000}


@pytest.fixture(scope="module")
def regenerated(tmp_path_factory):
    out = tmp_path_factory.mktemp("regenerated")
    make_discovery_logs.make(out)
    return out


# ten seconds; test_make_coil_logs.py has the quick test that a maker gives the same bytes again
@pytest.mark.slow
@pytest.mark.parametrize("folder", sorted(LIMITS))
def test_regeneration_gives_the_committed_bytes(regenerated, folder):
    made = {p.relative_to(regenerated): p.read_bytes() for p in (regenerated / folder).rglob("*") if p.is_file()}
    kept = {p.relative_to(SHIPPED): p.read_bytes() for p in (SHIPPED / folder).rglob("*") if p.is_file()}
    assert made == kept
    assert sum(map(len, made.values())) <= LIMITS[folder]
    assert len(made) >= 6


def coil_log(path):
    """Return sample interval, voltage and current of the last four periods, means removed."""
    lines = path.read_text().splitlines()
    interval = next(float(line.split(",")[1]) for line in lines if line.startswith("Sample Interval"))
    rows = np.array([[float(c) for c in line.split(",")] for line in lines[lines.index("TIME,CH1,CH2") + 1 :]])
    last = rows[-4 * PER_PERIOD :]
    return interval, last[:, 1] - last[:, 1].mean(), 10.0 * (last[:, 2] - last[:, 2].mean())


@pytest.mark.parametrize("drive", DRIVES, ids=lambda d: d.name)
def test_current_peaks_are_nominal(drive):
    name = f"{drive.shape}_{drive.frequency:02.0f}Hz_{drive.amplitude:.0f}A.csv"
    _, _, current = coil_log(SHIPPED / "coil-eddy" / name)
    assert np.ptp(current) / 2 == pytest.approx(drive.amplitude, rel=0.01, abs=0.02)


@pytest.mark.parametrize("ampere", [3, 5])
def test_losses_beside_the_copper_grow_with_frequency_as_an_eddy_resistance_says(ampere):
    """Power beyond R·I² is the static loop's, proportional to f, and U_L²/R_e, proportional to f²."""
    power, inductive = {}, {}
    for hertz in (1, 5, 10):
        _, voltage, current = coil_log(SHIPPED / "coil-eddy" / f"sine_{hertz:02d}Hz_{ampere}A.csv")
        flux_rate = voltage - COIL.resistance * current
        power[hertz], inductive[hertz] = np.mean(flux_rate * current), np.mean(flux_rate**2)
    static = (power[5] - inductive[5] / EDDY) / 5
    for hertz in (5, 10):
        assert power[hertz] == pytest.approx(static * hertz + inductive[hertz] / EDDY, rel=0.03)
    assert inductive[10] / EDDY > 5 * 10 * static


def law_residual(path, delay):
    """Return the RMS force in N that the bench's own law leaves if the fluid feels the current this late."""
    time, *columns = np.loadtxt(path, delimiter=",", skiprows=2).T
    position, force, current = columns[0] / 1e3, columns[1] * 1e3, columns[2]
    speed = savgol_filter(position, 9, 3, deriv=1, delta=time[1])
    keep = np.exp(-time[1] / delay) if delay else 0.0
    felt = lfilter([1.0 - keep], [1.0, -keep], current, zi=[keep * current[0]])[0]
    damping, spring = Damper().force(position, speed, felt)
    return np.sqrt(np.mean((damping + spring - force)[100:-100] ** 2))


@pytest.mark.parametrize("path", sorted((SHIPPED / "damper-lag").glob("*.csv")), ids=lambda p: p.stem)
def test_force_is_the_benchs_law_of_a_late_current(path):
    left = {delay: law_residual(path, delay) for delay in (0.0, 0.8 * LAG, LAG, 1.2 * LAG)}
    assert min(left, key=left.get) == LAG
    # 6 N of noise, and what the noise of the stroke makes of the speed
    assert left[LAG] < 12.0 < left[0.0] / 2


@pytest.mark.slow
def test_without_the_effects_the_logs_do_not_have_them(tmp_path):
    make_discovery_logs.make_coil(tmp_path, 1, np.inf)
    _, voltage, current = coil_log(tmp_path / "sine_10Hz_5A.csv")
    flux_rate = voltage - COIL.resistance * current
    assert np.mean(flux_rate * current) < 0.3 * np.mean(flux_rate**2) / EDDY
