"""Plug-ins for tests: the example package installed into a folder, plug-in files, and a log of its test bench."""

import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tests import commands
from tests.conftest import ROOT

EXAMPLE = Path(__file__).parent / "example_plugin"
TRUTH = {"c": 800.0, "c3": 3000.0, "f0": 12.0, "k3": 4e6}
"""Parameters of the log's force."""


def install(site: Path, source: Path = EXAMPLE) -> Path:
    """Put a package and the entry points of its pyproject into a folder, as an installer does, and return the folder.

    pip itself would need a build backend, which the tests' environment has not.
    """
    about = tomllib.loads((source / "pyproject.toml").read_text())
    project = about["project"]
    for package in about["tool"]["setuptools"]["packages"]:
        shutil.copytree(source / package, site / package, ignore=shutil.ignore_patterns("__pycache__"))
    info = site / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    info.mkdir()
    name, version = project["name"], project["version"]
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    lines = [f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in e.items()) for group, e in _groups(project).items()]
    (info / "entry_points.txt").write_text("\n".join(lines))
    return site


def _groups(project: Mapping[str, Mapping[str, Mapping[str, str]]]) -> Mapping[str, Mapping[str, str]]:
    return project["entry-points"]


def acme_log(
    path: Path, rate: float = 500.0, seconds: float = 8.0, frequency: float = 2.0, stroke: float = 0.015
) -> Path:
    """Write a log of the example's test bench: a sine (Hz, m), its force with a little noise."""
    t = np.arange(round(rate * seconds)) / rate
    w = 2 * np.pi * frequency
    x, v = stroke * np.sin(w * t), stroke * w * np.cos(w * t)
    force = TRUTH["c"] * v + TRUTH["c3"] * v**3 + TRUTH["f0"] + TRUTH["k3"] * x**3
    force += 0.2 * np.random.default_rng(3).standard_normal(len(t))
    rows = "".join(f"{1e3 * a:.6f}; {b:.4f}\n" for a, b in zip(x, force, strict=True))
    path.write_text(f"ACME bench 2\nrate_hz: {rate:g}\ndisplacement [mm]; force [N]\n{rows}")
    return path


def run_python(folder: Path, module: str, *arguments: object, **environment: str) -> "subprocess.CompletedProcess[str]":
    """Run a module of mrfit's in a folder; ``site`` is put into the environment as a folder of installed packages."""
    site = environment.pop("site", "")
    paths = os.pathsep.join(filter(None, (str(ROOT), site)))
    kept = {k: v for k, v in os.environ.items() if k != "MRFIT_PLUGINS"}
    around = {**kept, "PYTHONPATH": paths, **environment}
    if module == "mrfit.cli":
        return commands.text(folder, *arguments, env=around)
    command = [sys.executable, "-m", module, *map(str, arguments)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, env=around)
