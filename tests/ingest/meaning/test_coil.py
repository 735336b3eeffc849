"""Logs of H and B become logs of current and flux linkage."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mrfit.core.recording import Recording
from mrfit.ingest.stage import Settings, read

TURNS, LENGTH, AREA = 120.0, 0.15, 2.4e-4
TIME = np.arange(2000) * 1e-3
CURRENT = 2.0 * np.sin(2 * np.pi * TIME)
# a loop that saturates
FLUX = 0.02 * np.tanh(CURRENT - 0.3 * np.cos(2 * np.pi * TIME)) + 0.01 * CURRENT
H, B = TURNS * CURRENT / LENGTH, FLUX / (TURNS * AREA)


def recorded(folder: Path, columns: dict[str, np.ndarray], coil: str = "") -> Recording:
    """Return the recording of a log with these columns, and a channel map with a coil."""
    pd.DataFrame({"Time (s)": TIME, **columns}).to_csv(folder / "core.csv", index=False)
    (folder / "mrfit.toml").write_text(coil)
    (recording,) = read([folder], Settings()).recordings
    return recording


def test_current_and_flux_linkage_of_a_stated_coil(tmp_path: Path) -> None:
    coil = f"[coil]\nturns = {TURNS}\nlength = {LENGTH}\narea = {AREA}\n"
    made = recorded(tmp_path, {"H (A/m)": H, "B (T)": B}, coil)
    np.testing.assert_allclose(made.channels["current"], CURRENT, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(made.channels["flux"], FLUX, rtol=1e-12, atol=1e-15)
    assert (made.units["current"], made.units["flux"]) == ("A", "Wb")
    assert "120 turns, 0.15 m" in next(f.text for f in made.findings if f.kind == "computed-channel")


def test_without_a_coil_current_is_h_in_ka_per_m_and_flux_is_b(tmp_path: Path) -> None:
    made = recorded(tmp_path, {"H (A/m)": H, "B (T)": B})
    np.testing.assert_allclose(made.channels["current"], H / 1000.0, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(made.channels["flux"], B, rtol=1e-12, atol=1e-15)
    assert "read A as kA/m and Wb as T" in next(f.text for f in made.findings if f.kind == "computed-channel")


def test_units_of_the_cgs_system(tmp_path: Path) -> None:
    made = recorded(tmp_path, {"H (Oe)": H * 4e-3 * np.pi, "B (G)": B * 1e4})
    np.testing.assert_allclose(made.channels["field_strength"], H, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(made.channels["flux_density"], B, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("measured", ["current (A)", "flux (Wb)"])
def test_a_measured_channel_is_left_as_it_is(tmp_path: Path, measured: str) -> None:
    made = recorded(tmp_path, {"H (A/m)": H, "B (T)": B, measured: CURRENT})
    np.testing.assert_array_equal(made.channels[measured.split()[0]], CURRENT)
    assert len({"current", "flux"} & made.channels.keys()) == 1


def test_a_field_alone_makes_no_flux(tmp_path: Path) -> None:
    assert recorded(tmp_path, {"H (A/m)": H}).channels.keys() == {"field_strength"}
