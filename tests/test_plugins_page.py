"""The examples of docs/plugins.md work as they stand."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from mrfit.apply.damper import damper
from mrfit.apply.stepper import Stepper, simulate
from mrfit.core import plugins
from mrfit.models import dahl
from mrfit.simulate.uneven import simulate_unevenly
from tests.conftest import ROOT
from tests.core.foreign.compiled import compiled
from tests.plugin_files import run_python

PAGE = (ROOT / "docs" / "plugins.md").read_text()
FY, V0, C, K3 = 150.0, 0.02, 800.0, 4e6


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture
def page(tmp_path: Path) -> Path:
    """The page's files in a folder, with a log of the page's bench."""
    names = ("my_damper.py", "my_friction.py", "my_spring.py", "my_cell.py", "my_search.py", "my_reader.py")
    for name, text in zip(names, blocks("python"), strict=True):
        (tmp_path / name).write_text(text)
    t = np.arange(5000) / 1000
    w = 2 * np.pi * 2.0
    x, v = 0.015 * np.sin(w * t), 0.015 * w * np.cos(w * t)
    force = FY * (2 / np.pi) * np.arctan(v / V0) + C * v + K3 * x**3
    force += 0.1 * np.random.default_rng(1).standard_normal(len(t))
    rows = "".join(f"{1e3 * a:.6f};{b:.4f}\n" for a, b in zip(x, force, strict=True))
    (tmp_path / "run1.txt").write_text("ROOM 3 BENCH\n" + rows)
    return tmp_path


@pytest.mark.slow
def test_its_model_effect_optimizer_and_reader_are_used_together(page: Path) -> None:
    around = {"MRFIT_PLUGINS": "my_damper.py:my_spring.py:my_search.py:my_reader.py"}
    assert run_python(page, "mrfit.cli", "ingest", "run1.txt", **around).returncode == 0
    command = ("fit", "--model", "my-damper+my-spring", "--opt", "mysearch-lsq", "--json")
    done = run_python(page, "mrfit.cli", *command, **around)
    assert done.returncode == 0, done.stderr
    fit = json.loads(done.stdout)
    assert [p["value"] for p in fit["results"][0]["parameters"]] == pytest.approx([FY, V0, C, K3], rel=0.02)


def test_they_keep_their_contracts(page: Path) -> None:
    files = ("my_damper.py", "my_friction.py", "my_spring.py", "my_cell.py", "my_search.py", "my_reader.py")
    done = run_python(page, "mrfit.contracts", *files, "--log", "run1.txt")
    assert "all hold" in done.stdout, done.stdout + done.stderr


def test_its_model_with_a_state_is_stepped_as_it_is_fitted(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plugins, "_store", plugins.Store())
    monkeypatch.setenv(plugins.VARIABLE, "")
    plugins.use(page / "my_friction.py")
    one = damper("my-friction", {"c": 500.0, "fy@0A": 90.0, "fy@1A": 700.0, "rho": 900.0}, {"fy": 1})
    steps = np.random.default_rng(0).uniform(5e-4, 2e-3, 300)
    t = np.concatenate([[0.0], np.cumsum(steps[1:])])
    given = {"displacement": 0.01 * np.sin(9 * t), "velocity": 0.09 * np.cos(9 * t)}
    given["current"] = 0.5 + 0.4 * np.sin(60 * t)
    stepped = simulate(Stepper(one, held=False), given, steps)
    whole = simulate_unevenly(one.assembly, np.stack([given[n] for n in one.assembly.spec.inputs]), one.theta, steps)[0]
    assert np.abs(stepped - whole).max() < 1e-9 * np.ptp(whole)
    own = one.theta[0]
    theta = np.stack([np.full(300, own[0]), own[1] + (own[2] - own[1]) * given["current"], np.full(300, own[3]), 0 * t])
    twin = dahl.response(np.stack([given["displacement"], given["velocity"]]), theta[None], steps)[0]
    assert np.abs(whole - twin).max() < 1e-9 * np.ptp(whole)


def test_its_c_function_is_a_model(page: Path) -> None:
    (source,), tables = blocks("c"), blocks("toml")
    compiled(source, page / "their_damper.so")
    (page / "their.toml").write_text(next(t for t in tables if "[c]" in t))
    done = run_python(page, "mrfit.contracts", "their.toml")
    # that parameters may vary along the samples is not asked of such a model, as the page says
    assert done.returncode == 0 and "vary along" not in done.stdout, done.stdout + done.stderr


def test_its_entry_point_is_that_of_the_example_package() -> None:
    (entry,) = [t for t in blocks("toml") if "entry-points" in t]
    assert entry in (ROOT / "tests" / "example_plugin" / "pyproject.toml").read_text()
