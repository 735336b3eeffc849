"""Factors in names and units of columns."""

import numpy as np
import pytest

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog

K = np.arange(200)
FORCE = 987.0 * np.sin(K / 20.0)


def log(cell: str, factor: float, unit_row: str = "") -> str:
    rows = "".join(f"{k * 1e-3:.3f},{f / factor:.9g}\n" for k, f in zip(K, FORCE, strict=True))
    return f"Time{'' if unit_row else ' (s)'},{cell}\n{unit_row}{rows}"


@pytest.mark.parametrize(
    ("cell", "factor"),
    [
        ("Force x1000 (N)", 1e3),
        ("Force X1000 (N)".replace("X", "×"), 1e3),
        ("Force *10^3 (N)", 1e3),
        ("Force x 10 [N]", 10.0),
        ("Force (x1000) [N]", 1e3),
        ("Force x10³ (N)", 1e3),
        ("Force x 1e3 (N)", 1e3),
        ("Force_x1000_N", 1e3),
        ("Force (N) x1000", 1e3),
        ("Force x0.001 (N)", 1e-3),
        ("Force x10^-2 (kN)", 10.0),
        ("Force (N x 10)", 10.0),
        ("Force (x1000 N)", 1e3),
        ("Force (10^3 N)", 1e3),
        ("Force [10³ N]", 1e3),
        ("Force (N*10^3)", 1e3),
        ("Force [100 N]", 1e2),
        ("Force X10 (N)", 10.0),
        ("Force*1000 (N)", 1e3),
        ("Force(N)*1000", 1e3),
        ("Force*0.5 (N)", 0.5),
        ("Force·200 (N)", 200.0),
        ("Force X200 (N)", 200.0),
        ("Forcex1000 (N)", 1e3),
        ("Force 10X (N)", 10.0),
        ("10*Force (N)", 10.0),
        ("Force (N X10)", 10.0),
        ("Force [X10 N]", 10.0),
        ("Force (x10 N)", 10.0),
    ],
)
def test_a_factor_multiplies(cell: str, factor: float, read_log: ReadLog) -> None:
    (record,) = read_log(log(cell, factor))
    np.testing.assert_allclose(record.channels["force"], FORCE, rtol=1e-7, atol=1e-5)
    assert any(f.kind == "factor" for f in record.findings)


def test_a_factor_above_a_row_of_units(read_log: ReadLog) -> None:
    (record,) = read_log(log("Force x1000", 1e3, "s,N\n"))
    np.testing.assert_allclose(record.channels["force"], FORCE, rtol=1e-7, atol=1e-5)


@pytest.mark.parametrize(
    "cell",
    [
        "Force /100 (N)",
        "Force / 10^3 (N)",
        "Force x1000",
        "Force (x1000)",
        "Force ÷10 [N]",
        "Force/10 (N)",
        "Force X10",
    ],
)
def test_a_factor_that_says_two_things_makes_no_force(cell: str, read_log: ReadLog) -> None:
    text = log(cell, 100.0)
    (record,) = read_log(text)
    assert "force" not in record.channels
    assert any(f.kind == "unknown-unit" and "channel map" in f.text for f in record.findings)
    (record,) = read_log(text, channel_map='[channels]\nforce = {column = 1, unit = "N", scale = 100}\n')
    np.testing.assert_allclose(record.channels["force"], FORCE, rtol=1e-7, atol=1e-5)


def test_a_map_without_unit_leaves_the_factor(read_log: ReadLog) -> None:
    (record,) = read_log(log("Kraft A x1000 (N)", 1e3), channel_map='[channels]\nforce = {column = "Kraft A x1000"}\n')
    np.testing.assert_allclose(record.channels["force"], FORCE, rtol=1e-7, atol=1e-5)


@pytest.mark.parametrize("cell", ["Force x2 (N)", "Force 1000 (N)", "Force 10 (N)", "Force V2 (N)", "Force (N)"])
def test_names_with_numbers_have_no_factor(cell: str, read_log: ReadLog) -> None:
    (record,) = read_log(log(cell, 1.0))
    np.testing.assert_allclose(record.channels["force"], FORCE, rtol=1e-7, atol=1e-5)
    assert not any(f.kind == "factor" for f in record.findings)


def test_a_factor_of_the_time(read_log: ReadLog) -> None:
    rows = "".join(f"{k * 0.1:.1f},{f:.6f}\n" for k, f in zip(K, FORCE, strict=True))
    (record,) = read_log("Time x0.01 (s),Force (N)\n" + rows)
    assert record.dt == pytest.approx(1e-3)


@pytest.mark.parametrize(
    "header",
    [
        "Time,Force,Disp\nScale,1,1000,0.1\n",
        "Name,Time,Force,Disp\nUnit,s,N,mm\nFactor,1,1000,0.1\n",
        "Name,Time,Force,Disp\nUnit,s,N,mm\nOffset,0,100,1.5\n",
        "# Gain: ,1,1000,0.1\nTime (s),Force (N),Disp (mm)\n",
        "Multiplier,1,1000,0.1\nTime (s),Force (N),Disp (mm)\n",
        "Time (s),Force (N),Disp (mm)\nFaktor,1000,0.1\n",
        "Time (s),Force (N),Disp (mm)\nmultiplied by,1000,0.1\n",
        "Umrechnungsfaktor: 1,1000,0.1\nTime (s),Force (N),Disp (mm)\n",
        "Time (s),Force (N),Disp (mm)\n/1,/1000,/0.1\n",
        "Time (s),Force (N),Disp (mm)\n1,1000,0.1\n",
        "Time,Force,Disp\ns,N,mm\n1,0.001,10\n",
    ],
)
def test_a_row_of_factors_is_refused_by_its_line(header: str, read_log: ReadLog) -> None:
    lead = "," if header.startswith("Name") else ""
    rows = "".join(f"{lead}{k * 1e-3:.3f},{f:.4f},{f / 90:.4f}\n" for k, f in zip(K, FORCE, strict=True))
    with pytest.raises(Refusal, match=r"line [1-3].*scale factors"):
        read_log(header + rows)


@pytest.mark.parametrize(
    "header",
    [
        "Time (s),Force (N),Disp (mm)\n",
        "Gain,10\nTime (s),Force (N),Disp (mm)\n",
        "Scale,1,1,1\nTime (s),Force (N),Disp (mm)\n",
        "Time (s),Force (N),Disp (mm)\n-0.001,100,1\n",
    ],
)
def test_settings_are_no_row_of_factors(header: str, read_log: ReadLog) -> None:
    rows = "".join(f"{k * 1e-3:.3f},{f:.4f},{f / 90:.4f}\n" for k, f in zip(K, FORCE, strict=True))
    (record,) = read_log(header + rows)
    np.testing.assert_allclose(record.channels["force"][-200:], FORCE, atol=1e-3)


@pytest.mark.parametrize(
    "header",
    [
        "multiply by,1,1000,0.1\n{names}",
        "Multiply by: 1,1000,0.1\n{names}",
        "{names}multiply by,1000,0.1\n",
        "{names}x1,x1000,x0.1\n",
        "x1,x1000,x0.1\n{names}",
        "{names}*1,*1000,*0.1\n",
        "{names},×10³,×10⁻¹\n",
        "{names}-,1000x,0.1x\n",
        "{names}(x1),(x1000),(x0.1)\n",
        "Time,Force,Disp\nx1,x1000,x0.1\ns,N,mm\n",
        "Time,Force,Disp\ns,N,mm\n*1,*1000,*0.1\n",
    ],
)
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_a_row_that_says_to_multiply_is_applied(header: str, delimiter: str, read_log: ReadLog) -> None:
    top = header.format(names="Time (s),Force (N),Disp (mm)\n").replace(",", delimiter)
    rows = "".join(f"{k * 1e-3:.3f},{f / 1e3:.9f},{f / 9:.6f}\n" for k, f in zip(K, FORCE, strict=True))
    text = top + rows.replace(",", delimiter)
    (record,) = read_log(text)
    np.testing.assert_allclose(record.channels["force"], FORCE, atol=1e-5)
    np.testing.assert_allclose(record.channels["displacement"], FORCE / 9e4, atol=1e-9)
    assert record.dt == pytest.approx(1e-3)
    (said,) = [f.text for f in record.findings if f.kind == "factor"]
    assert said.startswith("line ") and "multiplied by 1, 1000, 0.1" in said
    mapped = '[channels]\nforce = {column = 1, unit = "N", scale = 1000}\ndisplacement = {column = 2}\n'
    (record,) = read_log(text, channel_map=mapped)
    np.testing.assert_allclose(record.channels["force"], FORCE, atol=1e-5)
    np.testing.assert_allclose(record.channels["displacement"], FORCE / 9e4, atol=1e-9)


@pytest.mark.parametrize("names", ["x1,x2,x3", "x,1,2", "t,x10,x100"])
def test_names_that_look_like_factors(names: str, read_log: ReadLog) -> None:
    rows = "".join(f"{k * 1e-3:.3f},{f:.4f},{f / 90:.4f}\n" for k, f in zip(K, FORCE, strict=True))
    mapped = 'time = 0\n[channels]\nforce = {column = 1, unit = "N"}\n'
    (record,) = read_log(f"{names}\n{rows}", channel_map=mapped)
    np.testing.assert_allclose(record.channels["force"], FORCE, atol=1e-3)
    assert not any(f.kind == "factor" for f in record.findings)


@pytest.mark.parametrize("row", ["0.1,x0.5,2", "0.1,0.5,x2", "0.1,∞,x2"])
def test_a_garbled_cell_makes_no_row_of_factors(row: str, read_log: ReadLog) -> None:
    rows = "".join(f"{0.1 * k:.1f},{k % 7},{k % 5}\n" for k in range(2, 40))
    (record,) = read_log(f"time (s),force (N),displacement (mm)\n{row}\n{rows}")
    assert record.rows_refused == 1 and not [f for f in record.findings if f.kind == "factor"]
    assert record.channels["force"][:3].tolist() == [2.0, 3.0, 4.0]
