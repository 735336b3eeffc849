"""A driven mass in C and as an FMU: the integrator of the export against that in Python."""

import io
import zipfile
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from mrfit.core.channels import EXCITATIONS
from mrfit.driven.integrator import PER_SAMPLE
from mrfit.driven.motion import between_samples, split
from mrfit.errors import ConfigError, DataError
from mrfit.export import fmu, stage
from mrfit.export.c import built, differs, rendered
from mrfit.export.c_parts import parts_of
from mrfit.export.causality import costs
from mrfit.export.compiler import compiler
from mrfit.export.source import ExportSource, LogStretch
from mrfit.settings.export import Settings
from mrfit.simulate.assembly import assemble
from tests.export.rigs import rig
from tests.export.test_c import STRICT

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")
DT = 2e-3
HARDENING = {"c": 10.0, "k": 5e4, "x0": 1e-4, "alpha": 5e4, "b": -2.2, "g": 1.6, "n": 1.0, "z0": 2e-3, "mass": 2.0}
STICKS = {"fy": 50.0, "C_inf": 20.0, "f0": 3.0, "mass": 2.0}
DELAYED = {
    "fy": 8.0,
    "a1": 80.0,
    "a2": 60.0,
    "c": 60.0,
    "k": 4e3,
    "f0": 1.0,
    "delay.tau": 4e-3,
    "delay.s": 0.3,
    "mass": 2.0,
}


def source(name: str, values: Mapping[str, float], samples: int = 500) -> ExportSource:
    whole, (law, by, _) = assemble(name), split(name)
    theta, time = whole.spec.theta(values), DT * np.arange(samples)
    drive = sum(a * np.sin(2 * np.pi * f * time + f) for a, f in ((90.0, 7.0), (60.0, 17.0), (25.0, 31.0)))
    inputs = {EXCITATIONS[by]: np.asarray(drive) / (1.0 if by == "force" else 2.0)}
    inputs |= {n: 20.0 + time for n in whole.spec.inputs[1:]}
    moved = whole.simulate(np.stack([inputs[n] for n in whole.spec.inputs]), theta[None], DT)[0]
    stretch = LogStretch("s", "all", "train", DT, inputs, moved, moved)
    made = rig(law)
    return replace(made, assembly=whole, theta=theta, stretches=(stretch,), condition="all")


@pytest.mark.parametrize(
    ("name", "values", "share"),
    [
        ("boucwen-hardening@force", HARDENING, 2e-5),
        ("boucwen-hardening@base-absolute-acceleration", HARDENING, 2e-4),
        ("tanh+delay@base-velocity", DELAYED, 2e-4),
        # where it sticks both take steps of order 1, of different lengths
        ("bingham@force", STICKS, 3e-3),
    ],
)
def test_excitation_given_as_often_as_the_integrator_sees_it_moves_the_mass_alike(name, values, share) -> None:
    own = source(name, values)
    parts, drive = parts_of(own), own.drive(own.stretches[0])
    fine = np.stack([between_samples(drive[0])])
    with built(parts, rendered(own, parts, ["measured elsewhere"], costs(own)), STRICT) as program:
        found, in_range = program.run(fine, DT / PER_SAMPLE)
    wanted = own.simulate(drive, DT)
    assert np.abs(found[::PER_SAMPLE] - wanted).max() < share * np.ptp(wanted)
    assert in_range[0] == 1.0


def test_excitation_as_logged_is_a_cubic_between_samples_and_the_difference_is_told() -> None:
    own = source("boucwen-hardening@force", HARDENING)
    parts = parts_of(own)
    files = rendered(own, parts, ["measured elsewhere"], costs(own))
    difference = differs(own, parts, files)
    assert difference.largest is not None and 0.0 < difference.largest < 0.01
    header = files[f"{parts.context.p}.h"]
    assert "excitation_force; /*" in header and "cubic through its last four values" in header


@pytest.mark.parametrize("fmi", [2, 3])
def test_fmu_has_the_force_in_and_the_motion_out(fmi: int) -> None:
    own = source("boucwen-hardening@force", HARDENING)
    made = fmu.files(own, Settings(fmi=fmi))
    assert made.error is not None and made.error < 0.01
    (archive,) = made.contents.values()
    text = zipfile.ZipFile(io.BytesIO(archive)).read("modelDescription.xml").decode()
    for variable in ("excitation_force", "displacement", "alpha", "mass"):
        assert f'name="{variable}"' in text


def test_other_formats_and_trackers_of_a_driven_mass_are_refused_in_one_line(tmp_path) -> None:
    own = source("bingham@force", STICKS, 50)
    with pytest.raises(DataError, match="--to matlab: a driven mass has no such form; --to c or fmu has"):
        stage.run(own, ["matlab"], tmp_path, Settings())
    with pytest.raises(ConfigError, match="a tracker is made of a model of force or flux"):
        stage.run(own, ["c"], tmp_path, Settings(track=("fy",)))
    assert not list(tmp_path.iterdir())
