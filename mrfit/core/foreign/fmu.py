"""A model that is an FMU for co-simulation (FMI 2 or 3), stepped from sample to sample by FMPy.

The inputs of a sample are set before the step that leads to it and held over that step; the output is read after it.
The output of sample 0 is read after initialisation.
"""

import hashlib
import math
import os
import shutil
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mrfit.core import temporary
from mrfit.core.foreign.model import ForeignModel, foreign_model
from mrfit.core.specs import Array, ModelSpec
from mrfit.errors import ConfigError

# An FMU with its sources, its pages and libraries for five systems has some hundred megabytes
MOST_BYTES, MOST_FILES = 10**9, 10_000
FMU_CAUTION = "the model {} is an FMU stepped from sample to sample: far slower than a model of mrfit's own"


def fmu_model(spec: ModelSpec, file: Path, variables: Mapping[str, str]) -> ForeignModel:
    """Return an FMU as a model; its bytes are part of the keys of its fits.

    Parameters
    ----------
    spec
        What the model is; its ``caution`` is set here.
    file
        The FMU.
    variables
        Its names of those channels and parameters that it calls otherwise.

    Raises
    ------
    ConfigError
        If FMPy is not installed, the file is no FMU for co-simulation, or lacks a variable.
    """
    simulate = _Slave(spec, file, variables).simulate
    source = f"{spec!r} {sorted(variables.items())} {hashlib.sha256(file.read_bytes()).hexdigest()}"
    return foreign_model(spec, FMU_CAUTION, simulate, source)


def check_size(file: Path) -> None:
    """Refuse an archive that would unpack to more than an FMU has, or than there is room for."""
    with zipfile.ZipFile(file) as archive:
        members = archive.infolist()
    size, free = sum(member.file_size for member in members), shutil.disk_usage(tempfile.gettempdir()).free
    if size > MOST_BYTES or len(members) > MOST_FILES:
        needs, most = f"{size / 1e9:.1f} GB in {len(members)} files", f"{MOST_BYTES / 1e9:.0f} GB in {MOST_FILES}"
        raise ConfigError(f"{file}: unpacks to {needs}, more than the {most} that an FMU may have; export it again")
    if size > free / 2:
        raise ConfigError(
            f"{file}: unpacks to {size / 1e6:.0f} MB, more than half of the {free / 1e6:.0f} MB free in "
            f"{tempfile.gettempdir()}; make room there, or set TMPDIR"
        )


class _Slave:
    """An unpacked FMU, with one instance for each process that simulates it."""

    def __init__(self, spec: ModelSpec, file: Path, variables: Mapping[str, str]) -> None:
        try:
            import fmpy
        except ImportError:
            raise ConfigError(f"{file}: an FMU needs FMPy; install it with: pip install 'mrfit[fmu]'") from None
        try:
            check_size(file)
            self.description = fmpy.read_model_description(str(file), validate=False)
            self.folder = fmpy.extract(str(file), unzipdir=str(temporary.kept("fmu")))
        except ConfigError:
            raise
        except Exception as error:
            text = " ".join(str(error).split())
            raise ConfigError(f"{file}: cannot be read as an FMU ({text}); export it again") from None
        self.file, self.instances = file, dict[int, Any]()
        if self.description.coSimulation is None:
            raise ConfigError(f"{file}: is no FMU for co-simulation; export it as one")
        self.three = self.description.fmiVersion.startswith("3")
        references = {v.name: v.valueReference for v in self.description.modelVariables}
        names = [variables.get(n, n) for n in (*spec.inputs, *spec.names, spec.output)]
        if missing := [n for n in names if n not in references]:
            known = ", ".join(list(references)[:20])
            raise ConfigError(f"{file}: has no variable '{missing[0]}'; name it in [fmu.variables] (it has {known})")
        found = [references[n] for n in names]
        count = len(spec.inputs)
        self.inputs, self.parameters, self.output = found[:count], found[count:-1], found[-1:]

    def simulate(self, drive: Array, theta: Array, dt: float) -> Array:
        """Return the output (N,) of a drive (C, N) and one parameter vector (K,); nan from where it fails."""
        slave = self._instance()
        write, read = (slave.setFloat64, slave.getFloat64) if self.three else (slave.setReal, slave.getReal)
        output = np.full(drive.shape[1], np.nan)
        try:
            slave.reset()
            self._begin(slave, write, drive[:, 0], theta)
            output[0] = read(self.output)[0]
            for n in range(1, len(output)):
                write(self.inputs, drive[:, n].tolist())
                slave.doStep(currentCommunicationPoint=(n - 1) * dt, communicationStepSize=dt)
                output[n] = value = read(self.output)[0]
                if not math.isfinite(value):
                    break
        except Exception:  # FMPy's own, for every status above a warning: this simulation has failed
            # not freed: after a fatal error the standard allows no further call
            self.instances.clear()
        return output

    def _begin(self, slave: Any, write: Any, first: Array, theta: Array) -> None:
        write(self.parameters, theta.tolist())
        if self.three:
            slave.enterInitializationMode(startTime=0.0)
        else:
            slave.setupExperiment(startTime=0.0)
            slave.enterInitializationMode()
        write(self.inputs, first.tolist())
        slave.exitInitializationMode()

    def _instance(self) -> Any:
        """Return this process's instance: a forked one must not step its parent's."""
        import fmpy

        process = os.getpid()
        if process not in self.instances:
            try:
                made = fmpy.instantiate_fmu(self.folder, self.description, "CoSimulation", require_functions=False)
            except Exception as error:
                text = " ".join(str(error).split())
                raise ConfigError(f"{self.file}: cannot be started ({text}); export it for this system") from None
            self.instances = {process: made}
        return self.instances[process]
