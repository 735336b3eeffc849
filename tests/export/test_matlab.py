"""The MATLAB function, run by Octave: what it gives is what Python simulates."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrfit.core import registry
from mrfit.export.c_parts import parts_of
from mrfit.export.matlab import files, function_file, run_octave
from mrfit.export.source import ExportSource
from mrfit.settings.export import Settings
from mrfit.simulate.current_dependence import CurrentDependence, orders_of
from tests.export.rigs import rig

OCTAVE = shutil.which("octave-cli") or shutil.which("octave") or ""
pytestmark = pytest.mark.skipif(not OCTAVE, reason="no Octave")

# What a causal form does not know, as in the tests of C
LOOSE = {"eddy-current": 2e-4, "delay": 1e-3, "coulomb-friction": 1e-3, "stribeck": 1e-3, "velocity-hysteresis": 1e-3}


def share(source: ExportSource) -> float:
    parts = parts_of(source)
    text = function_file(source, parts, ["measured elsewhere"])
    drive = source.drive(source.stretches[0])
    rows = drive[[source.spec.inputs.index(n) for n in source.channels]]
    wanted = source.simulate(drive, 1e-3)
    got, inside = run_octave(OCTAVE, parts, text, rows, 1e-3)
    assert np.all(inside == 1)
    return float(np.abs(got - wanted).max() / np.ptp(wanted))


def allowed(model: str) -> float:
    return max([1e-9, *(LOOSE[n] for n in model.split("+")[1:] if n in LOOSE)])


@pytest.mark.parametrize("model", ["boucwen+temperature+force-filter", "boucwen-flux+eddy-current"])
def test_is_the_simulation(model: str) -> None:
    assert share(rig(model, seconds=0.3)) < allowed(model)


def test_follows_a_current_that_moves() -> None:
    spec = registry.load("model", "boucwen").SPEC
    dependence = CurrentDependence(orders_of(spec, "alpha=plain2,kappa=log1/0.7/1,c=1:0.5:1"), 0.2, 1.4)
    assert share(rig("boucwen", dependence, seconds=0.3)) < 1e-9


def test_a_loop_that_depends_on_current_reads_its_curve_until_the_current_moves() -> None:
    spec = registry.load("model", "boucwen").SPEC
    source = rig("boucwen", CurrentDependence(orders_of(spec, "kappa=1,n=1"), 0.2, 1.4), seconds=0.3)
    (stretch,) = source.stretches
    current = stretch.inputs["current"].copy()
    current[:150] = current[0]
    source = replace(source, stretches=(replace(stretch, inputs={**stretch.inputs, "current": current}),))
    assert share(source) < 1e-9


def test_the_file_states_what_octave_measured(tmp_path: Path) -> None:
    made = files(rig("tanh", seconds=0.3), Settings())
    # a function of this name would hide MATLAB's own
    text = made.contents["tanh_fit.m"].decode()
    assert made.error is not None and made.error < 1e-9
    assert made.said[0][:60] in " ".join(text.replace("%", " ").split())
    assert text.startswith("function [force, state, in_range] = tanh_fit(displacement, velocity, dt, state)\n")


def test_an_excerpt_is_compared_with_the_simulation_of_its_whole_log() -> None:
    # the middle of the stroke is that of the log, which a few hundred samples do not have
    source = rig("tanh+velocity-hysteresis", seconds=1.3)
    (stretch,) = source.stretches
    drift = 0.02 * np.linspace(-1.0, 1.0, len(stretch.measured)) ** 3
    moved = {**stretch.inputs, "displacement": stretch.inputs["displacement"] + drift}
    difference = files(replace(source, stretches=(replace(stretch, inputs=moved),)), Settings()).error
    assert difference is not None and difference < LOOSE["velocity-hysteresis"]


@pytest.mark.parametrize("name", ["a'; system('x')\n end", "%{ ..."])
def test_hostile_names_stay_in_their_comment(name: str) -> None:
    source = rig("bingham", seconds=0.1)
    source = replace(source, condition=name, content=replace(source.content, name=name))
    assert share(source) < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(
    "model", [*registry.names("model"), *(f"tanh+{e}" for e in ("delay", "asymmetry", "stribeck"))]
)
def test_every_model_is_the_simulation(model: str) -> None:
    assert share(rig(model, seconds=0.3)) < allowed(model)
