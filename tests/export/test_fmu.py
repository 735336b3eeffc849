"""FMUs: valid by FMPy, and what FMPy simulates with them is what Python simulates."""

import io
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrfit.core import plugins, registry
from mrfit.core.foreign.fmu import fmu_model
from mrfit.core.specs import Array, ModelSpec
from mrfit.errors import ConfigError
from mrfit.export.c_parts import parts_of
from mrfit.export.compiler import compiler
from mrfit.export.fmi_description import model_description, variables_of
from mrfit.export.fmu import files
from mrfit.export.source import ExportSource
from mrfit.settings.export import Settings
from mrfit.simulate.current_dependence import CurrentDependence
from tests.export.rigs import rig
from tests.export.test_mass import HARDENING
from tests.export.test_mass import source as driven

fmpy = pytest.importorskip("fmpy", reason="an FMU needs FMPy: pip install 'mrfit[fmu]'")
validation = pytest.importorskip("fmpy.validation")
pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")

DEPENDENCE = CurrentDependence((("alpha", 2), ("c", 1)), 0.1, 1.5)
# A coil current that has a bend at the last sample of a lag is not known to a causal model
WITH_CURRENT = "boucwen+current-saturation+temperature+gas-spring"


def written(source: ExportSource, fmi: int, folder: Path) -> Path:
    made = files(source, Settings(fmi=fmi))
    assert made.error is not None and made.error < 1e-9
    (name,) = made.contents
    (folder / name).write_bytes(made.contents[name])
    return folder / name


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """The FMU's instance, initialised by hand."""
    description = fmpy.read_model_description(str(path))
    folder = fmpy.extract(str(path))
    slave = fmpy.instantiate_fmu(folder, description, "CoSimulation")
    try:
        yield slave, {v.name: v.valueReference for v in description.modelVariables}
    finally:
        slave.freeInstance()


DEPENDENCE_OF_TANH = CurrentDependence((("fy", 1),), 0.1, 1.5)


def stepped(path: Path, source: ExportSource, changed: dict[int, dict[str, float]] | None = None) -> Array:
    """The output at every sample, the inputs of a step set before it; parameters changed before some steps."""
    stretch = source.stretches[0]
    with opened(path) as (slave, references):
        three = hasattr(slave, "setFloat64")
        write, read = (slave.setFloat64, slave.getFloat64) if three else (slave.setReal, slave.getReal)
        inputs = [references[n] for n in source.channels]
        rows = np.column_stack([stretch.inputs[n] for n in source.channels])
        found = []
        for k, row in enumerate(rows.tolist()):
            if k == 0:
                if not three:
                    slave.setupExperiment(startTime=0.0)
                slave.enterInitializationMode()
            for name, value in (changed or {}).get(k, {}).items():
                write([references[name]], [value])
            write(inputs, row)
            if k == 0:
                slave.exitInitializationMode()
            else:
                slave.doStep(currentCommunicationPoint=(k - 1) * stretch.dt, communicationStepSize=stretch.dt)
            found += read([references[source.spec.output]])
        slave.terminate()
    return np.array(found)


@pytest.mark.parametrize("fmi", [2, 3])
def test_valid_and_the_simulation_in_python(fmi: int, tmp_path: Path) -> None:
    source = rig(WITH_CURRENT, DEPENDENCE)
    path = written(source, fmi, tmp_path)
    assert validation.validate_fmu(str(path)) == []
    wanted = source.simulate(source.drive(source.stretches[0]), 1e-3)
    np.testing.assert_allclose(stepped(path, source), wanted, atol=1e-6 * np.ptp(wanted))


@pytest.mark.parametrize("fmi", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_fmpy_drives_it_from_a_table(fmi: int, tmp_path: Path) -> None:
    source = rig("tanh")
    path = written(source, fmi, tmp_path)
    drive = source.drive(source.stretches[0])[:, :400]
    time = 1e-3 * np.arange(400)
    columns = [("time", float), *((n, float) for n in source.channels)]
    table = np.array(list(zip(time, *drive, strict=True)), dtype=columns)
    found = fmpy.simulate_fmu(
        str(path), input=table, output=["force", "in_range"], stop_time=time[-1], step_size=1e-3, output_interval=1e-3
    )
    # a master sets the inputs at the beginning of a step and reads the output at its end
    late = np.column_stack([drive[:, :1], drive[:, :-1]])
    wanted = source.simulate(late, 1e-3)
    np.testing.assert_allclose(found["force"], wanted, atol=1e-6 * np.ptp(wanted))
    assert np.all(found["in_range"])


@pytest.mark.parametrize("fmi", [pytest.param(2, marks=pytest.mark.slow), 3])
def test_parameters_are_tuned_at_the_start_and_on_the_way(fmi: int, tmp_path: Path) -> None:
    source = rig("boucwen")
    path = written(source, fmi, tmp_path)
    stretch, half = source.stretches[0], 500
    given = dict(zip(source.spec.names, source.theta.tolist(), strict=True))
    # a loop of another shape: the curve is tabulated anew
    start = {"n": 3.7, "beta": 900.0, "gamma": 150.0}
    got = stepped(path, source, {0: start, half: {"c": 2.0 * given["c"]}})
    before = np.array([list((given | start).values())])
    after = np.array([list((given | start | {"c": 2.0 * given["c"]}).values())])
    drive = source.drive(stretch)
    wanted = [source.assembly.simulate(drive, theta, 1e-3)[0] for theta in (before, after)]
    both = np.concatenate([wanted[0][:half], wanted[1][half:]])
    np.testing.assert_allclose(got, both, atol=1e-6 * np.ptp(both))
    assert np.abs(got - source.simulate(drive, 1e-3)).max() > 0.01 * np.ptp(both)


@pytest.mark.slow
def test_a_delay_set_on_the_way_finds_a_past(tmp_path: Path) -> None:
    source = rig("tanh+delay+current-lag", DEPENDENCE_OF_TANH, changes={"delay.tau": 0.0, "current-lag.t_d": 0.0})
    path, half, drive = written(source, 2, tmp_path), 500, source.drive(source.stretches[0])
    got = stepped(path, source, {half: {"delay.tau": 0.02, "delay.s": 0.0, "current-lag.t_d": 0.01}})
    late = source.theta.copy()
    for name, value in (("delay.tau", 0.02), ("delay.s", 0.0), ("current-lag.t_d", 0.01)):
        late[source.spec.names.index(name)] = value
    wanted = source.assembly.simulate(drive, late[None], 1e-3)[0]
    np.testing.assert_allclose(got[:half], source.simulate(drive, 1e-3)[:half], atol=1e-9 * np.ptp(wanted))
    # what the delay holds of the time before the current's delay was set has left after 20 ms
    np.testing.assert_allclose(got[half + 25 :], wanted[half + 25 :], atol=1e-9 * np.ptp(wanted))


def test_the_description_has_units_starts_and_words(tmp_path: Path) -> None:
    source = rig(WITH_CURRENT, DEPENDENCE)
    (tmp_path / "modelDescription.xml").write_bytes(model_description(source, parts_of(source), "{0}", ["head"], 2))
    description = fmpy.read_model_description(str(tmp_path / "modelDescription.xml"))
    by_name = {v.name: v for v in description.modelVariables}
    alpha = by_name["alpha@0.1A"]
    assert (alpha.unit, alpha.causality, alpha.variability) == ("N", "parameter", "tunable")
    assert "0.1 A" in alpha.description
    assert float(alpha.start) == source.theta[source.spec.names.index("alpha@0.1A")]
    assert by_name["temperature"].unit == "degC" and by_name["temperature"].start == "25.0"
    newton = next(u for u in description.unitDefinitions if u.name == "N").baseUnit
    assert (newton.kg, newton.m, newton.s) == (1, 1, -2)
    assert [v.reference for v in variables_of(source)] == list(range(len(by_name)))


def test_the_same_fit_gives_the_same_bytes_with_sources(tmp_path: Path) -> None:
    source = replace(rig("dahl"), stretches=())
    one, two = (files(source, Settings(fmi=3)).contents["dahl.fmu"] for _ in range(2))
    assert one == two
    with zipfile.ZipFile(io.BytesIO(one)) as archive:
        names = archive.namelist()
        assert b"rwx" not in archive.read("sources/dahl.c") and b"/tmp/" not in archive.read(names[-1])
    assert {"sources/dahl.c", "sources/fmi3.c", "sources/fmi3Functions.h", "sources/buildDescription.xml"} <= set(names)


def test_a_missing_compiler_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(ConfigError, match="^--to fmu needs a C compiler.*CC=no-such-compiler.*install gcc"):
        files(rig("bingham"), Settings())


def test_mrfit_reads_its_own_fmu_as_a_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plugins, "_store", plugins.Store())
    monkeypatch.setenv(plugins.VARIABLE, "")
    source = rig("guo")
    path = written(source, 2, tmp_path)
    spec = ModelSpec("guo-fmu", "", "", "", source.spec.inputs, "force", source.spec.params)
    model = fmu_model(spec, path, {})
    plugins.register(model.item, "a test", model.source)
    drive = source.drive(source.stretches[0])
    got = registry.load("model", "guo-fmu").response(drive, source.theta[None], 1e-3)[0]
    wanted = source.simulate(drive, 1e-3)
    np.testing.assert_allclose(got, wanted, atol=1e-6 * np.ptp(wanted))


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("model", registry.names("model"))
def test_every_model_is_valid_and_the_simulation(model: str, fmi: int, tmp_path: Path) -> None:
    source = rig(model)
    path = written(source, fmi, tmp_path)
    assert validation.validate_fmu(str(path)) == []
    wanted = source.simulate(source.drive(source.stretches[0]), 1e-3)
    np.testing.assert_allclose(stepped(path, source), wanted, atol=1e-6 * np.ptp(wanted))


@pytest.mark.parametrize("fmi", [2, 3])
def test_driven_mass_moves_as_in_python_and_its_mass_is_tuned(fmi: int, tmp_path: Path) -> None:
    source = driven("boucwen-hardening@force", HARDENING)
    ((name, archive),) = files(source, Settings(fmi=fmi)).contents.items()
    path = tmp_path / name
    path.write_bytes(archive)
    assert validation.validate_fmu(str(path)) == []
    wanted = source.simulate(source.drive(source.stretches[0]), source.stretches[0].dt)
    np.testing.assert_allclose(stepped(path, source), wanted, atol=2e-3 * np.ptp(wanted))
    heavier = replace(source, theta=np.append(source.theta[:-1], 3.0))
    changed = heavier.simulate(source.drive(source.stretches[0]), source.stretches[0].dt)
    np.testing.assert_allclose(stepped(path, source, {0: {"mass": 3.0}}), changed, atol=2e-3 * np.ptp(changed))
    assert np.abs(changed - wanted).max() > 0.01 * np.ptp(wanted)
