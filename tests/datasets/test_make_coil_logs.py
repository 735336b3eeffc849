import json
from pathlib import Path

import numpy as np
import pytest

from datasets import make_coil_logs
from datasets.make_coil_logs import PER_PERIOD, ROWS
from datasets.rig.boucwen import FluxBoucWen

SHIPPED = Path(make_coil_logs.__file__).parent
RESISTANCE = 2.1


def read(path):
    """Return time step, voltage and current of a log, the channel map applied."""
    lines = path.read_text().splitlines()
    interval = next(float(line.split(",")[1]) for line in lines if line.startswith("Sample Interval"))
    first = lines.index("TIME,CH1,CH2") + 1
    values = np.array([[float(cell) for cell in line.split(",")] for line in lines[first:]])
    return interval, values[:, 1], 10.0 * values[:, 2]


def steady_flux(interval, voltage, current, per_period):
    """Return flux and current of the last three periods, offset and drift removed by whole-period means."""
    quiet = slice(0, per_period)
    rate = voltage - voltage[quiet].mean() - RESISTANCE * (current - current[quiet].mean())
    rate = rate[-3 * per_period - 1 :]
    rate = rate - rate[1:].mean()
    flux = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2) * interval])
    return flux - flux[1:].mean(), current[-3 * per_period - 1 :]


@pytest.mark.parametrize("folder", [pytest.param("coil", marks=pytest.mark.slow), "coil-planted"])
def test_regeneration_gives_the_committed_bytes(tmp_path, folder):
    if folder == "coil":
        make_coil_logs.make(tmp_path)
    else:
        make_coil_logs.make_both_planted(tmp_path / folder, make_coil_logs.SEED)
    made = {p.relative_to(tmp_path): p.read_bytes() for p in (tmp_path / folder).rglob("*") if p.is_file()}
    kept = {p.relative_to(SHIPPED): p.read_bytes() for p in (SHIPPED / folder).rglob("*") if p.is_file()}
    assert made == kept
    assert len(made) >= 16


def test_another_seed_gives_other_noise_on_the_same_signal(tmp_path):
    signals = (7.0 * make_coil_logs.sine_burst(ROWS, PER_PERIOD), 3.0 * make_coil_logs.sine_burst(ROWS, PER_PERIOD))
    voltages = []
    for seed in (1, 2):
        make_coil_logs.save(tmp_path / "log.csv", 5.0, PER_PERIOD, signals, np.random.default_rng(seed))
        voltages.append(read(tmp_path / "log.csv")[1])
    # two draws of 4 mV noise and one level of 5 mV, and the rounding to it
    assert np.std(voltages[0] - voltages[1]) == pytest.approx(np.sqrt(2 * (16 + 25 + 25 / 12)) * 1e-3, rel=0.05)


@pytest.mark.parametrize("path", sorted((SHIPPED / "coil").glob("*.csv")), ids=lambda p: p.stem)
def test_coil_logs_obey_the_circuit_equation_and_dissipate(path):
    frequency, amplitude = float(path.stem[5:7]), float(path.stem[10:-1])
    interval, voltage, current = read(path)
    assert interval == pytest.approx(1 / (250 * frequency))
    flux, drive = steady_flux(interval, voltage, current, 250)
    peak = np.ptp(flux) / 2
    assert np.ptp(drive) / 2 == pytest.approx(amplitude, rel=0.02, abs=0.012)
    assert 0.0175 < peak / amplitude < 0.027
    assert np.trapezoid(drive, flux) > 0
    unmagnetised = np.abs(flux[np.flatnonzero(np.diff(np.sign(drive - drive[1:].mean())))])
    assert 0.04 < unmagnetised.mean() / peak < 0.16


def test_inductance_falls_as_the_iron_saturates():
    peaks = [np.ptp(steady_flux(*read(SHIPPED / "coil" / f"coil_05Hz_{a}A.csv"), 250)[0]) / 2 / a for a in range(1, 6)]
    assert all(one > two for one, two in zip(peaks, peaks[1:], strict=False))


@pytest.mark.parametrize("variant", ["standard", "printed"])
def test_planted_logs_hold_the_flux_of_the_published_equation(variant):
    truth = json.loads((SHIPPED / "coil-planted" / "truth.json").read_text())["variants"][variant]
    model = FluxBoucWen(**truth["parameters"])
    bursts = {f"{a}A": a * make_coil_logs.sine_burst(ROWS, PER_PERIOD)[-4 * PER_PERIOD - 1 :] for a in (1, 3, 5)}
    clean = {a: model.flux(i, model.hysteretic(i))[-3 * PER_PERIOD - 1 :] for a, i in bursts.items()}
    for name, instrument in truth["files"].items():
        interval, voltage, current = read(SHIPPED / "coil-planted" / variant / name)
        flux, _ = steady_flux(interval, voltage, current, PER_PERIOD)
        planted = clean[name[10:-4]]
        noise = [np.hypot(instrument[c]["noise"], instrument[c]["level"] / 12**0.5) for c in ("voltage", "current")]
        # a random walk over three periods, tied at its ends: standard deviation at most half that of a free one
        walk = np.hypot(noise[0], RESISTANCE * noise[1]) * interval * np.sqrt(3 * PER_PERIOD) / 2
        assert np.sqrt(np.mean((flux - planted) ** 2)) < 2 * walk + 1e-4 * np.ptp(planted)


def test_the_two_readings_of_d_differ_as_the_literature_says():
    current = 5 * make_coil_logs.sine_burst(ROWS, PER_PERIOD)
    model = make_coil_logs.PUBLISHED
    z = model.hysteretic(current)[-PER_PERIOD - 1 :]
    hysteretic = (model.A - 1) * model.Lc * np.ptp(z)
    whole = model.A * model.Lc * 10
    assert 0.00010 < hysteretic / model.D / whole < 0.00036
    assert 0.04 < hysteretic * model.D / whole < 0.15
