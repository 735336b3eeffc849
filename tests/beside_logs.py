"""Logs with code beside them that leaves a mark when it is run, and every command and call that there is."""

import json
import os
import stat
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from tests.conftest import ROOT
from tests.ingest.samples import BINARY, sample

MODULES = (
    *("mrfit", "pickle", "numpy", "pandas", "h5py", "scipy", "json", "typing", "numba", "nptdms", "asammdf", "pyarrow"),
    *("matplotlib", "jinja2", "pydantic", "pydantic_core", "typer", "click", "rich", "yaml", "cma", "pint", "filelock"),
    *("sitecustomize", "usercustomize", "multiprocessing", "concurrent", "subprocess", "threading", "signal", "socket"),
    *("struct", "random", "tempfile", "hashlib", "contextlib", "functools", "collections", "dataclasses", "tomllib"),
    *("ctypes", "ziglang", "fmpy", "readline", "site", "runpy", "types", "warnings", "shutil", "queue"),
)
"""Names under which Python files lie beside the logs; ``encodings`` is a package there."""
PROGRAMS = ("gcc", "cc", "clang", "ld", "octave", "octave-cli", "fc-list", "git", "uname", "python", "python3")
RIG = """
[rig]
seconds = 20
stroke = "2 cm"
acceleration = 20
speed = "0.4 m/s"
current = ["0 A", "2 A"]
"""
LOGS = ("zero.csv", "half.csv", "one.csv", "two.csv")
PIPELINE = """
work = "run"
[ingest]
logs = ["zero.csv", "one.csv"]
[[fit]]
model = "bingham"
"""
EXPORTS = tuple(w for name in ("c", "fmu", "json", "lookup", "matlab", "modelica", "ssv") for w in ("--to", name))
COIL = ("--fit", "boucwen-mmf.lsq.all", "--resistance", "2")
SINE = ("--sine", "1:0.01", "--dt", "0.01")
COMMANDS: tuple[tuple[str, ...], ...] = (
    *(("ingest", f"sample-{name}", "--work", f"work-{name}") for name in BINARY),
    ("ingest", *LOGS),
    ("ingest", "one.csv", "--preview"),
    ("flux",),
    ("segment",),
    ("fit", "--model", "tanh", "--per", "all", "--jobs", "2"),
    ("fit", "--model", "bingham", "--opt", "pso-lsq", "--budget", "200", "--jobs", "2"),
    ("report", "--jobs", "2"),
    ("predict", "two.csv", "--fit", "tanh.auto.all", "--save", "again"),
    ("compare", "--models", "tanh,bingham", "--jobs", "2"),
    ("discover", "--model", "tanh", "--jobs", "2"),
    ("advise", "--rig", "rig.toml"),
    ("figure", "loops"),
    ("export", "--fit", "tanh.auto.all", *EXPORTS),
    ("apply", "invert", "--fit", "tanh.auto.all", *SINE, "--law", "c=2e3"),
    ("apply", "track", "--fit", "tanh.auto.all", *SINE, "--law", "c=2e3"),
    ("apply", "quarter-car", "--fit", "tanh.auto.all", "--road", "bump", "--duration", "2"),
    ("ingest", "coil.txt", "--work", "work-coil"),
    ("fit", "--model", "boucwen-mmf", "--opt", "lsq", "--per", "all", "--work", "work-coil"),
    ("apply", "current", "coil.txt", "--fit", "boucwen-mmf.lsq.all", "--work", "work-coil"),
    ("apply", "flux-command", *COIL, "--sine", "5:0.01", "--work", "work-coil"),
    ("measure", "quasi-static", "one.csv"),
    ("measure", "sheet", "one.csv"),
    ("plot", "one.csv"),
    ("measure", "watch", "one.csv", "--model", "tanh", "--parameters", "fy", "--within", "20"),
    ("measure", "lag", "one.csv", "--command", "displacement", "--actual", "force"),
    ("batch", ".", "--like", "*.csv", "--model", "bingham", "--report", "--work", "batch", "--jobs", "2"),
    ("drift", "batch/batch.parquet", "--over", "current"),
    ("track-parameters", "one.csv", "--fit", "tanh.auto.all", "--track", "fy"),
    ("run", "pipeline.toml", "--jobs", "2"),
    ("status",),
    ("list", "models"),
    ("show", "tanh"),
    ("datasets",),
    ("remove", "bingham.pso-lsq"),
)
"""Every command, in an order in which each finds what it needs; ``test_every_command_is_among_them`` compares."""
CALLS = """
import sys
import mrfit

if __name__ == "__main__":
    for name in sys.argv[1].split(","):
        mrfit.read(f"sample-{name}")
    recordings = mrfit.read(["zero.csv", "half.csv", "one.csv", "two.csv"])
    result = mrfit.fit(recordings, "tanh", per="condition", jobs=2)
    result.plot()
    mrfit.predict(result, recordings)
    mrfit.discover(recordings, "tanh", jobs=2)
    mrfit.compare(recordings, ["tanh", "bingham"], jobs=2)
"""
START = "from mrfit.cli.__main__ import main\n\nif __name__ == '__main__':\n    main()\n"


def write_log(path: Path, current: float) -> None:
    """Write a log of a damper, a hyperbolic tangent over velocity that rises with current."""
    t = np.arange(900) / 300.0
    x, v = 0.01 * np.sin(4 * np.pi * t), 0.04 * np.pi * np.cos(4 * np.pi * t)
    force = (50.0 + 300.0 * current) * np.tanh(v / 0.02) + (500.0 + 100.0 * current) * v
    force += np.random.default_rng(round(10 * current)).standard_normal(len(t))
    rows = np.column_stack([t, x, v, force, np.full(len(t), current)])
    header = "time (s),displacement (m),velocity (m/s),force (N),current (A)"
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header=header, comments="")


def write_coil_log(path: Path) -> None:
    """Write a log of a coil, a sine of flux linkage and a current with a loop."""
    t = np.arange(900) / 300.0
    flux, turn = 0.02 * np.sin(4 * np.pi * t), np.cos(4 * np.pi * t)
    rows = np.column_stack([t, flux, flux / 0.03 + 0.1 * np.tanh(turn / 0.3)])
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header="time (s),flux (Wb),current (A)", comments="")


class Beside:
    """A folder of logs with code beside them, and a folder elsewhere in which that code leaves its marks."""

    def __init__(self, place: Path) -> None:
        self.logs, self.marks, self.start = place / "logs", place / "marks", place / "start"
        for folder in (self.logs, self.marks, self.start):
            folder.mkdir()
        for name, current in zip(LOGS, (0.0, 0.5, 1.0, 2.0), strict=True):
            write_log(self.logs / name, current)
        write_coil_log(self.logs / "coil.txt")
        for reader in BINARY:
            _, path = sample(reader, self.start)
            path.rename(self.logs / f"sample-{reader}")
        (self.logs / "rig.toml").write_text(RIG)
        (self.logs / "pipeline.toml").write_text(PIPELINE)
        (self.start / "mrfit-command.py").write_text(START)
        (self.start / "calls.py").write_text(CALLS)
        self._lay()

    def _lay(self) -> None:
        """Lay code and settings beside the logs."""
        for name in MODULES:
            (self.logs / f"{name}.py").write_text(self._marking(name))
        (self.logs / "encodings").mkdir()
        (self.logs / "encodings" / "__init__.py").write_text(self._marking("encodings"))
        info = self.logs / "planted-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: planted\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text("[mrfit.models]\nplanted = planted_model\n")
        (self.logs / "planted_model.py").write_text(self._marking("planted_model"))
        for name in PROGRAMS:
            program = self.logs / name
            program.write_text(f"#!/bin/sh\necho run > '{self.marks / name}'\nexit 1\n")
            program.chmod(program.stat().st_mode | stat.S_IXUSR)
        (self.logs / "matplotlibrc").write_text("backend: module://planted_model\nplanted: 1\n")
        (self.logs / ".numba_config.yaml").write_text("disable_jit: 1\n")

    def _marking(self, name: str) -> str:
        return f"open({str(self.marks / name)!r}, 'a').close()\nraise SystemExit('{name}.py beside the logs was run')\n"

    def command(self, *words: str) -> "subprocess.CompletedProcess[str]":
        """Run a command in the folder of the logs, as the installed script does."""
        return self._python("mrfit-command.py", *words)

    def calls(self) -> "subprocess.CompletedProcess[str]":
        """Run a script that lies elsewhere in the folder of the logs."""
        return self._python("calls.py", ",".join(BINARY))

    def _python(self, script: str, *words: str) -> "subprocess.CompletedProcess[str]":
        # empty parts at their ends, as `PATH=$OTHER:$PATH` leaves them, mean the current folder
        lists = {name: os.environ.get(name, "") + os.pathsep for name in ("PATH", "LD_LIBRARY_PATH", "CPATH")}
        around = {**os.environ, **lists, "PYTHONPATH": str(ROOT)}
        command = [sys.executable, str(self.start / script), *words]
        return subprocess.run(command, cwd=self.logs, env=around, capture_output=True, text=True, timeout=600)

    def run(self) -> list[str]:
        """Return what code beside the logs was run so far."""
        return sorted(p.name for p in self.marks.iterdir())


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as place:
        beside = Beside(Path(place))
        for words in COMMANDS:
            begin = time.time()
            done = beside.command(*words)
            print(
                f"{time.time() - begin:.1f}",
                done.returncode,
                json.dumps(words),
                beside.run(),
                done.stdout[-300:],
                done.stderr[-600:],
                sep="\n   ",
            )
        done = beside.calls()
        print(done.returncode, "calls", beside.run(), done.stdout[-300:], done.stderr[-900:], sep="\n   ")
