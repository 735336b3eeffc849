"""What discovery says where an effect follows a drift."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.rig import coil_bench
from datasets.rig.flux_coil import base_coil
from datasets.rig.style import Style


def discovered(folder: Path, settling: float, error: float) -> dict:
    """Discovery of coil logs whose resistance grows by a share, settling after a share of the record (0: at once)."""
    coil = base_coil(np.random.default_rng([1, 1]))
    record = coil_bench.run(coil, {}, coil_bench.PROGRAMMES["rich"]())
    since = np.arange(record.voltage.shape[1]) / record.voltage.shape[1]
    grown = 1.0 - np.exp(-since / settling) if settling else np.ones_like(since)
    record = replace(record, voltage=record.voltage + error * coil.resistance * grown * record.current)
    logs = folder / "logs"
    logs.mkdir()
    coil_bench.save(record, logs, Style(), np.random.default_rng([1, 2]))
    (logs / "mrfit.toml").write_text(coil_bench.channel_map(coil.resistance, Style()))
    work = str(folder / "work")
    for command in (["ingest", *map(str, sorted(logs.glob("*.csv")))], ["discover", "--model", "boucwen-flux"]):
        subprocess.run([sys.executable, "-m", "mrfit.cli", *command, "--work", work], check=True, capture_output=True)
    return json.loads((folder / "work" / "discover" / "discovery.json").read_text())


@pytest.mark.slow
def test_a_resistance_that_drifts_is_a_drift_and_no_resistance_error(tmp_path: Path) -> None:
    found = discovered(tmp_path, 0.2, 0.005)
    assert found["verdict"] == "unexplained" and not found["effects"]
    rows = [r for r in found["drift"] if r.get("follows") == "resistance-error"]
    assert rows and all(r["rate"] > 0.0 for r in rows)


@pytest.mark.slow
def test_a_steady_resistance_error_is_named(tmp_path: Path) -> None:
    found = discovered(tmp_path, 0.0, 0.005)
    assert found["verdict"] == "named" and [e["name"] for e in found["effects"]] == ["resistance-error"]
    assert not any(r.get("follows") for r in found["drift"])
