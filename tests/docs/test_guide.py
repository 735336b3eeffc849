"""The channel maps of the guide do what it says."""

from pathlib import Path

import numpy as np
import pytest

from mrfit.ingest.stage import Settings, read
from tests.conftest import ROOT
from tests.docs.pages import blocks

MAPS = list(blocks(ROOT / "docs" / "guide.md", "toml"))


def test_a_log_of_field_strength_and_flux_density_is_read_as_current_and_flux_linkage(tmp_path: Path) -> None:
    (map_text,) = [m for m in MAPS if "[coil]" in m]
    turns, area, length = 120, 2.4e-4, 0.15
    time = np.arange(500) / 500
    current, flux = 3.0 * np.sin(2 * np.pi * time), 0.05 * np.tanh(2.0 * np.sin(2 * np.pi * time))
    columns = zip(time, current * turns / length, flux / (turns * area), strict=True)
    rows = "".join(f"{t:.4f},{h:.9g},{b:.9g}\n" for t, h, b in columns)
    (tmp_path / "core.csv").write_text("Time,H,B\ns,A/m,T\n" + rows)
    (tmp_path / "mrfit.toml").write_text(map_text)
    (recording,) = read([tmp_path], Settings()).recordings
    np.testing.assert_allclose(recording.channels["current"], current, atol=1e-7)
    np.testing.assert_allclose(recording.channels["flux"], flux, atol=1e-9)


def test_columns_by_place_and_by_name_have_units_and_scales(tmp_path: Path) -> None:
    (map_text,) = [m for m in MAPS if "displacement" in m and "scale" in m]
    rows = "".join(f"{k * 0.01:.3f},{k % 7},{k % 5},{k % 3}\n" for k in range(100))
    (tmp_path / "25mm0x5Hz0x75A.csv").write_text("t,x,Load,CH2\n" + rows)
    (tmp_path / "mrfit.toml").write_text(map_text)
    (recording,) = read([tmp_path], Settings()).recordings
    assert recording.channels["displacement"][1] == pytest.approx(1e-3)
    assert recording.channels["force"][1] == pytest.approx(1e3)
    assert recording.channels["current"][1] == pytest.approx(10.0)
    assert recording.condition["frequency"] == 0.5 and recording.condition["current"] == 0.75
