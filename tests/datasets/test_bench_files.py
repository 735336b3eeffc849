import ast
import json
from pathlib import Path

import numpy as np
import pytest

import datasets.rig
from datasets.rig import noise, press
from datasets.rig.case import Hidden, make
from datasets.rig.coil_bench import channel_map
from datasets.rig.style import Style

INTERVAL = np.array([0.002, 0.002])


def tree(folder):
    return {p.name: p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def table(path):
    return np.genfromtxt(path, delimiter=",", skip_header=2)


@pytest.mark.parametrize("path", sorted(Path(datasets.rig.__file__).parent.glob("*.py")), ids=lambda p: p.stem)
def test_the_rig_shares_no_code_with_the_program(path):
    for node in ast.walk(ast.parse(path.read_text())):
        names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        assert not any(n.split(".")[0] == "mrfit" for n in names)


@pytest.mark.parametrize("kind", noise.KINDS)
def test_noise_has_the_deviation_asked_for(kind):
    drawn = noise.draw(kind, np.array([3.0, 3.0]), 40_000, INTERVAL, np.random.default_rng(1))
    deviation = 1.0 if kind == "coarse" else 3.0
    assert drawn.std() == pytest.approx(deviation, rel=0.03)
    lag_one = np.mean(drawn[:, 1:] * drawn[:, :-1]) / deviation**2
    assert lag_one == pytest.approx({"coloured": 0.8, "hum": 0.5 * np.cos(0.2 * np.pi)}.get(kind, 0.0), abs=0.03)


def test_the_converter_has_twelve_bits():
    stored = noise.quantise(np.linspace(-2.0, 2.0, 100_001), 1.0)
    assert len(np.unique(stored)) == 4096
    assert np.abs(stored).max() <= 1.0


def test_the_press_moves_as_its_derivatives_say():
    tests = press.rich(np.random.default_rng(2))
    motion = press.motion_of(tests)
    assert len({t.name for t in tests}) == len(tests) == 12
    inner = np.s_[:, 2:-2]
    speed = np.gradient(motion.position, motion.step, axis=1)
    acceleration = np.gradient(motion.speed, motion.step, axis=1)
    assert np.abs(speed - motion.speed)[inner].max() < 1e-3 * np.abs(motion.speed).max()
    assert np.abs(acceleration - motion.acceleration)[inner].max() < 2e-3 * np.abs(motion.acceleration).max()
    assert motion.current.min() == 0.0
    assert motion.current.max() == pytest.approx(2.8)


def test_the_same_seed_gives_the_same_files_and_another_seed_others(tmp_path):
    hidden = Hidden("damper", effects={"delay": 0.001}, seed=5)
    make(hidden, tmp_path / "a")
    make(hidden, tmp_path / "b")
    make(Hidden("damper", effects={"delay": 0.001}, seed=6), tmp_path / "c")
    assert tree(tmp_path / "a") == tree(tmp_path / "b")
    assert tree(tmp_path / "a") != tree(tmp_path / "c")


def test_the_truth_lies_beside_the_logs_not_among_them(tmp_path):
    make(Hidden("damper", effects={"inertia": 11.0}, seed=1), tmp_path)
    assert not list((tmp_path / "logs").rglob("*truth*"))
    assert all("inertia" not in p.read_text() for p in (tmp_path / "logs").iterdir())
    assert json.loads((tmp_path / "truth.json").read_text())["effects"] == {"inertia": 11.0}


def test_an_unknown_effect_is_refused(tmp_path):
    with pytest.raises(ValueError, match="phlogiston"):
        make(Hidden("damper", effects={"phlogiston": 1.0}), tmp_path)


def test_a_rewritten_damper_log_holds_the_same_signals(tmp_path):
    plain = Hidden("damper", programme="two-logs", seed=3)
    make(plain, tmp_path / "plain")
    styles = Style(other_units=True, sign=-1.0, stride=2, renamed=True)
    make(Hidden("damper", programme="two-logs", seed=3, style=styles), tmp_path / "other")
    names = [f"{n}.csv" for n in styles.names(["sine_2Hz_10mm_0.7A", "sine_2Hz_10mm_1.4A"])]
    one = table(tmp_path / "plain" / "logs" / "sine_2Hz_10mm_0.7A.csv")[::2]
    two = table(tmp_path / "other" / "logs" / names[0])
    assert two[:, 0] == pytest.approx(one[:, 0])
    assert two[:, 1] * 25.4 == pytest.approx(-one[:, 1], abs=1e-4)
    assert two[:, 2] * 4.4482216152605e-3 == pytest.approx(-one[:, 2], abs=1e-6)
    assert two[:, 3] / 1e3 == pytest.approx(one[:, 3], abs=1e-4)
    assert (two[:, 4] - 32) / 1.8 == pytest.approx(one[:, 4], abs=2e-3)


def test_a_column_left_out_is_not_written(tmp_path):
    style = Style(columns=("Displacement", "Load", "Current"))
    make(Hidden("damper", programme="one-log", style=style), tmp_path)
    (log,) = (tmp_path / "logs").glob("*.csv")
    assert log.read_text().splitlines()[0] == "Time,Displacement,Load,Current"


@pytest.mark.slow
def test_a_coil_log_obeys_the_circuit_equation(tmp_path):
    truth = make(Hidden("coil", programme="one-log", seed=2, style=Style(integrator=True)), tmp_path)
    lines = (tmp_path / "logs" / "sine_5Hz_3A.csv").read_text().splitlines()
    data = np.array([[float(c) for c in line.split(",")] for line in lines[lines.index("TIME,CH1,CH2,CH3") + 1 :]])
    current, flux = 10 * data[:, 2], data[:, 3] / 50.0
    rate = data[:, 1] - truth["map_resistance"] * current
    rate = rate[-2500:] - rate[-2500:].mean()
    rebuilt = np.cumsum(rate) / (250 * 5)
    apart = (rebuilt - rebuilt.mean()) - (flux[-2500:] - flux[-2500:].mean())
    assert np.std(apart) < 0.01 * np.ptp(flux)
    assert f"resistance = {truth['map_resistance']:.6g}" in channel_map(truth["map_resistance"], Style())


def test_a_testsuite_log_holds_what_the_csv_log_holds(tmp_path):
    make(Hidden("damper", programme="one-log", seed=3), tmp_path / "csv")
    make(Hidden("damper", programme="one-log", seed=3, style=Style(testsuite=True)), tmp_path / "txt")
    one = table(next((tmp_path / "csv" / "logs").iterdir()))
    (log,) = (tmp_path / "txt" / "logs").iterdir()
    assert log.read_bytes().startswith(b"\xef\xbb\xbfFile Path: ")
    two = np.genfromtxt(log, delimiter="\t", skip_header=8, encoding="utf-8-sig")
    assert two[:, :4] == pytest.approx(one[:, 1:])
    assert two[:, 4] - 76.675 == pytest.approx(one[:, 0], abs=1e-9)
