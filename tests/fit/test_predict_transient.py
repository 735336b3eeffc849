"""A prediction of a record without cycles has all of it, on the clock of the log, and says what is scored."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import mrfit
from tests.conftest import Run

DT, START, FRICTION, DAMPING = 0.002, 3.2, 300.0, 900.0


def earthquake(folder: Path, name: str, seed: int, output: bool = True) -> Path:
    """Write a motion that begins at once and dies away, with the force of a Bingham body."""
    rng, time = np.random.default_rng(seed), np.arange(6000) * DT
    motion = np.convolve(rng.standard_normal(len(time)), np.hanning(80), mode="same") * np.exp(-time / 1.5)
    x = 0.01 * motion / np.abs(motion).max()
    v = np.gradient(x, DT)
    columns = {"time (s)": START + time, "displacement (m)": x, "velocity (m/s)": v}
    if output:
        columns["force (N)"] = FRICTION * np.tanh(100.0 * v) + DAMPING * v + rng.standard_normal(len(time))
    pd.DataFrame(columns).to_csv(folder / f"{name}.csv", index=False, float_format="%.9g")
    return folder / f"{name}.csv"


@pytest.mark.parametrize("output", [True, False])
def test_the_whole_record_is_simulated_and_what_is_scored_is_marked(tmp_path: Path, output: bool) -> None:
    fit = mrfit.fit(mrfit.read(earthquake(tmp_path, "a", 1)), model="tanh", holdout="none", budget=300)
    log = earthquake(tmp_path, "b", 2, output)
    predicted = fit.predict(mrfit.read(log))
    frame, raw = predicted.to_frame(), pd.read_csv(log)
    np.testing.assert_allclose(frame["time"], raw["time (s)"], atol=1e-9)
    assert 0.05 < 1.0 - frame["scored"].mean() < 0.15 and not frame["scored"].iloc[0] and frame["scored"].iloc[-1]
    np.testing.assert_allclose(frame["velocity"], raw["velocity (m/s)"], atol=2e-3)
    assert {c.partition("-")[0] for c in predicted.found.used.values()} <= {"transient", "random"}
    if not output:
        assert frame["measured"].isna().all() and np.isfinite(frame["simulated"]).all()
        return
    error = (frame["measured"] - frame["simulated"])[frame["scored"]]
    assert predicted.metrics["rmse"].iloc[-1] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-12)
    # the strongest of the record is in what is not scored, and simulated as well
    lead = ~frame["scored"]
    assert (frame["measured"] - frame["simulated"])[lead].abs().max() < 0.05 * frame["measured"][lead].abs().max()


def test_a_saved_prediction_has_the_clock_of_its_log(tmp_path: Path, mrfit: Run) -> None:
    for name, seed in (("a", 1), ("b", 2)):
        earthquake(tmp_path, name, seed)
    for words in (
        ("ingest", "a.csv"),
        ("segment", "--holdout", "none"),
        ("fit", "--model", "bingham", "--opt", "lsq", "--name", "f", "--budget", 100),
        ("predict", "--fit", "f", "b.csv", "--save", "b.csv"),
    ):
        done = mrfit(*words)
        assert done.returncode == 0, done.stderr
    saved = pd.read_csv(tmp_path / "mrfit-work/predict/b.csv")
    assert saved["time"].iloc[0] == pytest.approx(START) and len(saved) == 6000
    assert list(saved["scored"].unique()) == [False, True]
