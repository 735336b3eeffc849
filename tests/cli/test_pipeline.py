"""The main job from logs to report, as a user runs it, against planted truth and real records."""

import csv
import json
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import mrfit.fit.stage
import mrfit.flux.stage
import mrfit.ingest.stage
import mrfit.segment.stage
from mrfit.cli import pipeline
from mrfit.cli.catalog import read_catalog
from mrfit.core.progress import silent
from tests import commands
from tests.conftest import Run
from tests.flux.records import coil, recording, workspace

PUBLISHED = {"A": 1.1993, "Lc": 0.0178, "kappa": 3.4887, "beta": 30.0007, "gamma": 59.9993, "n": 1.2695}
COIL_MAP = """
[channels]
voltage = {column = "CH1", unit = "V"}
current = {column = "CH2", scale = 10.0, unit = "A"}
"""
UTFSM_MAP = read_catalog()["mr_damper_utfsm"].map


def test_a_fit_of_a_damper_says_once_that_no_flux_was_made(tmp_path: Path) -> None:
    driven = coil(5.0, 3.0)
    channels = {"voltage": driven["voltage"], "current": driven["current"], "force": driven["truth"]}
    made = workspace(tmp_path, [recording(name, 4e-4, channels) for name in ("one", "two")])
    (note,) = pipeline._flux_as_before(made, None, silent)
    assert note.startswith("one: no flux linkage, which a damper does not need") and "--resistance OHM" in note
    assert pipeline._flux_as_before(made, 2.0, silent) == [
        "coil resistance 2.0 Ω, kept for later commands of this workspace; `mrfit flux` changes it"
    ]


def combinations(divisor: float) -> dict[str, float]:
    """What the data can determine of the published parameters, written out independently of the model."""
    p = PUBLISHED
    z_max = (p["kappa"] / (p["beta"] + p["gamma"])) ** (1 / p["n"])
    return {
        "slope": p["A"] * p["Lc"],
        "amplitude": (1 - p["A"]) * p["Lc"] * z_max / divisor,
        "turnover": z_max / p["kappa"],
        "sharpness": p["n"],
    }


def fitted(mrfit: Run, *arguments: object) -> dict[str, Any]:
    result = mrfit("fit", *arguments, "--json")
    assert result.returncode == 0, result.stderr
    return dict(json.loads(result.stdout))


@pytest.mark.parametrize(
    ("variant", "divisor"), [("standard", 0.05), pytest.param("printed", 20.0, marks=pytest.mark.slow)]
)
def test_planted_parameters_are_recovered_and_held_out_flux_is_predicted_to_the_noise(
    variant: str, divisor: float, mrfit: Run, datasets: Path
) -> None:
    assert mrfit("ingest", datasets / "coil-planted" / variant).returncode == 0
    fit = fitted(mrfit, "--model", "boucwen-flux", "--opt", "auto", "--per", "all", "--weight", "floor")
    held = next(m for m in fit["metrics"] if m["condition"] == "all" and m["role"] == "holdout")
    assert held["rmse"] <= 1.05 * held["noise_floor"]
    found = {d["name"]: d for d in fit["results"][0]["derived"]}
    for name, truth in combinations(divisor).items():
        quantity = found[name]
        if not quantity["identifiable"]:
            # a loop of 0.01 % of the range has a visible area but no visible shape
            assert variant == "printed" and name in ("sharpness", "turnover")
            continue
        centre, half = quantity["value"], (quantity["high"] - quantity["low"]) / 2
        assert abs(truth - centre) <= half, name
    single = {p["name"]: p["identifiable"] for p in fit["results"][0]["parameters"]}
    assert not any(single[n] for n in ("A", "Lc", "kappa", "beta", "gamma", "D"))


def test_the_shipped_pipeline_leaves_a_report_and_does_nothing_the_second_time(
    mrfit: Run, datasets: Path, tmp_path: Path
) -> None:
    pipeline = datasets.parent / "pipelines" / "coil-flux.toml"
    first = mrfit("run", pipeline, "--work", "w", "--json")
    assert first.returncode == 0, first.stderr
    assert (tmp_path / "w" / "report" / "index.html").stat().st_size > 10_000
    again = json.loads(mrfit("run", pipeline, "--work", "w", "--json").stdout)
    assert again["ingest"]["skipped"] and again["flux"]["skipped"] and again["segment"]["skipped"]
    assert all(f["skipped"] for f in again["fits"]) and again["report"]["skipped"]


def test_tables_have_one_row_per_condition_and_parameter(mrfit: Run, datasets: Path, tmp_path: Path) -> None:
    logs = [datasets / "coil" / f"coil_05Hz_{a}A.csv" for a in (1, 3, 5)]
    assert mrfit("ingest", *logs).returncode == 0
    fit = fitted(mrfit, "--model", "boucwen-flux", "--opt", "lsq")
    folder = tmp_path / "mrfit-work" / "fits" / "boucwen-flux.lsq"
    with (folder / "parameters.csv").open() as handle:
        rows = list(csv.DictReader(handle))
    conditions = {r["condition"] for r in rows}
    assert conditions == {"sine-5Hz-1A", "sine-5Hz-3A", "sine-5Hz-5A"}
    assert [r["parameter"] for r in rows if r["condition"] == "sine-5Hz-3A"][:7] == [*PUBLISHED, "D"]
    with (folder / "metrics.csv").open() as handle:
        metrics = list(csv.DictReader(handle))
    assert {(m["condition"], m["role"]) for m in metrics} == {
        (c, r) for c in (*conditions, "all") for r in ("train", "holdout")
    }
    assert float(metrics[0]["rmse"]) == pytest.approx(fit["metrics"][0]["rmse"], rel=1e-12)


def test_the_result_does_not_depend_on_the_number_of_workers_or_the_order_of_logs(
    mrfit: Run, datasets: Path, tmp_path: Path
) -> None:
    logs = [datasets / "coil" / f"coil_{f}Hz_{a}A.csv" for f in ("01", "10") for a in (4,)]
    written = []
    for jobs, order in ((1, logs), (3, logs[::-1])):
        work = tmp_path / f"w{jobs}"
        assert mrfit("ingest", *order, "--work", work).returncode == 0
        options = ("--model", "boucwen-flux", "--opt", "pso-fmin", "--budget", 500, "--jobs", jobs)
        assert mrfit("fit", *options, "--work", work).returncode == 0
        folder = work / "fits" / "boucwen-flux.pso-fmin"
        written.append(
            [(folder / n).read_bytes() for n in ("fit.json", "parameters.csv", "metrics.csv", "residuals.parquet")]
        )
    assert written[0] == written[1]


@pytest.mark.slow
def test_prediction_on_another_log_is_a_free_run_with_its_own_errors(mrfit: Run, datasets: Path) -> None:
    folder = datasets / "coil-planted" / "standard"
    train = [folder / f"coil_{f}Hz_{a}A.csv" for f in ("01", "05", "10") for a in (1, 5)]
    assert mrfit("ingest", *train).returncode == 0
    fitted(mrfit, "--model", "boucwen-flux", "--opt", "auto", "--per", "all", "--weight", "floor", "--name", "joint")
    result = mrfit("predict", "--fit", "joint", folder / "coil_05Hz_3A.csv", "--json")
    assert result.returncode == 0, result.stderr
    row = json.loads(result.stdout)["metrics"][0]
    assert row["role"] == "predict"
    assert row["rmse"] <= 1.1 * row["noise_floor"]


@pytest.mark.parametrize("frequencies", [("05",), ("01", "05", "10")])
def test_prediction_uses_the_resistance_and_segmentation_given_at_the_fit(
    frequencies: tuple[str, ...], datasets: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # one frequency could not give a resistance, three would give another one
    logs, work = [datasets / "coil" / f"coil_{f}Hz_3A.csv" for f in frequencies], tmp_path / "w"
    (tmp_path / "map.toml").write_text(COIL_MAP)
    reading = mrfit.ingest.stage.Settings(map=tmp_path / "map.toml")
    segmenting = mrfit.segment.stage.Settings(drive="current", min_cycles=3)
    pipeline.ingest(work, logs, reading, silent)
    pipeline.flux(work, mrfit.flux.stage.Settings(resistance=2.3), silent)
    pipeline.segment(work, segmenting, silent)
    fit = pipeline.fit(work, mrfit.fit.stage.Settings("boucwen-flux", "lsq", budget=100), None, silent)
    fitted = {m["condition"]: m["rmse"] for m in fit["metrics"] if m["role"] == "train"}

    used, segment = [], mrfit.segment.stage.run
    monkeypatch.setattr(
        mrfit.segment.stage, "run", lambda *arguments: (used.append(arguments[1]), segment(*arguments))[1]
    )
    found = pipeline.predict(work, "boucwen-flux.lsq", logs, reading, silent)
    for row in found["metrics"]:
        assert row["rmse"] == pytest.approx(fitted[row["condition"]], rel=0.1)
    assert used == [replace(segmenting, holdout="none")]
    assert not found["outdated"]
    pipeline.flux(work, mrfit.flux.stage.Settings(resistance=3.0), silent)
    assert pipeline.predict(work, "boucwen-flux.lsq", logs, reading, silent)["outdated"]


def killed(command: list[str], folder: Path, after: float) -> int:
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(after)
    process.send_signal(signal.SIGKILL)
    return process.wait()


EVEN = tuple(0.8 + 0.25 * k for k in range(12))


@pytest.mark.parametrize(
    ("currents", "budget", "moments", "fewest"),
    [
        pytest.param((1,), 300, EVEN[1::12], 1, id="a few"),
        pytest.param((1, 3, 5), 3000, EVEN, 3, id="many", marks=pytest.mark.slow),
    ],
)
def test_a_kill_at_any_moment_leaves_a_workspace_from_which_the_same_command_goes_on(
    currents: tuple[int, ...], budget: int, moments: tuple[float, ...], fewest: int, datasets: Path, tmp_path: Path
) -> None:
    pipeline = tmp_path / "p.toml"
    logs = [str(datasets / "coil" / f"coil_{f}Hz_{a}A.csv") for f in ("01", "05") for a in currents]
    pipeline.write_text(
        f"[ingest]\nlogs = {json.dumps(logs)}\n[[fit]]\nmodel = 'boucwen-flux'\nopt = 'pso-lsq'\nbudget = {budget}\n"
    )
    words = ["run", str(pipeline), "--jobs", "1", "--work"]
    command = [sys.executable, "-m", "mrfit.cli", *words, "w"]
    kills = sum(killed(command, tmp_path, moment) == -signal.SIGKILL for moment in moments)
    assert kills >= fewest
    assert commands.run(tmp_path, *words, "w").returncode == 0
    assert commands.run(tmp_path, *words, "other").returncode == 0
    ours, theirs = tmp_path / "w", tmp_path / "other"
    names = sorted(str(p.relative_to(theirs)) for p in theirs.rglob("*") if p.is_file())
    left = sorted(str(p.relative_to(ours)) for p in ours.rglob("*") if p.is_file())
    assert left == names
    # which says when each command ended
    names.remove("commands.log")
    for name in names:
        assert (ours / name).read_bytes() == (theirs / name).read_bytes(), name


def test_a_real_transformer_loop_is_fitted_to_its_noise(mrfit: Run, real_logs: Path, tmp_path: Path) -> None:
    (tmp_path / "map.toml").write_text(
        '[channels]\ncurrent = {column = "CH1", unit = "A"}\nflux = {column = "CH2", unit = "Wb"}\n'
    )
    log = real_logs / "rigol_bh_loop" / "histerese_osciloscopio_80.csv"
    assert mrfit("ingest", log, "--map", "map.toml").returncode == 0
    fit = fitted(mrfit, "--model", "boucwen-flux", "--opt", "pso-fmin")
    for row in fit["metrics"]:
        assert row["nrmse"] <= 0.025
        assert 0.010 <= row["noise_floor"] / row["rmse"] * row["nrmse"] <= 0.022
    assert all(p["passive"] for p in fit["results"][0]["passivity"])


def test_a_real_damper_is_fitted_condition_by_condition(mrfit: Run, real_logs: Path, tmp_path: Path) -> None:
    (tmp_path / "map.toml").write_text(UTFSM_MAP)
    assert mrfit("ingest", real_logs / "mr_damper_utfsm" / "preprocessed", "--map", "map.toml").returncode == 0
    fit = fitted(mrfit, "--model", "boucwen", "--opt", "auto")
    conditions = {r["condition"] for r in fit["results"]}
    assert {f"sine-5Hz-2mm-{i}A" for i in ("0", "0.25", "0.5", "0.75", "1")} <= conditions
    assert len(conditions) == 10
    assert max(m["nrmse"] for m in fit["metrics"]) < 0.07
