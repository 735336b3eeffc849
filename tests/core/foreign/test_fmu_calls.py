"""The calls that step an FMU, in their order, of a slave that only notes them; what fails is nan or one line."""

import os
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrfit.core.foreign import fmu as of_fmu
from mrfit.core.foreign.fmu import check_size, fmu_model
from mrfit.core.foreign.model import ForeignModel
from mrfit.core.specs import ModelSpec, Param
from mrfit.errors import ConfigError

SPEC = ModelSpec(
    name="noted",
    title="A slave that notes its calls",
    equation="",
    reference="",
    inputs=("velocity", "current"),
    output="force",
    params=(Param("fy", "N", 0.0, 1e4, 1.0), Param("c", "N*s/m", 0.0, 1e4, 1.0)),
)
NAMES = {"velocity": 3, "current": 1, "fy": 8, "c": 5, "F": 2}
DT = 0.25


class Slave:
    """Notes its calls; its force is fy times its first input, plus the steps it was taken."""

    def __init__(self, fails: Callable[[int, float], object]) -> None:
        self.calls, self.values, self.steps, self.fails = list[Any](), dict[int, float](), 0, fails

    def write(self, references: list[int], values: list[float]) -> None:
        self.calls.append(("set", references, values))
        self.values |= dict(zip(references, values, strict=True))

    def read(self, references: list[int]) -> list[float]:
        assert references == [NAMES["F"]]
        return [self.values[8] * self.values[3] + self.steps]

    def reset(self) -> None:
        self.calls.append("reset")
        self.steps, self.values = 0, {}

    def enterInitializationMode(self, **given: float) -> None:  # noqa: N802
        self.calls.append(("enter", given))

    def exitInitializationMode(self) -> None:  # noqa: N802
        self.calls.append("exit")

    def doStep(self, currentCommunicationPoint: float, communicationStepSize: float) -> None:  # noqa: N802, N803
        self.calls.append(("step", currentCommunicationPoint, communicationStepSize))
        self.steps += 1
        self.fails(self.steps, self.values[8])


class SecondSlave(Slave):
    setReal, getReal = Slave.write, Slave.read

    def setupExperiment(self, **given: float) -> None:  # noqa: N802
        self.calls.append(("setup", given))


class ThirdSlave(Slave):
    setFloat64, getFloat64 = Slave.write, Slave.read


class Library:
    """Stands for FMPy: what it is asked for, and what it answers."""

    def __init__(self, three: bool) -> None:
        variables = [SimpleNamespace(name=n, valueReference=r) for n, r in NAMES.items()]
        version = "3.0" if three else "2.0"
        self.description = SimpleNamespace(fmiVersion=version, coSimulation=object(), modelVariables=variables)
        self.kind: type[Slave] = ThirdSlave if three else SecondSlave
        self.made = list[Slave]()
        self.fails: Callable[[int, float], object] = lambda step, fy: None
        self.starts: Callable[[], object] = lambda: None

    def read_model_description(self, file: str, validate: bool) -> Any:
        return self.description

    def extract(self, file: str, unzipdir: str) -> str:
        return unzipdir

    def instantiate_fmu(self, folder: str, description: Any, kind: str, require_functions: bool) -> Slave:
        assert description is self.description and kind == "CoSimulation"
        self.starts()
        self.made.append(self.kind(self.fails))
        return self.made[-1]


@pytest.fixture(params=[False, True], ids=["fmi 2", "fmi 3"])
def library(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Library:
    found = Library(request.param)
    monkeypatch.setitem(sys.modules, "fmpy", found)
    monkeypatch.setattr(of_fmu.temporary, "kept", lambda word: tmp_path)
    with zipfile.ZipFile(tmp_path / "noted.fmu", "w") as made:
        made.writestr("modelDescription.xml", "<a/>")
    return found


def noted(tmp_path: Path) -> ForeignModel:
    return fmu_model(SPEC, tmp_path / "noted.fmu", {"force": "F"})


def simulated(model: ForeignModel, drive: list[list[float]], theta: list[list[float]]) -> list[list[float]]:
    found: list[list[float]] = model.item.response(np.array(drive), np.array(theta), DT).tolist()
    return found


def test_a_sample_s_inputs_are_set_before_the_step_to_it(library: Library, tmp_path: Path) -> None:
    assert simulated(noted(tmp_path), [[1.0, 2.0, 4.0], [0.5, 0.6, 0.7]], [[10.0, 7.0]]) == [[10.0, 21.0, 42.0]]
    (slave,) = library.made
    begun = (
        [("enter", {"startTime": 0.0})]
        if isinstance(slave, ThirdSlave)
        else [("setup", {"startTime": 0.0}), ("enter", {})]
    )
    assert slave.calls == [
        "reset",
        ("set", [8, 5], [10.0, 7.0]),
        *begun,
        ("set", [3, 1], [1.0, 0.5]),
        "exit",
        ("set", [3, 1], [2.0, 0.6]),
        ("step", 0.0, DT),
        ("set", [3, 1], [4.0, 0.7]),
        ("step", DT, DT),
    ]


def test_every_parameter_vector_begins_anew_in_one_instance(library: Library, tmp_path: Path) -> None:
    model = noted(tmp_path)
    assert simulated(model, [[1.0, 1.0], [0.0, 0.0]], [[1.0, 0.0], [3.0, 0.0]]) == [[1.0, 2.0], [3.0, 4.0]]
    assert len(library.made) == 1 and library.made[0].calls.count("reset") == 2


def test_a_forked_process_has_an_instance_of_its_own(
    library: Library, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, drive = noted(tmp_path), [[1.0], [0.0]]
    simulated(model, drive, [[1.0, 0.0]])
    monkeypatch.setattr(os, "getpid", lambda: -7)
    simulated(model, drive, [[1.0, 0.0]])
    simulated(model, drive, [[1.0, 0.0]])
    assert len(library.made) == 2


def test_what_fails_is_nan_from_there_and_the_next_begins_with_another_instance(
    library: Library, tmp_path: Path
) -> None:
    def fails(step: int, fy: float) -> None:
        if step == 2 and fy > 5.0:
            raise RuntimeError("fatal")

    library.fails = fails
    found = simulated(noted(tmp_path), [[1.0] * 4, [0.0] * 4], [[9.0, 0.0], [2.0, 0.0]])
    np.testing.assert_array_equal(found, [[9.0, 10.0, np.nan, np.nan], [2.0, 3.0, 4.0, 5.0]])
    assert len(library.made) == 2


def test_a_value_that_is_no_number_ends_a_simulation_and_keeps_the_instance(library: Library, tmp_path: Path) -> None:
    found = simulated(noted(tmp_path), [[1.0, np.inf, 1.0, 1.0], [0.0] * 4], [[1.0, 0.0], [2.0, 0.0]])
    np.testing.assert_array_equal(found, [[1.0, np.inf, np.nan, np.nan], [2.0, np.inf, np.nan, np.nan]])
    (slave,) = library.made
    assert sum(call[0] == "step" for call in slave.calls) == 2


def test_the_names_and_the_bytes_of_an_fmu_are_what_it_is_known_by(library: Library, tmp_path: Path) -> None:
    first = noted(tmp_path)
    assert first.source == noted(tmp_path).source and first.item.SPEC.caution.startswith("the model noted is an FMU")
    library.description.modelVariables.append(SimpleNamespace(name="G", valueReference=9))
    other = fmu_model(SPEC, tmp_path / "noted.fmu", {"force": "G"})
    with zipfile.ZipFile(tmp_path / "noted.fmu", "a") as made:
        made.writestr("more", "")
    assert len({first.source, other.source, noted(tmp_path).source}) == 3


def test_what_an_fmu_lacks_is_one_line(library: Library, tmp_path: Path) -> None:
    file = tmp_path / "noted.fmu"
    with pytest.raises(ConfigError, match=r"has no variable 'force'; name it in \[fmu.variables\] \(it has velocity, "):
        fmu_model(SPEC, file, {})
    with pytest.raises(ConfigError, match="has no variable 'yield'; "):
        fmu_model(SPEC, file, {"force": "F", "fy": "yield"})

    def starts() -> None:
        raise OSError("wrong\n  system")

    library.starts = starts
    with pytest.raises(ConfigError) as raised:
        simulated(noted(tmp_path), [[1.0], [0.0]], [[1.0, 0.0]])
    assert str(raised.value) == f"{file}: cannot be started (wrong system); export it for this system"
    library.description.coSimulation = None
    with pytest.raises(ConfigError, match="noted.fmu: is no FMU for co-simulation; export it as one$"):
        noted(tmp_path)
    file.write_bytes(b"none")
    with pytest.raises(ConfigError, match="noted.fmu: cannot be read as an FMU .*; export it again$"):
        noted(tmp_path)


def test_an_fmu_as_large_as_allowed_is_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "a.fmu"
    with zipfile.ZipFile(file, "w") as made:
        for k in range(3):
            made.writestr(str(k), b"\0" * 1000)
    for most, files, free, refused in (
        (3000, 3, 6000, False),
        (2999, 3, 6000, True),
        (3000, 2, 6000, True),
        (3000, 3, 5998, True),
    ):
        monkeypatch.setattr(of_fmu, "MOST_BYTES", most)
        monkeypatch.setattr(of_fmu, "MOST_FILES", files)
        monkeypatch.setattr("shutil.disk_usage", lambda path, free=free: SimpleNamespace(free=free))
        if refused:
            with pytest.raises(ConfigError, match="a.fmu: unpacks to"):
                check_size(file)
        else:
            check_size(file)
