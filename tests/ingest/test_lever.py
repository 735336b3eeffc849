"""Angle and torque by the lever between a press and a rotary device."""

from pathlib import Path

import numpy as np
import pytest

import mrfit
from mrfit.errors import DataError

LENGTH = 0.2
MAP = "lever = 0.2\n"


def write(folder: Path, stroke: np.ndarray, force: np.ndarray | None) -> Path:
    (folder / "mrfit.toml").write_text(MAP)
    path = folder / "log.csv"
    columns = [np.arange(len(stroke)) * 1e-3, 1e3 * stroke, *([] if force is None else [force])]
    head = "Time,Displacement\ns,mm" if force is None else "Time,Displacement,Load\ns,mm,N"
    np.savetxt(path, np.stack(columns, axis=1), "%.12g", ",", header=head, comments="")
    return path


def test_angle_and_torque_are_those_of_the_triangle(tmp_path: Path) -> None:
    angle = 0.4 * np.sin(np.linspace(0.0, 12.0, 400))
    force = 30.0 + 5.0 * angle
    found = mrfit.read(str(write(tmp_path, LENGTH * np.sin(angle), force)))[0].to_frame()
    assert found["angle"].to_numpy() == pytest.approx(angle, abs=1e-10)
    # virtual work: T*d(theta) = F*dx
    work = np.trapezoid(found["torque"], found["angle"])
    assert work == pytest.approx(np.trapezoid(force, LENGTH * np.sin(angle)), rel=1e-3)
    assert found["torque"].to_numpy() == pytest.approx(force * LENGTH * np.cos(angle), rel=1e-9)


def test_a_log_without_force_has_an_angle_only(tmp_path: Path) -> None:
    found = mrfit.read(str(write(tmp_path, 0.05 * np.sin(np.linspace(0.0, 12.0, 400)), None)))[0].to_frame()
    assert "angle" in found
    assert "torque" not in found


def test_a_stroke_longer_than_the_lever_is_refused_in_one_line(tmp_path: Path) -> None:
    path = write(tmp_path, 0.25 * np.sin(np.linspace(0.0, 12.0, 400)), None)
    with pytest.raises(DataError, match=r"as long as the lever of 0\.2 m.*check the unit"):
        mrfit.read(str(path))


def test_without_a_lever_nothing_is_added(tmp_path: Path) -> None:
    path = write(tmp_path, 0.05 * np.sin(np.linspace(0.0, 12.0, 400)), None)
    (tmp_path / "mrfit.toml").write_text("")
    assert "angle" not in mrfit.read(str(path))[0].to_frame()


def test_a_log_without_displacement_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "mrfit.toml").write_text(MAP)
    (tmp_path / "log.csv").write_text("Time,Load\ns,N\n" + "".join(f"{k / 100},{k % 7}\n" for k in range(200)))
    with pytest.raises(DataError, match="gives a lever, but the log has no displacement"):
        mrfit.read(str(tmp_path / "log.csv"))
